//! What voices need to know of the world at a new graphics frame, and what they say of its paths.

use glam::Quat;

use super::{BandCorrection, Hrtf};

/// What became of a frame's paths.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Dropped {
    /// Paths without a voice: beyond the limits, invalid, out of order.
    pub(super) paths: u32,
    /// Paths longer than the delay lines.
    pub(super) delays: u32,
    /// Paths that wait for a voice.
    pub(super) starts: u32,
}

/// What the voices need to know of their surroundings at a new frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surroundings<'a> {
    pub(super) hrtf: &'a Hrtf,
    pub(super) correction: &'a BandCorrection,
    /// From world to head coordinates.
    pub(super) to_head: Quat,
    pub(super) rate_hz: f64,
    /// Longest path delay in frames.
    pub(super) max_delay: f64,
    /// Time in frames.
    pub(super) now: i64,
    /// Frames the last ramp still had to go.
    pub(super) left: u32,
    /// Frames of the new ramp.
    pub(super) ramp: u32,
}

/// Who lives in a source's slot, and since when.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tenant {
    /// None before the first.
    pub(super) bits: Option<u32>,
    /// Nothing before this position is the tenant's.
    pub(super) since: i64,
}

impl Tenant {
    /// The slot before its first tenant, who may have sounded already.
    pub(super) const NONE: Self = Self {
        bits: None,
        since: i64::MIN / 2,
    };
}
