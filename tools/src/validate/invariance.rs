//! Law *invariance*: rotation, mirroring, translation and scale of a scene, the order and winding of its triangles, and the
//! exchange of source and listener change no path, with diffraction on.

use std::sync::Arc;

use glam::{Quat, Vec3};

use super::Row;
use super::solids::Solids;
use foresound::acoustics::BANDS;
use foresound::error::Result;
use foresound::propagation::rays::directions::{mix, unit};
use foresound::propagation::{Path, PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, TriangleMesh,
};

/// Random scenes, and pairs of source and listener in each.
const SCENES: u64 = 24;
const PAIRS: u64 = 8;

/// Largest relative difference of amplitudes: rays and vertices are `f32`, seven digits, and an angle near a boundary loses
/// some of them.
const AMPLITUDE_BOUND: f64 = 1e-3;

/// Largest share of paths without a counterpart, in percent: a path at the limit of audibility or of a list of the loudest.
const MISSING_BOUND: f64 = 0.1;

/// Paths of equal interactions whose lengths differ by less are the same, in metres.
const SAME_LENGTH_M: f64 = 2e-3;

/// Scale of the scaled scene. The speed of sound is scaled alike: wavelengths keep their proportion.
const SCALE: f32 = 1.0625;

/// Bands that are compared: up to 1 kHz, where the thin dry air of the law absorbs less than 0.002 dB a metre. What is left
/// of the absorption changes with the temperature.
const COMPARED: usize = 5;

/// A mesh with its end points.
#[derive(Clone)]
struct Case {
    solids: Solids,
    ends: Vec<[Vec3; 2]>,
    scale: f32,
    /// Whether sound is reflected and transmitted. Which surfaces reflect diffracted paths depends on the bounds along the
    /// axes, and like the thickness of a wall on distances in metres.
    reflects: bool,
}

/// A change of a case that changes no path.
type Change = fn(&mut Case, &mut Random);

pub(super) fn rows() -> Result<Vec<Row>> {
    let changes: [(&str, Change); 8] = [
        ("rotation", rotate),
        ("turn by a right angle", turn),
        ("mirroring", mirror),
        ("translation", translate),
        ("scale", scale),
        ("order of triangles", shuffle),
        ("winding", rewind),
        ("source and listener exchanged", exchange),
    ];
    let mut worst = [0f64; 8];
    let mut missing = [0u32; 8];
    let mut compared = 0u32;
    for seed in 0..SCENES {
        let mut random = Random(mix(seed + 1));
        let case = random_case(&mut random);
        let before = all_paths(&case)?;
        let unreflected = all_paths(&Case {
            reflects: false,
            ..case.clone()
        })?;
        compared += before.iter().map(|paths| paths.len() as u32).sum::<u32>();
        for (number, (_, change)) in changes.iter().enumerate() {
            let mut changed = case.clone();
            change(&mut changed, &mut random);
            let after = all_paths(&changed)?;
            let before = match changed.reflects {
                true => &before,
                false => &unreflected,
            };
            for (before, after) in before.iter().zip(&after) {
                let (off, lost) = compare(before, after);
                worst[number] = worst[number].max(off);
                missing[number] += lost;
            }
        }
    }
    let mut rows = vec![Row::at_least(
        "invariance: paths compared",
        f64::from(compared),
        1000.0,
        "paths",
    )];
    for (number, (name, _)) in changes.iter().enumerate() {
        let law = format!("invariance: {name}, amplitude");
        rows.push(Row::at_most(
            law,
            worst[number],
            AMPLITUDE_BOUND,
            "relative",
        ));
        let law = format!("invariance: {name}, paths without a counterpart");
        let share = 100.0 * f64::from(missing[number]) / f64::from(compared.max(1));
        rows.push(Row::at_most(law, share, MISSING_BOUND, "%"));
    }
    Ok(rows)
}

/// Reproducible numbers.
struct Random(u64);

impl Random {
    fn between(&mut self, low: f32, high: f32) -> f32 {
        self.0 = mix(self.0);
        low + (high - low) * unit(self.0)
    }

    fn point(&mut self, low: Vec3, high: Vec3) -> Vec3 {
        Vec3::from(std::array::from_fn(|a| self.between(low[a], high[a])))
    }
}

/// A length of air without absorption: the path's amplitudes in free air times its length.
struct Heard {
    interactions: [u8; 2],
    length_m: f64,
    amplitude: [f64; BANDS],
}

/// Solids, sheets and boxes without a front in random places, on the ground in every other case.
fn random_case(random: &mut Random) -> Case {
    let mut solids = Solids::new(1e-3);
    let mut occupied: Vec<(Vec3, f32)> = Vec::new();
    let has_ground = random.between(0.0, 1.0) < 0.5;
    for number in 0..4 {
        let first = solids.mesh.vertices.len();
        let size = random.point(Vec3::new(0.8, 1.0, 1.5), Vec3::new(3.0, 3.0, 3.5));
        match number {
            0 | 1 => solids.solid(-0.5 * size, 0.5 * size),
            2 => solids.sheet(-0.5 * size, Vec3::X * size.x, Vec3::Y * size.y),
            _ => {
                let from = solids.mesh.triangles.len();
                solids.solid(-0.5 * size, 0.5 * size);
                solids.mesh.triangles.drain(from + 2..from + 4);
                solids.mesh.triangle_materials.truncate(from + 10);
            }
        }
        let turn = Quat::from_rotation_y(random.between(0.0, 6.3));
        let place = random.point(Vec3::new(-3.0, 0.0, -3.0), Vec3::new(3.0, 0.0, 3.0));
        let lift = match has_ground {
            true => 0.5 * size.y,
            false => random.between(0.0, 3.0),
        };
        let place = place + Vec3::Y * lift;
        occupied.push((place, 0.5 * size.length()));
        for vertex in &mut solids.mesh.vertices[first..] {
            *vertex = turn * *vertex + place;
        }
    }
    if has_ground {
        let far = Vec3::new(-41.3, 0.0, -37.9);
        solids.sheet(far, Vec3::Z * 79.0, Vec3::X * 83.0);
    }
    let mut point = || loop {
        let point = random.point(Vec3::new(-6.0, 0.4, -6.0), Vec3::new(6.0, 4.0, 6.0));
        if occupied
            .iter()
            .all(|(at, reach_m)| at.distance(point) > *reach_m)
        {
            return point;
        }
    };
    let ends = (0..PAIRS).map(|_| [point(), point()]).collect();
    Case {
        solids,
        ends,
        scale: 1.0,
        reflects: true,
    }
}

/// The paths of every pair.
fn all_paths(case: &Case) -> Result<Vec<Vec<Heard>>> {
    let mut settings = SceneSettings::default();
    let square = f64::from(case.scale * case.scale);
    settings.min_panel_m2 *= square;
    // Reflections of finite panels fade over lengths that do not scale.
    settings.max_finite_panel_m2 = 0.0;
    (
        settings.medium.humidity_percent,
        settings.medium.pressure_kpa,
    ) = (0.01, 10.0);
    // The speed of sound is as the root of the absolute temperature.
    settings.medium.temperature_c = (settings.medium.temperature_c + 273.15) * square - 273.15;
    let table = MaterialTable::from_materials(vec![case.solids.material().clone()]);
    let scene = Arc::new(Scene::commit(&case.solids.mesh, &table, &settings)?);
    let settings = PropagationSettings {
        guide_rays: 2048,
        source_rays: 16,
        depth: 1,
        min_distance_m: 0.3 * case.scale,
        ..PropagationSettings::default()
    };
    let mut first: Option<Propagator> = None;
    let pair = |[from, to]: &[Vec3; 2]| -> Result<Vec<Heard>> {
        let mut propagator = Propagator::new(Arc::clone(&scene), settings)?;
        // The law is about paths: one late field is enough.
        if let Some(first) = &first {
            propagator.share_field(first);
        }
        let mut source = SourcePose::at(SourceId::default(), *from);
        source.settings.effects.reflections = case.reflects;
        source.settings.effects.transmission = case.reflects;
        let mut set = PathSet::default();
        for _ in 0..4 {
            let ear = ListenerPose::facing(*to, 0.0);
            propagator.update(&ear, &[source], 0.0, &mut set);
        }
        first.get_or_insert(propagator);
        Ok(set
            .paths
            .iter()
            .map(|p| heard(&scene, p, case.scale))
            .collect())
    };
    case.ends.iter().map(pair).collect()
}

fn heard(scene: &Scene, path: &Path, scale: f32) -> Heard {
    let length_m = f64::from(path.length_m);
    Heard {
        interactions: [path.order, path.diffraction_order],
        length_m: length_m / f64::from(scale),
        amplitude: std::array::from_fn(|b| {
            let dry = (f64::from(scene.air_np_per_m()[b]) * length_m).exp();
            f64::from(path.amplitude[b] * scale) * dry
        }),
    }
}

/// Largest difference of amplitudes of the same paths relative to their loudest band, and the number of paths without a
/// counterpart.
fn compare(before: &[Heard], after: &[Heard]) -> (f64, u32) {
    let mut rest: Vec<&Heard> = after.iter().collect();
    let (mut worst, mut missing) = (0f64, 0);
    for path in before {
        let loudest = path.amplitude.iter().fold(1e-9, |l, a| a.abs().max(l));
        let off = |other: &Heard| {
            (0..COMPARED).fold(0f64, |off, b| {
                off.max((other.amplitude[b] - path.amplitude[b]).abs() / loudest)
            })
        };
        let same = |other: &&Heard| {
            other.interactions == path.interactions
                && (other.length_m - path.length_m).abs() < SAME_LENGTH_M
        };
        let nearest = rest
            .iter()
            .enumerate()
            .filter(|(_, other)| same(other))
            .min_by(|a, b| off(a.1).total_cmp(&off(b.1)))
            .map(|(index, _)| index);
        match nearest {
            Some(index) => worst = worst.max(off(rest.swap_remove(index))),
            None => missing += 1,
        }
    }
    (worst, missing + rest.len() as u32)
}

fn each_point(case: &mut Case, map: impl Fn(Vec3) -> Vec3) {
    let ends = case.ends.iter_mut().flatten();
    for point in case.solids.mesh.vertices.iter_mut().chain(ends) {
        *point = map(*point);
    }
}

fn rotate(case: &mut Case, random: &mut Random) {
    let axis = random.point(Vec3::NEG_ONE, Vec3::ONE).normalize_or(Vec3::X);
    let turn = Quat::from_axis_angle(axis, random.between(0.5, 6.0));
    case.reflects = false;
    each_point(case, |point| turn * point);
}

fn turn(case: &mut Case, _: &mut Random) {
    each_point(case, |point| Vec3::new(point.z, point.x, point.y));
}

fn mirror(case: &mut Case, _: &mut Random) {
    each_point(case, |point| Vec3::new(-point.x, point.y, point.z));
}

fn translate(case: &mut Case, random: &mut Random) {
    let by = random.point(Vec3::splat(-50.0), Vec3::splat(50.0));
    each_point(case, |point| point + by);
}

fn scale(case: &mut Case, _: &mut Random) {
    case.reflects = false;
    case.scale = SCALE;
    each_point(case, |point| point * SCALE);
}

fn shuffle(case: &mut Case, random: &mut Random) {
    let mesh: &mut TriangleMesh = &mut case.solids.mesh;
    for last in (1..mesh.triangles.len()).rev() {
        let other = (random.between(0.0, 1.0) * (last + 1) as f32) as usize;
        mesh.triangles.swap(last, other.min(last));
    }
    for triangle in &mut mesh.triangles {
        triangle.rotate_left((random.between(0.0, 2.999)) as usize);
    }
}

fn rewind(case: &mut Case, random: &mut Random) {
    for triangle in &mut case.solids.mesh.triangles {
        if random.between(0.0, 1.0) < 0.5 {
            triangle.swap(1, 2);
        }
    }
}

fn exchange(case: &mut Case, _: &mut Random) {
    case.ends.iter_mut().for_each(|ends| ends.reverse());
}
