//! Diffraction: sound around edges.
//!
//! Runs with the propagation update; its first order ([`direct_field`]) runs with every graphics frame as well. Input: a
//! scene's edges and two positions; output: paths. Bounded: at most
//! [`scene::edges::MAX_DIFFRACTING_EDGES`](crate::scene::edges::MAX_DIFFRACTING_EDGES) edges are examined for each kind of path, with at
//! most [`MAX_DIRECT_EDGES`], [`MAX_TWO_EDGE_PATHS`] and [`MAX_REFLECTED_EDGE_PATHS`] paths. Deterministic: nothing is
//! random. The wave is \[KOUYOUMJIAN74\]'s and \[BIOT57\]'s ([`utd`]).
//!
//! # Continuity of levels
//! Every diffracted path is a [`Path`] with its own delay, direction and signed amplitude. On the lit side of a shadow
//! boundary the diffracted wave reduces the direct one (−½ at the boundary), in the shadow it is the only wave (+½), at
//! the same delay: the sum is continuous, as it is where a reflection ends at an edge. A real amplitude leaves out the
//! phase of the diffracted wave (up to 45° far from the boundary). Where the detour is below half a wavelength, and both
//! waves arrive as one, the diffracted wave is therefore added to the direct path's gain as a complex number and removed
//! from its own path, with a smooth transition in each band. The reflections of the edge's faces are treated alike, except
//! where they continue a reflection, which is a separate path.
//!
//! A transmitting wall casts a partial shadow: the diffracted wave carries the part that the wall removes, 1 − T, and the
//! transmitted direct path counts once.

pub mod biot_tolstoy;
pub mod complex;
mod direct_edges;
mod edge_ends;
pub mod edge_wave;
pub mod first_order;
pub mod lit_reflection;
pub mod moving_edge_pairs;
mod near_list;
mod open_legs;
mod ranked_list;
pub mod reflection_edges;
pub mod revalidate;
pub mod second_order;
pub mod transition;
mod truncation;
mod two_edge_crossings;
pub mod two_edge_path;
pub mod utd;
pub mod wedge_geometry;
pub mod wide_source;
pub mod with_reflections;

pub use crate::propagation::diffraction::direct_edges::{
    DirectEdges, MAX_DIRECT_EDGES, SeenEdges, boundary_sides,
};
pub use crate::propagation::diffraction::first_order::{DirectField, direct_field, no_limits};
pub use crate::propagation::diffraction::lit_reflection::{path_in_shadow, reflection_gain};
pub use crate::propagation::diffraction::reflection_edges::{
    MAX_REFLECTED_EDGE_PATHS, ReflectionEdges,
};
pub use crate::propagation::diffraction::revalidate::{DiffractionPath, DiffractionSequence};
pub use crate::propagation::diffraction::second_order::MAX_TWO_EDGE_PATHS;
pub use crate::propagation::diffraction::wide_source::{
    ExtentPoints, PointImage, WideField, sized_field, wide_field,
};

use crate::acoustics::smoothstep;
use crate::propagation::diffraction::near_list::list_share;
use crate::propagation::diffraction::second_order::MAX_PAIRED_APART;
use crate::propagation::endpoints::Endpoints;
use crate::propagation::path::{EdgeLimits, Path};
use crate::scene::Scene;
use crate::scene::edges::{DiffractingEdges, MAX_DIFFRACTING_EDGES};

/// Longest detour over an edge in metres, times `Scene::length_scale`: 36 wavelengths at 1 kHz, where less than 5 % of the
/// wave is left behind a screen. Paths fade out over the last quarter of it.
pub const MAX_DETOUR_M: f64 = 12.0;

/// Least amplitude of a diffracted path relative to the free field at the straight distance: −40 dB.
pub const MIN_RELATIVE_AMPLITUDE: f64 = 0.01;

/// Edges of a source for the frames until the next update.
#[derive(Debug, Clone, Copy, Default)]
pub struct NearEdges {
    /// Edges of the direct field.
    pub direct: DirectEdges,
    /// Edges near single reflections.
    pub reflections: ReflectionEdges,
    /// Where the lists end.
    pub limits: EdgeLimits,
}

/// What a source's last search found, which shortens the next one and does not change its result.
#[derive(Debug, Clone, Copy, Default)]
pub struct LastSearch {
    /// Edges near the straight line.
    line: DiffractingEdges,
    pairs: second_order::KnownPairs,
    reflected: with_reflections::KnownCandidates,
}

/// Emits the direct and the diffracted paths of a source, with at most `diffraction_order` edges each, as far as the
/// source's effects permit. Not emitted are the paths of [`NearEdges::reflections`], which replace reflections that are
/// not valid. Adds the rays cast to `rays`. `last` is of the previous call and is renewed.
///
/// # Real-time
/// Allocates nothing; bounded by the constants of this module.
pub fn update(
    scene: &Scene,
    endpoints: &Endpoints,
    diffraction_order: usize,
    last: &mut LastSearch,
    rays: &mut u64,
    emit: &mut impl FnMut(Path),
) -> NearEdges {
    let effects = endpoints.source.settings.effects;
    let diffraction_order = match effects.diffraction {
        true => diffraction_order,
        false => 0,
    };
    let (from, to) = edge_wave::local_positions(scene, endpoints);
    let longest_m = from.distance(to) + MAX_DETOUR_M * scene.length_scale();
    last.line = match diffraction_order {
        0 => DiffractingEdges::default(),
        _ => scene.diffracting_edges(&last.line, from, to, longest_m),
    };
    let straight_m = from.distance(to);
    let mut limits = EdgeLimits {
        direct_detour_m: last.line.limit_m(MAX_DIFFRACTING_EDGES) - straight_m,
        ..EdgeLimits::default()
    };
    let edges_with_shares = edges_with_shares(&last.line, straight_m, &limits);
    let mut near = None;
    let two_edge_paths = |field: &DirectField, rays: &mut u64, emit: &mut dyn FnMut(Path)| {
        let has_two_edges = diffraction_order > 1 && field.two_edge_share > 0.0;
        limits.left_out_energy = field.left_out_energy;
        if diffraction_order == 0 || field.visible && !has_two_edges {
            return limits;
        }
        let near = near.insert(scene.outer_crossings(from, to, longest_m));
        let detours_m =
            [MAX_DIFFRACTING_EDGES, MAX_PAIRED_APART].map(|most| near.limit_m(most) - straight_m);
        // Pairs between rigid bodies have other lists.
        limits.near_detours_m = (!scene.has_instances()).then_some(detours_m);
        if has_two_edges {
            second_order::find(
                scene,
                endpoints,
                (near, &field.edges, &mut limits),
                &mut last.pairs,
                field.least_energy,
                rays,
                &mut |mut path| {
                    path.amplitude = path.amplitude.map(|value| value * field.two_edge_share);
                    emit(path);
                },
            );
        }
        limits
    };
    let DirectField { visible, edges, .. } = sized_field(
        scene,
        endpoints,
        edges_with_shares,
        two_edge_paths,
        rays,
        emit,
    );
    let mut result = NearEdges {
        direct: edges,
        limits,
        ..NearEdges::default()
    };
    if diffraction_order == 0 || !effects.reflections {
        return result;
    }
    let known = &mut last.reflected;
    if visible {
        let edges = edges.as_slice().iter().copied();
        result.reflections =
            with_reflections::find(scene, endpoints, edges, None, known, rays, emit);
    } else if let Some(near) = near {
        let edges = near.as_slice().iter().map(|found| found.edge);
        let limits = Some(&result.limits);
        result.reflections =
            with_reflections::find(scene, endpoints, edges, limits, known, rays, emit);
    }
    result
}

/// The edges of a list of those near the straight line, and the share of the wave over each in the direct field.
pub fn edges_with_shares<'a>(
    near: &'a DiffractingEdges,
    straight_m: f64,
    limits: &EdgeLimits,
) -> impl Iterator<Item = (u32, f64)> + Clone + use<'a> {
    let longest_m = limits.direct_detour_m;
    let found = near.as_slice().iter();
    found.map(move |found| {
        (
            found.edge,
            list_share(found.length_m - straight_m, longest_m),
        )
    })
}

/// Amplitude factor of a detour: 1 up to ¾ of [`MAX_DETOUR_M`], then smoothly down to 0.
fn fade_out(scene: &Scene, detour_m: f64) -> f64 {
    let most_m = MAX_DETOUR_M * scene.length_scale();
    smoothstep(4.0 * (1.0 - detour_m / most_m))
}
