//! What extrapolation gives for one graphics frame, and generation takes.

use glam::{Quat, Vec3};

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::PathId;
use crate::scene::SourceId;

/// One path as it is to sound at the end of the present graphics frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FramePath {
    /// Identity across frames.
    pub id: PathId,
    /// The source it carries.
    pub source: SourceId,
    /// Number of reflections; 0 is the direct path.
    pub order: u8,
    /// Signed pressure ratio a band, relative to the free field at 1 m.
    pub amplitude: BandArray,
    /// Propagation delay in seconds.
    pub delay_s: f64,
    /// Unit vector in world coordinates from the listener towards where the sound comes from.
    pub arrival: Vec3,
}

pub use crate::propagation::LATE_SEGMENTS;

/// One start of the tail that a source sends to the late reverb.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LateSend {
    /// The source.
    pub source: SourceId,
    /// Energy a second of the diffuse impulse response, extrapolated back to emission, in 1/s; see
    /// [`crate::propagation::diffuse::LateSegment::energy_per_s`].
    pub energy_per_s: BandArray,
    /// Seconds from emission to this start.
    pub start_s: f32,
}

/// Everything generation needs to know about one graphics frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FramePaths {
    /// Head orientation: turns head coordinates (+x right, +y up, −z ahead) into world coordinates.
    pub orientation: Quat,
    /// Paths, sorted by [`FramePath::id`].
    pub paths: Vec<FramePath>,
    /// Late reverb sends, at most [`LATE_SEGMENTS`] a source; a source's are told apart by their order, so it stays.
    pub late: Vec<LateSend>,
    /// Reverberation time T60 of the tail in seconds, one a band.
    pub decay_time_s: BandArray,
}

impl Default for FramePaths {
    /// Silence: no paths, no tail.
    fn default() -> Self {
        Self {
            orientation: Quat::IDENTITY,
            paths: Vec::new(),
            late: Vec::new(),
            decay_time_s: [0.0; BANDS],
        }
    }
}
