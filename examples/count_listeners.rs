//! An engine in a room with one to four listeners, for counters of instructions.
//!
//! `count_listeners LISTENERS SOURCES FRAMES [walk]`: each listener walks its own way, and with `walk` so do the sources. In the
//! synchronous schedule every graphics frame has an update, an extrapolation and 735 audio frames of every listener, all on one
//! thread: `valgrind --tool=callgrind --toggle-collect='*::frame'` counts the frames after the first ones.

use std::sync::Arc;

use foresound::glam::Vec3;
use foresound::{
    AffinityPolicy, Controller, Engine, EngineSchedule, EngineSettings, FrameTime, ListenerPose,
    MaterialTable, Renderer, Scene, SceneSettings, SourcePose, shoebox,
};

/// Graphics frames before the walk: rays of all rotations, and voices.
const LEAD_IN_FRAMES: usize = 20;
/// Audio frames of a graphics frame at 60 Hz.
const BLOCK: usize = 735;
const WALK_M_S: f32 = 1.4;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [listeners, sources, frames, rest @ ..] = arguments.as_slice() else {
        return Err("arguments: LISTENERS SOURCES FRAMES [walk]".into());
    };
    let has_walking_sources = rest.first().is_some_and(|word| word == "walk");
    let (listeners, sources): (usize, usize) = (listeners.parse()?, sources.parse()?);
    let frames: usize = frames.parse()?;
    let mut settings = EngineSettings::default();
    settings.generation.listeners = listeners;
    settings.generation.max_sources = sources;
    settings.schedule = EngineSchedule::Synchronous;
    settings.affinity = AffinityPolicy::System;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    // Every graphics frame is complete in its block, whatever the number of listeners.
    settings.even_blocks = false;
    settings.tracing_threads = 1;
    let (mut controller, mut renderer) = Engine::new(settings)?;
    let size = Vec3::new(12.0, 4.0, 8.0);
    let mesh = shoebox(size, "brick");
    let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())?;
    controller.set_scene(Arc::new(scene))?;
    let clip: Vec<f32> = (0..44_100u32)
        .map(|n| 0.1 * (n as f32 * 0.05).sin())
        .collect();
    let clip: Arc<[f32]> = clip.into();
    let mut places = Vec::new();
    for source in 0..sources {
        let share = (source as f32 + 0.5) / sources as f32;
        let turn = 2.4 * source as f32;
        let offset = 0.8 * share.sqrt() * Vec3::new(turn.cos(), 0.3, turn.sin());
        let at = 0.5 * size * (Vec3::ONE + offset) - 0.2 * Vec3::X;
        let source = controller.add_source(at)?;
        controller.play(source, Arc::clone(&clip), true)?;
        places.push((source, at));
    }
    let mut output = vec![0.0; 2 * BLOCK * listeners];
    for number in 0..LEAD_IN_FRAMES + frames {
        let walked = WALK_M_S * number as f32 / 60.0;
        let pose = |listener: usize| {
            let turn = walked / 2.0 + 1.57 * listener as f32;
            let at = 0.5 * size + 2.0 * Vec3::new(turn.cos(), -0.1, turn.sin());
            ListenerPose::facing(at, turn)
        };
        for listener in 1..listeners {
            controller.set_listener(listener, pose(listener))?;
        }
        let moved: Vec<SourcePose> = match has_walking_sources {
            true => places
                .iter()
                .map(|(id, at)| SourcePose::at(*id, *at + walked * Vec3::X))
                .collect(),
            false => Vec::new(),
        };
        match number < LEAD_IN_FRAMES {
            true => step(&mut controller, &mut renderer, pose(0), &moved, &mut output)?,
            false => frame(&mut controller, &mut renderer, pose(0), &moved, &mut output)?,
        }
    }
    let energy: f32 = output.iter().map(|sample| sample * sample).sum();
    eprintln!("{frames} frames, {listeners} listeners, energy of the last {energy}");
    Ok(())
}

/// A graphics frame. Not inlined: `callgrind --toggle-collect` counts it by name.
#[inline(never)]
fn frame(
    controller: &mut Controller,
    renderer: &mut Renderer,
    listener: ListenerPose,
    sources: &[SourcePose],
    output: &mut [f32],
) -> foresound::Result<()> {
    step(controller, renderer, listener, sources, output)
}

fn step(
    controller: &mut Controller,
    renderer: &mut Renderer,
    listener: ListenerPose,
    sources: &[SourcePose],
    output: &mut [f32],
) -> foresound::Result<()> {
    controller.tick(listener, sources)?;
    renderer.render_listeners(output);
    Ok(())
}
