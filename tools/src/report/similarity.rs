//! Table 5 in the paper's own shape: a column a number of sources, ours and the printed figure below each other.

use std::fmt::Write;

use super::figures_of_merit::{PLAIN, figures};
use super::{Row, escaped};
use crate::cells::{Condition, Platform};
use crate::paper::{Printed, table_five};

/// Names of the figures, in the order of [`figures`].
const FIGURES: [&str; 3] = ["PESQ", "SSIM", "SI-SNR dB"];

/// What tells one table from the next.
type Heading<'a> = (Platform, Condition, &'a str);

/// One table a platform, condition and signal.
pub(super) fn similarity(rows: &[Row]) -> String {
    let mut headings: Vec<Heading<'_>> = Vec::new();
    for platform in Platform::ALL {
        for condition in [Condition::Dynamic, Condition::Static, Condition::Stress] {
            for row in rows {
                let heading = (row.platform, row.condition, row.signal.as_str());
                if (heading.0, heading.1) == (platform, condition) && !headings.contains(&heading) {
                    headings.push(heading);
                }
            }
        }
    }
    headings
        .into_iter()
        .map(|heading| table(rows, heading))
        .collect()
}

fn table(rows: &[Row], (platform, condition, signal): Heading<'_>) -> String {
    let part: Vec<&Row> = rows
        .iter()
        .filter(|r| (r.platform, r.condition, r.signal.as_str()) == (platform, condition, signal))
        .collect();
    let mut counts: Vec<usize> = part.iter().map(|row| row.sources).collect();
    counts.sort_unstable();
    counts.dedup();
    let mut scenes: Vec<&str> = Vec::new();
    for row in &part {
        if !scenes.contains(&row.scene.as_str()) {
            scenes.push(&row.scene);
        }
    }
    let title = format!(
        "{}, {} listener, {signal}",
        platform.name(),
        condition.listener()
    );
    let title = escaped(&title);
    let columns: String = counts
        .iter()
        .map(|n| format!("<th scope=\"col\">{n}</th>"))
        .collect();
    let body: String = scenes
        .iter()
        .map(|scene| scene_lines(&part, scene, &counts))
        .collect();
    format!(
        "<h3>{title}</h3><div class=\"scroll\" tabindex=\"0\"><table class=\"names\"><caption>By number of sources: {title}</caption>\
         <thead><tr><th scope=\"col\">figure</th><th scope=\"col\">predictor</th>{columns}</tr></thead>\
         <tbody>{body}</tbody></table></div>"
    )
}

/// The lines of one scene: its paces, then each figure by predictor and latency, then the paper's.
fn scene_lines(part: &[&Row], scene: &str, counts: &[usize]) -> String {
    let of = |sources: usize| {
        part.iter()
            .find(|r| r.scene == scene && r.sources == sources)
    };
    let mut lines = format!(
        "<tr class=\"group\"><td>{}</td><td>FPS, L</td>",
        escaped(scene)
    );
    for &sources in counts {
        let text = of(sources).map_or("–".to_owned(), |r| {
            format!("{}, {}", r.graphics_rate_hz, r.level)
        });
        let _ = write!(lines, "<td>{text}</td>");
    }
    lines.push_str("</tr>");
    let mut names = PLAIN.to_vec();
    for row in part {
        if !names.contains(&row.predictor.as_str()) {
            names.push(&row.predictor);
        }
    }
    let mut series: Vec<(&str, bool)> = Vec::new();
    for name in names {
        for is_late in [true, false] {
            let ran = part
                .iter()
                .any(|r| r.scene == scene && r.predictor == name && r.is_late == is_late);
            if ran {
                series.push((name, is_late));
            }
        }
    }
    let is_speech = part.iter().any(|r| r.scene == scene && r.pesq.is_some());
    for (place, figure) in FIGURES.iter().enumerate() {
        if place == 0 && !is_speech {
            continue;
        }
        for (line, &(name, is_late)) in series.iter().enumerate() {
            let find = |sources: usize| {
                part.iter().find(|r| {
                    r.scene == scene
                        && r.sources == sources
                        && r.predictor == name
                        && r.is_late == is_late
                })
            };
            let first = if line == 0 { *figure } else { "" };
            let at_once = if is_late { "" } else { ", at once" };
            let _ = write!(
                lines,
                "<tr{}><td>{first}</td><td>{}{at_once}</td>",
                if line == 0 { " class=\"begins\"" } else { "" },
                escaped(name)
            );
            for &sources in counts {
                let (text, met) =
                    find(sources).map_or(("–".to_owned(), false), |r| figures(r)[place].clone());
                let class = if met { " class=\"met\"" } else { "" };
                let _ = write!(lines, "<td{class}>{text}</td>");
            }
            lines.push_str("</tr>");
        }
        lines.push_str(&printed_line(part, scene, counts, place));
    }
    lines
}

/// The paper's figures, where the paper has the scene and the signal is its own.
fn printed_line(part: &[&Row], scene: &str, counts: &[usize], place: usize) -> String {
    let Some(row) = part
        .iter()
        .find(|r| r.scene == scene && r.signal == "speech")
    else {
        return String::new();
    };
    let printed = |sources| table_five(row.platform, scene, row.condition, sources);
    if counts.iter().all(|&sources| printed(sources).is_none()) {
        return String::new();
    }
    let text = |p: Printed| [p.pesq, p.ssim, p.si_snr_db][place].replace('>', "&gt;");
    let cells: String = counts
        .iter()
        .map(|&n| {
            format!(
                "<td>{}</td>",
                printed(n).map_or("–".to_owned(), text).replace('±', " ± ")
            )
        })
        .collect();
    format!("<tr class=\"paper\"><td></td><td>the paper</td>{cells}</tr>")
}
