//! Texts of the figures of merit and their targets.

use super::Row;
use crate::cells::Condition;
use crate::scores::Spread;
use crate::si_snr::{CAP_DB, capped_text};

/// Targets of `best` with a listener at rest and a walking one: PESQ, SSIM, SI-SNR.
const TARGETS: [[f64; 3]; 2] = [[4.63, 0.9995, 40.0], [4.50, 0.990, 25.0]];

/// The predictors in the order of the tables.
pub(super) const PLAIN: [&str; 3] = ["hold", "linear", "best"];

/// Mean and deviation; the mean alone if the deviation rounds to zero.
fn spread_text(spread: Spread, decimals: usize) -> String {
    if spread.sd < 0.5 * 0.1f64.powi(decimals as i32) {
        return format!("{:.decimals$}", spread.mean);
    }
    format!(
        "{:.decimals$}<span class=\"sd\"> ± {:.decimals$}</span>",
        spread.mean, spread.sd
    )
}

fn si_snr_text(spread: Spread) -> String {
    if spread.mean > CAP_DB {
        capped_text(spread.mean).replace('>', "&gt;")
    } else {
        spread_text(spread, 2)
    }
}

/// The three figures' texts, and whether each meets the target.
pub(super) fn figures(row: &Row) -> [(String, bool); 3] {
    let target = match row.condition {
        Condition::Static => TARGETS[0],
        Condition::Dynamic => TARGETS[1],
        Condition::Stress => [f64::INFINITY; 3],
    };
    let pesq = row.pesq.map_or(("–".to_owned(), false), |s| {
        (spread_text(s, 2), s.mean >= target[0])
    });
    [
        pesq,
        (spread_text(row.ssim, 4), row.ssim.mean >= target[1]),
        (si_snr_text(row.si_snr_db), row.si_snr_db.mean >= target[2]),
    ]
}
