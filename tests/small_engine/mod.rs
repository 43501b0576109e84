//! An engine without a scene, limiter and late reverb, on a fixed clock: what goes in comes out.
#![allow(dead_code, reason = "each test uses a part")]

use std::sync::Arc;

use foresound::Hrtf;
use foresound::runtime::{
    AffinityPolicy, Controller, Engine, EngineSchedule, EngineSettings, FrameTime, Renderer,
};
use foresound::scene::ListenerPose;

pub(crate) const RATE_HZ: u32 = 44_100;
/// Audio frames of a graphics frame.
pub(crate) const BLOCK: usize = 735;

/// Four slots; ears without a head.
pub(crate) fn engine() -> (Controller, Renderer) {
    engine_with(|_| ())
}

/// [`engine`] with other settings.
pub(crate) fn engine_with(change: impl FnOnce(&mut EngineSettings)) -> (Controller, Renderer) {
    let mut settings = EngineSettings::default();
    settings.generation.max_sources = 4;
    settings.generation.limiter = false;
    settings.generation.late = false;
    settings.generation.max_delay_s = 0.2;
    settings.propagation.guide_rays = 16;
    settings.propagation.source_rays = 16;
    settings.schedule = EngineSchedule::Synchronous;
    settings.affinity = AffinityPolicy::System;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    settings.hrtf = Some(Arc::new(Hrtf::omnidirectional(RATE_HZ).expect("a set")));
    change(&mut settings);
    Engine::new(settings).expect("an engine")
}

/// Interleaved stereo over graphics frames, for a listener at the origin.
pub(crate) fn run(controller: &mut Controller, renderer: &mut Renderer, frames: usize) -> Vec<f32> {
    let mut heard = Vec::new();
    let mut block = [0.0; 2 * BLOCK];
    for _ in 0..frames {
        controller
            .tick(ListenerPose::default(), &[])
            .expect("a good pose");
        renderer.render(&mut block);
        heard.extend(block);
    }
    heard
}
