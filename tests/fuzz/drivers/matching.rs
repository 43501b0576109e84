//! Arbitrary updates through matching, extrapolation and generation: matching finds the paths that are in both updates,
//! nothing panics, and every sample is finite.

use std::sync::Arc;

use foresound::extrapolation::geometric::GeometricSettings;
use foresound::extrapolation::tracking::match_by_id;
use foresound::extrapolation::{Extrapolator, FramePaths, PredictorKind};
use foresound::generation::{Generator, GeneratorSettings, Hrtf};
use foresound::propagation::{LateEnergy, MAX_DIFFRACTION_ORDER, MAX_ORDER, Path, PathId, PathSet};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural,
};
use glam::Vec3;

use super::bytes::Bytes;

thread_local! {
    static ROOM: Arc<Scene> = {
        let mesh = procedural::doorway().mesh;
        let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default());
        Arc::new(scene.expect("a room"))
    };
    static HRTF: Arc<Hrtf> = Arc::new(Hrtf::omnidirectional(16_000).expect("an HRTF set"));
}

/// The index of a surface or an edge: mostly valid, sometimes of another scene or of none.
fn number(bytes: &mut Bytes, most: usize) -> u32 {
    match bytes.byte() {
        255 => bytes.word(),
        tame => u32::from(tame) % most as u32,
    }
}

/// A count of reflections or diffractions, sometimes more than any path has.
fn count(bytes: &mut Bytes, most: usize) -> u8 {
    match bytes.byte() {
        wild @ 250.. => wild,
        tame => tame % (most as u8 + 1),
    }
}

/// A path of another scene, or of none.
fn path(bytes: &mut Bytes, edges: usize) -> Path {
    Path {
        id: PathId(bytes.below(24) as u64),
        source: SourceId::new(bytes.below(5) as u16, 0),
        order: count(bytes, MAX_ORDER),
        diffraction_order: count(bytes, MAX_DIFFRACTION_ORDER),
        surfaces: std::array::from_fn(|_| number(bytes, 12)),
        edges: std::array::from_fn(|_| number(bytes, edges)),
        points: std::array::from_fn(|_| Vec3::from_array(bytes.numbers())),
        image: Vec3::from_array(bytes.numbers()),
        length_m: bytes.number(),
        amplitude: bytes.numbers(),
    }
}

fn update(
    bytes: &mut Bytes,
    edges: usize,
    sources: &[SourcePose],
    listener: ListenerPose,
) -> PathSet {
    let mut paths: Vec<Path> = (0..bytes.below(24)).map(|_| path(bytes, edges)).collect();
    // An update is sorted; identifiers may occur twice.
    paths.sort_by_key(|path| path.id);
    let mut nearby: Vec<Path> = (0..bytes.below(6)).map(|_| path(bytes, edges)).collect();
    nearby.sort_by_key(|path| path.id);
    let direct_edges = (0..bytes.below(6))
        .map(|_| {
            (
                SourceId::new(bytes.below(5) as u16, 0),
                number(bytes, edges),
            )
        })
        .collect();
    let late = (0..bytes.below(4)).map(|slot| LateEnergy {
        energy: std::array::from_fn(|_| std::array::from_fn(|_| bytes.numbers())),
        start_s: bytes.number(),
        mean_free_time_s: bytes.number(),
        ..LateEnergy::silent(SourceId::new(slot as u16, 0))
    });
    PathSet {
        late: late.collect(),
        listener,
        sources: sources.to_vec(),
        paths,
        nearby,
        direct_edges,
        ..PathSet::default()
    }
}

/// Updates, poses and blocks in any order.
pub(crate) fn matching(data: &[u8]) {
    let mut bytes = Bytes(data);
    let kinds = [
        PredictorKind::Hold,
        PredictorKind::Linear,
        PredictorKind::Geometric(GeometricSettings::FULL),
    ];
    let kind = kinds[bytes.below(3)];
    let scene = ROOM.with(Arc::clone);
    let edges = scene.edges().len();
    let mut extrapolator = Extrapolator::new(scene, kind, 0.3);
    let settings = GeneratorSettings {
        rate_hz: 16_000,
        max_sources: 4,
        max_voices: 16,
        fine_voices: 4,
        max_delay_s: 0.05,
        late: true,
        limiter: bytes.byte() & 1 == 0,
        ..GeneratorSettings::default()
    };
    let mut generator = Generator::new(settings, HRTF.with(Arc::clone)).expect("settings");
    let mut frame = FramePaths::default();
    let mut matches = Vec::new();
    for _ in 0..8 {
        if bytes.is_empty() {
            break;
        }
        let sources: Vec<SourcePose> = (0..bytes.below(4) as u16)
            .map(|slot| SourcePose::at(SourceId::new(slot, 0), Vec3::from_array(bytes.numbers())))
            .collect();
        let listener = ListenerPose::facing(Vec3::from_array(bytes.numbers()), bytes.number());
        let next = update(&mut bytes, edges, &sources, listener);
        let before = &extrapolator.current().paths;
        match_by_id(&next.paths, before, &mut matches);
        assert_eq!(matches.len(), next.paths.len());
        for (path, found) in next.paths.iter().zip(&matches) {
            let first = before.iter().position(|old| old.id == path.id);
            assert_eq!(found.map(|at| at as usize), first, "{:?}", path.id);
        }
        drop(extrapolator.store_update(next, u32::from(bytes.byte())));
        for _ in 0..2 {
            extrapolator.frame(&listener, &sources, &mut frame);
            generator.set_frame(&frame, u32::from(bytes.byte()));
            let inputs: [[f32; 40]; 3] = std::array::from_fn(|_| [bytes.number(); 40]);
            let mut block = [0.0; 80];
            generator.render(&[&inputs[0], &inputs[1], &inputs[2]], &mut block);
            assert!(block.iter().all(|sample| sample.is_finite()), "{block:?}");
        }
    }
}
