//! What propagation gives: valid paths with eight-band amplitudes, and what the late reverb needs.

use glam::Vec3;

use crate::acoustics::{BANDS, BandArray};
use crate::scene::{InstancePose, ListenerPose, SourceId, SourcePose};

/// Highest reflection order of a discrete path (the paper's depth).
pub const MAX_ORDER: usize = 4;

/// Most edges that one path bends around.
pub const MAX_DIFFRACTION_ORDER: usize = 2;

/// Identity of a path across updates: source and canonical surface sequence, folded into 64 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct PathId(pub u64);

/// One valid path from a source to the listener.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// Identity across updates.
    pub id: PathId,
    /// The source it starts at.
    pub source: SourceId,
    /// Number of reflections; 0 is the direct path, or one that bends around edges only.
    pub order: u8,
    /// Number of edges that it bends around, 0 to [`MAX_DIFFRACTION_ORDER`]; together with `order` at most [`MAX_ORDER`].
    pub diffraction_order: u8,
    /// Indices of the reflecting surfaces from source to listener; the first `order` count.
    pub surfaces: [u32; MAX_ORDER],
    /// Numbers of the edges in [`crate::scene::Scene::edges`] from source to listener; the first `diffraction_order` count.
    pub edges: [u32; MAX_DIFFRACTION_ORDER],
    /// Reflection points and bends in metres, from source to listener; the first `order` + `diffraction_order` count.
    pub points: [Vec3; MAX_ORDER],
    /// Position of the image source in metres: the listener hears the path from there. Of a bent path: as far off as
    /// the path is long, in the direction of its last bend or what reflects it after that.
    pub image: Vec3,
    /// Length in metres.
    pub length_m: f32,
    /// Signed pressure ratio a band, relative to the free field at 1 m.
    pub amplitude: BandArray,
}

impl Path {
    /// Whether this is the direct path.
    pub fn is_direct(&self) -> bool {
        self.order == 0 && self.diffraction_order == 0
    }

    /// Whether this path is computed anew in every graphics frame instead of being continued from its last update: the
    /// direct path and those that bend once on their way and do nothing else
    /// ([`crate::propagation::diffraction::direct_field`]).
    pub fn is_frame_validated(&self) -> bool {
        self.order == 0 && self.diffraction_order <= 1
    }

    /// The edges it bends around, from source to listener.
    pub fn edges(&self) -> &[u32] {
        &self.edges[..usize::from(self.diffraction_order).min(MAX_DIFFRACTION_ORDER)]
    }

    /// The reflecting surfaces from source to listener.
    pub fn surfaces(&self) -> &[u32] {
        &self.surfaces[..usize::from(self.order).min(MAX_ORDER)]
    }

    /// The reflection points and bends from source to listener.
    pub fn points(&self) -> &[Vec3] {
        &self.points
            [..(usize::from(self.order) + usize::from(self.diffraction_order)).min(MAX_ORDER)]
    }
}

/// Steps in time that a tail's energy is told in.
pub const LATE_SEGMENTS: usize = 4;

/// What the late reverb needs of one source: the energy that no discrete path carries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LateEnergy {
    /// The source.
    pub source: SourceId,
    /// Energy of the diffuse impulse response in each step of time, relative to the free field at 1 m, one a band. Steps
    /// start at [`crate::propagation::diffuse::envelope::LATE_SEGMENT_STARTS`]; the last one has no end.
    pub energy: [BandArray; LATE_SEGMENTS],
    /// Reverberation time T60 in seconds around this source, one a band.
    pub decay_time_s: BandArray,
    /// Seconds from emission before which nothing can arrive: the straight line's.
    pub start_s: f32,
    /// Mean seconds between two bounces.
    pub mean_free_time_s: f32,
}

impl LateEnergy {
    /// A source without a late field.
    pub fn silent(source: SourceId) -> Self {
        Self {
            source,
            energy: [[0.0; BANDS]; LATE_SEGMENTS],
            decay_time_s: [0.0; BANDS],
            start_s: 0.0,
            mean_free_time_s: 0.0,
        }
    }
}

/// The result of one propagation update.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PathSet {
    /// Number of the update, from 0.
    pub update: u64,
    /// Time the poses belong to, in seconds on the caller's clock.
    pub time_s: f64,
    /// The listener it was computed for.
    pub listener: ListenerPose,
    /// The sources it was computed for, by slot.
    pub sources: Vec<SourcePose>,
    /// The poses of the scene's instances that it was computed for, by slot.
    pub instances: Vec<InstancePose>,
    /// Valid paths, sorted by [`Path::id`].
    pub paths: Vec<Path>,
    /// Reflected paths that are not there but may be for a listener nearby, as if nothing stood in their way and no
    /// surface had an end; sorted by [`Path::id`], none of [`Self::paths`]. Empty unless asked for
    /// ([`super::Propagator::set_nearby_radius`]).
    pub nearby: Vec<Path>,
    /// Edges near which each source's direct field is to be looked at in every graphics frame, in the order of
    /// [`Self::sources`], nearest first.
    pub direct_edges: Vec<(SourceId, u32)>,
    /// Late reverb, one entry a source, in the order of [`Self::sources`].
    pub late: Vec<LateEnergy>,
    /// Other places where the listener may be while this is used, if somebody asked for them
    /// ([`super::Propagator::set_predicted_positions`]).
    pub way: Vec<Vec3>,
    /// Late reverb there: for each place the entries of [`Self::late`].
    pub predicted_late: Vec<LateEnergy>,
    /// Where the sources are taken to be then, one place an entry of [`Self::predicted_late`].
    pub predicted_sources: Vec<Vec3>,
    /// Rays cast for it. The same for any number of threads; instruction sets may differ in it, since what blocked a
    /// candidate last is whatever their tree came upon first.
    pub rays: u64,
}
