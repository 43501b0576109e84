//! Output of propagation: valid paths with eight-band amplitudes, and the energy of the late reverb.

use glam::Vec3;

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::late_group::{LATE_GROUPS, LateGroup};
use crate::propagation::update_scope::UpdateScope;
use crate::scene::{InstancePose, ListenerPose, Scene, SourceId, SourcePose};

/// Highest reflection order of a path (the paper's depth).
pub const MAX_ORDER: usize = 4;

/// Most edges that one path is diffracted at.
pub const MAX_DIFFRACTION_ORDER: usize = 2;

/// Identity of a path across updates: a 64-bit hash of its source and its interactions in canonical order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct PathId(pub u64);

/// One valid path from a source to the listener, in world coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// Identity across updates.
    pub id: PathId,
    /// The source it starts at.
    pub source: SourceId,
    /// Number of reflections, 0 to [`MAX_ORDER`].
    pub order: u8,
    /// Number of diffractions, 0 to [`MAX_DIFFRACTION_ORDER`]; together with `order` at most [`MAX_ORDER`].
    pub diffraction_order: u8,
    /// Indices of the reflecting surfaces from source to listener; the first `order` count.
    pub surfaces: [u32; MAX_ORDER],
    /// Indices of the edges in [`crate::scene::Scene::edges`] from source to listener; the first `diffraction_order` count.
    pub edges: [u32; MAX_DIFFRACTION_ORDER],
    /// Reflection and diffraction points in metres from source to listener; the first `order` + `diffraction_order` count.
    pub points: [Vec3; MAX_ORDER],
    /// Position of the image source in metres, in the direction of arrival. For a diffracted path: the point at
    /// the path's length in the direction of its last edge, or of that edge's image in the surfaces after it.
    pub image: Vec3,
    /// Length in metres.
    pub length_m: f32,
    /// Signed pressure factor of each band, relative to the free field at 1 m.
    pub amplitude: BandArray,
}

impl Path {
    /// Whether this is the direct path: no reflection, no edge, perhaps through walls.
    pub fn is_direct(&self) -> bool {
        self.order == 0 && self.diffraction_order == 0
    }

    /// Whether this path is recomputed in every graphics frame instead of extrapolated: the direct path, and those with
    /// one diffraction and no reflection (`direct_field`).
    pub fn is_frame_validated(&self) -> bool {
        self.order == 0 && self.diffraction_order <= 1
    }

    /// Whether this is a reflection at planes alone.
    pub(crate) fn is_of_planes(&self, scene: &Scene) -> bool {
        // Facets of curved surfaces are no panels.
        let is_panel = |surface: &u32| scene.surface(*surface).panel_triangle_count > 0;
        self.order > 0 && self.diffraction_order == 0 && self.surfaces().iter().all(is_panel)
    }

    /// The same path with its amplitude multiplied by a factor.
    pub(crate) fn scaled(self, factor: f32) -> Self {
        Self {
            amplitude: self.amplitude.map(|value| value * factor),
            ..self
        }
    }

    /// The indices of its edges from source to listener.
    pub fn edges(&self) -> &[u32] {
        &self.edges[..usize::from(self.diffraction_order).min(MAX_DIFFRACTION_ORDER)]
    }

    /// The indices of its reflecting surfaces from source to listener.
    pub fn surfaces(&self) -> &[u32] {
        &self.surfaces[..usize::from(self.order).min(MAX_ORDER)]
    }

    /// The reflection and diffraction points from source to listener.
    pub fn points(&self) -> &[Vec3] {
        &self.points
            [..(usize::from(self.order) + usize::from(self.diffraction_order)).min(MAX_ORDER)]
    }
}

/// An edge near a single reflection: its wave continues the reflection where the edge occludes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReflectionEdge {
    /// Index of the edge.
    pub edge: u32,
    /// Indices of the surfaces before and after it; one of them is none.
    pub surfaces: [Option<u32>; 2],
}

impl ReflectionEdge {
    /// The reflecting surface.
    pub fn surface(&self) -> Option<u32> {
        self.surfaces[0].or(self.surfaces[1])
    }

    /// Whether a surface is the reflecting one, or goes on in it beyond the fixed part.
    pub(crate) fn is_beside(&self, scene: &Scene, surface: u32) -> bool {
        let named = |surface| scene.naming_surface(surface);
        self.surface().map(named) == Some(named(surface))
    }
}

/// Where a source's lists of edges and of paths over them end. Frames have the same limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeLimits {
    /// Energy relative to the free field towards which paths over two edges fade: that of the loudest one left out of the list,
    /// summed over the bands; 0 if none is left out.
    pub two_edge_floor: f64,
    /// Detour in metres at which the list of the shortest paths over two neighbouring edges ends, infinite for a list with room;
    /// `None` if there was no search for them, and in a scene with instances.
    pub two_edge_detour_m: Option<f64>,
    /// Energy relative to the free field of the loudest wave over one edge that is left out of the direct field; 0 if none is.
    pub left_out_energy: f64,
    /// Longest detour in metres over an edge of the direct field; infinite for a list with room.
    pub direct_detour_m: f64,
    /// The same of edges of other paths, and of those that are paired with each other however far apart; `None` if there was no
    /// search for them, and in a scene with instances.
    pub near_detours_m: Option<[f64; 2]>,
}

impl Default for EdgeLimits {
    /// No limits.
    fn default() -> Self {
        Self {
            two_edge_floor: 0.0,
            two_edge_detour_m: None,
            left_out_energy: 0.0,
            direct_detour_m: f64::INFINITY,
            near_detours_m: None,
        }
    }
}

/// Time segments of the late-energy envelope.
pub const LATE_SEGMENTS: usize = 5;

/// Late energy of one source: all energy outside of discrete paths, as decays of [`PathSet::late_groups`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LateEnergy {
    /// The source.
    pub source: SourceId,
    /// Energy of the diffuse impulse response in the decay of each group that starts with each time segment, per band,
    /// relative to the free field at 1 m. Segments start at `LATE_SEGMENT_STARTS`, the last one in the first two groups alone;
    /// decays have no end.
    pub energy: [[BandArray; LATE_SEGMENTS]; LATE_GROUPS],
    /// Delay of the straight line in seconds: the earliest arrival.
    pub start_s: f32,
    /// Mean time between two bounces in seconds, the unit of the starts.
    pub mean_free_time_s: f32,
}

impl LateEnergy {
    /// No late energy.
    pub fn silent(source: SourceId) -> Self {
        Self {
            source,
            energy: [[[0.0; BANDS]; LATE_SEGMENTS]; LATE_GROUPS],
            start_s: 0.0,
            mean_free_time_s: 0.0,
        }
    }

    /// Energy of all decays per band.
    pub fn total(&self) -> BandArray {
        let mut total = [0.0; BANDS];
        for energy in self.energy.as_flattened() {
            for b in 0..BANDS {
                total[b] += energy[b];
            }
        }
        total
    }
}

/// The result of one propagation update. [`Default`] is an empty set; updates reuse its memory.
///
/// ```
/// use foresound::paths::{Path, PathSet};
///
/// /// The strongest path at 1 kHz, and its delay in seconds at 343.4 m/s.
/// fn strongest(set: &PathSet) -> Option<(&Path, f32)> {
///     let level = |path: &&Path| path.amplitude[4].abs();
///     let path = set.paths.iter().max_by(|a, b| level(a).total_cmp(&level(b)))?;
///     Some((path, path.length_m / 343.4))
/// }
/// assert!(strongest(&PathSet::default()).is_none());
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PathSet {
    /// Number of the update, from 0.
    pub update: u64,
    /// Time of the poses in seconds on the caller's clock.
    pub time_s: f64,
    /// The listener.
    pub listener: ListenerPose,
    /// The sources, in the caller's order.
    pub sources: Vec<SourcePose>,
    /// What was searched for: a path outside of it is not in the set, or as of the update before.
    #[doc(hidden)]
    pub scope: UpdateScope,
    /// The poses of the scene's instances, by slot.
    pub instances: Vec<InstancePose>,
    /// Valid paths, sorted by [`Path::id`].
    pub paths: Vec<Path>,
    /// Reflected paths that are invalid but may become valid for a listener nearby, with amplitudes as if nothing blocked them
    /// and surfaces had no ends; sorted by [`Path::id`], none of [`Self::paths`]. Empty unless enabled by
    /// [`super::Propagator::set_nearby_radius`].
    pub nearby: Vec<Path>,
    /// Edges at which each source's direct field is computed in every graphics frame, in the order of [`Self::sources`],
    /// nearest first.
    pub direct_edges: Vec<(SourceId, u32)>,
    /// Edges near each source's single reflections, whose waves are part of them, in the order of [`Self::sources`].
    pub reflection_edges: Vec<(SourceId, ReflectionEdge)>,
    /// Where each source's lists of edges and of paths over them end, in the order of [`Self::sources`].
    pub edge_limits: Vec<(SourceId, EdgeLimits)>,
    /// Late energy of each source, in the order of [`Self::sources`].
    pub late: Vec<LateEnergy>,
    /// Decay times of the late energy, which depend on the scene only, and the directions from which that of all sources together arrives.
    pub late_groups: [LateGroup; LATE_GROUPS],
    /// Predicted positions of the listener, as given to [`super::Propagator::set_predicted_positions`]; empty if a source's
    /// late energy was not due.
    pub predicted_positions: Vec<Vec3>,
    /// Late energy at the predicted positions: for each of them the entries of [`Self::late`].
    pub predicted_late: Vec<LateEnergy>,
    /// [`Self::late_groups`] at the predicted positions.
    pub predicted_groups: Vec<[LateGroup; LATE_GROUPS]>,
    /// Positions of the sources for each entry of [`Self::predicted_late`].
    pub predicted_sources: Vec<Vec3>,
    /// Number of rays cast. It does not depend on the number of threads. It may differ between instruction sets, which may
    /// find another one of several occluders first.
    pub rays: u64,
}

impl PathSet {
    /// Whether a path was searched for: if it were valid it would most likely be in the set.
    pub(crate) fn was_searched(&self, scene: &Scene, path: &Path) -> bool {
        let scope = &self.scope;
        scope.has_source(path.source)
            && (scope.has_order(path.order) || path.diffraction_order > 0)
            && (!scope.only_planes || path.is_of_planes(scene))
    }
}
