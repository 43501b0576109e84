//! Numerical robustness end to end: random scenes from a millimetre to ten kilometres, listeners on faces, edges and corners,
//! sources at the listener, non-finite samples. Results are finite and bounded, and energy never exceeds the free field's
//! plus the reflected one.

use std::sync::Arc;

use foresound::acoustics::BANDS;
use foresound::generation::{GeneratorSettings, Hrtf};
use foresound::propagation::diffraction::MAX_DIRECT_EDGES;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::runtime::{
    AffinityPolicy, Engine, EngineSchedule, EngineSettings, FrameTime, Renderer,
};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, TriangleMesh,
    procedural,
};
use glam::Vec3;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const NEAREST_M: f32 = 0.3;

const PROPAGATION: PropagationSettings = PropagationSettings {
    guide_rays: 64,
    source_rays: 32,
    depth: 4,
    seed: 1,
    cache_updates: 16,
    cache_capacity: 256,
    min_distance_m: NEAREST_M,
    diffraction_order: 2,
};

fn commit(mesh: &TriangleMesh) -> Option<Arc<Scene>> {
    let table = MaterialTable::built_in();
    let scene = Scene::commit(mesh, &table, &SceneSettings::default());
    scene.ok().map(Arc::new)
}

/// Loose triangles and, in two of three cases, a room around them, all of one size.
fn scene_of(size_m: f32, soup: &[[Vec3; 3]], has_room: bool) -> TriangleMesh {
    let mut mesh = if has_room {
        procedural::shoebox(Vec3::splat(2.0 * size_m), "concrete")
    } else {
        TriangleMesh::default()
    };
    for vertex in &mut mesh.vertices {
        *vertex -= Vec3::splat(size_m);
    }
    let material = mesh.material("brick");
    for triangle in soup {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(triangle.map(|corner| corner * size_m));
        mesh.triangles.push([first, first + 1, first + 2]);
        mesh.triangle_materials.push(material);
    }
    mesh
}

/// Degenerate positions: a corner, the middle of a side, of a face, and a step inside and outside of it.
fn odd_positions(mesh: &TriangleMesh, number: usize) -> [Vec3; 5] {
    let triangle = mesh.triangles[number % mesh.triangles.len()];
    let [a, b, c] = triangle.map(|i| mesh.vertices[i as usize]);
    let middle = (a + b + c) / 3.0;
    let step = 1e-4 * (b - a).cross(c - a).normalize_or_zero();
    [a, (a + b) / 2.0, middle, middle + step, middle - step]
}

fn update(scene: &Arc<Scene>, listener: Vec3, sources: &[Vec3]) -> PathSet {
    let mut propagator = Propagator::new(Arc::clone(scene), PROPAGATION).expect("settings");
    let poses: Vec<SourcePose> = (0..)
        .zip(sources)
        .map(|(slot, &position)| SourcePose::at(SourceId::new(slot, 0), position))
        .collect();
    let mut set = PathSet::default();
    for _ in 0..2 {
        propagator.update(&ListenerPose::facing(listener, 0.0), &poses, 0.0, &mut set);
    }
    set
}

/// A reflected path has at most the amplitude of the free field over its length. The direct path includes the waves diffracted
/// at edges near it, up to half a free field each. A diffracted path has at most the amplitude of the direct path at the
/// least distance.
fn check_paths(set: &PathSet) -> Result<(), TestCaseError> {
    for path in &set.paths {
        prop_assert!(
            path.length_m.is_finite() && path.length_m >= 0.0,
            "{path:?}"
        );
        prop_assert!(path.image.is_finite(), "{path:?}");
        let free = 1.0 / path.length_m.max(NEAREST_M);
        // Amplitudes are single precision.
        let most = 1.0001
            * match (path.order, path.diffraction_order) {
                (0, 0) => (1.0 + 0.5 * MAX_DIRECT_EDGES as f32) * free,
                (_, 0) => free,
                _ => 1.0 / NEAREST_M,
            };
        for band in path.amplitude {
            prop_assert!(band.abs() <= most, "{band} above {most}: {path:?}");
        }
    }
    for late in &set.late {
        for number in late.energy.as_flattened().as_flattened() {
            prop_assert!(number.is_finite() && *number >= 0.0, "{late:?}");
        }
        prop_assert!(late.start_s.is_finite() && late.mean_free_time_s.is_finite());
    }
    Ok(())
}

fn engine(schedule: EngineSchedule) -> EngineSettings {
    let mut settings = EngineSettings::default();
    settings.generation = GeneratorSettings::default();
    settings.generation.rate_hz = 16_000;
    settings.generation.max_sources = 4;
    settings.generation.max_voices = 64;
    settings.generation.fine_voices = 16;
    settings.generation.max_delay_s = 0.1;
    settings.hrtf = Some(Arc::new(Hrtf::omnidirectional(16_000).expect("an HRTF")));
    settings.propagation = PROPAGATION;
    settings.schedule = schedule;
    settings.block_frames = 64;
    settings.max_paths = 128;
    settings.affinity = AffinityPolicy::System;
    settings.frame_time = FrameTime::Fixed(0.01);
    settings
}

/// Renders and checks a block; returns its peak.
fn render(renderer: &mut Renderer) -> f32 {
    let mut block = [f32::NAN; 320];
    renderer.render(&mut block);
    assert!(
        block.iter().all(|s| s.is_finite() && s.abs() <= 1.0),
        "{block:?}"
    );
    block.iter().fold(0.0, |most, s| most.max(s.abs()))
}

fn position() -> impl Strategy<Value = Vec3> {
    (-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

/// Triangles, some of them on a grid: they touch, coincide or have no area.
fn soup() -> impl Strategy<Value = Vec<[Vec3; 3]>> {
    let corner = prop_oneof![
        position(),
        (-2i8..3, -2i8..3, -2i8..3)
            .prop_map(|(x, y, z)| Vec3::new(x.into(), y.into(), z.into()) / 2.0),
    ]
    .boxed();
    prop::collection::vec([corner.clone(), corner.clone(), corner], 1..24)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, rng_seed: RngSeed::Fixed(7), ..ProptestConfig::default() })]

    #[test]
    fn paths_are_finite_and_bounded_anywhere(
        soup in soup(),
        // From a millimetre to ten kilometres across.
        exponent in -3.3f32..3.7,
        has_room in any::<bool>(),
        (a, b) in (position(), position()),
        number in any::<prop::sample::Index>(),
    ) {
        let size_m = 10f32.powf(exponent);
        let mesh = scene_of(size_m, &soup, has_room);
        let Some(scene) = commit(&mesh) else { return Ok(()) };
        let odd = odd_positions(&mesh, number.index(mesh.triangles.len()));
        let (a, b) = (size_m * a, size_m * b);
        for listener in odd.into_iter().chain([a]) {
            // One source at the listener, one on a surface, one at a random position.
            check_paths(&update(&scene, listener, &[listener, odd[2], b]))?;
        }
    }

    #[test]
    fn every_sample_is_finite_in_any_scene(
        soup in soup(),
        exponent in -3.3f32..3.7,
        (a, b) in (position(), position()),
        number in any::<prop::sample::Index>(),
        best in any::<bool>(),
    ) {
        let size_m = 10f32.powf(exponent);
        let mesh = scene_of(size_m, &soup, true);
        let Some(scene) = commit(&mesh) else { return Ok(()) };
        let odd = odd_positions(&mesh, number.index(mesh.triangles.len()));
        let mut settings = engine(EngineSchedule::Synchronous);
        if best {
            settings.predictor = foresound::extrapolation::PredictorKind::ALL[2];
        }
        let (mut controller, mut renderer) = Engine::new(settings).expect("an engine");
        controller.set_scene(scene).expect("taken");
        let clip: Arc<[f32]> = (0..500).map(|n| if n % 7 == 0 { 1.0 } else { -0.5 }).collect();
        for position in [size_m * a, odd[0], odd[2]] {
            let id = controller.add_source(position).expect("a position");
            controller.play(id, Arc::clone(&clip), true).expect("is there");
        }
        for (step, position) in odd.into_iter().chain([size_m * b, odd[0]]).enumerate() {
            controller.tick(ListenerPose::facing(position, step as f32), &[]).expect("a position");
            render(&mut renderer);
        }
    }

    /// In a closed room the energy of discrete paths and late field is at most the free field plus four times the
    /// reverberant energy of Sabine's balance; the factor covers the variation of single rooms.
    #[test]
    fn a_rooms_energy_is_bounded(
        (x, y, z) in (2.0f32..20.0, 2.0f32..8.0, 2.0f32..20.0),
        (a, b) in (position(), position()),
        material in prop_oneof![Just("concrete"), Just("brick"), Just("acoustic_ceiling")],
    ) {
        let size = Vec3::new(x, y, z);
        let mesh = procedural::shoebox(size, material);
        let scene = commit(&mesh).expect("a room");
        let inside = |p: Vec3| size * (0.5 + 0.45 * p);
        let (source, listener) = (inside(a), inside(b));
        let set = update(&scene, listener, &[source]);
        check_paths(&set)?;
        let table = MaterialTable::built_in();
        let absorption = table.get(material).expect("is built in").material.absorption;
        let area_m2 = 2.0 * (x * y + y * z + z * x);
        let free = 1.0 / source.distance(listener).max(NEAREST_M).powi(2);
        for band in 0..BANDS {
            let discrete: f32 = set.paths.iter().map(|p| p.amplitude[band].powi(2)).sum();
            let late = set.late[0].total()[band];
            let reverberant = 16.0 * std::f32::consts::PI / (area_m2 * absorption[band]);
            let most = free + 4.0 * reverberant;
            prop_assert!(discrete + late <= most, "band {band}: {discrete} + {late} > {most}");
        }
    }
}

/// A non-finite sample in a clip or stream is silent at the device and has no later effect.
#[test]
fn no_nan_reaches_the_device() {
    let poisons = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1e30];
    for schedule in [EngineSchedule::Synchronous, EngineSchedule::Asynchronous] {
        for poison in poisons {
            let (mut controller, mut renderer) = Engine::new(engine(schedule)).expect("an engine");
            let scene = commit(&procedural::shoebox(Vec3::new(6.0, 3.0, 5.0), "concrete"));
            controller.set_scene(scene.expect("a room")).expect("taken");
            let listener = ListenerPose::facing(Vec3::new(3.0, 1.5, 2.0), 0.0);
            let good: Arc<[f32]> = (0..400).map(|n| 0.2 * (0.2 * n as f32).sin()).collect();
            let bad: Arc<[f32]> = good
                .iter()
                .enumerate()
                .map(|(n, &s)| if n % 5 == 0 { poison } else { s })
                .collect();
            let positions = [
                Vec3::ONE,
                Vec3::new(4.0, 1.0, 2.0),
                Vec3::new(2.0, 2.0, 4.0),
            ];
            let [a, b, c] =
                positions.map(|position| controller.add_source(position).expect("a position"));
            controller.play(a, bad, true).expect("is there");
            controller.play(c, Arc::clone(&good), true).expect("there");
            let mut stream = controller.stream(b, 400).expect("is there");
            let mut loudest = 0.0f32;
            for _ in 0..60 {
                stream.write(&[poison; 100]);
                controller.tick(listener, &[]).expect("a good pose");
                loudest = loudest.max(render(&mut renderer));
            }
            assert!(loudest > 0.0, "the good source is audible beside {poison}");
            // After the bad sources have stopped all blocks are valid.
            controller.stop(a).expect("is there");
            controller.stop(b).expect("is there");
            for _ in 0..60 {
                controller.tick(listener, &[]).expect("a good pose");
                render(&mut renderer);
            }
        }
    }
}
