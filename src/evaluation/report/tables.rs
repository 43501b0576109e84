//! The page's tables: ours, with the paper's printed value below.

use std::fmt::Write;

use super::{Row, escaped};
use crate::evaluation::cells::{Platform, SOURCE_COUNTS};
use crate::evaluation::paper::{Printed, table_five, table_six};
use crate::evaluation::scores::Spread;
use crate::evaluation::si_snr::capped_text;

/// What the issue asks of `best` with a walking and a standing listener: PESQ, SSIM, SI-SNR.
const TARGETS: [[f64; 3]; 2] = [[4.63, 0.9995, 40.0], [4.50, 0.990, 25.0]];

/// The table's predictors, in its order; others are the ablation's.
const PLAIN: [&str; 3] = ["hold", "linear", "best"];

/// Mean and deviation; the mean alone where, to these decimals, nothing deviates.
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
    if spread.mean > crate::evaluation::si_snr::CAP_DB {
        capped_text(spread.mean).replace('>', "&gt;")
    } else {
        spread_text(spread, 2)
    }
}

/// The three figures' texts, and whether each meets the target.
fn figures(row: &Row) -> [(String, bool); 3] {
    let target = TARGETS[usize::from(row.dynamic)];
    let pesq = row.pesq.map_or(("–".to_owned(), false), |s| {
        (spread_text(s, 2), s.mean >= target[0])
    });
    [
        pesq,
        (spread_text(row.ssim, 4), row.ssim.mean >= target[1]),
        (si_snr_text(row.si_snr_db), row.si_snr_db.mean >= target[2]),
    ]
}

/// Tiles above everything: the worst cell of each predictor with a walking listener.
pub(super) fn summary(rows: &[Row]) -> String {
    let mut tiles = String::new();
    for name in PLAIN {
        let walking = || rows.iter().filter(|r| r.dynamic && r.predictor == name);
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

/// Table 5, one table a platform and condition.
pub(super) fn similarity(rows: &[Row]) -> String {
    let mut html = String::new();
    for platform in Platform::ALL {
        for dynamic in [true, false] {
            let part: Vec<&Row> = rows
                .iter()
                .filter(|r| r.platform == platform && r.dynamic == dynamic)
                .filter(|r| PLAIN.contains(&r.predictor.as_str()))
                .collect();
            if part.is_empty() {
                continue;
            }
            let listener = if dynamic { "walking" } else { "standing" };
            let _ = write!(html, "<h3>{}, {listener} listener</h3>", platform.name());
            html.push_str(&cells(&part));
        }
    }
    html
}

fn cells(rows: &[&Row]) -> String {
    let head = "<tr><th>cell</th><th>predictor</th><th>L</th><th>FPS</th><th>PESQ</th><th>SSIM</th><th>SI-SNR dB</th><th>EPS µs</th></tr>";
    let mut body = String::new();
    let mut last = String::new();
    for (place, row) in rows.iter().enumerate() {
        let signal = if row.signal == "speech" {
            ""
        } else {
            &row.signal
        };
        let at_once = if row.is_late { "" } else { " at once" };
        let cell = format!("{} {} {signal}{at_once}", row.scene, row.sources);
        let name = if cell == last {
            String::new()
        } else {
            escaped(&cell)
        };
        let _ = write!(
            body,
            "<tr><td>{name}</td><td>{}</td><td>{}</td><td>{}</td>",
            escaped(&row.predictor),
            row.level,
            row.graphics_rate_hz
        );
        for (text, met) in figures(row) {
            let class = if met { " class=\"met\"" } else { "" };
            let _ = write!(body, "<td{class}>{text}</td>");
        }
        let _ = write!(body, "<td>{:.0}</td></tr>", row.extrapolation_us);
        let ends = rows.get(place + 1).is_none_or(|next| {
            next.scene != row.scene
                || next.sources != row.sources
                || next.is_late != row.is_late
                || next.signal != row.signal
        });
        if ends
            && row.signal == "speech"
            && let Some(printed) = table_five(row.platform, &row.scene, row.dynamic, row.sources)
        {
            body.push_str(&printed_row(&printed));
        }
        last = cell;
    }
    format!(
        "<div class=\"scroll\"><table class=\"names\"><thead>{head}</thead><tbody>{body}</tbody></table></div>"
    )
}

fn printed_row(printed: &Printed) -> String {
    format!(
        "<tr class=\"paper\"><td></td><td>the paper</td><td></td><td></td><td>{}</td><td>{}</td><td>{}</td><td></td></tr>",
        printed.pesq,
        printed.ssim,
        printed.si_snr_db.replace('>', "&gt;")
    )
}

/// Table 6: of the three figures, how many `linear` and how many `hold` win, on the workstation.
pub(super) fn wins(rows: &[Row]) -> String {
    let find = |scene: &str, sources: usize, name: &str| {
        rows.iter().find(|r| {
            r.platform == Platform::Workstation
                && r.dynamic
                && r.scene == scene
                && r.sources == sources
                && r.predictor == name
                && r.signal == "speech"
        })
    };
    let mut body = String::new();
    for scene in crate::evaluation::cells::SCENES {
        let mut line = String::new();
        let mut any = false;
        for sources in SOURCE_COUNTS {
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
                format!("{}/{}", count(a, b), count(b, a))
            });
            let _ = write!(
                line,
                "<td>{} <span class=\"paper\">{}</span></td>",
                ours.as_deref().unwrap_or("–"),
                table_six(scene, sources).unwrap_or("")
            );
        }
        if any {
            let _ = write!(body, "<tr><td>{scene}</td>{line}</tr>");
        }
    }
    if body.is_empty() {
        return body;
    }
    let head: String = SOURCE_COUNTS
        .iter()
        .map(|n| format!("<th>{n}</th>"))
        .collect();
    format!(
        "<p>How many of PESQ, SSIM and SI-SNR <code>linear</code> and <code>hold</code> win, by number of sources.</p>\
         <div class=\"scroll\"><table><thead><tr><th>scene</th>{head}</tr></thead><tbody>{body}</tbody></table></div>"
    )
}

/// `best` and its leave-outs, where there are any.
pub(super) fn ablation(rows: &[Row]) -> String {
    let is_part = |r: &&Row| r.predictor.starts_with("best-");
    let part: Vec<&Row> = rows
        .iter()
        .filter(|row| {
            rows.iter()
                .filter(is_part)
                .any(|r| r.wav_stem == row.wav_stem)
        })
        .collect();
    if part.is_empty() {
        return String::new();
    }
    format!(
        "<p>What each ingredient of <code>best</code> is worth: all of them, each left out, geometry alone.</p>{}",
        cells(&part)
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
            "<tr><td>{}</td><td>{}</td><td>{:.2} %</td><td>{}</td><td><code>{}</code></td></tr>",
            escaped(&row.wav_stem),
            row.reference_paths,
            100.0 * row.reference_recall,
            row.repeats,
            row.reference_checksum
        );
    }
    format!(
        "<p>Recall: the share of the paths found with eight times the rays which the reference has in mid-walk.</p>\
         <div class=\"scroll\"><table><thead><tr><th>cell</th><th>paths</th><th>recall</th><th>repeats</th><th>checksum</th></tr></thead><tbody>{body}</tbody></table></div>"
    )
}
