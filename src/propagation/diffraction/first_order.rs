//! The direct field: the straight path and those that bend once, computed together.
//!
//! The same function serves the propagation update and every graphics frame between two, so it casts two rays an edge
//! and no more, allocates nothing, and takes the edges from outside: an update all that are near, a frame those that the
//! last updates found. See [`super`] for how the parts join.

use std::f64::consts::PI;

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::amplitude::{apply_directivity, free_field};
use crate::propagation::diffraction::complex::Complex;
use crate::propagation::diffraction::edge_wave;
use crate::propagation::diffraction::edge_wave::{Course, Wave};
use crate::propagation::diffraction::{WEAKEST, fade_out, smooth};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::sequence::Interaction;
use crate::propagation::path::Path;
use crate::propagation::transmission::{direct_path, direct_path_of};
use crate::scene::Scene;
use crate::scene::edges::EdgeCrossing;

/// Most edges that the direct field of one source is followed at.
pub const MOST_DIRECT_EDGES: usize = 6;

/// Detour in radians at a band's centre up to which direct and bent wave are one, and from which they are two.
const ONE_WAVE: f64 = PI;
const TWO_WAVES: f64 = 2.0 * PI;

/// Edges that matter to the direct field, the shortest way first.
#[derive(Debug, Clone, Copy, Default)]
pub struct DirectEdges {
    edges: [u32; MOST_DIRECT_EDGES],
    count: usize,
}

impl DirectEdges {
    /// The edges' numbers.
    pub fn as_slice(&self) -> &[u32] {
        &self.edges[..self.count]
    }

    fn is_full(&self) -> bool {
        self.count == MOST_DIRECT_EDGES
    }

    fn push(&mut self, edge: u32) {
        self.edges[self.count] = edge;
        self.count += 1;
    }
}

/// What the direct field of one source has shown.
#[derive(Debug, Clone, Copy, Default)]
pub struct DirectField {
    /// Whether source and listener see each other, or nothing of this source is to bend: no need to look for longer
    /// ways then.
    pub visible: bool,
    /// Edges that it bends around: both ends see the bend, and what comes of it is above [`WEAKEST`].
    pub edges: DirectEdges,
}

/// One way over one edge.
struct OneBend {
    edge: u32,
    crossing: EdgeCrossing,
    detour_m: f64,
    /// What the length of its detour leaves of it.
    left: f64,
}

/// The wave along it.
struct OneWave {
    crossing: OneBend,
    incident: Wave,
    reflected: Wave,
}

impl OneBend {
    fn of(scene: &Scene, spot: &Endpoints, edge: u32) -> Option<Self> {
        let (from, to) = (scene.to_local(spot.from), scene.to_local(spot.to));
        let crossing = scene.edge(edge).crossing(from, to)?;
        let detour_m = (crossing.length_m() - from.distance(to)).max(0.0);
        let left = fade_out(detour_m);
        (left > 0.0).then_some(Self {
            edge,
            crossing,
            detour_m,
            left,
        })
    }

    fn is_clear(&self, scene: &Scene, spot: &Endpoints, rays: &mut u64) -> bool {
        let line = &scene.edge(self.edge);
        let stand = edge_wave::stand(line, self.crossing.apex);
        let mut sees =
            |place| edge_wave::sees(scene, scene.to_local(place), stand, line.faces, rays);
        sees(spot.to) && sees(spot.from)
    }

    fn wave(self, scene: &Scene, spot: &Endpoints) -> OneWave {
        let line = &scene.edge(self.edge);
        let beside_transmission = spot.source.settings.effects.transmission;
        let spread = edge_wave::spread(&self.crossing);
        let fades = edge_wave::fading_faces(scene, line, self.crossing.apex);
        let (incident, reflected) = edge_wave::around(
            scene,
            line,
            &self.crossing,
            &spread,
            beside_transmission,
            fades,
        );
        OneWave {
            incident: incident.map(|wave| wave * self.left),
            reflected: reflected.map(|wave| wave * self.left),
            crossing: self,
        }
    }

    /// Share of the incident wave that goes with the direct path in a band, if that is seen.
    fn joined(&self, wavenumber: f64) -> f64 {
        1.0 - smooth((wavenumber * self.detour_m - ONE_WAVE) / (TWO_WAVES - ONE_WAVE))
    }
}

impl OneWave {
    /// Share of the faces' part in a band that goes where the incident wave's goes: all of it where that is near its own
    /// boundary, a half of the direct path, and nothing where only the faces' is near its own, since there it continues a
    /// reflection.
    fn faces_follow(&self, band: usize) -> f64 {
        let near = |wave: Complex| (2.0 * wave.abs()).min(1.0).powi(2);
        let (incident, faces) = (near(self.incident[band]), near(self.reflected[band]));
        incident + (1.0 - incident) * (1.0 - faces)
    }

    fn is_audible(&self, reaches: f64) -> bool {
        (0..BANDS).any(|b| (self.incident[b].abs() + self.reflected[b].abs()) * reaches > WEAKEST)
    }
}

/// Gives the straight path, seen or through walls, and the paths that bend around one of `edges`, which come in the order
/// of the ways' lengths: the first [`MOST_DIRECT_EDGES`] that are seen from both ends and heard count. Adds the rays it
/// cast to `rays`.
///
/// # Real-time
/// Allocates nothing. One ray for the straight path, more behind walls, and up to two for each edge of the list.
pub fn direct_field(
    scene: &Scene,
    spot: &Endpoints,
    edges: impl Iterator<Item = u32>,
    rays: &mut u64,
    give: &mut impl FnMut(Path),
) -> DirectField {
    let effects = spot.source.settings.effects;
    let mut found = DirectField {
        visible: true,
        ..DirectField::default()
    };
    if !effects.diffraction {
        let straight = direct_path_of(scene, &spot.source, spot.to, spot.min_distance_m, rays);
        straight.into_iter().for_each(give);
        return found;
    }
    let id = spot.source.id;
    let mut straight = direct_path(scene, id, spot.from, spot.to, spot.min_distance_m, rays);
    let straight_m = scene.to_local(spot.from).distance(scene.to_local(spot.to));
    let free = free_field(scene, straight_m, spot.min_distance_m);
    // A wall that takes nothing away is none.
    found.visible = straight.is_some_and(|path| path.amplitude == free);
    if !effects.direct || !(found.visible || effects.transmission) {
        straight = None;
    }
    let joins = found.visible && straight.is_some();
    let wavenumbers = edge_wave::wavenumbers(scene);
    let mut gain = [Complex::ONE; BANDS];
    for edge in edges {
        if found.edges.is_full() {
            break;
        }
        let Some(crossing) = OneBend::of(scene, spot, edge) else {
            continue;
        };
        // Two rays cost less than a wave in eight bands.
        if !crossing.is_clear(scene, spot, rays) {
            continue;
        }
        let length_m = crossing.crossing.length_m();
        let reaches = straight_m.max(spot.min_distance_m) / length_m.max(spot.min_distance_m);
        let wave = crossing.wave(scene, spot);
        if !wave.is_audible(reaches) {
            continue;
        }
        found.edges.push(edge);
        let detour_m = wave.crossing.detour_m;
        let bent_free = free_field(scene, length_m, spot.min_distance_m);
        let (mut together, mut apart) = ([Complex::ZERO; BANDS], [Complex::ZERO; BANDS]);
        for (b, &wavenumber) in wavenumbers.iter().enumerate() {
            let joined = if joins {
                wave.crossing.joined(wavenumber)
            } else {
                0.0
            };
            let follows = joined * wave.faces_follow(b);
            together[b] = wave.incident[b] * joined + wave.reflected[b] * follows;
            apart[b] = wave.incident[b] * (1.0 - joined) + wave.reflected[b] * (1.0 - follows);
        }
        let gains: BandArray = apart.map(|wave| edge_wave::signed(wave) as f32);
        let is_heard = |gain: &f32| f64::from(gain.abs()) * reaches > WEAKEST;
        let is_apart = gains.iter().any(is_heard);
        for (b, &wavenumber) in wavenumbers.iter().enumerate() {
            // What is too weak for a path of its own is not lost.
            let wave = if is_apart {
                together[b]
            } else {
                together[b] + apart[b]
            };
            let reach = f64::from(bent_free[b]) / f64::from(free[b]).max(1e-30);
            gain[b] += wave * Complex::turn(-wavenumber * detour_m) * reach;
        }
        if is_apart {
            let course = Course {
                stops: &[Interaction::Edge(edge)],
                points: &[wave.crossing.crossing.apex],
                length_m,
                heard_at: wave.crossing.crossing.apex,
            };
            give(edge_wave::path(scene, spot, &course, &gains));
        }
    }
    if let Some(path) = &mut straight {
        if found.visible {
            for (value, factor) in path.amplitude.iter_mut().zip(gain) {
                // Bright fringes beside a shadow reach +1.4 dB; a source within its nearest distance gets no louder.
                *value = (*value * factor.abs() as f32).min(1.0 / spot.min_distance_m as f32);
            }
        }
        apply_directivity(&mut path.amplitude, &spot.source, spot.to - spot.from);
        give(*path);
    }
    found
}
