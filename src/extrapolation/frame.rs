//! The paths of one graphics frame: the output of extrapolation and the input of generation.

use glam::{Quat, Vec3};

use crate::acoustics::BandArray;
use crate::acoustics::medium::HIGH_AIR_HZ;
use crate::propagation::{Path, PathId};
use crate::scene::{ListenerPose, Scene, SourceId, SourcePose};

pub use crate::propagation::{
    LATE_DIRECTION_VECTORS, LATE_DIRECTIONS, LATE_GROUPS, LATE_SEGMENTS, LateGroup,
};

/// One path at the end of a graphics frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FramePath {
    /// Identity across frames.
    pub id: PathId,
    /// The source.
    pub source: SourceId,
    /// Number of reflections; 0 for the direct field.
    pub order: u8,
    /// Signed amplitude per band, relative to the free field at 1 m.
    pub amplitude: BandArray,
    /// Propagation delay in seconds.
    pub delay_s: f64,
    /// Unit vector in world coordinates from the listener towards the last image source, edge or source.
    pub arrival: Vec3,
    /// Unit vector in world coordinates from the source along the path; zero if its length is zero.
    pub departure: Vec3,
}

impl FramePath {
    /// A path unchanged from its update, for a source at `from` and a listener at `listener`.
    pub(super) fn of(path: &Path, from: Vec3, listener: &ListenerPose, scene: &Scene) -> Self {
        let first = path.points().first().copied();
        let departure = first.unwrap_or(listener.position) - from;
        Self {
            departure: departure.normalize_or_zero(),
            ..Self::from_image(path.image, path.length_m, path, listener, scene)
        }
    }

    /// A path of an update with its image source moved to `image` and this length in metres, without its departure. The
    /// direction is straight ahead if image and listener coincide.
    #[inline]
    pub(super) fn from_image(
        image: Vec3,
        length_m: f32,
        path: &Path,
        listener: &ListenerPose,
        scene: &Scene,
    ) -> Self {
        let ahead = || listener.orientation * Vec3::NEG_Z;
        Self {
            id: path.id,
            source: path.source,
            order: path.order,
            amplitude: path.amplitude,
            delay_s: f64::from(length_m) / scene.speed_of_sound_m_s(),
            arrival: (image - listener.position)
                .try_normalize()
                .unwrap_or_else(ahead),
            departure: Vec3::ZERO,
        }
    }

    /// Energy over all bands.
    pub(crate) fn energy(&self) -> f32 {
        energy(&self.amplitude)
    }
}

/// Energy over all bands.
pub(crate) fn energy(amplitude: &BandArray) -> f32 {
    amplitude.iter().map(|a| a * a).sum()
}

/// Whether the effects of a source allow a path: the last update may have paths of effects that are now off.
pub(super) fn allows(source: &SourcePose, path: &Path) -> bool {
    let effects = source.settings.effects;
    (path.order == 0 || effects.reflections) && (path.diffraction_order == 0 || effects.diffraction)
}

/// One segment of a source's late energy, sent to the late reverb.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LateSend {
    /// The source.
    pub source: SourceId,
    /// Index of the decay in [`FramePaths::late_groups`].
    pub group: u8,
    /// Energy per second of the diffuse impulse response, extrapolated back to emission, in 1/s; see
    /// `energy_per_s`.
    pub energy_per_s: BandArray,
    /// Time from emission to the segment's start in seconds.
    pub start_s: f32,
}

/// One graphics frame for generation. The default is silence: no paths, no late reverb.
///
/// ```
/// use foresound::paths::FramePaths;
///
/// let silence = FramePaths::default();
/// assert!(silence.paths.is_empty() && silence.late.is_empty());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FramePaths {
    /// Listener orientation: rotates head coordinates (+x right, +y up, −z ahead) to world coordinates.
    pub orientation: Quat,
    /// Paths, sorted by [`FramePath::id`].
    pub paths: Vec<FramePath>,
    /// Late reverb sends, at most [`LATE_SEGMENTS`] per source and group, in the order of the segments.
    pub late: Vec<LateSend>,
    /// The decays that the sends start. A group without sends costs nothing once it is silent.
    pub late_groups: [LateGroup; LATE_GROUPS],
    /// Absorption of air in Np per second of delay at 9, 12, 14 and 16 kHz, which the bands do not cover; 0 for none.
    pub high_air_np_per_s: [f32; HIGH_AIR_HZ.len()],
}

impl Default for FramePaths {
    fn default() -> Self {
        Self {
            orientation: Quat::IDENTITY,
            paths: Vec::new(),
            late: Vec::new(),
            late_groups: Default::default(),
            high_air_np_per_s: Default::default(),
        }
    }
}
