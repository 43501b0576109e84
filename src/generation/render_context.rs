//! Inputs of the voices at a new graphics frame, and counts of its paths.

use glam::Quat;

use crate::acoustics::medium::HIGH_AIR_HZ;
use crate::extrapolation::WideArrival;
use crate::generation::BandCorrection;
use crate::generation::bands::air_filter::AirFilter;
use crate::generation::panning::direction_table::DirectionTable;

/// Paths of a frame without a voice.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Dropped {
    /// Dropped paths: beyond the limits, invalid or out of order.
    pub(crate) paths: u32,
    /// Dropped paths: longer than the delay lines.
    pub(crate) delays: u32,
    /// Paths that wait for a voice.
    pub(crate) late_starts: u32,
}

/// Inputs of the voices at a new frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RenderContext<'a> {
    pub(crate) table: &'a DirectionTable,
    pub(crate) correction: &'a BandCorrection,
    pub(crate) air: &'a AirFilter,
    /// Absorption of air in Np/s at [`HIGH_AIR_HZ`].
    pub(crate) air_np_per_s: [f32; HIGH_AIR_HZ.len()],
    /// Directions of the paths of wide sources, sorted by identity.
    pub(crate) wide: &'a [WideArrival],
    /// From world to head coordinates.
    pub(crate) to_head: Quat,
    pub(crate) rate_hz: f64,
    /// Longest path delay in seconds, by source slot.
    pub(crate) longest_s: &'a [f64],
    /// Time in frames.
    pub(crate) now: i64,
    /// Frames of the last ramp left.
    pub(crate) left: u32,
    /// Frames of the new ramp.
    pub(crate) ramp: u32,
}

/// The source that owns a slot, and the start of its signal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SlotOwner {
    /// Bits of the source's identity; `None` before the first owner.
    pub(crate) bits: Option<u32>,
    /// First position of its signal.
    pub(crate) since: i64,
}

impl SlotOwner {
    /// No owner yet; the input of the first one may already have started.
    pub(crate) const NONE: Self = Self {
        bits: None,
        since: i64::MIN / 2,
    };
}
