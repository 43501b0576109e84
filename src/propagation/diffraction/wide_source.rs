//! The direct field of a source with a size: the mean over points on its ellipsoid.
//!
//! Runs with the propagation update and with every graphics frame; allocates nothing; costs the direct field of a point source
//! once a point, and a ray more. Own.
//!
//! # Partial visibility and edge waves
//! The points sound independently, so their energies add. What is averaged is the whole direct field of a point: its straight
//! path and its edge waves together, which are continuous over a shadow boundary. A share of visible points times the straight
//! path, with the edge waves of the centre beside it, would count twice what the waves of the hidden points carry.
//!
//! One straight path and one path an edge stand for all points, and generation adds them as one signal. While half of the energy or more
//! arrives straight, the straight path carries all of it. Below, the edges' paths take over, at the delay that the straight path has
//! reached by then, so amplitudes add up to the mean energy; in full shadow the edges' paths carry all of it.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::acoustics::{BANDS, BandArray, smoothstep};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::amplitude::{apply_directivity, free_field};
use crate::propagation::diffraction::direct_edges::MAX_DIRECT_EDGES;
use crate::propagation::diffraction::edge_wave::wavenumbers;
use crate::propagation::diffraction::first_order::{DirectField, direct_field, no_limits};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::path::{EdgeLimits, Path};
use crate::propagation::transmission::unoccluded_path;
use crate::scene::{MAX_EXTENT_POINTS, Scene, SourceExtent, SourcePose};

/// Share of the way from the centre to a surface up to which points are pulled in.
const INSIDE: f32 = 0.95;

/// Least amplitude of the straight path relative to the free field: −80 dB. Less is rounding in full shadow.
const LEAST_AMPLITUDE: f32 = 1e-4;

/// Frequencies of an octave, relative to its centre, at which interference is averaged.
const TONES: [f64; 6] = [0.749, 0.841, 0.944, 1.059, 1.189, 1.335];

/// Shares by the share of the energy that arrives straight: that of the edges' amplitude in paths of their own, 1 in full shadow and 0
/// from a half on; and that of the straight path's length that is the edges', 1 up to a half and 0 in the light.
fn shares(straight: f64) -> (f64, f64) {
    (
        1.0 - smoothstep(2.0 * straight),
        1.0 - smoothstep(2.0 * straight - 1.0),
    )
}

/// Mean over an octave of the cosine of a phase difference, in radians at the octave's centre: 1 for waves that arrive as one.
fn coherence(phase: f64) -> f64 {
    TONES.iter().map(|tone| (phase * tone).cos()).sum::<f64>() / TONES.len() as f64
}

/// Where the direct sound of a wide source comes from.
#[derive(Debug, Clone, Copy)]
pub struct PointImage {
    positions: [Vec3; MAX_EXTENT_POINTS],
    energies: [f32; MAX_EXTENT_POINTS],
    count: usize,
}

impl PointImage {
    /// The points in world coordinates, and the energy at the listener that comes from each.
    pub fn points(&self) -> impl Iterator<Item = (Vec3, f32)> {
        let energies = self.energies.iter().copied();
        self.positions
            .iter()
            .copied()
            .zip(energies)
            .take(self.count)
    }
}

/// Result of [`wide_field`].
#[derive(Debug, Clone, Copy)]
pub struct WideField {
    /// As of a point: visible if any point is, edges of all points; through what blocks the hidden points in the mean.
    pub direct: DirectField,
    /// Share of the points that the listener sees, 0 to 1.
    pub visible_share: f32,
    /// Amplitude as if nothing were between source and listener.
    pub free: BandArray,
    /// Where the sound comes from.
    pub image: PointImage,
}

/// The points of a wide source, for rays that start at each in turn.
#[derive(Debug, Clone, Copy)]
pub struct ExtentPoints {
    /// From the centre.
    offsets: [Vec3; MAX_EXTENT_POINTS],
    count: usize,
}

impl ExtentPoints {
    /// Those of a source; `None` for a point source. Casts a ray a point.
    pub fn of(scene: &Scene, pose: &SourcePose, rays: &mut u64) -> Option<Self> {
        if !pose.settings.extent.is_wide() {
            return None;
        }
        let (positions, count) = extent_points(scene, pose, rays);
        Some(Self {
            offsets: positions.map(|position| position - pose.position),
            count,
        })
    }

    /// From the centre to the point of one of so many rotations of the source's rays: all together have each point equally often
    /// where their number allows it, and any few in turn are spread over the ellipsoid.
    pub fn of_rotation(&self, rotation: u64, rotations: u64) -> DVec3 {
        let spread = (STRIDE * rotation % rotations) as usize;
        self.offsets[spread * self.count / rotations as usize].as_dvec3()
    }
}

/// Step through the points from one rotation to the next, without a common divisor with the number of rotations.
const STRIDE: u64 = 7;

/// The points of a wide source in world coordinates. Behind a surface, as seen from the centre, there is none: such points are
/// pulled in front of it.
fn extent_points(
    scene: &Scene,
    pose: &SourcePose,
    rays: &mut u64,
) -> ([Vec3; MAX_EXTENT_POINTS], usize) {
    let SourceExtent {
        semi_axes_m,
        points,
    } = pose.settings.extent;
    let count = points.clamp(1, MAX_EXTENT_POINTS);
    let centre = scene.to_local(pose.position);
    let golden_angle = PI * (3.0 - 5f64.sqrt());
    let mut positions = [pose.position; MAX_EXTENT_POINTS];
    for (index, position) in positions.iter_mut().enumerate().take(count) {
        // A Fibonacci spiral: even on a sphere, and its projection even on a line.
        let up = 1.0 - (2 * index + 1) as f64 / count as f64;
        let (sin, cos) = (golden_angle * index as f64).sin_cos();
        let across = (1.0 - up * up).sqrt();
        let unit = DVec3::new(across * cos, up, across * sin).as_vec3();
        let offset = pose.orientation * (unit * semi_axes_m);
        *rays += 1;
        let line = Ray::between(centre.as_vec3(), (centre + offset.as_dvec3()).as_vec3());
        let reached = scene.closest_hit(&line, [NO_GROUP, NO_GROUP]);
        *position += offset * reached.map_or(1.0, |hit| INSIDE * hit.t);
    }
    (positions, count)
}

/// The waves over one edge from all points.
struct EdgeSum {
    /// The first of the paths.
    path: Path,
    energy: [f64; BANDS],
    signed: [f64; BANDS],
    magnitude: [f64; BANDS],
    /// Point on the edge and length, weighted by energy, and the weight.
    apex: DVec3,
    length_m: f64,
    weight: f64,
}

impl EdgeSum {
    fn new(path: &Path) -> Self {
        Self {
            path: *path,
            energy: [0.0; BANDS],
            signed: [0.0; BANDS],
            magnitude: [0.0; BANDS],
            apex: DVec3::ZERO,
            length_m: 0.0,
            weight: f64::MIN_POSITIVE,
        }
    }

    fn add(&mut self, path: &Path) {
        let mut weight = 0.0;
        for (b, amplitude) in path.amplitude.into_iter().enumerate() {
            let amplitude = f64::from(amplitude);
            self.energy[b] += amplitude * amplitude;
            self.signed[b] += amplitude;
            self.magnitude[b] += amplitude.abs();
            weight += amplitude * amplitude;
        }
        self.apex += path.points[0].as_dvec3() * weight;
        self.length_m += f64::from(path.length_m) * weight;
        self.weight += weight;
    }

    /// Amplitude of the path of all waves. Its sign is −1 where all reduce the direct sound, 1 where none does, and smooth
    /// between.
    fn amplitude(&self, band: usize, points: f64) -> f64 {
        let sign = self.signed[band] / self.magnitude[band].max(f64::MIN_POSITIVE);
        sign * (self.energy[band] / points).sqrt()
    }

    fn to_path(&self, own: f64, listener: Vec3, points: f64) -> Path {
        let mut path = self.path;
        let apex = (self.apex / self.weight).as_vec3();
        path.points[0] = apex;
        path.length_m = (self.length_m / self.weight) as f32;
        path.image = listener + (apex - listener).normalize_or_zero() * path.length_m;
        path.amplitude = std::array::from_fn(|b| (own * self.amplitude(b, points)) as f32);
        path
    }
}

/// The direct field of one point.
struct PointField {
    field: DirectField,
    straight: Option<Path>,
    edges: [Option<Path>; MAX_DIRECT_EDGES],
}

fn point_field(
    scene: &Scene,
    endpoints: &Endpoints,
    edges: impl Iterator<Item = (u32, f64)>,
    rays: &mut u64,
) -> PointField {
    let (mut straight, mut found, mut count) = (None, [const { None }; MAX_DIRECT_EDGES], 0);
    let field = direct_field(scene, endpoints, edges, no_limits, rays, &mut |path| {
        if path.diffraction_order == 0 {
            straight = Some(path);
        } else if let Some(free) = found.get_mut(count) {
            *free = Some(path);
            count += 1;
        }
    });
    PointField {
        field,
        straight,
        edges: found,
    }
}

/// Emits the straight path of a wide source and its paths over one of `edges`, as [`direct_field`] does for a point.
/// `transmission` scales what comes through walls.
///
/// # Real-time
/// Allocates nothing; bounded by [`MAX_EXTENT_POINTS`] times the work of [`direct_field`].
pub fn wide_field(
    scene: &Scene,
    endpoints: &Endpoints,
    edges: impl Iterator<Item = (u32, f64)> + Clone,
    transmission: f32,
    rays: &mut u64,
    emit: &mut impl FnMut(Path),
) -> WideField {
    let pose = &endpoints.source;
    let has_direct = pose.settings.effects.direct;
    let (positions, count) = extent_points(scene, pose, rays);
    let points = count as f64;
    // Half of the distance between points: nearer to one of them than that, the sound of a surface does not rise.
    let mean_m = f64::from(pose.settings.extent.semi_axes_m.element_sum()) / 3.0;
    let min_distance_m = endpoints.min_distance_m.max(mean_m * (PI / points).sqrt());
    let wavenumbers = wavenumbers(scene);
    let listener = scene.to_local(endpoints.to);
    let mut result = WideField {
        direct: DirectField {
            visible: false,
            ..DirectField::default()
        },
        visible_share: 0.0,
        free: [0.0; BANDS],
        image: PointImage {
            positions,
            energies: [0.0; MAX_EXTENT_POINTS],
            count,
        },
    };
    let mut sums = [const { None::<EdgeSum> }; MAX_DIRECT_EDGES];
    let (mut energy, mut signed, mut free) = ([0.0; BANDS], [0.0; BANDS], [0.0; BANDS]);
    let (mut centre, mut length_m, mut weight) = (DVec3::ZERO, 0.0, 0.0);
    let (mut through, mut hidden, mut seen) = ([0.0f32; BANDS], 0.0f32, 0);
    let mut straight_energy = 0.0;
    for (index, position) in positions.into_iter().enumerate().take(count) {
        let mut from_point = *endpoints;
        from_point.source.position = position;
        (from_point.from, from_point.min_distance_m) = (position, min_distance_m);
        let found = point_field(scene, &from_point, edges.clone(), rays);
        let straight_m = scene.to_local(position).distance(listener);
        let mut unobstructed = free_field(scene, straight_m, min_distance_m);
        apply_directivity(&mut unobstructed, pose, endpoints.to - position);
        let is_blocked = found.field.through != [1.0; BANDS];
        let is_visible = found.field.visible && !is_blocked;
        result.direct.visible |= found.field.visible;
        result.direct.waves += found.field.waves;
        let share = &mut result.direct.two_edge_share;
        *share = share.max(found.field.two_edge_share);
        let least = &mut result.direct.least_energy;
        *least = least.max(found.field.least_energy);
        seen += usize::from(is_visible);
        for &edge in found.field.edges.as_slice() {
            result.direct.edges.insert(edge);
        }
        if is_blocked {
            hidden += 1.0;
            for (sum, factor) in through.iter_mut().zip(found.field.through) {
                *sum += factor;
            }
        }
        let mut straight = [0.0; BANDS];
        if let Some(path) = &found.straight {
            let gain = if is_blocked { transmission } else { 1.0 };
            straight = path.amplitude.map(|amplitude| f64::from(gain * amplitude));
        }
        let mut arriving = straight.map(|amplitude| amplitude * amplitude);
        for path in found.edges.iter().flatten() {
            let detour_m = f64::from(path.length_m) - straight_m;
            for b in 0..BANDS {
                let wave = f64::from(path.amplitude[b]);
                let common = match straight[b] == 0.0 {
                    true => 0.0,
                    false => 2.0 * straight[b] * coherence(wavenumbers[b] * detour_m),
                };
                arriving[b] += wave * (wave + common);
                signed[b] += wave;
            }
            let is_same = |sum: &EdgeSum| sum.path.id == path.id;
            let known = sums.iter().flatten().position(is_same);
            let place = known.or_else(|| sums.iter().position(Option::is_none));
            if let Some(sum) = place.and_then(|place| sums.get_mut(place)) {
                sum.get_or_insert_with(|| EdgeSum::new(path)).add(path);
            }
        }
        let (mut own, mut all) = (f64::MIN_POSITIVE, 0.0);
        for b in 0..BANDS {
            energy[b] += arriving[b].max(0.0);
            signed[b] += straight[b];
            free[b] += f64::from(unobstructed[b]).powi(2);
            own += straight[b] * straight[b];
            straight_energy += straight[b] * straight[b];
            all += arriving[b].max(0.0);
        }
        result.image.energies[index] = all as f32;
        // Without any straight line the geometry is that of all points.
        let own = own + 1e-6 * all;
        centre += position.as_dvec3() * own;
        length_m += straight_m * own;
        weight += own;
    }
    result.visible_share = seen as f32 / count as f32;
    result.free = free.map(|energy| (energy / points).sqrt() as f32);
    if hidden > 0.0 {
        result.direct.through = through.map(|sum| sum / hidden);
    }
    let (own, edges_length) = match has_direct {
        true => shares(straight_energy / energy.iter().sum::<f64>().max(f64::MIN_POSITIVE)),
        false => (1.0, 0.0),
    };
    let over_edges = || sums.iter().flatten();
    if own > 0.0 {
        over_edges().for_each(|sum| emit(sum.to_path(own, endpoints.to, points)));
    }
    if has_direct {
        let mut straight =
            unoccluded_path(scene, pose.id, endpoints.from, endpoints.to, min_distance_m);
        straight.image = (centre / weight).as_vec3();
        let straight_m = length_m / weight;
        let edges_weight: f64 = over_edges().map(|sum| sum.weight).sum();
        let edges_m = match edges_weight > 0.0 {
            true => over_edges().map(|sum| sum.length_m).sum::<f64>() / edges_weight,
            false => straight_m,
        };
        straight.length_m = (straight_m + edges_length * (edges_m - straight_m)) as f32;
        for (b, value) in straight.amplitude.iter_mut().enumerate() {
            let waves = over_edges().map(|sum| (own * sum.amplitude(b, points)).powi(2));
            let rest = (energy[b] / points).sqrt() - waves.sum::<f64>().sqrt();
            *value = rest.copysign(rest * signed[b]) as f32;
        }
        let is_audible = |b: usize| straight.amplitude[b].abs() > LEAST_AMPLITUDE * result.free[b];
        if (0..BANDS).any(is_audible) {
            emit(straight);
        }
    }
    result
}

/// [`direct_field`] of a source of any size. What comes through walls is not scaled, and edges of a wide source are heard whole where
/// another edge begins to hide them.
pub fn sized_field(
    scene: &Scene,
    endpoints: &Endpoints,
    edges: impl Iterator<Item = (u32, f64)> + Clone,
    two_edge_paths: impl FnOnce(&DirectField, &mut u64, &mut dyn FnMut(Path)) -> EdgeLimits,
    rays: &mut u64,
    emit: &mut impl FnMut(Path),
) -> DirectField {
    if !endpoints.source.settings.extent.is_wide() {
        return direct_field(scene, endpoints, edges, two_edge_paths, rays, emit);
    }
    let field = wide_field(scene, endpoints, edges, 1.0, rays, emit).direct;
    two_edge_paths(&field, rays, emit);
    field
}
