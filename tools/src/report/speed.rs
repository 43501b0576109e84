//! Tables 3 and 4: the rows of `bench speed --json` beside the paper's figures.

use serde_json::Value;

use super::html::{NONE, escaped, row, table};
use crate::cells::Platform;
use crate::paper::printed_speed;

/// The section's content from the output of `bench speed --json`; empty without rows.
pub(super) fn speed(measured: &Value) -> String {
    let Some(rows) = measured["rows"].as_array().filter(|rows| !rows.is_empty()) else {
        return String::new();
    };
    let head = [
        "scene, sources",
        "predictor",
        "own work ms",
        "sync FPS",
        "async FPS",
        "speedup",
        "update ms, p50 / p95",
        "EPS µs, p50 / p95",
        "SGS µs, p50 / p95",
        "L",
        "paper: PC, FPS",
        "paper: phone, FPS",
    ];
    let body: String = rows.iter().map(measured_row).collect();
    let machine = measured["machine"].as_object().into_iter().flatten();
    let machine: Vec<String> = machine
        .map(|(name, value)| match value {
            Value::String(text) => format!("{name}: {text}"),
            other => format!("{name}: {other}"),
        })
        .collect();
    format!(
        "<p>Graphics frames a second by <code>bench speed</code>, audio work on two threads. Measured on {}. The paper's \
         rates are of its machines and scenes: baseline → proposed (speedup).</p>{}",
        escaped(&machine.join(", ")),
        table("names", "", &head, &body)
    )
}

fn measured_row(measured: &Value) -> String {
    let number = |key: &str, decimals: usize, unit: &str| {
        let number = measured.pointer(key).and_then(Value::as_f64);
        number.map_or(NONE.to_owned(), |n| format!("{n:.decimals$}{unit}"))
    };
    let both = |key: &str, decimals: usize| {
        let [p50, p95] = ["p50", "p95"].map(|p| number(&format!("{key}/{p}"), decimals, ""));
        format!("{p50} / {p95}")
    };
    let scene = measured["scene"].as_str().unwrap_or_default();
    let sources = measured["sources"].as_u64().unwrap_or_default();
    let printed = |platform| {
        let cell = printed_speed(platform, scene, sources as usize);
        let text = cell.map_or(NONE.to_owned(), |p| {
            format!(
                "{} → {} ({:.2}×)",
                p.baseline_fps, p.proposed_fps, p.speedup
            )
        });
        format!("<span class=\"paper\">{text}</span>")
    };
    let cells = [
        format!("{}, {sources}", escaped(scene)),
        escaped(measured["predictor"].as_str().unwrap_or(NONE)),
        measured["graphics_ms"]
            .as_f64()
            .unwrap_or_default()
            .to_string(),
        number("/sync_fps", 1, ""),
        number("/async_fps", 1, ""),
        number("/speedup", 2, "×"),
        both("/sps_ms", 2),
        both("/eps_us", 0),
        both("/sgs_us", 0),
        number("/level/p50", 0, ""),
        printed(Platform::Workstation),
        printed(Platform::Mobile),
    ];
    row("", &cells)
}
