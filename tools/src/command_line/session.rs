//! One offline rendering: sounds looped or played once, moving parts, a moving listener, a sink.

use std::sync::Arc;
use std::time::Duration;

use foresound::Result;
use foresound::generation::Hrtf;
use foresound::propagation::PathSet;
use foresound::runtime::{OfflineRenderer, OfflineReport, OfflineSettings, Poses};
use foresound::scene::{InstanceId, InstancePose, Scene, SourcePose};
use foresound_tools::clip::Clip;
use foresound_tools::listener_path::ListenerPath;

use crate::progress::Progress;

/// A source and its sound.
pub(crate) struct Sound {
    pub(crate) source: SourcePose,
    pub(crate) clip: Clip,
    pub(crate) looped: bool,
    /// Where the source is, if it moves.
    pub(crate) path: Option<ListenerPath>,
}

impl Sound {
    fn at(&self, time_s: f64) -> SourcePose {
        let Some(path) = &self.path else {
            return self.source;
        };
        let pose = path.at(time_s);
        SourcePose {
            position: pose.position,
            orientation: match path.is_oriented() {
                true => pose.orientation,
                false => self.source.orientation,
            },
            ..self.source
        }
    }
}

/// A moving part of the scene, in its own coordinates.
pub(crate) struct MovingPart {
    pub(crate) part: Arc<Scene>,
    /// Position of its origin and its rotation.
    pub(crate) path: ListenerPath,
}

impl MovingPart {
    fn at(&self, id: InstanceId, time_s: f64) -> InstancePose {
        let pose = self.path.at(time_s);
        InstancePose {
            id,
            position: pose.position.as_dvec3(),
            rotation: pose.orientation,
        }
    }
}

/// Inputs of a rendering.
pub(crate) struct Session<'a> {
    pub(crate) what: &'static str,
    pub(crate) scene: &'a Arc<Scene>,
    pub(crate) hrtf: &'a Arc<Hrtf>,
    pub(crate) parts: &'a [MovingPart],
    /// Under the handles of slots 0, 1, 2, …
    pub(crate) sounds: &'a [Sound],
    pub(crate) listener: &'a ListenerPath,
    pub(crate) duration_s: f64,
    pub(crate) settings: OfflineSettings,
}

/// Result of a rendering.
pub(crate) struct Rendered {
    pub(crate) report: OfflineReport,
    /// The update in use in the middle of the rendering.
    pub(crate) middle: PathSet,
}

impl Session<'_> {
    /// Renders into a sink of interleaved stereo. The output ends with a whole graphics frame.
    pub(crate) fn render(&self, sink: &mut dyn FnMut(&[f32]) -> Result<()>) -> Result<Rendered> {
        let mut renderer = OfflineRenderer::new(
            Arc::clone(self.scene),
            Arc::clone(self.hrtf),
            self.settings.clone(),
        )?;
        let mut instances = Vec::with_capacity(self.parts.len());
        for moving in self.parts {
            let pose = moving.at(InstanceId::default(), 0.0);
            let id = renderer.add_instance(Arc::clone(&moving.part), &pose)?;
            instances.push(InstancePose { id, ..pose });
        }
        let frames = (self.duration_s * self.settings.graphics_rate_hz).ceil() as u64;
        let mut progress = Progress::new(self.what, frames);
        let mut poses = Poses::default();
        let mut signal = |slot: usize, from: u64, samples: &mut [f32]| {
            let sound = &self.sounds[slot];
            if sound.looped {
                sound.clip.looped(from as usize, samples);
            } else {
                play_once(&sound.clip.samples, from as usize, samples);
            }
        };
        let mut middle = PathSet::default();
        for frame in 0..frames {
            let time_s = renderer.time_s();
            poses.listener = self.listener.at(time_s);
            poses.sources.clear();
            let sounds = self.sounds.iter();
            poses.sources.extend(sounds.map(|sound| sound.at(time_s)));
            for (instance, moving) in instances.iter_mut().zip(self.parts) {
                *instance = moving.at(instance.id, time_s);
            }
            renderer.set_instance_poses(&instances)?;
            renderer.next_frame(&poses, &mut signal, sink)?;
            if frame == frames / 2 {
                middle = renderer.paths().clone();
            }
            progress.step();
        }
        Ok(Rendered {
            report: renderer.report().clone(),
            middle,
        })
    }
}

fn play_once(clip: &[f32], from: usize, samples: &mut [f32]) {
    let rest = clip.get(from..).unwrap_or_default();
    let count = rest.len().min(samples.len());
    samples[..count].copy_from_slice(&rest[..count]);
    samples[count..].fill(0.0);
}

/// Times in milliseconds.
pub(crate) fn milliseconds(times: &[Duration]) -> Vec<f64> {
    times.iter().map(|time| 1e3 * time.as_secs_f64()).collect()
}

/// The median; 0 of none.
pub(crate) fn median<T: Copy + PartialOrd + Default>(values: &[T]) -> T {
    let mut sorted = values.to_vec();
    sorted.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    sorted.get(sorted.len() / 2).copied().unwrap_or_default()
}
