//! Another scene while sound runs, in the same and in neighbouring graphics frames as another layout: nothing clicks.

use std::sync::Arc;

use foresound::generation::Layout;
use foresound::runtime::{EngineSchedule, EngineSettings, VirtualClock, VirtualEngine};
use foresound::scene::procedural::{BenchmarkScene, concert_hall, doorway};
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose};
use foresound_tools::clicks::{ClickDetector, smooth_loop};

const RATE_HZ: u32 = 44_100;
const GRAPHICS_RATE_HZ: f64 = 60.0;
const SOURCES: usize = 4;

/// Graphics frames from one change of scene to the next, and changes of a run.
const PERIOD: i64 = 30;
const CHANGES: i64 = 6;

/// Two scenes whose decays differ.
struct Scenes {
    scenes: [BenchmarkScene; 2],
    committed: [Arc<Scene>; 2],
}

impl Scenes {
    fn new() -> Self {
        let scenes = [concert_hall(), doorway()];
        let table = MaterialTable::built_in();
        let commit = |scene: &BenchmarkScene| {
            let scene = Scene::commit(&scene.mesh, &table, &SceneSettings::default());
            Arc::new(scene.expect("commits"))
        };
        Self {
            committed: scenes.each_ref().map(commit),
            scenes,
        }
    }
}

/// Sound of a walk in two scenes by turns. `layout_change` graphics frames after each change of scene comes another layout,
/// if there is one.
fn heard(both: &Scenes, channels: usize, layout_change: Option<i64>) -> ClickDetector {
    let Scenes { scenes, committed } = both;
    let mut settings = EngineSettings::default();
    settings.generation.max_sources = SOURCES;
    settings.generation.channels = Some(channels);
    settings.schedule = EngineSchedule::Asynchronous;
    let clock = VirtualClock::at_level(GRAPHICS_RATE_HZ, 3);
    let mut engine = VirtualEngine::new(settings, clock).expect("settings");
    let controller = engine.controller();
    controller
        .set_scene(Arc::clone(&committed[0]))
        .expect("a scene");
    let clip: Arc<[f32]> = smooth_loop(RATE_HZ).into();
    let ids: Vec<SourceId> = (0..SOURCES)
        .map(|n| {
            let id = controller.add_source(scenes[0].sources[n].1);
            let id = id.expect("a slot");
            let clip = Arc::clone(&clip);
            controller.play(id, clip, true).expect("is there");
            id
        })
        .collect();
    let layouts: Vec<Layout> = Layout::ALL
        .into_iter()
        .filter(|layout| layout.channels() <= channels)
        .collect();
    let mut detector = ClickDetector::with_channels(RATE_HZ, channels);
    let (mut scene, mut layout) = (0, 0);
    for frame in 0..CHANGES * PERIOD {
        let controller = engine.controller();
        if frame % PERIOD == PERIOD / 2 {
            scene = 1 - scene;
            let next = Arc::clone(&committed[scene]);
            controller.set_scene(next).expect("a scene");
        }
        if layout_change.is_some_and(|after| (frame - after) % PERIOD == PERIOD / 2) {
            layout += 1;
            let next = layouts[layout % layouts.len()];
            controller.set_layout(next).expect("fits");
        }
        let time_s = frame as f32 / GRAPHICS_RATE_HZ as f32;
        let walk = scenes[scene].walk;
        let position = walk.from.lerp(walk.to, 0.3 + 0.02 * time_s);
        let poses = ids.iter().zip(&scenes[scene].sources);
        let poses: Vec<SourcePose> = poses
            .map(|(id, (_, at))| SourcePose::at(*id, *at))
            .collect();
        let listener = ListenerPose::facing(position, 0.5 * time_s);
        engine
            .next_frame(listener, &poses, |block| detector.push(block))
            .expect("poses");
    }
    detector
}

#[test]
fn another_scene_does_not_click() {
    let both = Scenes::new();
    // Another scene's first update arrives after one to four graphics frames.
    let cases = [(2, None), (16, Some(0)), (16, Some(1)), (16, Some(4))];
    for (channels, layout_change) in cases {
        let detector = heard(&both, channels, layout_change);
        let worst = detector.worst();
        println!("{channels} channels, layout {layout_change:?}: worst {worst:.3}");
        assert!(detector.peak() > 0.01);
        assert_eq!(detector.clicks(), 0, "{layout_change:?}: worst {worst}");
    }
}
