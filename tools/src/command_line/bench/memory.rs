//! `bench memory`: resident memory of a scene and of an engine in it.

use std::path::Path;
use std::sync::Arc;

use foresound::Result;
use foresound::propagation::rays::directions::{mix, unit};
use foresound::runtime::{AffinityPolicy, Engine, EngineSchedule, EngineSettings};
use foresound::scene::ListenerPose;
use serde_json::json;

use super::sources::sources;
use crate::inputs::{SceneArguments, load_scene};
use crate::memory_use::{resident_files_mb, resident_mb};
use crate::printed;

/// Graphics frames after which all buffers have been used.
const FRAMES: usize = 120;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Benchmark scene by name, or a file.
    #[arg(long, default_value = "concert_hall")]
    scene: String,
    /// Number of sources.
    #[arg(long, default_value_t = 16)]
    sources: usize,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let loaded = load_scene(Path::new(&arguments.scene), &SceneArguments::default())?;
    let scene = Arc::clone(&loaded.scene);
    let poses = sources(&scene, &loaded.sources(), arguments.sources);
    let standing = loaded.walk().map(|walk| walk.standing);
    let (before_mb, files_before_mb) = (resident_mb(), resident_files_mb());
    let mut settings = EngineSettings::default();
    settings.generation.max_sources = arguments.sources;
    settings.schedule = EngineSchedule::Synchronous;
    settings.affinity = AffinityPolicy::System;
    let (mut controller, mut renderer) = Engine::new(settings)?;
    let made_mb = resident_mb();
    controller.set_scene(Arc::clone(&scene))?;
    // A clip of one second, shared.
    let clip: Arc<[f32]> = (0..44_100).map(|n| 0.1 * unit(mix(n))).collect();
    for pose in &poses {
        let id = controller.add_source(pose.position)?;
        controller.play(id, Arc::clone(&clip), true)?;
    }
    let listener = ListenerPose::facing(standing.unwrap_or_default(), 0.0);
    let mut block = [0.0; 2 * 735];
    for _ in 0..FRAMES {
        controller.tick(listener, &[])?;
        renderer.render(&mut block);
    }
    let (after_mb, files_after_mb) = (resident_mb(), resident_files_mb());
    let row = json!({
        "scene": arguments.scene,
        "sources": poses.len(),
        "paths": controller.statistics().paths,
        "program_and_scene_mb": before_mb,
        "engine_made_mb": made_mb - before_mb,
        "engine_mb": after_mb - before_mb,
        "of_which_program_mb": files_after_mb - files_before_mb,
    });
    printed::rows(&[row], arguments.json);
    Ok(())
}
