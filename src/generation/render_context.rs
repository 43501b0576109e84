//! What voices need to know of the world at a new graphics frame, and what they say of its paths.

use glam::Quat;

use crate::generation::{BandCorrection, Hrtf};

/// What became of a frame's paths.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Dropped {
    /// Paths without a voice: beyond the limits, invalid, out of order.
    pub(crate) paths: u32,
    /// Paths longer than the delay lines.
    pub(crate) delays: u32,
    /// Paths that wait for a voice.
    pub(crate) starts: u32,
}

/// What the voices need to know of their surroundings at a new frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    pub(crate) hrtf: &'a Hrtf,
    pub(crate) correction: &'a BandCorrection,
    /// From world to head coordinates.
    pub(crate) to_head: Quat,
    pub(crate) rate_hz: f64,
    /// Longest path delay in frames.
    pub(crate) max_delay: f64,
    /// Time in frames.
    pub(crate) now: i64,
    /// Frames the last ramp still had to go.
    pub(crate) left: u32,
    /// Frames of the new ramp.
    pub(crate) ramp: u32,
}

/// Who lives in a source's slot, and since when.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tenant {
    /// None before the first.
    pub(crate) bits: Option<u32>,
    /// Nothing before this position is the tenant's.
    pub(crate) since: i64,
}

impl Tenant {
    /// The slot before its first tenant, who may have sounded already.
    pub(crate) const NONE: Self = Self {
        bits: None,
        since: i64::MIN / 2,
    };
}
