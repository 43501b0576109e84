//! The paths of one graphics frame: the output of extrapolation and the input of generation.

use glam::{Quat, Vec3};

use crate::acoustics::BandArray;
use crate::acoustics::medium::HIGH_AIR_HZ;
use crate::propagation::{Path, PathId};
use crate::scene::{ListenerPose, MAX_EXTENT_POINTS, Scene, SourceId, SourcePose};

pub use crate::propagation::{
    LATE_DIRECTION_VECTORS, LATE_DIRECTIONS, LATE_GROUPS, LATE_SEGMENTS, LateGroup,
};

/// What a path does between source and listener.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PathKind {
    /// The straight line, unobstructed.
    #[default]
    Direct,
    /// The straight line, through walls.
    Transmitted,
    /// Reflected, without diffraction.
    Reflected,
    /// Diffracted at one or two edges, perhaps also reflected.
    Diffracted,
}

impl PathKind {
    fn of(path: &Path) -> Self {
        match (path.order, path.diffraction_order) {
            (0, 0) => Self::Direct,
            (_, 0) => Self::Reflected,
            _ => Self::Diffracted,
        }
    }

    /// Whether the path is the straight line.
    pub fn is_straight(self) -> bool {
        matches!(self, Self::Direct | Self::Transmitted)
    }
}

/// One path at the end of a graphics frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FramePath {
    /// Identity across frames.
    pub id: PathId,
    /// The source.
    pub source: SourceId,
    /// What it does on its way.
    pub kind: PathKind,
    /// Number of reflections; 0 for the direct field.
    pub order: u8,
    /// Signed amplitude per band, relative to the free field at 1 m.
    pub amplitude: BandArray,
    /// Propagation delay in seconds.
    pub delay_s: f64,
    /// Time in air, in seconds, by which [`FramePaths::high_air_np_per_s`] counts: the delay, unless the source's mix changes
    /// one of the two.
    pub air_delay_s: f64,
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
        let delay_s = f64::from(length_m) / scene.speed_of_sound_m_s();
        Self {
            id: path.id,
            source: path.source,
            kind: PathKind::of(path),
            order: path.order,
            amplitude: path.amplitude,
            delay_s,
            air_delay_s: delay_s,
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
pub(super) fn allows(source: &SourcePose, order: u8, is_diffracted: bool) -> bool {
    let effects = source.settings.effects;
    (order == 0 || effects.reflections) && (!is_diffracted || effects.diffraction)
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

/// What is between a source and the listener in a graphics frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstruction {
    /// The source.
    pub source: SourceId,
    /// Whether anything blocks the straight line; of a wide source, the lines to all of its points.
    pub is_blocked: bool,
    /// How much of the straight line is blocked, 0 to 1, times the strength of the source's occlusion: of a point 0 or 1, of a
    /// wide source the share of its points.
    pub occlusion: f32,
    /// Pressure factor of all walls on the straight line per band, before the source's mix: 1 where nothing blocks it, 0
    /// where walls are opaque or the source's transmission is off. Of a wide source the mean over its hidden points.
    pub transmission: BandArray,
}

/// The directions of a path from a wide source. Its own direction is their mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WideArrival {
    /// The path.
    pub id: PathId,
    /// Unit vectors in world coordinates from the listener; the first `count` matter.
    pub directions: [Vec3; MAX_EXTENT_POINTS],
    /// Share of the path's energy from each direction; their sum is 1.
    pub shares: [f32; MAX_EXTENT_POINTS],
    /// Number of directions.
    pub count: usize,
}

impl WideArrival {
    /// From points in world coordinates with their energies; `None` without energy.
    pub(super) fn of(
        id: PathId,
        points: impl Iterator<Item = (Vec3, f32)>,
        listener: Vec3,
    ) -> Option<Self> {
        let mut arrival = Self {
            id,
            directions: [Vec3::NEG_Z; MAX_EXTENT_POINTS],
            shares: [0.0; MAX_EXTENT_POINTS],
            count: 0,
        };
        let mut total = 0.0;
        for (point, energy) in points.filter(|(_, energy)| *energy > 0.0) {
            let Some(direction) = (point - listener).try_normalize() else {
                continue;
            };
            arrival.directions[arrival.count] = direction;
            arrival.shares[arrival.count] = energy;
            arrival.count += 1;
            total += energy;
        }
        arrival.shares.iter_mut().for_each(|share| *share /= total);
        (total > 0.0 && total.is_finite()).then_some(arrival)
    }

    /// Directions and shares.
    pub fn iter(&self) -> impl Iterator<Item = (Vec3, f32)> {
        let shares = self.shares.iter().copied();
        self.directions.iter().copied().zip(shares).take(self.count)
    }
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
    /// Directions of the paths that come from a wide source, sorted by identity: of the straight one, and of the nearest
    /// reflections.
    pub wide: Vec<WideArrival>,
    /// What blocks each source, in the order of the sources.
    pub obstructions: Vec<Obstruction>,
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
            wide: Vec::new(),
            obstructions: Vec::new(),
            late: Vec::new(),
            late_groups: Default::default(),
            high_air_np_per_s: Default::default(),
        }
    }
}
