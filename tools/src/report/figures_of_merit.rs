//! Texts of the figures of merit and their targets.

use super::Row;
use crate::cells::Condition;
use crate::scores::Spread;
use crate::si_snr::{CAP_DB, capped_text};

/// Targets of `best`: PESQ, SSIM, SI-SNR; infinite where none is set.
fn targets(condition: Condition) -> [f64; 3] {
    const NONE: f64 = f64::INFINITY;
    match condition {
        Condition::Static => [4.63, 0.9995, 40.0],
        Condition::Dynamic => [4.50, 0.990, 25.0],
        Condition::Stress => [4.0, NONE, NONE],
        Condition::Restless => [4.4, NONE, 20.0],
        Condition::Dash => [4.3, NONE, 17.0],
        Condition::Irregular => [4.3, NONE, 16.0],
        Condition::Teleport | Condition::Jump => [4.0, NONE, 13.0],
    }
}

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
    let target = targets(row.condition);
    let pesq = row.pesq.map_or(("–".to_owned(), false), |s| {
        (spread_text(s, 2), s.mean >= target[0])
    });
    [
        pesq,
        (spread_text(row.ssim, 4), row.ssim.mean >= target[1]),
        (si_snr_text(row.si_snr_db), row.si_snr_db.mean >= target[2]),
    ]
}
