//! Another measured head while sound runs: read from a SOFA file on a thread of its own, it is heard without a click, and the audio
//! side allocates nothing.

use std::sync::Arc;
use std::thread;

use foresound::runtime::{
    AffinityPolicy, Controller, Engine, EngineSchedule, EngineSettings, FrameTime, Renderer,
};
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, procedural};
use foresound::{Hrtf, Layout};
use glam::Vec3;

#[path = "../tools/src/clicks.rs"]
#[expect(unreachable_pub, dead_code, reason = "the tools' own")]
mod clicks;
#[path = "../tools/src/command_line/counting.rs"]
mod counting;
#[path = "reference/sphere_sofa.rs"]
#[expect(unreachable_pub, reason = "shared by test crates")]
mod sphere_sofa;

use clicks::{ClickDetector, smooth_loop};
use sphere_sofa::{GOOD, RADIUS_S, Sphere};

#[global_allocator]
static ALLOCATOR: counting::Counting = counting::Counting;

const RATE_HZ: u32 = 44_100;
const BLOCK: usize = 735;

fn engine() -> (Controller, Renderer) {
    let mut settings = EngineSettings::default();
    settings.generation.max_sources = 3;
    settings.generation.layout = Layout::Binaural;
    settings.propagation.guide_rays = 128;
    settings.propagation.source_rays = 32;
    settings.schedule = EngineSchedule::Synchronous;
    settings.affinity = AffinityPolicy::System;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    let (mut controller, renderer) = Engine::new(settings).expect("an engine");
    let room = procedural::shoebox(Vec3::new(9.0, 3.0, 6.0), "plaster");
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&room, &table, &SceneSettings::default()).expect("commits");
    controller.set_scene(Arc::new(scene)).expect("accepted");
    let clip: Arc<[f32]> = smooth_loop(RATE_HZ).into();
    for n in 0..3u8 {
        let position = [2.0 + 2.0 * f32::from(n), 1.5, 2.0];
        let id = controller.add_source(position).expect("a slot");
        controller
            .play(id, Arc::clone(&clip), true)
            .expect("is there");
    }
    (controller, renderer)
}

#[test]
fn another_head_is_heard_without_a_click_and_without_allocation() {
    let read = thread::spawn(|| {
        [0.6, 1.5].map(|size| {
            let radius_s = size * RADIUS_S;
            let bytes = Sphere { radius_s, ..GOOD }.bytes();
            Arc::new(Hrtf::from_sofa(&bytes, "sphere.sofa", RATE_HZ).expect("is a set"))
        })
    });
    let [small, large] = read.join().expect("no panic");
    let mut same = engine();
    let mut swapped = engine();
    let mut detector = ClickDetector::new(RATE_HZ);
    let (mut operations, mut swaps) = (0, 0);
    let (mut difference, mut energy) = (0.0f64, 0.0f64);
    for frame in 0..420 {
        // A second apart, and then so near to each other that a change meets the fade of the last.
        let is_due = match frame {
            0..60 => false,
            60..240 => frame % 30 == 0,
            _ => frame % 2 == 0,
        };
        if is_due {
            let sets = [Some(&small), Some(&large), None];
            let set = sets[swaps % 3].map(Arc::clone);
            swapped.0.set_hrtf(set).expect("of this rate");
            swaps += 1;
        }
        let time_s = frame as f32 / 60.0;
        let position = Vec3::new(4.5 + time_s.sin(), 1.7, 4.0);
        let listener = ListenerPose::facing(position, 0.5 * time_s);
        let (mut one, mut other) = ([0.0; 2 * BLOCK], [0.0; 2 * BLOCK]);
        for ((controller, renderer), output) in [(&mut same, &mut one), (&mut swapped, &mut other)]
        {
            controller.tick(listener, &[]).expect("a good pose");
            let before = counting::operations();
            renderer.render(output);
            operations += counting::operations() - before;
        }
        detector.push(&other);
        for (one, other) in one.iter().zip(&other) {
            difference += f64::from(one - other).powi(2);
            energy += f64::from(*one).powi(2);
        }
    }
    println!(
        "{swaps} swaps, worst {}, difference {:.1} dB",
        detector.worst(),
        10.0 * (difference / energy).log10()
    );
    assert_eq!(operations, 0, "allocations and frees on the audio side");
    assert!(swaps > 90 && detector.peak() > 0.01);
    assert_eq!(detector.clicks(), 0, "worst {}", detector.worst());
    // Otherwise no other set was heard.
    assert!(difference > 0.01 * energy, "{difference} of {energy}");
}
