//! Table 5 in the paper's own layout: a column a number of sources, ours and the printed figure below each other.

use super::Row;
use super::figures_of_merit::{PLAIN, figures};
use super::html::{NONE, escaped, figure, row, table};
use crate::cells::{Condition, Platform, RendererKind};
use crate::paper::{Printed, table_five};

/// Names of the figures, in the order of [`figures`].
const FIGURES: [&str; 3] = ["PESQ", "SSIM", "SI-SNR dB"];

/// Conditions in the order of the tables.
const ORDER: [Condition; 8] = [
    Condition::Dynamic,
    Condition::Static,
    Condition::Stress,
    Condition::Restless,
    Condition::Dash,
    Condition::Irregular,
    Condition::Teleport,
    Condition::Jump,
];

/// Platform, condition and signal of a table.
type Heading<'a> = (Platform, Condition, &'a str);

/// One table a platform, condition and signal.
pub(super) fn similarity(rows: &[Row]) -> String {
    let mut headings: Vec<Heading<'_>> = Vec::new();
    for platform in Platform::ALL {
        for condition in ORDER {
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
        .map(|heading| similarity_table(rows, heading))
        .collect()
}

fn similarity_table(rows: &[Row], (platform, condition, signal): Heading<'_>) -> String {
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
    let title = format!("{}, {}, {signal}", platform.name(), condition.motion());
    let title = escaped(&title);
    let counts_text: Vec<String> = counts.iter().map(|n| n.to_string()).collect();
    let head = ["figure", "predictor"]
        .into_iter()
        .chain(counts_text.iter().map(String::as_str));
    let body: String = scenes
        .iter()
        .map(|scene| scene_lines(&part, scene, &counts))
        .collect();
    let caption = format!("By number of sources: {title}");
    let head: Vec<&str> = head.collect();
    format!("<h3>{title}</h3>{}", table("names", &caption, &head, &body))
}

/// The lines of one scene: its paces, then each figure by predictor and latency, then the paper's.
fn scene_lines(part: &[&Row], scene: &str, counts: &[usize]) -> String {
    let of = |sources: usize| {
        part.iter()
            .find(|r| r.scene == scene && r.sources == sources)
    };
    let mut cells = vec![escaped(scene), "FPS, L".to_owned()];
    cells.extend(counts.iter().map(|&sources| {
        of(sources).map_or(NONE.to_owned(), |r| {
            format!("{}, {}", r.graphics_rate_hz, r.level)
        })
    }));
    let mut lines = row("group", &cells);
    let mut names = PLAIN.to_vec();
    for row in part {
        if !names.contains(&row.predictor.as_str()) {
            names.push(&row.predictor);
        }
    }
    let mut series: Vec<(&str, bool, RendererKind)> = Vec::new();
    for name in names {
        for (is_late, renderer) in [true, false]
            .into_iter()
            .flat_map(|is_late| RendererKind::ALL.map(|renderer| (is_late, renderer)))
        {
            let ran = part.iter().any(|r| {
                let is_cell = r.scene == scene && r.predictor == name;
                is_cell && (r.is_late, r.renderer) == (is_late, renderer)
            });
            if ran {
                series.push((name, is_late, renderer));
            }
        }
    }
    let is_speech = part.iter().any(|r| r.scene == scene && r.pesq.is_some());
    for (index, merit) in FIGURES.iter().enumerate() {
        if index == 0 && !is_speech {
            continue;
        }
        for (line, &(name, is_late, renderer)) in series.iter().enumerate() {
            let find = |sources: usize| {
                part.iter().find(|r| {
                    r.scene == scene
                        && r.sources == sources
                        && r.predictor == name
                        && (r.is_late, r.renderer) == (is_late, renderer)
                })
            };
            let name_cell = if line == 0 { *merit } else { "" };
            let at_once = if is_late { "" } else { ", at once" };
            let renderer = match renderer {
                RendererKind::Offline => String::new(),
                engine => format!(", {}", engine.name()),
            };
            let mut cells = vec![
                name_cell.to_owned(),
                format!("{}{at_once}{renderer}", escaped(name)),
            ];
            cells.extend(counts.iter().map(|&sources| {
                find(sources).map_or(NONE.to_owned(), |r| figure(figures(r)[index].clone()))
            }));
            lines.push_str(&row(if line == 0 { "begins" } else { "" }, &cells));
        }
        lines.push_str(&printed_line(part, scene, counts, index));
    }
    lines
}

/// The paper's figures, where the paper has the scene and the signal is its own.
fn printed_line(part: &[&Row], scene: &str, counts: &[usize], index: usize) -> String {
    let Some(first) = part
        .iter()
        .find(|r| r.scene == scene && r.signal == "speech")
    else {
        return String::new();
    };
    let printed = |sources| table_five(first.platform, scene, first.condition, sources);
    if counts.iter().all(|&sources| printed(sources).is_none()) {
        return String::new();
    }
    let text = |p: Printed| [p.pesq, p.ssim, p.si_snr_db][index].replace('>', "&gt;");
    let mut cells = vec![String::new(), "the paper".to_owned()];
    let texts = counts
        .iter()
        .map(|&n| printed(n).map_or(NONE.to_owned(), text));
    cells.extend(texts.map(|text| text.replace('±', " ± ")));
    row("paper", &cells)
}
