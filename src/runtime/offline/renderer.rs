//! Offline rendering: all stages in turn on a virtual clock. Deterministic to the bit.
//!
//! Control side; the clock is read for the report only.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Quat;

use crate::error::{Error, Result};
use crate::extrapolation::{Extrapolator, FramePaths, PredictorKind};
use crate::generation::{Generator, GeneratorSettings, Hrtf, Layout, OutputStage};
use crate::propagation::{PathSet, PropagationSettings, Propagator};
use crate::runtime::offline::schedule::{Poses, Schedule};
use crate::runtime::offline::scheduled_propagation::ScheduledPropagation;
use crate::runtime::pipeline::line_lengths::LineLengths;
use crate::runtime::threads::clock::thread_processor_time;
use crate::scene::{Scene, SourcePose};

/// Settings of offline rendering; start from [`Default`] and assign fields.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct OfflineSettings {
    /// Graphics frames per second on the virtual clock, 1 to 1,000.
    pub graphics_rate_hz: f64,
    /// Audio frames per block, 32 to 4,096; inaudible.
    pub block_frames: usize,
    /// When propagation runs.
    pub schedule: Schedule,
    /// How paths continue between updates.
    pub predictor: PredictorKind,
    /// Rays, reflection orders, seed.
    pub propagation: PropagationSettings,
    /// Sample rate, layout, source slots, voices, limiter. One listener.
    pub generation: GeneratorSettings,
}

impl Default for OfflineSettings {
    /// 60 graphics frames a second, blocks of 256, a whole propagation in every graphics frame.
    fn default() -> Self {
        Self {
            graphics_rate_hz: 60.0,
            block_frames: 256,
            schedule: Schedule::Synchronous,
            predictor: PredictorKind::default(),
            propagation: PropagationSettings::default(),
            generation: GeneratorSettings::default(),
        }
    }
}

/// Times and counts of a rendering.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct OfflineReport {
    /// Graphics frames rendered.
    pub graphics_frames: u64,
    /// Time of each propagation update (SPS).
    pub propagation: Vec<Duration>,
    /// Processor time of each graphics frame's extrapolation (EPS), including direct paths and taking an update.
    /// Elapsed time on systems without processor time.
    pub extrapolation: Vec<Duration>,
    /// Time of each graphics frame's generation (SGS).
    pub generation: Vec<Duration>,
    /// Rays of each update.
    pub rays: Vec<u64>,
    /// Valid paths in each update.
    pub paths: Vec<usize>,
    /// Paths dropped for lack of a voice, over all blocks.
    pub dropped_paths: u64,
}

/// Renders a moving scene frame by frame, without threads or real time.
///
/// ```
/// use std::sync::Arc;
/// use foresound::offline::{OfflineRenderer, OfflineSettings, Poses};
/// use foresound::glam::Vec3;
/// use foresound::{Hrtf, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, shoebox};
///
/// # fn main() -> foresound::Result<()> {
/// let mesh = shoebox(Vec3::new(6.0, 3.0, 5.0), "brick");
/// let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())?;
/// let hrtf = Arc::new(Hrtf::omnidirectional(44_100)?);
/// let mut renderer = OfflineRenderer::new(Arc::new(scene), hrtf, OfflineSettings::default())?;
/// let mut poses = Poses::default();
/// poses.listener.position = Vec3::new(1.0, 1.7, 1.0);
/// poses.sources.push(SourcePose::at(SourceId::new(0, 0), Vec3::new(4.0, 1.5, 3.0)));
/// let mut sound = Vec::new();
/// let mut silence = |_slot: usize, _from: u64, samples: &mut [f32]| samples.fill(0.0);
/// renderer.next_frame(&poses, &mut silence, &mut |block| {
///     sound.extend_from_slice(block);
///     Ok(())
/// })?;
/// assert_eq!(sound.len(), 2 * 735); // 1/60 s of stereo
/// # Ok(())
/// # }
/// ```
pub struct OfflineRenderer {
    settings: OfflineSettings,
    pub(crate) propagation: ScheduledPropagation,
    pub(crate) extrapolator: Extrapolator,
    generator: Generator,
    line_lengths: LineLengths,
    frame_paths: FramePaths,
    report: OfflineReport,
    frame: u64,
    inputs: Vec<Vec<f32>>,
    output: Vec<f32>,
}

/// Fills mono samples of a source slot, given slot, number of the first sample and buffer.
pub type Signal<'a> = dyn FnMut(usize, u64, &mut [f32]) + 'a;

impl OfflineRenderer {
    /// For a scene and an HRTF set.
    ///
    /// # Errors
    /// [`Error::Setting`] names a setting outside its range, and more listeners than one.
    pub fn new(scene: Arc<Scene>, hrtf: Arc<Hrtf>, settings: OfflineSettings) -> Result<Self> {
        let rate_hz = settings.graphics_rate_hz;
        if !(1.0..=1000.0).contains(&rate_hz) {
            let problem = format!("{rate_hz} Hz is outside 1 to 1000");
            return Err(Error::setting(
                "graphics_rate_hz",
                problem,
                "choose a rate in that range",
            ));
        }
        if !(32..=4096).contains(&settings.block_frames) {
            let problem = format!(
                "{} audio frames is outside 32 to 4096",
                settings.block_frames
            );
            return Err(Error::setting(
                "block_frames",
                problem,
                "choose a size in that range",
            ));
        }
        settings.schedule.check()?;
        let listeners = settings.generation.listeners;
        if listeners > 1 {
            let problem = format!("{listeners} in an offline rendering, which has one");
            let advice = "give 1, and render each listener by a renderer of its own";
            return Err(Error::setting("listeners", problem, advice));
        }
        let propagator = Propagator::new(Arc::clone(&scene), settings.propagation)?;
        let generator = Generator::with_short_lines(settings.generation.clone(), hrtf)?;
        let min_distance_m = settings.propagation.min_distance_m;
        Ok(Self {
            propagation: ScheduledPropagation::new(
                settings.schedule,
                propagator,
                rate_hz,
                settings.predictor,
            ),
            extrapolator: Extrapolator::new(scene, settings.predictor, min_distance_m),
            frame_paths: FramePaths::default(),
            report: OfflineReport::default(),
            frame: 0,
            inputs: vec![vec![0.0; settings.block_frames]; settings.generation.max_sources],
            output: vec![0.0; generator.channels() * settings.block_frames],
            generator,
            line_lengths: LineLengths::new(&settings.generation),
            settings,
        })
    }

    /// Time of the next graphics frame in seconds.
    pub fn time_s(&self) -> f64 {
        self.frame as f64 / self.settings.graphics_rate_hz
    }

    /// Paths of the update in use.
    pub fn paths(&self) -> &PathSet {
        self.extrapolator.current()
    }

    /// Extrapolated paths of the last graphics frame.
    pub fn frame_paths(&self) -> &FramePaths {
        &self.frame_paths
    }

    /// Times and counts so far.
    pub fn report(&self) -> &OfflineReport {
        &self.report
    }

    /// Channels of the output; constant.
    pub fn channels(&self) -> usize {
        self.generator.channels()
    }

    /// Changes layout or HRTF set: sound cross-fades within the next graphics frame. A change within the fade of the last
    /// one is refused. The HRTF set matters in [`Layout::Binaural`] only.
    ///
    /// # Errors
    /// [`Error::Setting`] for a layout with more channels than the output, an HRTF set of another sample rate, or a fade
    /// in progress; nothing changes then.
    pub fn set_output(&mut self, layout: Layout, hrtf: &Hrtf) -> Result<()> {
        self.generator.take_retired_stages(&mut Vec::new());
        if !self.generator.can_change_stage() {
            let problem = "the last change is still fading";
            return Err(Error::setting("layout", problem, "render a graphics frame"));
        }
        let generation = GeneratorSettings {
            layout,
            channels: Some(self.settings.generation.output_channels()),
            ..self.settings.generation.clone()
        };
        let stage = OutputStage::new(&generation, hrtf)?;
        self.generator.change_stages(&mut vec![Box::new(stage)]);
        self.settings.generation = generation;
        Ok(())
    }

    /// Latency of limiter and interpolation in audio frames.
    pub fn latency_frames(&self) -> usize {
        self.generator.latency_frames()
    }

    fn sample_at(&self, frame: u64) -> u64 {
        let rate_hz = f64::from(self.settings.generation.rate_hz);
        (frame as f64 * rate_hz / self.settings.graphics_rate_hz).round() as u64
    }

    /// Renders the sound from this graphics frame to the next; paths reach the values of `poses` at its end. `sink`
    /// gets interleaved frames of [`Self::channels`].
    ///
    /// # Errors
    /// [`Error::Setting`] for an orientation that cannot be normalised (of a source, four zeros are the identity) and for a
    /// source without a position ([`SourceSettings::is_2d`](crate::SourceSettings::is_2d)); nothing is rendered then. Those of
    /// `sink`.
    pub fn next_frame(
        &mut self,
        poses: &Poses,
        signal: &mut Signal<'_>,
        sink: &mut dyn FnMut(&[f32]) -> Result<()>,
    ) -> Result<()> {
        let poses = &checked(poses)?;
        let started = now();
        let arrived = self.propagation.next_frame(poses);
        if self.propagation.has_computed() && self.frame > 0 {
            self.report.propagation.push(started.elapsed());
        }
        if let Some(update) = &arrived {
            self.report.rays.push(update.rays);
            self.report.paths.push(update.paths.len());
            let mut longer = Vec::new();
            let updates = std::iter::once(update);
            let speed_m_s = self
                .propagation
                .propagator_mut()
                .scene()
                .speed_of_sound_m_s();
            self.line_lengths.grow(updates, speed_m_s, &mut longer);
            for line in &mut longer {
                self.generator.lengthen_line(line);
            }
        }
        let started = ProcessorTimer::start();
        if let Some(update) = arrived {
            let level = self.settings.schedule.extrapolation_level();
            let prepared = self.propagation.prepared_mut();
            let extrapolator = &mut self.extrapolator;
            let retired = extrapolator.store_prepared_update(update, prepared, level);
            self.propagation.recycle(retired);
        }
        let interval_s = self.settings.graphics_rate_hz.recip();
        self.extrapolator.record_sources(&poses.sources, interval_s);
        self.extrapolator
            .frame(&poses.listener, &poses.sources, &mut self.frame_paths);
        self.report.extrapolation.push(started.elapsed());
        self.generate(poses, signal, sink)?;
        self.frame += 1;
        self.report.graphics_frames += 1;
        Ok(())
    }

    fn generate(
        &mut self,
        poses: &Poses,
        signal: &mut Signal<'_>,
        sink: &mut dyn FnMut(&[f32]) -> Result<()>,
    ) -> Result<()> {
        let (mut from, to) = (self.sample_at(self.frame), self.sample_at(self.frame + 1));
        let mut spent = Duration::ZERO;
        let started = now();
        self.generator
            .set_frame(&self.frame_paths, (to - from) as u32);
        spent += started.elapsed();
        while from < to {
            let frames = self.settings.block_frames.min((to - from) as usize);
            let mut inputs: Vec<&[f32]> = vec![&[]; self.inputs.len()];
            for (slot, buffer) in self.inputs.iter_mut().enumerate() {
                if poses.sources.iter().any(|pose| pose.id.slot() == slot) {
                    signal(slot, from, &mut buffer[..frames]);
                    inputs[slot] = &buffer[..frames];
                }
            }
            let output = &mut self.output[..self.generator.channels() * frames];
            let started = now();
            let block = self.generator.render(&inputs, output);
            spent += started.elapsed();
            self.report.dropped_paths += u64::from(block.dropped_paths);
            sink(output)?;
            from += frames as u64;
        }
        self.report.generation.push(spent);
        Ok(())
    }
}

/// Poses with normalised orientations.
fn checked(poses: &Poses) -> Result<Poses> {
    let no_orientation = |name: &str, orientation: Quat| {
        let problem = format!("{orientation} is no orientation");
        Error::setting(
            name,
            problem,
            "give a unit quaternion for each graphics frame",
        )
    };
    let listener = poses.listener;
    let normalized = |source: &SourcePose| {
        if source.settings.is_2d {
            let problem = format!("the source of slot {} has no position", source.id.slot());
            let advice = "leave it out, and add its samples to the output";
            return Err(Error::setting("is_2d", problem, advice));
        }
        let normalized = source.normalized();
        normalized.ok_or_else(|| no_orientation("orientation", source.orientation))
    };
    Ok(Poses {
        listener: listener
            .normalized()
            .ok_or_else(|| no_orientation("listener", listener.orientation))?,
        sources: poses
            .sources
            .iter()
            .map(normalized)
            .collect::<Result<_>>()?,
    })
}

/// Measures processor time of this thread, or elapsed time where the system has none.
struct ProcessorTimer {
    processor: Option<Duration>,
    clock: Instant,
}

impl ProcessorTimer {
    fn start() -> Self {
        Self {
            processor: thread_processor_time(),
            clock: now(),
        }
    }

    fn elapsed(&self) -> Duration {
        let both = self.processor.zip(thread_processor_time());
        both.map_or_else(
            || self.clock.elapsed(),
            |(before, after)| after.saturating_sub(before),
        )
    }
}

#[expect(clippy::disallowed_methods, reason = "for the report only")]
fn now() -> Instant {
    Instant::now()
}
