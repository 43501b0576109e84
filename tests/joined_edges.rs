//! Second-order diffraction over an edge of an instance and one of another part: a half-open door and its frame.

mod parts;

use foresound::propagation::diffraction::{
    DiffractionSequence, MAX_TWO_EDGE_PATHS, direct_field, no_limits,
};
use foresound::propagation::endpoints::Endpoints;
use foresound::propagation::{EdgeLimits, Path, PathSet, PropagationSettings, Propagator};
use foresound::runtime::Threads;
use foresound::scene::{InstanceId, InstancePose, ListenerPose, Scene, SourcePose, procedural};
use glam::{DVec3, Quat, Vec2, Vec3};
use parts::*;

/// Few rays: paths over two edges do not depend on them.
fn settings(diffraction_order: usize) -> PropagationSettings {
    PropagationSettings {
        // All surfaces of single reflections are found at once: an edge continues those alone that are not.
        guide_rays: 1024,
        // The late field is not compared.
        source_rays: 4,
        depth: 1,
        diffraction_order,
        ..PropagationSettings::default()
    }
}

/// Whether a path has edges of two instances, or of an instance and the fixed scene.
fn crosses_parts(path: &Path) -> bool {
    let of = |edge: u32| if moves(&edge) { edge >> 19 } else { 0 };
    path.diffraction_order == 2 && of(path.edges[0]) != of(path.edges[1])
}

/// Indices of all edges: the fixed scene's, then the instances'.
fn edges_of(scene: &Scene) -> Vec<u32> {
    let fixed = 0..scene.edges().len() as u32;
    let parts = scene.instance_poses().flat_map(|pose| {
        let part = scene.instance_part(pose.id).expect("is there");
        let first = 1 << 31 | (pose.id.slot() as u32) << 19;
        first..first + part.edges().len() as u32
    });
    fixed.chain(parts).collect()
}

/// All paths over two edges, loudest first, by trying every ordered pair of a scene's edges. Beside the visible direct path they
/// are masked in part, and all fade towards the energy of the loudest one that an update leaves out.
fn two_edge_paths(scene: &Scene, source: &SourcePose, set: &PathSet) -> Vec<Path> {
    let (ear, limits) = (&set.listener, limits_of(set, source));
    let endpoints = Endpoints::of(
        source,
        ear.position,
        f64::from(PropagationSettings::default().min_distance_m),
    );
    let edges = edges_of(scene);
    let all = edges.iter().map(|edge| (*edge, 1.0));
    let share = direct_field(scene, &endpoints, all, no_limits, &mut 0, &mut |_| ()).two_edge_share;
    let pairs = edges
        .iter()
        .flat_map(|&a| edges.iter().map(move |&b| [a, b]));
    let path_over = |edges: [u32; 2]| {
        let path = DiffractionSequence::TwoEdges(edges).between(scene, &endpoints)?;
        let mut audible = path.ranked_path(scene, &endpoints, false, &limits)?;
        audible.amplitude = audible.amplitude.map(|value| value * share);
        let is_heard = share > 0.0 && path.is_unoccluded(scene, &endpoints, &mut 0);
        is_heard.then_some(audible)
    };
    let mut paths: Vec<Path> = pairs
        .filter(|[a, b]| a != b)
        .filter_map(path_over)
        .collect();
    paths.sort_by(|a, b| energy(b).total_cmp(&energy(a)));
    paths
}

/// [`PathSet::edge_limits`] of a source.
fn limits_of(set: &PathSet, source: &SourcePose) -> EdgeLimits {
    let mut limits = set.edge_limits.iter();
    limits
        .find(|limits| limits.0 == source.id)
        .expect("is there")
        .1
}

fn energy(path: &Path) -> f32 {
    path.amplitude.iter().map(|a| a * a).sum()
}

/// Counts of compared paths over two edges.
#[derive(Debug, Default)]
struct TwoEdgeCounts {
    /// The loudest paths, as many as an update emits.
    loudest: usize,
    /// How many of them the moving scene and the committed one have found.
    moving: usize,
    committed: usize,
    /// How many of them have edges of two parts, and how many of these the moving scene has found.
    joined: usize,
    found: usize,
}

impl TwoEdgeCounts {
    /// Compares an update in a scene with moving parts to one in a scene committed with them at the same poses. A committed
    /// scene has the nearest pairs of edges only, so the moving scene may find more, and emits them instead of quieter
    /// ones: all exist, and it misses a path only if it has as many louder ones as an update emits.
    fn compare(
        &mut self,
        (found, moving): (&PathSet, &Scene),
        (expected, committed): (&PathSet, &Scene),
        what: &str,
    ) {
        for source in &found.sources {
            let own = |path: &&Path| path.diffraction_order == 2 && path.source == source.id;
            let own =
                |set: &PathSet| -> Vec<Path> { set.paths.iter().filter(own).copied().collect() };
            let (heard, expected) = (own(found), own(expected));
            if heard.is_empty() && expected.is_empty() {
                continue;
            }
            let all = two_edge_paths(committed, source, found);
            let wrong = without(&heard, &all);
            assert!(wrong.is_empty(), "{what}: adds {wrong:#?}");
            // The committed scene leaves out other paths, so its weights differ: those of the moving scene are compared.
            let is_expected = |path: &&Path| expected.iter().any(|e| e.id == path.id);
            let expected: Vec<Path> = all.iter().filter(is_expected).copied().collect();
            let is_heard = |path: &&Path| energy(path) > 0.0;
            let audible: Vec<Path> = expected.iter().filter(is_heard).copied().collect();
            for missing in without(&audible, &heard) {
                let is_louder = |path: &&Path| energy(path) > 0.999 * energy(&missing);
                let louder = heard.iter().filter(is_louder).count();
                assert_eq!(louder, MAX_TWO_EDGE_PATHS, "{what}: misses {missing:#?}");
            }
            let there = two_edge_paths(moving, source, found);
            let loudest = &there[..there.len().min(MAX_TWO_EDGE_PATHS)];
            let joined: Vec<Path> = loudest
                .iter()
                .filter(|p| crosses_parts(p))
                .copied()
                .collect();
            let has = |paths: &[Path], set: &[Path]| paths.len() - without(paths, set).len();
            self.loudest += loudest.len();
            self.moving += has(loudest, &heard);
            self.committed += has(loudest, &expected);
            self.joined += joined.len();
            self.found += has(&joined, &heard);
        }
    }

    /// The moving scene finds 90 % of the loudest with edges of two parts, and of all no fewer than a committed scene.
    fn check(&self, fewest: usize) {
        assert!(self.joined >= fewest, "{self:?}");
        assert!(10 * self.found >= 9 * self.joined, "{self:?}");
        assert!(self.moving >= self.committed, "{self:?}");
    }
}

fn hidden_from_each_other() -> ([SourcePose; 3], [Vec3; 3]) {
    let sources = [
        source(0, Vec3::new(4.8, 1.5, 3.2)),
        source(1, Vec3::new(6.1, 1.2, 1.4)),
        source(2, Vec3::new(5.3, 1.7, 5.1)),
    ];
    let ears = [
        Vec3::new(9.92, 1.65, 1.89),
        Vec3::new(11.3, 1.7, 4.4),
        Vec3::new(10.1, 1.6, 5.2),
    ];
    (sources, ears)
}

fn with_a_door(settings: PropagationSettings) -> (Propagator, InstanceId) {
    let mut rooms = Propagator::new(commit(&rooms()), settings).expect("settings");
    let open = swung(InstanceId::default(), 0.0);
    let id = rooms.scene_mut().add_instance(commit(&door()), &open);
    (rooms, id.expect("a door"))
}

#[test]
fn a_door_and_its_frame_diffract_like_a_scene_committed_with_it() {
    let (sources, ears) = hidden_from_each_other();
    let (mut moving, id) = with_a_door(settings(2));
    let mut counts = TwoEdgeCounts::default();
    let mut set = PathSet::default();
    for step in 0..45 {
        let degrees = 0.3 + 2.0 * step as f32;
        let pose = swung(id, degrees);
        moving.scene_mut().set_instance_pose(&pose).expect("rigid");
        let fresh = commit(&joined(&rooms(), &door(), &pose));
        let mut fresh = Propagator::new(fresh, settings(2)).expect("settings");
        for position in ears {
            let ear = ear(position + Vec3::X * 0.004 * step as f32);
            let mut expected = PathSet::default();
            moving.update(&ear, &sources, 0.0, &mut set);
            fresh.update(&ear, &sources, 0.0, &mut expected);
            let what = format!("{degrees}°, {position}");
            counts.compare((&set, moving.scene()), (&expected, fresh.scene()), &what);
        }
    }
    counts.check(400);
}

#[test]
fn two_parts_diffract_like_a_scene_committed_with_them() {
    let fixed = procedural::shoebox(Vec3::new(9.0, 4.0, 7.0), "concrete");
    let part = block(Vec3::new(-1.1, -1.5, -0.1), Vec3::new(1.1, 0.9, 0.1));
    let mut moving = Propagator::new(commit(&fixed), settings(2)).expect("settings");
    let at = |id, x: f64, degrees: f32| InstancePose {
        id,
        position: DVec3::new(x, 1.55 - 0.03 * x, 3.4),
        rotation: Quat::from_rotation_y(degrees.to_radians()),
    };
    let part_scene = commit(&part);
    let ids = [3.6, 5.4].map(|x| {
        let pose = at(InstanceId::default(), x, 90.0);
        let added = moving.scene_mut().add_instance(part_scene.clone(), &pose);
        added.expect("a screen")
    });
    let sources = [source(0, Vec3::new(1.6, 1.1, 3.3))];
    let (mut counts, mut set) = (TwoEdgeCounts::default(), PathSet::default());
    for step in 0..30 {
        let turned = 2.3 * step as f32;
        let poses = [
            at(ids[0], 3.6, 61.0 + turned),
            at(ids[1], 5.4, 104.0 - turned),
        ];
        assert_eq!(moving.scene_mut().set_instance_poses(&poses), 2);
        let mesh = joined(&joined(&fixed, &part, &poses[0]), &part, &poses[1]);
        let fresh = commit(&mesh);
        let mut fresh = Propagator::new(fresh, settings(2)).expect("settings");
        let ear = ear(Vec3::new(7.3, 1.2, 3.6 + 0.01 * step as f32));
        let mut expected = PathSet::default();
        moving.update(&ear, &sources, 0.0, &mut set);
        fresh.update(&ear, &sources, 0.0, &mut expected);
        let what = format!("step {step}");
        counts.compare((&set, moving.scene()), (&expected, fresh.scene()), &what);
    }
    counts.check(25);
}

/// Sound pressure of all direct and diffracted paths at the centres of the lowest three bands.
fn pressure(set: &PathSet) -> [Vec2; 3] {
    std::array::from_fn(|band| {
        let wavenumber = std::f32::consts::TAU * [63.0, 125.0, 250.0][band] / 343.0;
        let comes = set
            .paths
            .iter()
            .filter(|p| p.order == 0 || p.diffraction_order > 0);
        comes
            .map(|p| p.amplitude[band] * Vec2::from_angle(-wavenumber * p.length_m))
            .sum()
    })
}

/// Sum of the squared steps of sound pressure.
#[derive(Default)]
struct Restlessness {
    last: Option<[Vec2; 3]>,
    steps: f32,
}

impl Restlessness {
    fn see(&mut self, set: &PathSet) {
        let now = pressure(set);
        if let Some(last) = self.last.replace(now) {
            let step = |(a, b): (&Vec2, &Vec2)| a.distance_squared(*b);
            self.steps += last.iter().zip(&now).map(step).sum::<f32>();
        }
    }
}

#[test]
fn a_swinging_door_is_as_continuous_as_scenes_committed_with_it() {
    let (sources, ears) = hidden_from_each_other();
    for (source, position) in sources.into_iter().zip(ears) {
        let (source, ear) = ([source], ear(position));
        let mut restless: [Restlessness; 3] = Default::default();
        let (mut once, first) = with_a_door(settings(1));
        let (mut twice, second) = with_a_door(settings(2));
        let (mut set, mut before) = (PathSet::default(), PathSet::default());
        let (mut kept, mut all) = (0, 0);
        // The door's farthest corner from the hinge, and the step of its angle. Legs within the door keep their length, and
        // lengths do not depend on where along an edge a path crosses it, so two legs change by the corner's motion at most.
        let most_moved_m = 2.0 * Vec2::new(0.93, 0.08).length() * 0.4f32.to_radians();
        for step in 0..220 {
            let degrees = 0.1 + 0.4 * step as f32;
            let pose = swung(second, degrees);
            let hear =
                |propagator: &mut Propagator, set: &mut PathSet, restless: &mut Restlessness| {
                    propagator.update(&ear, &source, 0.0, set);
                    restless.see(set);
                };
            once.scene_mut()
                .set_instance_pose(&swung(first, degrees))
                .expect("rigid");
            twice.scene_mut().set_instance_pose(&pose).expect("rigid");
            let fresh = commit(&joined(&rooms(), &door(), &pose));
            let mut fresh = Propagator::new(fresh, settings(2)).expect("settings");
            hear(&mut once, &mut set, &mut restless[0]);
            hear(&mut fresh, &mut set, &mut restless[1]);
            hear(&mut twice, &mut set, &mut restless[2]);
            // A path that persists keeps its identity, and moves little.
            for path in before.paths.iter().filter(|path| crosses_parts(path)) {
                if let Some(next) = set.paths.iter().find(|p| p.id == path.id) {
                    assert_eq!(next.edges, path.edges);
                    let moved_m = (next.length_m - path.length_m).abs();
                    assert!(moved_m < most_moved_m, "{degrees}°: {moved_m} m");
                }
                let goes_on = |p: &&Path| p.diffraction_order == 2 && p.edges == path.edges;
                if let Some(next) = set.paths.iter().find(goes_on) {
                    all += 1;
                    kept += usize::from(next.id == path.id);
                }
            }
            std::mem::swap(&mut before, &mut set);
        }
        let [once, committed, moving] = restless.map(|r| r.steps);
        assert!(all > 100 && kept == all, "{kept} of {all} kept their names");
        assert!(
            moving < 1.1 * committed.max(once),
            "{moving} {committed} {once}"
        );
    }
}

#[test]
fn the_number_of_threads_changes_no_bit_of_paths_around_a_door() {
    let (sources, ears) = hidden_from_each_other();
    let run = |count: usize| {
        let threads = Threads::start(count).expect("threads start");
        let (mut rooms, id) = with_a_door(settings(2));
        let hear = |step: usize| {
            let pose = swung(id, 7.0 * step as f32);
            rooms.scene_mut().set_instance_pose(&pose).expect("rigid");
            let mut set = PathSet::default();
            let ear: ListenerPose = ear(ears[step % 3]);
            rooms.update_with(&threads, &ear, &sources, 0.0, &mut set);
            set
        };
        (0..13).map(hear).collect::<Vec<_>>()
    };
    let one = run(1);
    let joined = one
        .iter()
        .flat_map(|set| &set.paths)
        .filter(|p| crosses_parts(p));
    assert!(joined.count() > 20);
    for count in [2, 3] {
        assert_eq!(one, run(count), "{count} threads");
    }
}

/// Between updates extrapolation recomputes a path at the door's current pose: the result is the update's.
#[test]
fn a_revalidated_path_equals_the_update_s() {
    let (sources, ears) = hidden_from_each_other();
    let min_distance_m = f64::from(settings(2).min_distance_m);
    let (mut rooms, id) = with_a_door(settings(2));
    let (mut before, mut set) = (PathSet::default(), PathSet::default());
    let mut followed = 0;
    for step in 0..60 {
        let pose = swung(id, 5.0 + 0.5 * step as f32);
        rooms.scene_mut().set_instance_pose(&pose).expect("rigid");
        let ear = ear(ears[0]);
        rooms.update(&ear, &sources, 0.0, &mut set);
        for path in before.paths.iter().filter(|path| crosses_parts(path)) {
            let Some(now) = set.paths.iter().find(|p| p.id == path.id) else {
                continue;
            };
            let source = sources.iter().find(|s| s.id == path.source).expect("one");
            let endpoints = Endpoints::of(source, ear.position, min_distance_m);
            let sequence = DiffractionSequence::of(rooms.scene(), path).expect("two edges");
            let revalidated = sequence.between(rooms.scene(), &endpoints).expect("a path");
            assert!(revalidated.is_unoccluded(rooms.scene(), &endpoints, &mut 0));
            let limits = limits_of(&set, source);
            let path = revalidated.ranked_path(rooms.scene(), &endpoints, false, &limits);
            assert_eq!(path.as_ref(), Some(now));
            followed += 1;
        }
        std::mem::swap(&mut before, &mut set);
    }
    assert!(followed > 100, "{followed}");
}

#[test]
fn paths_are_reciprocal_between_source_and_listener() {
    let (sources, ears) = hidden_from_each_other();
    let (mut rooms, id) = with_a_door(settings(2));
    let (mut there, mut back) = (PathSet::default(), PathSet::default());
    let mut compared = 0;
    for step in 0..24 {
        let pose = swung(id, 1.0 + 3.7 * step as f32);
        rooms.scene_mut().set_instance_pose(&pose).expect("rigid");
        for (from, to) in sources.iter().zip(ears) {
            rooms.update(&ear(to), &[*from], 0.0, &mut there);
            rooms.update(&ear(from.position), &[source(0, to)], 0.0, &mut back);
            for path in there.paths.iter().filter(|path| crosses_parts(path)) {
                let returning = back.paths.iter().filter(|p| p.diffraction_order == 2);
                let is_back =
                    |p: &&Path| p.edges[0] == path.edges[1] && p.edges[1] == path.edges[0];
                match returning.clone().find(is_back) {
                    Some(other) => {
                        assert!((other.length_m - path.length_m).abs() < 1e-4);
                        let loudest = energy(path).sqrt();
                        for (a, b) in path.amplitude.iter().zip(other.amplitude) {
                            assert!((a - b).abs() < 1e-3 * loudest, "{path:?} {other:?}");
                        }
                        compared += 1;
                    }
                    // Paths over edges of one part are found from one end only, and may be louder.
                    None => {
                        let louder = returning.filter(|p| energy(p) > 0.999 * energy(path));
                        assert_eq!(louder.count(), MAX_TWO_EDGE_PATHS, "{path:?}");
                    }
                }
            }
        }
    }
    assert!(compared > 60, "{compared}");
}
