//! The page's smaller tables: summary, wins, references.

use std::fmt::Write;

use super::figures_of_merit::PLAIN;
use super::{Row, escaped};
use crate::cells::{Condition, Platform, SOURCE_COUNTS};
use crate::paper::table_six;

/// Tiles above everything: the worst cell of each predictor with a walking listener.
pub(super) fn summary(rows: &[Row]) -> String {
    let mut tiles = String::new();
    for name in PLAIN {
        let walking = || {
            let walks = |r: &&Row| r.condition == Condition::Dynamic && r.is_late;
            rows.iter().filter(walks).filter(|r| r.predictor == name)
        };
        if walking().next().is_none() {
            continue;
        }
        let least = |pick: &dyn Fn(&Row) -> f64| walking().map(pick).fold(f64::INFINITY, f64::min);
        let pesq = least(&|r| r.pesq.map_or(f64::INFINITY, |s| s.mean));
        let pesq = if pesq.is_finite() {
            format!("PESQ {pesq:.2}")
        } else {
            "no speech".to_owned()
        };
        let _ = write!(
            tiles,
            "<div class=\"tile\"><span>{name}, worst walking cell</span><b>{pesq}</b>\
             <span>SSIM {:.3}, SI-SNR {:.1} dB</span></div>",
            least(&|r| r.ssim.mean),
            least(&|r| r.si_snr_db.mean)
        );
    }
    format!(
        "<p>Each cell renders the same walk twice: with a whole propagation in every graphics frame (the reference), and \
         with one every L + 1 frames whose result comes L + 1 frames late. The figures say how alike the two sound. \
         The paper's printed values stand in <span class=\"paper\">this colour</span>; its scenes are not public and \
         ours stand in. A shaded figure meets the target set for <code>best</code>.</p><div class=\"tiles\">{tiles}</div>"
    )
}

/// Table 6: of the three figures, how many `linear` and how many `hold` win, on the workstation.
pub(super) fn wins(rows: &[Row]) -> String {
    let find = |scene: &str, sources: usize, name: &str| {
        rows.iter().find(|r| {
            r.platform == Platform::Workstation
                && r.condition == Condition::Dynamic
                && r.is_late
                && r.scene == scene
                && r.sources == sources
                && r.predictor == name
                && r.signal == "speech"
        })
    };
    let mut body = String::new();
    let mut totals = [[0usize; 2]; SOURCE_COUNTS.len()];
    let mut printed_totals = totals;
    for scene in crate::cells::SCENES {
        let mut line = String::new();
        let mut any = false;
        for (column, sources) in SOURCE_COUNTS.into_iter().enumerate() {
            let printed = table_six(scene, sources).unwrap_or("");
            for (total, wins) in printed_totals[column].iter_mut().zip(printed.split('/')) {
                *total += wins.parse().unwrap_or(0);
            }
            let pair = find(scene, sources, "linear").zip(find(scene, sources, "hold"));
            let ours = pair.map(|(linear, hold)| {
                any = true;
                let figures = |r: &Row| {
                    [
                        r.pesq.map_or(0.0, |s| s.mean),
                        r.ssim.mean,
                        r.si_snr_db.mean,
                    ]
                };
                let (a, b) = (figures(linear), figures(hold));
                let count =
                    |x: [f64; 3], y: [f64; 3]| x.iter().zip(y).filter(|(x, y)| **x > *y).count();
                let wins = [count(a, b), count(b, a)];
                for (total, wins) in totals[column].iter_mut().zip(wins) {
                    *total += wins;
                }
                format!("{}/{}", wins[0], wins[1])
            });
            let _ = write!(
                line,
                "<td>{} <span class=\"paper\">{}</span></td>",
                ours.as_deref().unwrap_or("–"),
                printed
            );
        }
        if any {
            let _ = write!(body, "<tr><td>{scene}</td>{line}</tr>");
        }
    }
    if body.is_empty() {
        return body;
    }
    let pairs = totals.iter().zip(&printed_totals);
    let total: String = pairs
        .map(|([linear, hold], [p, q])| {
            let ours = match linear + hold {
                0 => "–".to_owned(),
                _ => format!("{linear}/{hold}"),
            };
            format!("<td>{ours} <span class=\"paper\">{p}/{q}</span></td>")
        })
        .collect();
    let total = format!("<tr class=\"begins\"><td>total</td>{total}</tr>");
    let head: String = SOURCE_COUNTS
        .iter()
        .map(|n| format!("<th scope=\"col\">{n}</th>"))
        .collect();
    format!(
        "<p>How many of PESQ, SSIM and SI-SNR <code>linear</code> and <code>hold</code> win on the means over repeats, by \
         number of sources: ours, then <span class=\"paper\">the paper's</span>. Equal means are nobody's win.</p>\
         <div class=\"scroll\" tabindex=\"0\"><table><caption>linear/hold wins, workstation, walking listener</caption>\
         <thead><tr><th scope=\"col\">scene</th>{head}</tr></thead><tbody>{body}{total}</tbody></table></div>"
    )
}

/// Path counts, recall and checksums of the references.
pub(super) fn references(rows: &[Row]) -> String {
    let mut body = String::new();
    let mut last = "";
    for row in rows.iter() {
        if row.wav_stem == last {
            continue;
        }
        last = &row.wav_stem;
        let _ = write!(
            body,
            "<tr><td>{}</td><td>{}</td><td>{:.2} %</td><td>{:.2} %</td><td>{}</td><td><code>{}</code></td></tr>",
            escaped(&row.wav_stem),
            row.reference_paths,
            100.0 * row.reference_recall,
            100.0 * row.reference_energy_recall,
            row.repeats,
            row.reference_checksum
        );
    }
    format!(
        "<p>Recall: which share of the paths that are found with eight times the rays the reference has in mid-walk, by \
         number and by energy. Checksum: FNV-1a, 64 bits, of the first repeat's samples in f32.</p>\
         <div class=\"scroll\" tabindex=\"0\"><table><caption>References, a line a cell</caption><thead><tr><th scope=\"col\">cell</th>\
         <th scope=\"col\">paths</th><th scope=\"col\">recall</th><th scope=\"col\">by energy</th><th scope=\"col\">repeats</th>\
         <th scope=\"col\">checksum</th></tr></thead><tbody>{body}</tbody></table></div>"
    )
}
