//! What a slow machine plays: the table beside the paper's Figure 8.

use std::fmt::Write;

use serde::Serialize;

use super::escaped;
use crate::playback::AHEAD;
use crate::si_snr::capped_text;

/// One schedule under one load.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OverloadRow {
    /// Name of the scene.
    pub scene: String,
    /// Number of sources.
    pub sources: usize,
    /// Time of the median update, in graphics frame times.
    pub load: f64,
    /// Whose loop it is.
    pub schedule: String,
    /// Graphics frames that were due.
    pub frames: usize,
    /// Of these, how many were made but took longer than a frame time.
    pub late: usize,
    /// How many were dropped.
    pub dropped: usize,
    /// Blocks that the device played again.
    pub repeated: usize,
    /// SI-SNR in dB of what was played against the synchronous rendering in time, not capped.
    pub si_snr_db: f64,
}

/// The section's content; nothing without rows.
pub(super) fn overload(rows: &[OverloadRow]) -> String {
    let Some(first) = rows.first() else {
        return String::new();
    };
    const HEAD: [&str; 7] = [
        "update, frame times",
        "schedule",
        "frames due",
        "made late",
        "dropped",
        "blocks repeated",
        "SI-SNR dB",
    ];
    let head: String = HEAD
        .iter()
        .map(|name| format!("<th scope=\"col\">{name}</th>"))
        .collect();
    let mut body = String::new();
    for row in rows {
        let share = |count: usize| 100.0 * count as f64 / row.frames.max(1) as f64;
        let _ = write!(
            body,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{} ({:.0} %)</td><td>{} ({:.0} %)</td><td>{} ({:.0} %)</td><td>{}</td></tr>",
            row.load,
            escaped(&row.schedule),
            row.frames,
            row.late,
            share(row.late),
            row.dropped,
            share(row.dropped),
            row.repeated,
            share(row.repeated),
            capped_text(row.si_snr_db).replace('>', "&gt;")
        );
    }
    format!(
        "<p>{}, {} sources, walking listener, on a virtual clock. Cost model: a ray takes the same time wherever it is cast, \
         so that the median update takes the first column's share of a graphics frame; generation costs nothing. The \
         synchronous loop casts an update's rays within every frame; <code>best</code> casts at most its own few, and updates \
         have another core. The device holds {AHEAD} blocks; where none has come it plays the last one again, and a \
         loop that is late leaves frames out. The last pair is the paper's own ratio. Compared with the synchronous \
         rendering of a machine that is never late.</p>\
         <div class=\"scroll\" tabindex=\"0\"><table class=\"names\"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>",
        escaped(&first.scene),
        first.sources
    )
}
