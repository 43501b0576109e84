//! The page's smaller tables: summary, wins, references.

use std::fmt::Write;

use super::Row;
use super::figures_of_merit::PLAIN;
use super::html::{NONE, escaped, row, table};
use crate::cells::{Condition, Platform, RendererKind, SCENES, SOURCE_COUNTS};
use crate::paper::table_six;

/// Tiles above everything: the worst cell of each predictor with a walking listener.
pub(super) fn summary(rows: &[Row]) -> String {
    let mut tiles = String::new();
    for name in PLAIN {
        let walking = || {
            let walks = |r: &&Row| {
                let is_offline = r.renderer == RendererKind::Offline;
                r.condition == Condition::Dynamic && r.is_late && is_offline
            };
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
         with one every L + 1 frames whose result comes L + 1 frames late. The figures measure how alike the two sound. \
         The paper's printed values have <span class=\"paper\">this colour</span>; its scenes are not public and \
         ours stand in. A shaded figure meets the target set for <code>best</code>.</p><div class=\"tiles\">{tiles}</div>"
    )
}

/// Table 6: of the three figures, how many `linear` and how many `hold` win, on the workstation.
pub(super) fn wins(rows: &[Row]) -> String {
    let find = |scene: &str, sources: usize, name: &str| {
        rows.iter().find(|r| {
            r.platform == Platform::Workstation
                && r.renderer == RendererKind::Offline
                && r.condition == Condition::Dynamic
                && r.is_late
                && r.scene == scene
                && r.sources == sources
                && r.predictor == name
                && r.signal == "speech"
        })
    };
    let cell =
        |ours: String, printed: &str| format!("{ours} <span class=\"paper\">{printed}</span>");
    let mut body = String::new();
    let mut totals = [[[0usize; 2]; 2]; SOURCE_COUNTS.len()];
    for scene in SCENES {
        let mut cells = vec![scene.to_owned()];
        let mut any = false;
        for (totals, sources) in totals.iter_mut().zip(SOURCE_COUNTS) {
            let printed = table_six(scene, sources).unwrap_or_default();
            for (total, wins) in totals[1].iter_mut().zip(printed.split('/')) {
                *total += wins.parse().unwrap_or(0);
            }
            let pair = find(scene, sources, "linear").zip(find(scene, sources, "hold"));
            let ours = pair.map_or(NONE.to_owned(), |(linear, hold)| {
                any = true;
                let figures = |r: &Row| {
                    [
                        r.pesq.map_or(0.0, |s| s.mean),
                        r.ssim.mean,
                        r.si_snr_db.mean,
                    ]
                };
                let pairs = || figures(linear).into_iter().zip(figures(hold));
                let wins = [
                    pairs().filter(|(l, h)| l > h).count(),
                    pairs().filter(|(l, h)| h > l).count(),
                ];
                totals[0] = [totals[0][0] + wins[0], totals[0][1] + wins[1]];
                format!("{}/{}", wins[0], wins[1])
            });
            cells.push(cell(ours, printed));
        }
        if any {
            body.push_str(&row("", &cells));
        }
    }
    if body.is_empty() {
        return body;
    }
    let sums = totals
        .iter()
        .map(|[[linear, hold], [p, q]]| match linear + hold {
            0 => cell(NONE.to_owned(), &format!("{p}/{q}")),
            _ => cell(format!("{linear}/{hold}"), &format!("{p}/{q}")),
        });
    let cells: Vec<String> = std::iter::once("total".to_owned()).chain(sums).collect();
    body.push_str(&row("begins", &cells));
    let counts = SOURCE_COUNTS.map(|n| n.to_string());
    let head: Vec<&str> = std::iter::once("scene")
        .chain(counts.iter().map(String::as_str))
        .collect();
    format!(
        "<p>How many of PESQ, SSIM and SI-SNR <code>linear</code> and <code>hold</code> win on the means over repeats, by \
         number of sources: ours, then <span class=\"paper\">the paper's</span>. Equal means count for neither.</p>{}",
        table(
            "",
            "linear/hold wins, workstation, walking listener",
            &head,
            &body
        )
    )
}

/// Path counts, recall and checksums of the references.
pub(super) fn references(rows: &[Row]) -> String {
    let head = [
        "cell",
        "paths",
        "recall",
        "by energy",
        "repeats",
        "checksum",
    ];
    let percent = |share: Option<f64>| {
        share.map_or(NONE.to_owned(), |share| format!("{:.2} %", 100.0 * share))
    };
    let mut body = String::new();
    let mut last = "";
    for r in rows.iter() {
        if r.wav_stem != std::mem::replace(&mut last, &r.wav_stem) {
            let cells = [
                escaped(&r.wav_stem),
                r.reference_paths.to_string(),
                percent(r.reference_recall),
                percent(r.reference_energy_recall),
                r.repeats.to_string(),
                format!("<code>{}</code>", r.reference_checksum),
            ];
            body.push_str(&row("", &cells));
        }
    }
    format!(
        "<p>Recall: the share, by number and by energy, of the paths found with eight times the rays that the reference has \
         in mid-walk. Checksum: FNV-1a, 64 bits, of the first repeat's samples in f32.</p>{}",
        table("", "References, a line for each cell", &head, &body)
    )
}
