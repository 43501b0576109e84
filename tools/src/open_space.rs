//! A walk for the listener and positions for sources in a mesh without a layout, in open space above floors.
//!
//! Own method: vertical rays on a grid find floors with headroom; the walk is the longest free straight line near their
//! middle, and sources are spread over the floors that it reaches. The result depends on the mesh only.

use glam::{Vec2, Vec3};

use foresound::geometry::Ray;
use foresound::geometry::bvh::NO_GROUP;
use foresound::scene::Scene;
use foresound::scene::layout::Walk;
use foresound::{Error, Result};

/// Grid squares along the longer side of the floor plan.
const SQUARES: f32 = 40.0;
/// Widest squares around the walk, in metres: a room has some.
const NEAR_SQUARE_M: f32 = 0.75;
/// Height of ears and mouths above the floor, in metres.
pub(crate) const EAR_HEIGHT_M: f32 = 1.6;
/// Least clear height above a floor, in metres.
const HEADROOM_M: f32 = 1.9;
/// Minimum horizontal distance to any surface, in metres.
pub(crate) const CLEARANCE_M: f32 = 0.35;
/// Shortest and longest walk, in metres.
const WALK_M: [f32; 2] = [1.5, 10.0];
/// Largest step up or down between neighbouring squares, in metres.
pub(crate) const STEP_M: f32 = 0.5;
/// Least distance of sources from each other and from the walk, in metres.
const APART_M: f32 = 1.0;
/// Largest distance of a source from the walk's middle, in metres.
const FAR_M: f32 = 30.0;
/// Most floors above each other.
const STOREYS: usize = 8;
/// Walking speed in m/s.
const SPEED_M_S: f64 = 1.4;

/// A layout found in a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenSpace {
    /// The listener's walk.
    pub walk: Walk,
    /// Positions of sources, in the order of their distance from those before.
    pub sources: Vec<Vec3>,
}

/// A position at ear height above a floor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FloorPosition {
    pub(crate) square: [i32; 2],
    pub(crate) at: Vec3,
}

/// Finds a walk and up to `most_sources` positions.
///
/// # Errors
/// [`Error::Setting`] if no floor has room for a walk: the advice says how to write a layout.
pub fn open_space(scene: &Scene, most_sources: usize) -> Result<OpenSpace> {
    let [low, high] = bounds(scene);
    let mut squares = Squares::over([low, high]);
    let mut found = candidates(scene, &squares);
    let mut walk = longest_walk(scene, &found);
    let middle = match &walk {
        Some(walk) => walk.standing,
        None => median_corner(scene),
    };
    // The squares of a large mesh are wider than a house: those around the walk, or where most of the mesh is, are finer.
    let near = Squares::around([low, high], middle, FAR_M, NEAR_SQUARE_M);
    if near.pitch_m < squares.pitch_m {
        squares = near;
        found = candidates(scene, &squares);
        walk = walk.or_else(|| longest_walk(scene, &found));
    }
    let none = |problem: String| {
        let advice = "check --scale and --up, or put a TOML file with sources and a listener beside the mesh";
        Error::setting("scene", problem, advice)
    };
    let searched = format!("searched every {:.2} m", squares.pitch_m);
    let Some(walk) = walk else {
        return Err(none(match found.len() {
            0 => format!("no floor with {HEADROOM_M} m of headroom was found, {searched}"),
            _ => format!("no floor has room to walk {} m, {searched}", WALK_M[0]),
        }));
    };
    let reached = reached(scene, &found, walk.standing);
    let sources = spread(&reached, &walk, most_sources);
    if sources.is_empty() {
        return Err(none(format!(
            "there is a walk, but no place {APART_M} m beside it that can be reached from it, {searched}"
        )));
    }
    Ok(OpenSpace { walk, sources })
}

/// A square grid over a rectangle of the floor plan.
struct Squares {
    low: Vec3,
    high: Vec3,
    pitch_m: f32,
}

impl Squares {
    fn over([low, high]: [Vec3; 2]) -> Self {
        let extent = high - low;
        let pitch_m = (extent.x.max(extent.z) / SQUARES).max(0.1);
        Self { low, high, pitch_m }
    }

    /// Over what is up to `reach_m` from a position.
    fn around([low, high]: [Vec3; 2], middle: Vec3, reach_m: f32, pitch_m: f32) -> Self {
        let reach = Vec3::new(reach_m, 0.0, reach_m);
        let middle = Vec3::new(middle.x, 0.0, middle.z);
        let heights = [low, high].map(|corner| Vec3::Y * corner.y);
        Self {
            low: low.max(middle - reach + heights[0]),
            high: high.min(middle + reach + heights[1]),
            pitch_m,
        }
    }
}

/// Positions at ear height in open space up to `reach_m` from a position, on a grid.
pub(crate) fn floor_positions(
    scene: &Scene,
    middle: Vec3,
    reach_m: f32,
    pitch_m: f32,
) -> Vec<FloorPosition> {
    candidates(
        scene,
        &Squares::around(bounds(scene), middle, reach_m, pitch_m),
    )
}

/// The median of all corners, in each coordinate.
fn median_corner(scene: &Scene) -> Vec3 {
    let median = |axis: usize| {
        let corners = scene.triangles().flatten();
        let mut all: Vec<f32> = corners.map(|corner| corner[axis]).collect();
        let middle = all.len() / 2;
        *all.select_nth_unstable_by(middle, f32::total_cmp).1
    };
    Vec3::new(median(0), median(1), median(2))
}

/// Whether a surface lies between two positions.
pub(crate) fn hits(scene: &Scene, from: Vec3, to: Vec3) -> bool {
    let local = |p: Vec3| scene.to_local(p).as_vec3();
    let ray = Ray::between(local(from), local(to));
    scene.bvh().any_hit(&ray, [NO_GROUP; 2])
}

/// Distance from a position to the first surface along a vector; the vector's length if there is none.
pub fn clear_m(scene: &Scene, from: Vec3, along: Vec3) -> f32 {
    let local = |p: Vec3| scene.to_local(p).as_vec3();
    let ray = Ray::between(local(from), local(from + along));
    let hit = scene.bvh().closest_hit(&ray, [NO_GROUP; 2]);
    along.length() * hit.map_or(1.0, |hit| hit.t)
}

fn bounds(scene: &Scene) -> [Vec3; 2] {
    let corners = scene.triangles().flatten();
    corners.fold([Vec3::MAX, Vec3::MIN], |[low, high], corner| {
        [low.min(corner), high.max(corner)]
    })
}

/// Whether no surface is nearer than [`CLEARANCE_M`] in eight horizontal directions.
pub(crate) fn is_clear(scene: &Scene, at: Vec3) -> bool {
    (0..8).all(|k| {
        let (sine, cosine) = (std::f32::consts::TAU * k as f32 / 8.0).sin_cos();
        !hits(scene, at, at + CLEARANCE_M * Vec3::new(cosine, 0.0, sine))
    })
}

/// Heights of the surfaces at a point of the floor plan, the highest first. The highest is left out as a roof if there is
/// headroom below it.
fn floors(scene: &Scene, x: f32, z: f32, [low, high]: [f32; 2]) -> Vec<f32> {
    let mut floors = Vec::new();
    let mut top = high + 1.0;
    while floors.len() < STOREYS {
        let down = Vec3::NEG_Y * (top - low + 1.0);
        let depth = clear_m(scene, Vec3::new(x, top, z), down);
        if depth >= down.length() {
            break;
        }
        floors.push(top - depth);
        top -= depth + 0.02;
    }
    let is_roof = |highest: f32| floors.iter().any(|floor| highest - floor >= HEADROOM_M);
    if floors.first().is_some_and(|highest| is_roof(*highest)) {
        floors.remove(0);
    }
    floors
}

/// Positions with a floor below and headroom above, in the grid's order.
fn candidates(scene: &Scene, squares: &Squares) -> Vec<FloorPosition> {
    let (low, high, pitch) = (squares.low, squares.high, squares.pitch_m);
    let extent = high - low;
    let count = |length: f32| (length / pitch).ceil().max(1.0) as i32;
    let mut candidates = Vec::new();
    for x in 0..count(extent.x) {
        for z in 0..count(extent.z) {
            // Off the squares' middles by irregular fractions: rays then miss the mesh's edges.
            let at = low + pitch * Vec3::new(x as f32 + 0.4871, 0.0, z as f32 + 0.5127);
            for floor in floors(scene, at.x, at.z, [low.y, high.y]) {
                let ground = Vec3::new(at.x, floor + 0.05, at.z);
                let ear = Vec3::new(at.x, floor + EAR_HEIGHT_M, at.z);
                let has_room = !hits(scene, ground, ground + Vec3::Y * (HEADROOM_M - 0.05));
                if has_room && is_clear(scene, ear) {
                    candidates.push(FloorPosition {
                        square: [x, z],
                        at: ear,
                    });
                }
            }
        }
    }
    candidates
}

/// Whether a straight walk is free: no surface between its ends, a floor below all of it.
pub(crate) fn can_walk(scene: &Scene, from: Vec3, to: Vec3) -> bool {
    if hits(scene, from, to) {
        return false;
    }
    let steps = (from.distance(to) / 0.5).ceil().max(1.0);
    (0..=steps as u32).all(|k| {
        let at = from.lerp(to, k as f32 / steps);
        let depth = clear_m(scene, at, Vec3::NEG_Y * (EAR_HEIGHT_M + STEP_M));
        (EAR_HEIGHT_M - STEP_M..EAR_HEIGHT_M + STEP_M).contains(&depth) && is_clear(scene, at)
    })
}

/// The longest free line through a position; of equal ones the nearest to the middle of all positions.
fn longest_walk(scene: &Scene, candidates: &[FloorPosition]) -> Option<Walk> {
    let middle = candidates.iter().map(|s| s.at).sum::<Vec3>() / candidates.len().max(1) as f32;
    let mut best: Option<(f32, Walk)> = None;
    // At most some two hundred candidates are tried, evenly over the list.
    for candidate in candidates
        .iter()
        .step_by(candidates.len().div_ceil(200).max(1))
    {
        for k in 0..4 {
            let (sine, cosine) = (std::f32::consts::PI * k as f32 / 4.0).sin_cos();
            let ahead_dir = Vec3::new(cosine, 0.0, sine);
            let room = |direction: Vec3| {
                let room = clear_m(
                    scene,
                    candidate.at,
                    direction * (0.5 * WALK_M[1] + CLEARANCE_M),
                );
                (room - CLEARANCE_M).max(0.0)
            };
            let [mut ahead, mut behind] = [room(ahead_dir), room(-ahead_dir)];
            while ahead > 0.0 && !can_walk(scene, candidate.at, candidate.at + ahead_dir * ahead) {
                ahead -= 0.5;
            }
            while behind > 0.0 && !can_walk(scene, candidate.at, candidate.at - ahead_dir * behind)
            {
                behind -= 0.5;
            }
            let (from, to) = (
                candidate.at - ahead_dir * behind.max(0.0),
                candidate.at + ahead_dir * ahead.max(0.0),
            );
            let length = from.distance(to);
            if length < WALK_M[0] {
                continue;
            }
            let score = length - 0.05 * (0.5 * (from + to)).distance(middle);
            if best.as_ref().is_none_or(|(other, _)| score > *other) {
                let walk = Walk {
                    from,
                    to,
                    speed_m_s: SPEED_M_S,
                    standing: from.midpoint(to),
                };
                best = Some((score, walk));
            }
        }
    }
    best.map(|(_, walk)| walk)
}

/// Positions reachable from a start over neighbouring squares, also through doors.
fn reached(scene: &Scene, candidates: &[FloorPosition], start: Vec3) -> Vec<Vec3> {
    let near = |a: &FloorPosition, b: &FloorPosition| {
        let apart = [0, 1].map(|i| (a.square[i] - b.square[i]).abs());
        apart[0] <= 1 && apart[1] <= 1 && (a.at.y - b.at.y).abs() <= STEP_M
    };
    let nearest = (0..candidates.len())
        .filter(|&i| !hits(scene, start, candidates[i].at))
        .min_by(|&a, &b| {
            let far = |i: usize| candidates[i].at.distance_squared(start);
            far(a).total_cmp(&far(b))
        });
    let mut is_reached = vec![false; candidates.len()];
    let mut waiting: Vec<usize> = nearest.into_iter().collect();
    for &first in &waiting {
        is_reached[first] = true;
    }
    while let Some(here) = waiting.pop() {
        for there in 0..candidates.len() {
            if !is_reached[there]
                && near(&candidates[here], &candidates[there])
                && !hits(scene, candidates[here].at, candidates[there].at)
            {
                is_reached[there] = true;
                waiting.push(there);
            }
        }
    }
    let kept = candidates.iter().zip(is_reached);
    kept.filter_map(|(candidate, kept)| kept.then_some(candidate.at))
        .collect()
}

/// Positions, each the farthest from those before and from the walk. The first has the median distance from the walk: a
/// single source is neither at the ear nor far away.
fn spread(positions: &[Vec3], walk: &Walk, most: usize) -> Vec<Vec3> {
    let from_walk = |p: Vec3| {
        let (from, to) = (walk.from, walk.to);
        let along = ((p - from).dot(to - from) / from.distance_squared(to)).clamp(0.0, 1.0);
        p.distance(from.lerp(to, along))
    };
    let is_near = |p: &&Vec3| {
        let flat = |v: Vec3| Vec2::new(v.x, v.z);
        from_walk(**p) >= APART_M && flat(**p).distance(flat(walk.standing)) <= FAR_M
    };
    let mut positions: Vec<Vec3> = positions.iter().filter(is_near).copied().collect();
    positions.sort_by(|a, b| from_walk(*a).total_cmp(&from_walk(*b)));
    let mut taken: Vec<Vec3> = positions
        .get(positions.len() / 2)
        .copied()
        .into_iter()
        .collect();
    while taken.len() < most {
        let room = |p: &Vec3| {
            let others = taken.iter().map(|other| other.distance(*p));
            others.fold(2.0 * from_walk(*p), f32::min)
        };
        let Some(next) = positions.iter().max_by(|a, b| room(a).total_cmp(&room(b))) else {
            break;
        };
        if room(next) < APART_M {
            break;
        }
        taken.push(*next);
    }
    taken
}

#[cfg(test)]
mod tests {
    use super::*;
    use foresound::scene::{MaterialTable, SceneSettings, TriangleMesh, procedural};

    fn scene_of(mesh: &foresound::scene::TriangleMesh) -> Scene {
        Scene::commit(mesh, &MaterialTable::built_in(), &SceneSettings::default()).unwrap()
    }

    #[test]
    fn a_room_has_a_walk_along_it_and_sources_apart() {
        let size = Vec3::new(9.0, 3.0, 6.0);
        let scene = scene_of(&procedural::shoebox(size, "concrete"));
        let found = open_space(&scene, 16).unwrap();
        let walk = found.walk;
        assert!(walk.from.distance(walk.to) > 6.0, "{walk:?}");
        assert_eq!(found.sources.len(), 16);
        let positions = found.sources.iter().chain([&walk.from, &walk.to]);
        for position in positions {
            assert!((position.y - EAR_HEIGHT_M).abs() < 0.01, "{position}");
            let inside = position.cmpgt(Vec3::splat(0.3)) & position.cmplt(size - 0.3);
            assert!(inside.all(), "{position}");
        }
        for (i, one) in found.sources.iter().enumerate() {
            for other in &found.sources[..i] {
                assert!(one.distance(*other) >= APART_M, "{one} {other}");
            }
        }
        assert_eq!(open_space(&scene, 16).unwrap(), found);
    }

    #[test]
    fn every_benchmark_scene_has_open_space() {
        for name in procedural::NAMES {
            let benchmark = procedural::by_name(name).unwrap();
            let scene = scene_of(&benchmark.mesh);
            let found = open_space(&scene, 16).unwrap();
            let walk = found.walk;
            assert!(walk.from.distance(walk.to) >= WALK_M[0], "{name}: {walk:?}");
            assert_eq!(found.sources.len(), 16, "{name}");
            assert!(!hits(&scene, walk.from, walk.to), "{name}");
        }
    }

    /// Open ground of so many metres along x and z.
    fn ground(extent_m: f32) -> TriangleMesh {
        let mut mesh = procedural::shoebox(Vec3::new(extent_m, 40.0, extent_m), "grass");
        let is_ground = |corner: &u32| mesh.vertices[*corner as usize].y == 0.0;
        mesh.triangles
            .retain(|corners| corners.iter().all(is_ground));
        mesh.triangle_materials.truncate(mesh.triangles.len());
        assert_eq!(mesh.triangles.len(), 2);
        mesh
    }

    #[test]
    fn large_meshes_have_sources_near_the_walk() {
        for extent_m in [60.0, 400.0, 800.0, 1200.0, 2000.0, 9000.0] {
            let scene = scene_of(&ground(extent_m));
            let found = open_space(&scene, 16).unwrap();
            assert_eq!(found.sources.len(), 16, "{extent_m} m");
            let middle = found.walk.standing;
            for source in &found.sources {
                assert!(source.distance(middle) <= FAR_M, "{extent_m} m: {source}");
                assert!(!hits(&scene, middle, *source), "{extent_m} m: {source}");
            }
        }
    }

    #[test]
    fn a_house_is_found_in_a_mesh_with_a_far_corner() {
        let size = Vec3::new(9.0, 3.0, 6.0);
        let mut mesh = procedural::shoebox(size, "concrete");
        let far = mesh.vertices.len() as u32;
        let corner = Vec3::new(5e3, 0.0, 5e3);
        mesh.vertices
            .extend([corner, corner + Vec3::X, corner + Vec3::Y]);
        mesh.triangles.push([far, far + 1, far + 2]);
        mesh.triangle_materials.push(0);
        let found = open_space(&scene_of(&mesh), 16).unwrap();
        assert_eq!(found.sources.len(), 16);
        for source in &found.sources {
            assert!(source.cmplt(size).all(), "{source}");
        }
    }

    #[test]
    fn a_box_without_headroom_is_refused_with_advice() {
        let mesh = procedural::shoebox(Vec3::new(9.0, 1.0, 6.0), "concrete");
        // Its lid is a floor too, under the open sky; half a metre across it is too narrow to walk on.
        let narrow = procedural::shoebox(Vec3::new(0.9, 1.0, 0.5), "concrete");
        assert!(open_space(&scene_of(&mesh), 4).is_ok());
        let text = open_space(&scene_of(&narrow), 4).unwrap_err().to_string();
        assert!(text.contains("TOML"), "{text}");
        assert!(text.contains("room to walk 1.5 m"), "{text}");
    }
}
