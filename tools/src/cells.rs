//! The cells of the paper's Tables 3 and 4: graphics rate and extrapolation level of every scene and source count.

use serde::Serialize;

/// Numbers of sources that the paper's columns stand for.
pub const SOURCE_COUNTS: [usize; 5] = [1, 2, 4, 8, 16];

/// The paper's three scenes; ours of the same names stand in for them.
pub const SCENES: [&str; 3] = ["concert_hall", "bootcamp", "angrybot"];

/// The two machines of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Platform {
    /// A PC with ten cores (Table 3).
    Workstation,
    /// A telephone (Table 4).
    Mobile,
}

impl Platform {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Workstation, Self::Mobile];

    /// The name the command line uses.
    pub fn name(self) -> &'static str {
        match self {
            Self::Workstation => "workstation",
            Self::Mobile => "mobile",
        }
    }
}

/// How the listener, and the sources, move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Condition {
    /// Nobody moves.
    Static,
    /// The listener walks to and fro, as in the paper.
    Dynamic,
    /// Beyond the paper: the listener runs and turns the head, the sources move, updates are [`STRESS_LEVEL`] + 1 graphics
    /// frames apart.
    Stress,
}

impl Condition {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Static, Self::Dynamic, Self::Stress];

    /// The name the command line uses.
    pub fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Dynamic => "dynamic",
            Self::Stress => "stress",
        }
    }

    /// What the listener does, in a word.
    pub fn listener(self) -> &'static str {
        match self {
            Self::Static => "standing",
            Self::Dynamic => "walking",
            Self::Stress => "running",
        }
    }
}

/// Extrapolation level of [`Condition::Stress`]: twice the paper's highest.
pub const STRESS_LEVEL: u32 = 24;

/// How fast a cell runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pace {
    /// Graphics frames a second: the paper's "Proposed".
    pub graphics_rate_hz: f64,
    /// Extrapolation level L that the speedup implies.
    pub level: u32,
}

/// Proposed FPS and speedup by source count: Tables 3 and 4 as printed.
type Row = [(f64, f64); 5];

const WORKSTATION: [Row; 3] = [
    [
        (122.1, 2.68),
        (101.2, 3.36),
        (94.1, 4.84),
        (84.6, 7.69),
        (74.6, 12.43),
    ],
    [
        (251.0, 1.01),
        (213.7, 1.04),
        (165.8, 1.03),
        (162.0, 1.68),
        (124.8, 2.18),
    ],
    [
        (166.3, 1.71),
        (129.8, 1.83),
        (108.7, 2.35),
        (95.3, 3.55),
        (87.1, 5.09),
    ],
];

const MOBILE: [Row; 3] = [
    [
        (82.4, 3.79),
        (68.6, 4.39),
        (48.2, 4.68),
        (35.6, 5.86),
        (25.8, 6.79),
    ],
    [
        (88.2, 1.81),
        (82.6, 2.05),
        (77.9, 2.62),
        (73.0, 3.58),
        (65.6, 5.35),
    ],
    [
        (83.4, 2.10),
        (75.4, 2.36),
        (64.2, 2.75),
        (53.5, 3.62),
        (45.0, 5.75),
    ],
];

/// FPS of the synchronous baseline.
const WORKSTATION_BASELINE: [[f64; 5]; 3] = [
    [45.6, 30.2, 19.4, 11.0, 6.0],
    [249.1, 204.8, 160.8, 96.4, 57.3],
    [97.2, 71.0, 46.2, 26.9, 17.1],
];

const MOBILE_BASELINE: [[f64; 5]; 3] = [
    [21.7, 15.6, 10.3, 6.1, 3.8],
    [48.8, 40.2, 29.8, 20.4, 12.3],
    [39.7, 32.0, 23.4, 14.8, 7.8],
];

/// The pace of a cell. A scene that the paper does not know (such as `doorway`) goes at the concert hall's; a number of
/// sources between two columns at the larger one's.
pub fn pace(platform: Platform, scene: &str, sources: usize) -> Pace {
    let row = SCENES.iter().position(|name| *name == scene).unwrap_or(0);
    let column = SOURCE_COUNTS
        .iter()
        .position(|count| *count >= sources)
        .unwrap_or(SOURCE_COUNTS.len() - 1);
    let table = match platform {
        Platform::Workstation => &WORKSTATION,
        Platform::Mobile => &MOBILE,
    };
    let (graphics_rate_hz, speedup) = table[row][column];
    Pace {
        graphics_rate_hz,
        level: implied_level(speedup),
    }
}

/// Tables 3 and 4 as printed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrintedSpeed {
    /// Graphics frames a second of the synchronous baseline.
    pub baseline_fps: f64,
    /// Of the paper's asynchronous algorithm.
    pub proposed_fps: f64,
    /// Their printed ratio.
    pub speedup: f64,
}

/// What the paper printed on speed, if it has the cell.
pub fn printed_speed(platform: Platform, scene: &str, sources: usize) -> Option<PrintedSpeed> {
    let row = SCENES.iter().position(|name| *name == scene)?;
    let column = SOURCE_COUNTS.iter().position(|count| *count == sources)?;
    let (proposed, baseline) = match platform {
        Platform::Workstation => (&WORKSTATION, &WORKSTATION_BASELINE),
        Platform::Mobile => (&MOBILE, &MOBILE_BASELINE),
    };
    let (proposed_fps, speedup) = proposed[row][column];
    Some(PrintedSpeed {
        baseline_fps: baseline[row][column],
        proposed_fps,
        speedup,
    })
}

/// max(1, ⌈speedup⌉ − 1): an update every L + 1 frames makes frames at most L + 1 times as frequent.
fn implied_level(speedup: f64) -> u32 {
    (speedup.ceil() as u32).saturating_sub(1).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_follow_from_the_speedups() {
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
        let lines = include_str!("../../assets/paper/paper_table_4.csv").lines();
        let mut count = 0;
        for line in lines.skip(1) {
            let words: Vec<&str> = line.split(',').collect();
            let number = |place: usize| words[place].parse::<f64>().unwrap();
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
    fn other_scenes_and_counts_have_a_pace_too() {
        assert_eq!(pace(Platform::Workstation, "doorway", 16).level, 12);
        assert_eq!(
            pace(Platform::Mobile, "bootcamp", 3),
            pace(Platform::Mobile, "bootcamp", 4)
        );
        assert_eq!(pace(Platform::Mobile, "bootcamp", 40).level, 5);
    }
}
