//! Sources and the listener: components become sources, clips and poses of the engine, once a frame.

use bevy_asset::{AssetId, Assets};
use bevy_ecs::prelude::*;
use bevy_transform::components::GlobalTransform;
use foresound::{ListenerPose, PlaySettings, SourceId, SourcePose};

use crate::assets::SoundClip;
use crate::components::{ForesoundListener, ForesoundSource};
use crate::coordinates;
use crate::engine::Foresound;

/// A source of the engine.
pub(crate) struct Voice {
    pub(crate) id: SourceId,
    /// The clip that it plays, and whether in a loop.
    plays: Option<(AssetId<SoundClip>, bool)>,
    /// Factor of the pitch: the clip's rate over the engine's.
    rate: f32,
}

impl Voice {
    fn silent(id: SourceId) -> Self {
        Self {
            id,
            plays: None,
            rate: 1.0,
        }
    }
}

/// Adds, configures and removes sources, and starts clips.
pub(crate) fn update(
    mut engine: ResMut<Foresound>,
    clips: Res<Assets<SoundClip>>,
    sources: Query<(Entity, Ref<ForesoundSource>, &GlobalTransform)>,
) {
    let engine = &mut *engine;
    let mut gone = Vec::new();
    engine.voices.retain(|entity, voice| {
        let stays = sources.contains(*entity);
        if !stays {
            gone.push(voice.id);
        }
        stays
    });
    for id in gone {
        if let Err(error) = engine.controller().remove_source(id) {
            engine.problems.report("a source", error);
        }
    }
    engine.poses.clear();
    for (entity, source, transform) in &sources {
        let pose = coordinates::pose(transform);
        let (mut voice, is_new) = match engine.voices.remove(&entity) {
            Some(voice) => (voice, false),
            None => match engine.controller().add_source(pose.position) {
                Ok(id) => (Voice::silent(id), true),
                Err(error) => {
                    engine
                        .problems
                        .report(format_args!("entity {entity}"), error);
                    continue;
                }
            },
        };
        engine.poses.push(SourcePose {
            id: voice.id,
            position: pose.position,
            orientation: pose.orientation,
            settings: source.settings,
        });
        let result = play(engine, &mut voice, &source, &clips, is_new);
        engine.voices.insert(entity, voice);
        if let Err(error) = result {
            engine
                .problems
                .report(format_args!("entity {entity}"), error);
        }
    }
}

fn play(
    engine: &mut Foresound,
    voice: &mut Voice,
    source: &Ref<ForesoundSource>,
    clips: &Assets<SoundClip>,
    is_new: bool,
) -> foresound::Result<()> {
    let wanted = (source.clip.id(), source.is_looped);
    let sound = clips.get(&source.clip);
    let starts = voice.plays != Some(wanted) && sound.is_some();
    if starts && let Some(sound) = sound {
        let controller = engine.controller();
        let settings = PlaySettings {
            is_looped: source.is_looped,
            ..PlaySettings::default()
        };
        let rate_hz = controller.settings().generation.rate_hz;
        controller.play_clip(voice.id, sound.clip.clone(), settings)?;
        voice.plays = Some(wanted);
        voice.rate = sound.rate_hz as f32 / rate_hz as f32;
    } else if voice.plays.is_some_and(|plays| plays != wanted) {
        // The old clip does not play on while the new one loads.
        engine.controller().stop(voice.id)?;
        voice.plays = None;
    }
    if is_new || starts || source.is_changed() {
        let controller = engine.controller();
        controller.set_source_pitch(voice.id, source.pitch * voice.rate)?;
        controller.pause_source(voice.id, source.is_paused)?;
        controller.set_source_gain(voice.id, source.gain)?;
        controller.configure_source(voice.id, source.settings)?;
    }
    Ok(())
}

/// Sends the frame.
pub(crate) fn tick(
    mut engine: ResMut<Foresound>,
    listeners: Query<&GlobalTransform, With<ForesoundListener>>,
) {
    let engine = &mut *engine;
    match listeners.iter().next() {
        Some(transform) => {
            let pose = coordinates::pose(transform);
            engine.listener = ListenerPose {
                position: pose.position,
                orientation: pose.orientation,
            };
        }
        None if !engine.voices.is_empty() => {
            let problem = "no entity has ForesoundListener: put it on the camera";
            engine.problems.report("listener", problem);
        }
        None => {}
    }
    if listeners.iter().len() > 1 {
        let problem = "several entities have ForesoundListener: one of them is taken";
        engine.problems.report("listener", problem);
    }
    let poses = std::mem::take(&mut engine.poses);
    let listener = engine.listener;
    let sent = engine.controller().tick(listener, &poses);
    engine.poses = poses;
    if let Err(error) = sent {
        engine.problems.report("frame", error);
    }
}
