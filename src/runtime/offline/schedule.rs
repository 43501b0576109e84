//! Schedules of propagation, and the poses of a graphics frame.
//!
//! Source: the paper's section III-B and Figure 2 for the asynchronous schedule, its reference 18 for the synchronous
//! one.

use crate::error::{Error, Result};
use crate::scene::{ListenerPose, SourcePose};

/// Poses of listener and sources at one graphics frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Poses {
    /// The listener.
    pub listener: ListenerPose,
    /// The sources, one per slot at most.
    pub sources: Vec<SourcePose>,
}

/// When the asynchronous schedule uses a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Latency {
    /// L + 1 graphics frames after its poses, as in real time.
    #[default]
    Modelled,
    /// At once; the next result still follows L + 1 graphics frames later.
    None,
}

/// When propagation runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Schedule {
    /// A whole propagation in every graphics frame.
    Synchronous,
    /// A propagation every L + 1 graphics frames, extrapolation in between.
    Asynchronous {
        /// Extrapolation level L.
        extrapolation_level: u32,
        /// When a result is used.
        latency: Latency,
    },
}

/// Highest extrapolation level: ten seconds of graphics frames at 100 Hz.
const MAX_EXTRAPOLATION_LEVEL: u32 = 1000;

impl Schedule {
    /// The extrapolation level L.
    pub fn extrapolation_level(&self) -> u32 {
        match self {
            Self::Synchronous => 0,
            Self::Asynchronous {
                extrapolation_level: level,
                ..
            } => *level,
        }
    }

    pub(crate) fn check(&self) -> Result<()> {
        let level = self.extrapolation_level();
        if level <= MAX_EXTRAPOLATION_LEVEL {
            return Ok(());
        }
        let problem = format!("{level} graphics frames without an update");
        Err(Error::setting(
            "level",
            problem,
            "choose a level up to 1000",
        ))
    }
}
