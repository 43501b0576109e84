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

/// How listener and sources move.
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
    /// The listener walks at random, with sudden turns and stops and a turning head.
    Restless,
    /// The listener runs through doorways and around corners.
    Dash,
    /// The listener walks, the sources move along random smooth curves.
    Irregular,
    /// The listener is put elsewhere again and again.
    Teleport,
    /// The listener walks, a source is put elsewhere again and again.
    Jump,
}

impl Condition {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Static,
        Self::Dynamic,
        Self::Stress,
        Self::Restless,
        Self::Dash,
        Self::Irregular,
        Self::Teleport,
        Self::Jump,
    ];

    /// Those of a run that names none.
    pub const USUAL: [Self; 7] = [
        Self::Static,
        Self::Dynamic,
        Self::Restless,
        Self::Dash,
        Self::Irregular,
        Self::Teleport,
        Self::Jump,
    ];

    /// Those whose motion no model of motion predicts.
    pub const UNPREDICTED: [Self; 5] = [
        Self::Restless,
        Self::Dash,
        Self::Irregular,
        Self::Teleport,
        Self::Jump,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Dynamic => "dynamic",
            Self::Stress => "stress",
            Self::Restless => "restless",
            Self::Dash => "dash",
            Self::Irregular => "irregular",
            Self::Teleport => "teleport",
            Self::Jump => "jump",
        }
    }

    /// Whether it is one of [`Self::UNPREDICTED`].
    pub fn is_unpredicted(self) -> bool {
        Self::UNPREDICTED.contains(&self)
    }

    /// A few words for the motion.
    pub fn motion(self) -> &'static str {
        match self {
            Self::Static => "standing listener",
            Self::Dynamic => "walking listener",
            Self::Stress => "running listener, swaying sources",
            Self::Restless => "random walk with stops",
            Self::Dash => "dash around corners",
            Self::Irregular => "irregular sources, walking listener",
            Self::Teleport => "teleported listener",
            Self::Jump => "jumping sources, walking listener",
        }
    }
}

/// What renders both schedules of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
pub enum RendererKind {
    /// The offline renderer.
    #[serde(rename = "offline")]
    Offline,
    /// The engine on a virtual clock.
    #[serde(rename = "engine-virtual")]
    EngineVirtual,
    /// The engine with its threads, by the clock.
    #[serde(rename = "engine-real")]
    EngineReal,
}

impl RendererKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Offline, Self::EngineVirtual, Self::EngineReal];

    /// The name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Offline => "offline",
            Self::EngineVirtual => "engine-virtual",
            Self::EngineReal => "engine-real",
        }
    }
}

/// Extrapolation level of [`Condition::Stress`]: twice the paper's highest.
pub const STRESS_LEVEL: u32 = 24;

/// Number of sources of the conditions without prediction, unless another is requested.
pub const UNPREDICTED_SOURCES: usize = 4;
