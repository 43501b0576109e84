//! The printed figures of the paper's Tables 3 to 6, as data for comparison.
//!
//! Typed from the tables literally: a mean, a ± and a standard deviation where one is printed, "> 40" where the ratio is
//! beyond the paper's cap.

use serde::Serialize;

use super::cells::{Condition, Platform, SCENES, SOURCE_COUNTS};

const SPEED: &str = include_str!("paper_tables_3_4.csv");
const FIDELITY: &str = include_str!("paper_table_5.csv");
const WINS: &str = include_str!("paper_table_6.csv");

/// One cell of Table 5.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Printed {
    /// PESQ.
    pub pesq: &'static str,
    /// SSIM.
    pub ssim: &'static str,
    /// SI-SNR in dB.
    pub si_snr_db: &'static str,
}

/// One cell of Tables 3 and 4.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrintedSpeed {
    /// Graphics frames a second of the synchronous baseline.
    pub baseline_fps: f64,
    /// Graphics frames a second of the paper's asynchronous algorithm.
    pub proposed_fps: f64,
    /// Their printed ratio.
    pub speedup: f64,
}

/// The fields behind a key of the line that has it.
fn cell(table: &'static str, key: &str) -> Option<std::str::Split<'static, char>> {
    let line = table.lines().find_map(|line| line.strip_prefix(key));
    line.map(|line| line.split(','))
}

/// A cell of Tables 3 (workstation) and 4 (mobile), if the paper has it.
pub fn printed_speed(platform: Platform, scene: &str, sources: usize) -> Option<PrintedSpeed> {
    let fields = cell(SPEED, &format!("{},{scene},{sources},", platform.name()))?;
    let mut numbers = fields.filter_map(|field| field.parse().ok());
    Some(PrintedSpeed {
        baseline_fps: numbers.next()?,
        proposed_fps: numbers.next()?,
        speedup: numbers.next()?,
    })
}

/// A cell of Table 5, if the paper has it.
pub fn table_five(
    platform: Platform,
    scene: &str,
    condition: Condition,
    sources: usize,
) -> Option<Printed> {
    let key = format!(
        "{},{},{scene},{sources},",
        platform.name(),
        condition.name()
    );
    let mut fields = cell(FIDELITY, &key)?;
    Some(Printed {
        pesq: fields.next()?,
        ssim: fields.next()?,
        si_snr_db: fields.next()?,
    })
}

/// A cell of Table 6, if the paper has it: wins of linear extrapolation and of the zero-order hold.
pub fn table_six(scene: &str, sources: usize) -> Option<&'static str> {
    cell(WINS, &format!("{scene},{sources},"))?.next()
}

/// Speed of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pace {
    /// Graphics frames a second: the paper's "Proposed".
    pub graphics_rate_hz: f64,
    /// Extrapolation level L that the speedup implies.
    pub level: u32,
}

/// The pace of a cell. Scenes that the paper does not have (such as `doorway`) take the concert hall's; numbers of sources
/// between two columns take the larger one's.
pub fn pace(platform: Platform, scene: &str, sources: usize) -> Pace {
    let scene = if SCENES.contains(&scene) {
        scene
    } else {
        SCENES[0]
    };
    let column = SOURCE_COUNTS.iter().find(|count| **count >= sources);
    let column = *column.unwrap_or(&SOURCE_COUNTS[SOURCE_COUNTS.len() - 1]);
    printed_speed(platform, scene, column).map_or(
        Pace {
            graphics_rate_hz: 60.0,
            level: 1,
        },
        |cell| Pace {
            graphics_rate_hz: cell.proposed_fps,
            level: implied_level(cell.speedup),
        },
    )
}

/// max(1, ⌈speedup⌉ − 1): an update every L + 1 frames makes frames at most L + 1 times as frequent.
fn implied_level(speedup: f64) -> u32 {
    (speedup.ceil() as u32).saturating_sub(1).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_is_present_with_the_paper_s_extremes() {
        let mut pesq = Vec::new();
        for platform in Platform::ALL {
            for condition in [Condition::Static, Condition::Dynamic] {
                for (scene, sources) in SCENES.iter().flat_map(|s| SOURCE_COUNTS.map(|n| (s, n))) {
                    let cell = table_five(platform, scene, condition, sources).unwrap();
                    let mean = cell.pesq.split('±').next().unwrap();
                    if condition == Condition::Dynamic {
                        pesq.push(mean.parse::<f64>().unwrap());
                    }
                    assert!(!cell.ssim.is_empty() && !cell.si_snr_db.is_empty());
                    assert!(table_six(scene, sources).is_some());
                }
            }
        }
        let (low, high) = pesq
            .iter()
            .fold((9.0f64, 0.0f64), |(l, h), p| (l.min(*p), h.max(*p)));
        // "Across all dynamic cases on both platforms, PESQ ranges from 2.86 to 4.44."
        assert_eq!((pesq.len(), low, high), (30, 2.86, 4.44));
    }

    #[test]
    fn levels_are_implied_by_the_speedups() {
        let levels =
            |platform, scene| SOURCE_COUNTS.map(|count| pace(platform, scene, count).level);
        assert_eq!(
            levels(Platform::Workstation, "concert_hall"),
            [2, 3, 4, 7, 12]
        );
        assert_eq!(levels(Platform::Workstation, "bootcamp"), [1, 1, 1, 1, 2]);
        assert_eq!(levels(Platform::Workstation, "angrybot"), [1, 1, 2, 3, 5]);
        assert_eq!(levels(Platform::Mobile, "concert_hall"), [3, 4, 4, 5, 6]);
        assert_eq!(levels(Platform::Mobile, "bootcamp"), [1, 2, 2, 3, 5]);
        assert_eq!(levels(Platform::Mobile, "angrybot"), [2, 2, 2, 3, 5]);
    }

    #[test]
    fn printed_speedups_are_the_ratios_of_printed_rates() {
        for platform in Platform::ALL {
            for scene in SCENES {
                for sources in SOURCE_COUNTS {
                    let cell = printed_speed(platform, scene, sources).unwrap();
                    let ratio = cell.proposed_fps / cell.baseline_fps;
                    // Rates are printed to a tenth, ratios to a hundredth.
                    let slack =
                        0.006 + ratio * (0.05 / cell.baseline_fps + 0.05 / cell.proposed_fps);
                    assert!(
                        (ratio - cell.speedup).abs() < slack,
                        "{scene} {sources}: {ratio}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_phones_copy_of_table_four_is_the_same() {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../assets/paper/paper_table_4.csv"
        );
        let text = std::fs::read_to_string(path).unwrap();
        let lines = text.lines();
        let mut count = 0;
        for line in lines.skip(1) {
            let words: Vec<&str> = line.split(',').collect();
            let number = |column: usize| words[column].parse::<f64>().unwrap();
            let cell = printed_speed(Platform::Mobile, words[0], number(1) as usize).unwrap();
            assert_eq!(
                [number(2), number(3)],
                [cell.baseline_fps, cell.proposed_fps]
            );
            count += 1;
        }
        assert_eq!(count, SCENES.len() * SOURCE_COUNTS.len());
    }

    #[test]
    fn other_scenes_and_counts_have_a_pace() {
        assert_eq!(pace(Platform::Workstation, "doorway", 16).level, 12);
        assert_eq!(
            pace(Platform::Mobile, "bootcamp", 3),
            pace(Platform::Mobile, "bootcamp", 4)
        );
        assert_eq!(pace(Platform::Mobile, "bootcamp", 40).level, 5);
    }
}
