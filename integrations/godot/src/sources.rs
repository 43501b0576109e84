//! Source nodes as sources of the engine.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use foresound::{Controller, PlaySettings, SourceId, SourcePose, SourceSettings};
use godot::classes::AudioStreamWav;
use godot::classes::audio_stream_wav::Format as WavFormat;
use godot::obj::InstanceId;
use godot::prelude::*;

use crate::clip::{Format, clip};
use crate::coordinates::Pose;
use crate::engine::Problems;
use crate::nodes::ForesoundSource3D;

/// A source of the engine.
struct Voice {
    id: SourceId,
    /// Start and stream that it plays.
    plays: Option<(u32, InstanceId)>,
    rate: f32,
    /// Gain, pitch, pause and place of the last frame.
    last: Option<(f32, f32, bool, bool)>,
}

/// All of them, by node.
#[derive(Default)]
pub(crate) struct Voices {
    voices: BTreeMap<InstanceId, Voice>,
    pub(crate) poses: Vec<SourcePose>,
}

impl Voices {
    pub(crate) fn is_empty(&self) -> bool {
        self.voices.is_empty()
    }

    /// Brings the engine's sources to the state of the nodes that are in the tree.
    pub(crate) fn update(
        &mut self,
        nodes: &[(Gd<ForesoundSource3D>, Pose)],
        controller: &mut Controller,
        problems: &mut Problems,
    ) {
        let is_there = |id: &InstanceId| nodes.iter().any(|(node, _)| node.instance_id() == *id);
        self.voices.retain(|id, voice| {
            let stays = is_there(id);
            if !stays && let Err(error) = controller.remove_source(voice.id) {
                problems.report("a source", &error);
            }
            stays
        });
        self.poses.clear();
        for (node, pose) in nodes {
            let key = node.instance_id();
            if let Err(error) = self.update_one(key, &node.bind(), pose, controller) {
                problems.report(&node.get_name().to_string(), &error);
            }
        }
    }

    fn update_one(
        &mut self,
        key: InstanceId,
        node: &ForesoundSource3D,
        pose: &Pose,
        controller: &mut Controller,
    ) -> Result<(), String> {
        let told = |error: foresound::Error| error.to_string();
        let voice = match self.voices.entry(key) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => entry.insert(Voice {
                id: controller.add_source(pose.position).map_err(told)?,
                plays: None,
                rate: 1.0,
                last: None,
            }),
        };
        let mut settings = SourceSettings::default();
        settings.is_2d = node.without_position;
        self.poses.push(SourcePose {
            id: voice.id,
            position: pose.position,
            orientation: pose.orientation,
            settings,
        });
        let stream = node.stream.as_ref().filter(|_| node.sounds);
        let wanted = stream.map(|stream| (node.starts, stream.instance_id()));
        if wanted != voice.plays {
            voice.plays = wanted;
            voice.last = None;
            match stream {
                Some(stream) => {
                    let (sound, rate_hz) = samples(stream)?;
                    let own_hz = controller.settings().generation.rate_hz;
                    voice.rate = rate_hz as f32 / own_hz as f32;
                    let settings = PlaySettings {
                        is_looped: node.looped,
                        ..PlaySettings::default()
                    };
                    controller
                        .play_clip(voice.id, sound, settings)
                        .map_err(told)?;
                }
                None => controller.stop(voice.id).map_err(told)?,
            }
        }
        let values = (node.gain, node.pitch, node.paused, node.without_position);
        if voice.last != Some(values) {
            voice.last = Some(values);
            let pitch = node.pitch * voice.rate;
            controller
                .set_source_gain(voice.id, node.gain)
                .and_then(|()| controller.set_source_pitch(voice.id, pitch))
                .and_then(|()| controller.pause_source(voice.id, node.paused))
                .and_then(|()| controller.configure_source(voice.id, settings))
                .map_err(told)?;
        }
        Ok(())
    }
}

/// The samples of a stream and their rate in Hz.
fn samples(stream: &Gd<AudioStreamWav>) -> Result<(foresound::Clip, u32), String> {
    let format = match stream.get_format() {
        WavFormat::FORMAT_8_BITS => Format::Eight,
        WavFormat::FORMAT_16_BITS => Format::Sixteen,
        _ => return Err("a compressed sound: import it with the compress mode PCM".into()),
    };
    let rate_hz = u32::try_from(stream.get_mix_rate()).unwrap_or(0);
    let bytes = stream.get_data();
    Ok((clip(bytes.as_slice(), format, stream.is_stereo()), rate_hz))
}
