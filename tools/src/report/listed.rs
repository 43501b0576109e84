//! Rows one below the other, as they come: the ablation's and the doorway's.

use std::fmt::Write;

use super::figures_of_merit::figures;
use super::{Row, escaped};

/// A table with a line a row.
pub(super) fn listed(rows: &[&Row]) -> String {
    const HEAD: [&str; 8] = [
        "cell",
        "predictor",
        "L",
        "FPS",
        "PESQ",
        "SSIM",
        "SI-SNR dB",
        "EPS µs",
    ];
    let head: String = HEAD
        .iter()
        .map(|name| format!("<th scope=\"col\">{name}</th>"))
        .collect();
    let mut body = String::new();
    let mut last = String::new();
    for row in rows {
        let mut cell = format!("{}, {}, {}", row.scene, row.platform.name(), row.sources);
        if row.signal != "speech" {
            cell = format!("{cell}, {}", row.signal);
        }
        if !row.is_late {
            cell.push_str(", at once");
        }
        let name = if cell == last { "" } else { &cell };
        let group = if cell == last {
            ""
        } else {
            " class=\"begins\""
        };
        let _ = write!(
            body,
            "<tr{group}><td>{}</td><td>{}</td><td>{}</td><td>{}</td>",
            escaped(name),
            escaped(&row.predictor),
            row.level,
            row.graphics_rate_hz
        );
        for (text, met) in figures(row) {
            let class = if met { " class=\"met\"" } else { "" };
            let _ = write!(body, "<td{class}>{text}</td>");
        }
        let _ = write!(body, "<td>{:.0}</td></tr>", row.extrapolation_us);
        last = cell;
    }
    format!(
        "<div class=\"scroll\" tabindex=\"0\"><table class=\"names\"><thead><tr>{head}</tr></thead>\
         <tbody>{body}</tbody></table></div>"
    )
}
