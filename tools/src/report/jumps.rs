//! How soon sounds agree after the listener or a source is put elsewhere.

use super::Row;
use super::html::{escaped, figure, row, table};
use crate::settling::{SETTLED_DB, WITHIN_S};

/// The section's content; empty without jumps.
pub(super) fn jumps(rows: &[Row]) -> String {
    let head = [
        "cell",
        "predictor",
        "renderer",
        "jumps",
        "settled after ms, median",
        "largest",
        "difference dB, median",
        "largest",
    ];
    let body: String = rows.iter().filter_map(line).collect();
    if body.is_empty() {
        return body;
    }
    let within_ms = 1e3 * WITHIN_S;
    format!(
        "<p>The listener is put elsewhere every 1.5 s, or a source every second. Settled: the difference from the \
         reference stays {} dB below the signal until the next jump. The difference is measured from {within_ms} ms after \
         a jump to the next one; the signal is the reference from a jump to the next.</p>{}",
        -SETTLED_DB,
        table("names", "", &head, &body)
    )
}

fn line(of: &Row) -> Option<String> {
    let settling = of.settling?;
    let milliseconds = |value: f64| (format!("{value:.0}"), value <= 1e3 * WITHIN_S);
    let level = |value: f64| (format!("{value:.1}"), value <= SETTLED_DB);
    let [settled, largest_settled] = settling.settled_ms.map(|ms| figure(milliseconds(ms)));
    let [after, largest_after] = settling.after_db.map(|db| figure(level(db)));
    Some(row(
        "",
        &[
            escaped(&format!(
                "{}, {}, {}",
                of.scene,
                of.condition.name(),
                of.sources
            )),
            escaped(&of.predictor),
            of.renderer.name().to_owned(),
            settling.jumps.to_string(),
            settled,
            largest_settled,
            after,
            largest_after,
        ],
    ))
}
