//! The report on an evaluation: one HTML page with its style and pictures inside and the WAV files beside it.

mod equal_terms;
mod figures_of_merit;
mod html;
mod jumps;
mod listed;
mod overload;
mod similarity;
mod similarity_map;
mod speed;
mod style;
mod tables;

use std::fmt::Write;

use base64::prelude::{BASE64_STANDARD, Engine};

pub use self::overload::OverloadRow;
pub use self::similarity_map::SimilarityMap;

use self::html::escaped;
use super::cells::{Condition, Platform, RendererKind};
use super::scores::{Scores, Spread};
use super::settling::Settling;

/// One cell and predictor.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// What rendered both schedules.
    pub renderer: RendererKind,
    /// Platform of the graphics rate and level.
    pub platform: Platform,
    /// Name of the scene.
    pub scene: String,
    /// How listener and sources move.
    pub condition: Condition,
    /// Number of sources.
    pub sources: usize,
    /// Extrapolation level L.
    pub level: u32,
    /// Graphics frames a second.
    pub graphics_rate_hz: f64,
    /// Name of the predictor.
    pub predictor: String,
    /// Whether results are L + 1 graphics frames late.
    pub is_late: bool,
    /// speech, music or percussion.
    pub signal: String,
    /// Number of renderings of the means.
    pub repeats: usize,
    /// Wideband PESQ, of speech.
    pub pesq: Option<Spread>,
    /// Structural similarity of log-mel spectrograms.
    pub ssim: Spread,
    /// SI-SNR in dB, not capped.
    pub si_snr_db: Spread,
    /// The difference after jumps of listener or sources, the largest of all repeats, if there are any.
    pub settling: Option<Settling>,
    /// Processor time of a graphics frame's extrapolation in µs, the mean of all frames.
    pub extrapolation_us: f64,
    /// Paths of the reference, median over updates of the first repeat.
    pub reference_paths: usize,
    /// Extrapolation level in use: median and 99th percentile over updates.
    pub extrapolation_level: [f64; 2],
    /// Median time of an update of its schedule, and of the reference.
    pub update_ms: f64,
    /// The same of the reference.
    pub reference_update_ms: f64,
    /// The reference with another ray seed, compared with the reference.
    pub other_seed: Option<Scores>,
    /// Share of the paths of a search with more rays that the reference has in mid-walk, where it is known.
    pub reference_recall: Option<f64>,
    /// The same by energy.
    pub reference_energy_recall: Option<f64>,
    /// Checksum of the first repeat's reference.
    pub reference_checksum: String,
    /// Stem of the cell's WAV files.
    pub wav_stem: String,
}

impl Row {
    /// Extrapolation's share of a core.
    pub fn extrapolation_share(&self) -> f64 {
        1e-6 * self.extrapolation_us * self.graphics_rate_hz
    }
}

/// A picture with a title and a caption.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Title; figures of one title are grouped.
    pub title: String,
    /// Caption.
    pub caption: String,
    /// The picture as a data URI.
    pub image: String,
}

/// Renderings of one cell to compare by ear.
#[derive(Debug, Clone, PartialEq)]
pub struct Listening {
    /// Title.
    pub title: String,
    /// Name and relative file of each rendering.
    pub files: Vec<(String, String)>,
}

/// Everything on the page.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The tables' rows.
    pub rows: Vec<Row>,
    /// The stress case of the paper's Figure 7.
    pub doorway: Vec<Row>,
    /// Output of `bench speed --json`, or null.
    pub speed: serde_json::Value,
    /// Playback under overload.
    pub overload: Vec<OverloadRow>,
    /// Pictures in order.
    pub figures: Vec<Figure>,
    /// Sounds in order.
    pub listening: Vec<Listening>,
    /// Name and value of each condition, such as the machine.
    pub conditions: Vec<(String, String)>,
}

/// Bytes of a media type (such as image/png) as a data URI.
pub fn data_uri(media_type: &str, bytes: &[u8]) -> String {
    format!("data:{media_type};base64,{}", BASE64_STANDARD.encode(bytes))
}

impl Report {
    /// The page.
    pub fn html(&self) -> String {
        let mut page = String::new();
        let sections = [
            (
                "similarity",
                "Similarity (Table 5)",
                similarity::similarity(&self.rows),
            ),
            (
                "jumps",
                "After teleports and jumps",
                jumps::jumps(&self.rows),
            ),
            (
                "wins",
                "Extrapolation against hold (Table 6)",
                tables::wins(&self.rows),
            ),
            (
                "equal",
                "Level, cost and fidelity of each predictor",
                equal_terms::equal_terms(&self.rows),
            ),
            ("speed", "Speed (Tables 3 and 4)", speed::speed(&self.speed)),
            (
                "doorway",
                "Past a door (Figure 7's cell)",
                self.doorway_section(),
            ),
            (
                "overload",
                "Playback under overload (Figure 8)",
                overload::overload(&self.overload),
            ),
            ("figures", "Figures", self.figure_section()),
            ("listen", "Listen", self.listening_section()),
            ("reference", "The reference", tables::references(&self.rows)),
            ("conditions", "Conditions", self.condition_section()),
        ];
        let sections: Vec<_> = sections
            .into_iter()
            .filter(|(_, _, content)| !content.is_empty())
            .collect();
        let links: String = sections
            .iter()
            .map(|(id, title, _)| format!("<a href=\"#{id}\">{title}</a>"))
            .collect();
        // Writing to a string does not fail.
        let _ = write!(
            page,
            "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
             <title>Foresound: fidelity</title><style>{}</style></head><body>\
             <header><h1>How close asynchronous sound comes</h1>{}<nav>{links}</nav></header><main>",
            style::STYLE,
            tables::summary(&self.rows)
        );
        for (id, title, content) in sections {
            let _ = write!(
                page,
                "<section id=\"{id}\"><h2>{title}</h2>{content}</section>"
            );
        }
        page.push_str("</main></body></html>\n");
        page
    }

    fn doorway_section(&self) -> String {
        if self.doorway.is_empty() {
            return String::new();
        }
        format!(
            "<p>Two rooms, one door, a walk that crosses a wall's edge beside it: paths appear and vanish suddenly.</p>{}",
            listed::listed(&self.doorway)
        )
    }

    fn figure_section(&self) -> String {
        let mut section = String::new();
        let mut last = "";
        for figure in &self.figures {
            if figure.title != last {
                let _ = write!(section, "<h3>{}</h3>", escaped(&figure.title));
                last = &figure.title;
            }
            let caption = escaped(&figure.caption);
            let _ = write!(
                section,
                "<figure><div class=\"scroll\" tabindex=\"0\"><img src=\"{}\" alt=\"{caption}\"></div>\
                 <figcaption>{caption}</figcaption></figure>",
                figure.image
            );
        }
        section
    }

    fn listening_section(&self) -> String {
        let cards: String = self
            .listening
            .iter()
            .map(|pair| {
                let players: String = pair
                    .files
                    .iter()
                    .map(|(name, file)| {
                        format!(
                            "<label>{}<audio controls preload=\"none\" src=\"{}\"></audio></label>",
                            escaped(name),
                            escaped(file)
                        )
                    })
                    .collect();
                format!(
                    "<div class=\"card\"><h3>{}</h3>{players}</div>",
                    escaped(&pair.title)
                )
            })
            .collect();
        if cards.is_empty() {
            return cards;
        }
        format!(
            "<p>Wear headphones. The files lie in <code>wav/</code> beside this page.</p>\
             <div class=\"cards\">{cards}</div>"
        )
    }

    fn condition_section(&self) -> String {
        let rows: String = self
            .conditions
            .iter()
            .map(|(name, value)| format!("<dt>{}</dt><dd>{}</dd>", escaped(name), escaped(value)))
            .collect();
        format!("<dl>{rows}</dl>")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row for tests.
    pub(super) fn row() -> Row {
        let spread = Spread { mean: 1.0, sd: 0.0 };
        Row {
            renderer: RendererKind::EngineVirtual,
            platform: Platform::Workstation,
            scene: "doorway".to_owned(),
            condition: Condition::Teleport,
            sources: 4,
            level: 12,
            graphics_rate_hz: 74.6,
            predictor: "best".to_owned(),
            is_late: true,
            signal: "speech".to_owned(),
            repeats: 1,
            pesq: Some(spread),
            ssim: spread,
            si_snr_db: spread,
            settling: Some(Settling {
                jumps: 6,
                after_db: [-40.0, -20.0],
                settled_ms: [100.0, 300.0],
            }),
            extrapolation_us: 1000.0,
            extrapolation_level: [12.0; 2],
            update_ms: 2.0,
            reference_update_ms: 1.0,
            other_seed: None,
            reference_paths: 100,
            reference_recall: None,
            reference_energy_recall: None,
            reference_checksum: String::new(),
            wav_stem: "workstation-doorway-teleport-4".to_owned(),
        }
    }

    #[test]
    fn every_section_has_the_row() {
        let report = Report {
            rows: vec![row()],
            doorway: Vec::new(),
            speed: serde_json::Value::Null,
            overload: Vec::new(),
            figures: Vec::new(),
            listening: Vec::new(),
            conditions: Vec::new(),
        };
        let page = report.html();
        for text in [
            "id=\"jumps\"",
            "id=\"equal\"",
            "best, engine-virtual",
            "7.5 %",
        ] {
            assert!(page.contains(text), "{text}");
        }
    }
}
