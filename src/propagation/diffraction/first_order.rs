//! The direct field: the straight path and the paths over one edge, computed together.
//!
//! Shared by the propagation update and every graphics frame: casts two rays per edge at most and allocates nothing. The
//! caller passes the edges: all near ones in an update, those of the last update in a frame. See [`super`] for the
//! continuity of the parts.

use std::f64::consts::PI;

use crate::acoustics::{BANDS, BandArray, smoothstep};
use crate::propagation::amplitude::{apply_directivity, free_field};
use crate::propagation::diffraction::complex::{Complex, ComplexBands};
use crate::propagation::diffraction::direct_edges::{DirectEdges, MAX_DIRECT_EDGES, SeenEdges};
use crate::propagation::diffraction::edge_wave::{self, EdgePath, is_unoccluded, local_positions};
use crate::propagation::diffraction::near_list::continued_share;
use crate::propagation::diffraction::open_legs::open_share;
use crate::propagation::diffraction::ranked_list::{rank_weight, rank_weight_in_light};
use crate::propagation::diffraction::two_edge_path::{self, TwoEdgePath};
use crate::propagation::diffraction::wedge_geometry::on_side;
use crate::propagation::diffraction::{MIN_RELATIVE_AMPLITUDE, fade_out};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::sequence::Interaction;
use crate::propagation::path::{EdgeLimits, Path};
use crate::propagation::transmission::{direct_path, direct_path_of};
use crate::scene::Scene;
use crate::scene::edges::EdgeCrossing;

/// Phase of the detour in radians up to which the diffracted wave is part of the direct path, and from which it is a
/// separate path.
const MERGED_PHASE: f64 = PI;
const SEPARATE_PHASE: f64 = 2.0 * PI;

/// Detour over the nearest edge in metres, times `Scene::length_scale`, from which a visible direct path masks paths over two
/// edges: 0.4 to 0.8 m beside a shadow boundary that is 20 m from the source.
const MASKED_DETOUR_M: f64 = 5e-3;

/// Detour over the nearest edge in metres, times `Scene::length_scale`, up to which waves over other edges are part of that path
/// in the shadow, as they are part of the direct path in the light. Also the detour over another edge up to which a leg of a wave is
/// nearly hidden by it ([`open_share`]): 1 to 10 cm beside the leg.
const JOINED_DETOUR_M: f64 = 5e-4;

/// Energy of a wave relative to the straight path's up to which it ends whole where another edge hides it: −30 dB.
const LEAST_FADED: f64 = 1e-3;

/// For [`direct_field`]: paths over two edges continue all waves over one.
pub fn no_limits(_: &DirectField, _: &mut u64, _: &mut dyn FnMut(Path)) -> EdgeLimits {
    EdgeLimits::default()
}

/// Result of [`direct_field`].
#[derive(Debug, Clone, Copy)]
pub struct DirectField {
    /// Whether source and listener are mutually visible or the source's diffraction is off: other diffracted paths are
    /// then not searched.
    pub visible: bool,
    /// Edges visible from both ends with a wave above [`MIN_RELATIVE_AMPLITUDE`].
    pub edges: DirectEdges,
    /// The edges of the list that are visible from both ends.
    pub seen: SeenEdges,
    /// Edge waves that were computed: most of the cost.
    pub waves: usize,
    /// Pressure factor of what is on the straight line per band: 1 where nothing is, 0 where it is opaque or the source's
    /// transmission is off.
    pub through: BandArray,
    /// Amplitude factor of paths over two edges: 1 in the shadow and at its boundary, and beside it falling to 0, where the
    /// direct path masks them.
    pub two_edge_share: f32,
    /// Energy towards which waves over the edges of a full list fade, relative to the straight path's: that of the quietest one,
    /// and less, down to [`Self::left_out_energy`], where another edge begins to hide one of them in the shadow; 0 if there is
    /// room.
    pub least_energy: f64,
    /// Energy of the loudest wave for which the list has no room, relative to the straight path's; 0 if there is room.
    pub left_out_energy: f64,
}

impl Default for DirectField {
    /// Nothing between source and listener.
    fn default() -> Self {
        Self {
            visible: true,
            edges: DirectEdges::default(),
            seen: SeenEdges::NONE,
            waves: 0,
            through: [1.0; BANDS],
            two_edge_share: 0.0,
            least_energy: 0.0,
            left_out_energy: 0.0,
        }
    }
}

/// Amplitude of a straight path relative to the free field, 0 without a path.
fn through(straight: Option<&Path>, free: &BandArray) -> BandArray {
    straight.map_or([0.0; BANDS], |path| {
        std::array::from_fn(|b| (path.amplitude[b] / free[b].max(f32::MIN_POSITIVE)).min(1.0))
    })
}

/// A path over one edge.
struct FirstOrderPath {
    edge: u32,
    crossing: EdgeCrossing,
    detour_m: f64,
    fade: f64,
}

/// The field along it.
struct FirstOrderField {
    path: FirstOrderPath,
    incident: ComplexBands,
    reflected: ComplexBands,
}

impl FirstOrderPath {
    fn over(scene: &Scene, endpoints: &Endpoints, (edge, share): (u32, f64)) -> Option<Self> {
        let (from, to) = local_positions(scene, endpoints);
        let crossing = scene.edge(edge).crossing(from, to)?;
        let detour_m = (crossing.length_m() - from.distance(to)).max(0.0);
        let fade = fade_out(scene, detour_m) * share;
        (fade > 0.0).then_some(Self {
            edge,
            crossing,
            detour_m,
            fade,
        })
    }

    fn is_unoccluded(&self, scene: &Scene, endpoints: &Endpoints, rays: &mut u64) -> bool {
        let edge = scene.edge(self.edge);
        let sight_point = edge_wave::sight_point(&edge, self.crossing.apex, edge.outward());
        let (from, to) = local_positions(scene, endpoints);
        let mut sees = |end| is_unoccluded(scene, end, sight_point, edge.faces, rays);
        sees(to) && sees(from)
    }

    /// [`open_share`] among the edges of a list that come before this one: over another one that touches a leg of this path the path
    /// is at most as long.
    fn open_share(
        &self,
        scene: &Scene,
        endpoints: &Endpoints,
        listed: &[u32],
        hidden_m: f64,
    ) -> f64 {
        let index = listed.iter().position(|listed| *listed == self.edge);
        let nearer = &listed[..index.unwrap_or(0)];
        let over = (self.edge, self.crossing.apex);
        let ends = local_positions(scene, endpoints).into();
        open_share(scene, over, ends, nearer, hidden_m)
    }

    fn field(self, scene: &Scene, endpoints: &Endpoints, is_lit: bool) -> FirstOrderField {
        let edge = &scene.edge(self.edge);
        let (incident, reflected) = edge_wave::diffracted_field(
            scene,
            edge,
            &on_side(edge, &self.crossing, is_lit),
            &edge_wave::spread(&self.crossing),
            endpoints.source.settings.effects.transmission,
            edge_wave::finite_panel_faces(scene, edge, self.crossing.apex),
        );
        FirstOrderField {
            incident: incident.map(|wave| wave * self.fade),
            reflected: reflected.map(|wave| wave * self.fade),
            path: self,
        }
    }
}

/// Share of the incident part that is added to a visible straight path, by the phase of the detour in radians.
pub(super) fn merged_share(phase: f64) -> f64 {
    1.0 - smoothstep((phase - MERGED_PHASE) / (SEPARATE_PHASE - MERGED_PHASE))
}

/// Share of the faces' part that accompanies the incident part: 1 where the incident part is near its own boundary, 0 where
/// only the faces' is, since it continues a reflection there.
pub(super) fn face_share(incident: Complex, reflected: Complex) -> f64 {
    let nearness = |wave: Complex| (2.0 * wave.abs()).min(1.0).powi(2);
    let incident = nearness(incident);
    incident + (1.0 - incident) * (1.0 - nearness(reflected))
}

/// The loudest fields in the order in which they come.
struct Loudest {
    fields: [Option<FirstOrderField>; MAX_DIRECT_EDGES],
    energies: [f64; MAX_DIRECT_EDGES],
    count: usize,
    /// The greatest energy of those left out.
    left_out: f64,
}

impl Loudest {
    fn new() -> Self {
        Self {
            fields: [const { None }; MAX_DIRECT_EDGES],
            energies: [0.0; MAX_DIRECT_EDGES],
            count: 0,
            left_out: 0.0,
        }
    }

    /// The fields and their energies.
    fn fields(&self) -> impl Iterator<Item = (&FirstOrderField, f64)> {
        self.fields.iter().flatten().zip(self.energies)
    }

    /// Energy of the quietest of a full list, otherwise 0.
    fn least_energy(&self) -> f64 {
        match self.count == MAX_DIRECT_EDGES {
            true => self.energies.iter().copied().fold(f64::MAX, f64::min),
            false => 0.0,
        }
    }

    /// Adds a field; of too many the quietest is left out, so that lists of neighbouring listeners differ little.
    fn push(&mut self, field: FirstOrderField, energy: f64) {
        if self.count < MAX_DIRECT_EDGES {
            self.fields[self.count] = Some(field);
            self.energies[self.count] = energy;
            self.count += 1;
            return;
        }
        let ranked = self.energies.iter().enumerate();
        let quietest = ranked.min_by(|a, b| a.1.total_cmp(b.1));
        let Some((index, least)) = quietest.filter(|(_, least)| **least < energy) else {
            self.left_out = self.left_out.max(energy);
            return;
        };
        self.left_out = self.left_out.max(*least);
        self.fields[index..].rotate_left(1);
        self.energies[index..].rotate_left(1);
        self.fields[MAX_DIRECT_EDGES - 1] = Some(field);
        self.energies[MAX_DIRECT_EDGES - 1] = energy;
    }
}

impl FirstOrderField {
    /// Energy relative to the straight path's, of all bands.
    fn energy(&self, spreading: f64) -> f64 {
        let amplitude = |b: usize| (self.incident[b].abs() + self.reflected[b].abs()) * spreading;
        (0..BANDS).map(|b| amplitude(b).powi(2)).sum()
    }

    fn scale(&mut self, factor: f64) {
        self.incident = self.incident.map(|wave| wave * factor);
        self.reflected = self.reflected.map(|wave| wave * factor);
    }

    fn is_audible(&self, spreading: f64) -> bool {
        (0..BANDS).any(|b| {
            (self.incident[b].abs() + self.reflected[b].abs()) * spreading > MIN_RELATIVE_AMPLITUDE
        })
    }
}

/// Free field over a path's length relative to that over the straight distance.
fn spreading(straight_m: f64, length_m: f64, min_distance_m: f64) -> f64 {
    straight_m.max(min_distance_m) / length_m.max(min_distance_m)
}

/// Lengths of paths over two edges along a narrow face, and the field along them.
type AlongFaces = [Option<(f64, ComplexBands)>; 2];

/// The paths over an edge and another one along a narrow face between them, but those over an edge that is `done`. Without
/// them the wave over the edge alone supposes that the face has no other end.
fn along_faces(
    scene: &Scene,
    endpoints: &Endpoints,
    edge: u32,
    done: &DirectEdges,
    rays: &mut u64,
) -> AlongFaces {
    let (from, to) = local_positions(scene, endpoints);
    let line = &scene.edge(edge);
    let mut found = scene.edge_neighbours(edge).filter_map(|other| {
        // Most neighbours have no face of the edge.
        let faces = scene.edge_faces(other);
        if !faces.iter().any(|face| line.faces.contains(face)) || done.as_slice().contains(&other) {
            return None;
        }
        let other_line = &scene.edge(other);
        if !two_edge_path::bound_narrow_face([line, other_line]) {
            return None;
        }
        let [a, b] = [line, other_line].map(|line| [from, to].map(|end| line.line_distance_m(end)));
        let edges = match a[0] + b[1] < b[0] + a[1] {
            true => [edge, other],
            false => [other, edge],
        };
        let path = TwoEdgePath::over(scene, edges, endpoints)?;
        let fade = fade_out(scene, path.length_m() - from.distance(to));
        path.is_unoccluded(scene, endpoints, rays).then(|| {
            let field = path.field(scene, endpoints).map(|wave| wave * fade);
            (path.length_m(), field)
        })
    });
    [found.next(), found.next()]
}

/// Emits the straight path, direct or transmitted, and the paths over one of `edges`, each with its share of the wave. The
/// edges come in the order of the paths' lengths; the loudest [`MAX_DIRECT_EDGES`] that are visible from both ends and audible
/// count. Adds the rays cast to `rays`. `two_edge_paths` tells the limits of paths over two edges; it may emit them.
///
/// # Real-time
/// Allocates nothing. One ray for the straight path, more behind walls, and up to two for each edge of the list.
pub fn direct_field(
    scene: &Scene,
    endpoints: &Endpoints,
    edges: impl Iterator<Item = (u32, f64)>,
    two_edge_paths: impl FnOnce(&DirectField, &mut u64, &mut dyn FnMut(Path)) -> EdgeLimits,
    rays: &mut u64,
    emit: &mut impl FnMut(Path),
) -> DirectField {
    let Endpoints {
        ref source,
        from,
        to,
        min_distance_m,
    } = *endpoints;
    let effects = source.settings.effects;
    let mut result = DirectField::default();
    let straight_m = scene.to_local(from).distance(scene.to_local(to));
    let free = free_field(scene, straight_m, min_distance_m);
    if !effects.diffraction {
        if !effects.direct {
            return result;
        }
        let straight = direct_path_of(scene, source, to, min_distance_m, rays);
        result.through = through(straight.as_ref(), &free);
        if let Some(mut path) = straight {
            apply_directivity(&mut path.amplitude, source, to - from);
            emit(path);
        }
        return result;
    }
    let mut straight = direct_path(scene, source.id, from, to, min_distance_m, rays);
    // A wall without any loss does not occlude.
    result.visible = straight.is_some_and(|path| path.amplitude == free);
    if !result.visible {
        let heard = straight.as_ref().filter(|_| effects.transmission);
        result.through = through(heard, &free);
    }
    if !effects.direct || !(result.visible || effects.transmission) {
        straight = None;
    }
    let merges = result.visible && straight.is_some();
    let wavenumbers = edge_wave::wavenumbers(scene);
    let mut gain = [if merges { Complex::ONE } else { Complex::ZERO }; BANDS];
    // Made for the first wave: far from edges clearing it is a third of the work.
    let mut loudest: Option<Loudest> = None;
    let joined_m = JOINED_DETOUR_M * scene.length_scale();
    let masked_m = MASKED_DETOUR_M * scene.length_scale();
    let is_lit = result.visible;
    let shadow_share = |nearest_m: f64| match is_lit {
        true => 1.0 - smoothstep(nearest_m / masked_m),
        false => 1.0,
    };
    let mut nearest = (f64::INFINITY, u32::MAX);
    for (edge, share) in edges {
        let Some(path) = FirstOrderPath::over(scene, endpoints, (edge, share)) else {
            continue;
        };
        // Two rays cost less than the field in eight bands.
        if !path.is_unoccluded(scene, endpoints, rays) {
            continue;
        }
        result.seen.push(edge);
        let spreading = spreading(straight_m, path.crossing.length_m(), min_distance_m);
        let mut field = path.field(scene, endpoints, result.visible);
        result.waves += 1;
        if !field.is_audible(spreading) {
            continue;
        }
        if field.path.detour_m < nearest.0 {
            nearest = (field.path.detour_m, edge);
        }
        let loudest = loudest.get_or_insert_with(Loudest::new);
        let mut energy = field.energy(spreading);
        let shadow_share = shadow_share(nearest.0);
        if shadow_share < 1.0 && energy > loudest.least_energy().max(LEAST_FADED) {
            let seen = result.seen.as_slice();
            let open = field.path.open_share(scene, endpoints, seen, joined_m);
            let factor = shadow_share + (1.0 - shadow_share) * open;
            field.scale(factor);
            energy *= factor * factor;
        }
        loudest.push(field, energy);
    }
    result.two_edge_share = shadow_share(nearest.0) as f32;
    let shadow_share = f64::from(result.two_edge_share);
    let fields = || loudest.iter().flat_map(Loudest::fields);
    for (field, _) in fields() {
        result.edges.push(field.path.edge);
    }
    let mut open = [1.0; MAX_DIRECT_EDGES];
    // Edges of different rigid bodies are no neighbours: one commit with both would find others that hide them.
    if shadow_share > 0.0 && !scene.has_instances() {
        let seen = result.seen.as_slice();
        for (open, (field, energy)) in open.iter_mut().zip(fields()) {
            if energy > LEAST_FADED {
                *open = field.path.open_share(scene, endpoints, seen, joined_m);
            }
        }
    }
    // In the light fields have faded already.
    let in_list = open.map(|open| 1.0 - shadow_share * (1.0 - open));
    let least_energy = loudest.as_ref().map_or(0.0, Loudest::least_energy);
    let least_faded = fields().zip(in_list);
    let least_faded = least_faded.fold(least_energy, |least, ((_, energy), factor)| {
        least.min(energy * factor * factor)
    });
    result.left_out_energy = loudest.as_ref().map_or(0.0, |list| list.left_out);
    result.least_energy = least_faded.max(result.left_out_energy);
    let limits = two_edge_paths(&result, rays, emit);
    // Where another edge begins to hide one of a full list, what is left out takes its place.
    let least = match limits.two_edge_detour_m {
        Some(_) => result
            .least_energy
            .max(limits.left_out_energy.min(least_energy)),
        None => least_energy,
    };
    let nearness = match !result.visible && fields().any(|(field, _)| field.path.edge == nearest.1)
    {
        true => 1.0 - smoothstep(nearest.0 / joined_m),
        false => 0.0,
    };
    let mut beside_boundary: Option<([Complex; BANDS], EdgeCrossing, f64)> = None;
    let mut done = DirectEdges::default();
    for ((field, energy), open) in fields().zip(open) {
        // By the whole energy, as that of the path over two edges which continues it.
        let weight = shadow_share * rank_weight(energy, least)
            + (1.0 - shadow_share) * rank_weight_in_light(energy, least);
        let continued = continued_share(energy, field.path.detour_m, least, &limits);
        let in_light = shadow_share + (1.0 - shadow_share) * open;
        let hidden = shadow_share * (1.0 - continued) * (1.0 - open);
        let weight = weight * (1.0 - hidden / in_light.max(f64::MIN_POSITIVE));
        let edge = field.path.edge;
        let length_m = field.path.crossing.length_m();
        let spreading = spreading(straight_m, length_m, min_distance_m);
        let along_faces = along_faces(scene, endpoints, edge, &done, rays);
        result.waves += along_faces.iter().flatten().count();
        done.push(edge);
        let along_faces = along_faces.map(|path| {
            path.map(|(over_both_m, waves)| {
                let later = edge_wave::delays(&wavenumbers, over_both_m - length_m);
                let share = length_m / over_both_m * weight;
                std::array::from_fn::<_, BANDS, _>(|b| waves[b] * later[b] * share)
            })
        });
        let (mut merged, mut separate) = ([Complex::ZERO; BANDS], [Complex::ZERO; BANDS]);
        for (b, &wavenumber) in wavenumbers.iter().enumerate() {
            let share = match merges {
                true => merged_share(wavenumber * field.path.detour_m),
                false if edge == nearest.1 => 0.0,
                false => nearness * merged_share(wavenumber * field.path.detour_m),
            };
            let faces = share * face_share(field.incident[b], field.reflected[b]);
            merged[b] = (field.incident[b] * share + field.reflected[b] * faces) * weight;
            separate[b] =
                (field.incident[b] * (1.0 - share) + field.reflected[b] * (1.0 - faces)) * weight;
            for waves in along_faces.iter().flatten() {
                merged[b] += waves[b] * share;
                separate[b] += waves[b] * (1.0 - share);
            }
        }
        if nearness > 0.0 && edge == nearest.1 {
            beside_boundary = Some((separate, field.path.crossing, field.path.detour_m));
            continue;
        }
        let gains: BandArray = separate.map(|wave| edge_wave::real_gain(wave) as f32);
        let is_path = edge_wave::is_audible(&gains, spreading);
        let diffracted_free = free_field(scene, length_m, min_distance_m);
        let later = edge_wave::delays(&wavenumbers, field.path.detour_m);
        for b in 0..BANDS {
            // A part too weak for a separate path remains in the direct path.
            let wave = match is_path {
                true => merged[b],
                false if result.visible => merged[b] + separate[b],
                false => merged[b],
            };
            let ratio = f64::from(diffracted_free[b]) / f64::from(free[b]).max(1e-30);
            gain[b] += wave * later[b] * ratio;
        }
        if is_path {
            let apex = field.path.crossing.apex;
            let path = EdgePath {
                interactions: &[Interaction::Edge(edge)],
                points: &[apex],
                length_m,
                last_point: apex,
            };
            emit(path.to_path(scene, endpoints, &gains));
        }
    }
    if let Some((mut waves, crossing, detour_m)) = beside_boundary {
        let length_m = crossing.length_m();
        let diffracted_free = free_field(scene, length_m, min_distance_m);
        let later = edge_wave::delays(&wavenumbers, -detour_m);
        for b in 0..BANDS {
            let ratio = f64::from(free[b]) / f64::from(diffracted_free[b]).max(1e-30);
            waves[b] += gain[b] * later[b] * ratio;
        }
        let gains = waves.map(|wave| edge_wave::real_gain(wave) as f32);
        if edge_wave::is_audible(&gains, spreading(straight_m, length_m, min_distance_m)) {
            let apex = crossing.apex;
            let path = EdgePath {
                interactions: &[Interaction::Edge(nearest.1)],
                points: &[apex],
                length_m,
                last_point: apex,
            };
            emit(path.to_path(scene, endpoints, &gains));
        }
    }
    if let Some(path) = &mut straight {
        if result.visible {
            for (value, factor) in path.amplitude.iter_mut().zip(gain) {
                // Interference beside a shadow reaches +1.4 dB; the amplitude at the least distance is the limit.
                *value = (*value * factor.abs() as f32).min(1.0 / min_distance_m as f32);
            }
        }
        apply_directivity(&mut path.amplitude, source, to - from);
        emit(*path);
    }
    result
}
