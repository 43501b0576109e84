//! Diffraction: sound that bends around edges.
//!
//! Runs with the propagation update, and its first order ([`direct_field`]) with every graphics frame. Takes a scene's
//! edges and two places, gives paths. Bounded: at most [`scene::edges::MAX_DIFFRACTING_EDGES`](crate::scene::edges::MAX_DIFFRACTING_EDGES) edges
//! are looked at for each kind of path, and at most [`MOST_DIRECT_EDGES`], [`MOST_DOUBLE`] and [`MOST_MIRRORED`] paths
//! come of them. Nothing here is random: a path set at rest does not change.
//!
//! # How level stays continuous
//! Every bent path is a [`Path`] of its own: delay and arrival are those of the bend, and its amplitude is
//! signed, because on the lit side of a shadow boundary the bent wave takes away from the direct one (−½ at the
//! boundary) what it is itself on the dark side (+½), at the same delay. So the sum is continuous whichever wall throws
//! the shadow, and a reflection that ends at an edge is handed over in the same way. A real amplitude cannot say the
//! phase that the bent wave has besides (up to 45° far from the boundary); where the detour is below half a wavelength
//! and both arrive as one, the bent wave is therefore added to the direct path's gain, as complex numbers, and taken off
//! the bent path. The two shares change over gradually, band by band. What an edge's faces reflect goes along, but where it
//! continues a reflection: that is a path of its own, beside which the bent one has to stay.
//!
//! A wall that lets sound through throws half a shadow: the bent wave is what the wall takes away, 1 − T of it, so the
//! transmitted direct path, which is a path of its own, counts once.

pub mod biot_tolstoy;
pub mod complex;
pub mod edge_wave;
pub mod first_order;
pub mod moving_edge_pairs;
pub mod revalidate;
pub mod second_order;
pub mod transition;
pub mod utd;
pub mod with_reflections;

pub use crate::propagation::diffraction::first_order::{
    DirectEdges, DirectField, MOST_DIRECT_EDGES, direct_field,
};
pub use crate::propagation::diffraction::revalidate::{DiffractionPath, DiffractionSequence};
pub use crate::propagation::diffraction::second_order::MOST_DOUBLE;
pub use crate::propagation::diffraction::with_reflections::MOST_MIRRORED;

use std::f64::consts::PI;

use super::path::Path;
use crate::propagation::diffraction::utd::WedgeAngles;
use crate::propagation::endpoints::Endpoints;
use crate::scene::Scene;
use crate::scene::edges::{DiffractingEdges, EdgeCrossing};

/// Longest detour over an edge in metres: 36 wavelengths at 1 kHz, where less than 5 % of the wave is left behind a
/// screen. Paths fade out over the last quarter of it.
pub const LONGEST_DETOUR_M: f64 = 12.0;

/// Weakest bent path worth keeping, relative to the free field at the straight distance: −40 dB.
pub const WEAKEST: f64 = 0.01;

/// The band of [`rough_gain`].
const ROUGH_BAND: usize = 2;

/// Gives all that reaches a listener directly or around edges, with up to `diffraction_order` edges a path; returns the edges that
/// the direct field is to be followed at between updates. Adds the rays it cast to `rays`. What the source's effects
/// switch off is left out. `near` are the edges that were near when it was last asked, and are now: with them the search is
/// shorter, and no answer another one.
pub fn update(
    scene: &Scene,
    spot: &Endpoints,
    diffraction_order: usize,
    near: &mut DiffractingEdges,
    rays: &mut u64,
    give: &mut impl FnMut(Path),
) -> DirectEdges {
    let effects = spot.source.settings.effects;
    let diffraction_order = if effects.diffraction {
        diffraction_order
    } else {
        0
    };
    let (from, to) = (scene.to_local(spot.from), scene.to_local(spot.to));
    *near = match diffraction_order {
        0 => DiffractingEdges::default(),
        _ => {
            let longest_m = from.distance(to) + LONGEST_DETOUR_M;
            scene.diffracting_edges(near, from, to, longest_m)
        }
    };
    let listed = near.as_slice().iter().map(|found| found.edge);
    let DirectField { visible, edges } = direct_field(scene, spot, listed, rays, give);
    if visible || diffraction_order == 0 {
        return edges;
    }
    let longest_m = from.distance(to) + LONGEST_DETOUR_M;
    let near = scene.first_crossings(from, to, longest_m);
    if effects.reflections {
        with_reflections::find(scene, spot, &near, rays, give);
    }
    if diffraction_order > 1 {
        second_order::find(scene, spot, &near, rays, give);
    }
    edges
}

/// 1 up to a quarter before [`LONGEST_DETOUR_M`], then smoothly down to 0.
fn fade_out(detour_m: f64) -> f64 {
    smooth(4.0 * (1.0 - detour_m / LONGEST_DETOUR_M))
}

/// About how loud a bend is at the band around 250 Hz relative to the free field over its length: for an order of
/// loudness.
fn rough_gain(scene: &Scene, edge: u32, crossing: &EdgeCrossing) -> f64 {
    let angles = WedgeAngles {
        n: scene.edge(edge).n,
        incoming: crossing.incoming,
        outgoing: crossing.outgoing,
    };
    let wavenumber = edge_wave::wavenumbers(scene)[ROUGH_BAND];
    // The transition function's size, 1 at the boundary and 1/√(πx) far from it.
    0.5 / (1.0 + PI * angles.crossing(wavenumber, edge_wave::distance_m(crossing))).sqrt()
}

/// 0 below 0, 1 above 1, and a cubic between.
pub(super) fn smooth(share: f64) -> f64 {
    let t = share.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
