//! Dimensions of the paper's tables: platform, scene, number of sources, motion.

use serde::Serialize;

/// Numbers of sources of the paper's columns.
pub const SOURCE_COUNTS: [usize; 5] = [1, 2, 4, 8, 16];

/// Names of the paper's three scenes, and of ours that replace them.
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

    /// The name on the command line.
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
    /// Listener and sources are at rest.
    Static,
    /// The listener walks to and fro, as in the paper.
    Dynamic,
    /// Beyond the paper: the listener runs and turns, the sources move, updates are [`STRESS_LEVEL`] + 1 graphics
    /// frames apart.
    Stress,
}

impl Condition {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Static, Self::Dynamic, Self::Stress];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Dynamic => "dynamic",
            Self::Stress => "stress",
        }
    }

    /// One word for the listener's motion.
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
