//! Tables 3 and 4: what `bench speed --json` measured, beside what the paper printed.

use std::fmt::Write;

use serde::Deserialize;

use super::escaped;
use crate::cells::Platform;
use crate::paper::printed_speed;

/// The output of `bench speed --json`.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
pub struct SpeedTable {
    /// A row a scene and number of sources.
    pub rows: Vec<SpeedRow>,
    /// Where it was measured, by name.
    #[serde(default)]
    pub machine: serde_json::Map<String, serde_json::Value>,
}

/// What was measured of one cell. What a measurement left out is `None`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct SpeedRow {
    /// Name of the scene.
    pub scene: String,
    /// Number of sources.
    pub sources: usize,
    /// The caller's own work in a graphics frame.
    #[serde(default)]
    pub graphics_ms: f64,
    /// Graphics frames a second of the synchronous schedule.
    pub sync_fps: Option<f64>,
    /// Of the asynchronous one.
    pub async_fps: Option<f64>,
    /// Their ratio.
    pub speedup: Option<f64>,
    /// Time of a propagation update.
    pub sps_ms: Option<Middle>,
    /// Of a graphics frame's extrapolation.
    pub eps_us: Option<Middle>,
    /// Of a graphics frame's sound.
    pub sgs_us: Option<Middle>,
    /// Extrapolation level.
    pub level: Option<Middle>,
}

/// Middle and near-worst value.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Middle {
    /// Half of the values are below.
    pub p50: f64,
    /// 19 of 20 are below.
    pub p95: f64,
}

/// The section's content; nothing without rows.
pub(super) fn speed(table: &SpeedTable) -> String {
    if table.rows.is_empty() {
        return String::new();
    }
    const HEAD: [&str; 11] = [
        "scene, sources",
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
    let head: String = HEAD
        .iter()
        .map(|name| format!("<th scope=\"col\">{name}</th>"))
        .collect();
    let mut body = String::new();
    for row in &table.rows {
        let number = |value: Option<f64>, decimals: usize, unit: &str| {
            value.map_or("–".to_owned(), |v| format!("{v:.decimals$}{unit}"))
        };
        let both = |middle: Option<Middle>, decimals: usize| {
            middle.map_or("–".to_owned(), |m| {
                format!("{:.decimals$} / {:.decimals$}", m.p50, m.p95)
            })
        };
        let printed = |platform| {
            printed_speed(platform, &row.scene, row.sources).map_or("–".to_owned(), |p| {
                format!(
                    "{} → {} ({:.2}×)",
                    p.baseline_fps, p.proposed_fps, p.speedup
                )
            })
        };
        let _ = write!(
            body,
            "<tr><td>{}, {}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>\
             <td class=\"paper\">{}</td><td class=\"paper\">{}</td></tr>",
            escaped(&row.scene),
            row.sources,
            row.graphics_ms,
            number(row.sync_fps, 1, ""),
            number(row.async_fps, 1, ""),
            number(row.speedup, 2, "×"),
            both(row.sps_ms, 2),
            both(row.eps_us, 0),
            both(row.sgs_us, 0),
            number(row.level.map(|l| l.p50), 0, ""),
            printed(Platform::Workstation),
            printed(Platform::Mobile)
        );
    }
    let machine: Vec<String> = table
        .machine
        .iter()
        .map(|(name, value)| match value {
            serde_json::Value::String(text) => format!("{name}: {text}"),
            other => format!("{name}: {other}"),
        })
        .collect();
    format!(
        "<p>Graphics frames a second by <code>bench speed</code>, audio work on two threads. Measured on {}. The paper's \
         rates are of its machines and scenes: baseline → proposed (speedup).</p>\
         <div class=\"scroll\" tabindex=\"0\"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>",
        escaped(&machine.join(", "))
    )
}
