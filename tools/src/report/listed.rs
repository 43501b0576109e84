//! The doorway's rows in one table.

use super::Row;
use super::figures_of_merit::figures;
use super::html::{escaped, figure, row, table};
use crate::cells::RendererKind;

/// A table with a line for each row.
pub(super) fn listed(rows: &[Row]) -> String {
    let head = [
        "cell",
        "predictor",
        "L",
        "FPS",
        "PESQ",
        "SSIM",
        "SI-SNR dB",
        "EPS µs",
    ];
    let (mut body, mut last) = (String::new(), String::new());
    for r in rows {
        let mut cell = format!("{}, {}, {}", r.scene, r.platform.name(), r.sources);
        if r.signal != "speech" {
            cell = format!("{cell}, {}", r.signal);
        }
        if r.renderer != RendererKind::Offline {
            cell = format!("{cell}, {}", r.renderer.name());
        }
        if !r.is_late {
            cell.push_str(", at once");
        }
        let is_new = cell != last;
        let [pesq, ssim, si_snr] = figures(r).map(figure);
        let cells = [
            if is_new {
                escaped(&cell)
            } else {
                String::new()
            },
            escaped(&r.predictor),
            r.level.to_string(),
            r.graphics_rate_hz.to_string(),
            pesq,
            ssim,
            si_snr,
            format!("{:.0}", r.extrapolation_us),
        ];
        body.push_str(&row(if is_new { "begins" } else { "" }, &cells));
        last = cell;
    }
    table("names", "", &head, &body)
}
