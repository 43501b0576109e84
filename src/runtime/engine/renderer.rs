//! The audio half of an engine.
//!
//! Audio side, one thread at a time: the device's or a [`crate::runtime::SoundThread`]. [`Renderer::render`] does not
//! allocate, free, lock or wait; it reads the clock (no system call on Linux and Android). Bounded by the number of
//! paths, sources and audio frames. Dropping a renderer frees memory.

mod frame;
mod source_buses;

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::frame_clock::FrameClock;
use super::frame_numbers::FrameSender;
use super::messages::{AudioFrame, OutputChange, SampleSourceChange, UpdateMessage};
use super::mixer::Mixer;
use super::settings::EngineSettings;
use super::statistics::{Metrics, add};
use crate::extrapolation::{
    Extrapolator, FramePaths, LATE_GROUPS, LATE_SEGMENTS, MAX_WIDE_REFLECTIONS,
};
use crate::generation::Generator;
use crate::propagation::MAX_ORDER;
use crate::runtime::engine::block_pacing::BlockPacing;
use crate::runtime::engine::sample_source::SampleSource;
use crate::runtime::engine::source_virtualization::own_slots;
use crate::runtime::handover::newest::Receiver;
use crate::runtime::phone::this_thread;
use crate::runtime::threads::affinity::{Placement, ThreadRole, place_this_thread};
use crate::runtime::threads::clock::{nanoseconds, now};
use crate::runtime::threads::flush_to_zero::FlushToZero;
use crate::runtime::trace::{SpanKind, SpanWriter};

/// Greatest number of slots of a generator.
const MAX_SLOTS: usize = 256;
/// Weight of a block in the mean load of the sound thread.
const SHARE_WEIGHT: f64 = 0.02;
/// Fade into and out of a pause, in seconds.
const PAUSE_FADE_S: f32 = 0.005;

/// Result of one call of [`Renderer::render`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct RenderReport {
    /// Audio frames written.
    pub frames: u32,
    /// Graphics frames taken.
    pub graphics_frames: u32,
    /// Propagation updates taken.
    pub updates: u32,
    /// Extrapolation level L.
    pub extrapolation_level: u32,
    /// Active voices at the end, including those that fade out.
    pub voices: u32,
    /// Paths dropped for lack of a voice.
    pub dropped_paths: u32,
    /// Samples missing in streams.
    pub underrun_samples: u32,
    /// Whether the call took longer than the duration of the rendered sound.
    pub missed_deadline: bool,
    /// Whether the controller was dropped.
    pub controller_dropped: bool,
}

/// Parts of a renderer.
pub(super) struct RendererParts {
    pub(super) frames: Receiver<AudioFrame>,
    pub(super) updates: Receiver<UpdateMessage>,
    pub(super) outputs: Receiver<OutputChange>,
    pub(super) source_changes: rtrb::Consumer<SampleSourceChange>,
    pub(super) retired: rtrb::Producer<SampleSource>,
    /// The graphics frame in use.
    pub(super) frame: Box<AudioFrame>,
    pub(super) generator: Generator,
    pub(super) numbers: FrameSender,
    pub(super) spans: SpanWriter,
    pub(super) metrics: Arc<Metrics>,
    pub(super) settings: EngineSettings,
}

/// A listener's part of a graphics frame.
struct ListenerFrame {
    extrapolator: Box<Extrapolator>,
    paths: FramePaths,
    /// Whether its extrapolation is complete, and the number of its paths prepared for generation.
    is_extrapolated: bool,
    prepared: usize,
    /// Paths of the last frame without a started voice.
    waiting_voices: usize,
    /// Whether they wait for voices of earlier paths to fade out.
    wait_for_fades: bool,
}

impl ListenerFrame {
    fn is_prepared(&self) -> bool {
        self.is_extrapolated && self.prepared == self.paths.paths.len()
    }
}

/// The audio half of an engine. Belongs to the audio thread.
pub struct Renderer {
    parts: RendererParts,
    mixer: Mixer,
    /// By listener.
    frames: Vec<ListenerFrame>,
    clock: FrameClock,
    /// Gain of each reflection order, moving towards `target_order_gain`.
    order_gain: [f32; MAX_ORDER + 1],
    target_order_gain: [f32; MAX_ORDER + 1],
    /// Mean load as a fraction of a core.
    core_share: f64,
    /// Gain of the output, moving towards 0 in a pause.
    pause_gain: f32,
    pacing: BlockPacing,
    /// Carries the last output back when it has faded out.
    output_change: Option<Box<OutputChange>>,
    /// Whether a graphics frame is in progress.
    frame_in_progress: bool,
    /// Voices of the last block.
    voices: u32,
    /// Length of the frame in progress, in seconds.
    frame_s: f64,
    /// Time spent on its direct paths and on its other paths so far.
    elapsed: [Duration; 2],
    apart: SourceBlock,
}

/// State of a block whose sources are rendered apart.
struct SourceBlock {
    /// Frames of the block that has begun; 0 for none.
    frames: usize,
    /// Slots rendered so far.
    is_rendered: Vec<bool>,
    report: RenderReport,
    /// Time of its calls so far.
    elapsed: Duration,
    /// Takes the place of an output that is missing.
    spare: Vec<f32>,
}

impl SourceBlock {
    fn new(settings: &EngineSettings) -> Self {
        let generation = &settings.generation;
        let (slots, samples) = match generation.source_buses {
            true => (
                generation.max_sources,
                generation.output_channels() * settings.block_frames,
            ),
            false => (0, 0),
        };
        Self {
            frames: 0,
            is_rendered: vec![false; slots],
            report: RenderReport::default(),
            elapsed: Duration::ZERO,
            spare: vec![0.0; samples],
        }
    }
}

impl Renderer {
    /// With an extrapolator for each listener.
    pub(super) fn new(parts: RendererParts, extrapolators: Vec<Box<Extrapolator>>) -> Self {
        let settings = &parts.settings;
        let (sources, slots) = (settings.source_limit(), settings.generation.max_sources);
        let max_paths = settings.max_frame_paths();
        let frame = |extrapolator| {
            let mut paths = FramePaths::default();
            paths.paths.reserve(max_paths);
            paths.obstructions.reserve(slots);
            paths.wide.reserve(slots * (1 + MAX_WIDE_REFLECTIONS));
            paths.late.reserve(slots * LATE_SEGMENTS * LATE_GROUPS);
            ListenerFrame {
                extrapolator,
                paths,
                is_extrapolated: false,
                prepared: 0,
                waiting_voices: 0,
                wait_for_fades: false,
            }
        };
        Self {
            mixer: Mixer::new(
                sources,
                [slots, own_slots(sources, slots)],
                settings.block_frames,
                settings.generation.rate_hz,
            ),
            clock: FrameClock::new(settings.frame_time),
            frames: extrapolators.into_iter().map(frame).collect(),
            order_gain: [1.0; MAX_ORDER + 1],
            target_order_gain: [1.0; MAX_ORDER + 1],
            core_share: 0.0,
            pause_gain: 1.0,
            pacing: BlockPacing::new(
                settings.block_frames as f64 / f64::from(settings.generation.rate_hz),
                settings.even_blocks,
                settings.generation.listeners,
            ),
            output_change: None,
            frame_in_progress: false,
            voices: 0,
            frame_s: 0.0,
            elapsed: [Duration::ZERO; 2],
            apart: SourceBlock::new(settings),
            parts,
        }
    }

    /// Sample rate in Hz of what [`Self::render`] writes; constant.
    pub fn rate_hz(&self) -> u32 {
        self.parts.settings.generation.rate_hz
    }

    /// Channels of what [`Self::render`] writes; constant.
    pub fn channels(&self) -> usize {
        self.parts.generator.channels()
    }

    /// Audio frames per block; [`Self::render`] takes any number, this one is the cheapest.
    pub fn block_frames(&self) -> usize {
        self.parts.settings.block_frames
    }

    /// Latency of limiter and interpolation in audio frames, without the device's buffer.
    pub fn latency_frames(&self) -> usize {
        self.parts.generator.latency_frames()
    }

    /// Sets core and priority of the calling thread by the engine's settings. Once on the audio thread, before its
    /// first block; makes system calls.
    pub fn place_thread(&mut self) -> Placement {
        let placement = place_this_thread(self.parts.settings.affinity, ThreadRole::Sound);
        let metrics = &self.parts.metrics;
        metrics.sound_placement.store(placement);
        metrics.sound_thread.store(this_thread(), Ordering::Relaxed);
        placement
    }

    /// Fills `output` with interleaved frames of [`Self::channels`]; any number, multiples of [`Self::block_frames`] are
    /// most efficient. Samples of an incomplete frame at the end are silent. Wait-free; audio thread.
    ///
    /// ```
    /// # fn main() -> foresound::Result<()> {
    /// # let (_controller, mut renderer) = foresound::Engine::new(Default::default())?;
    /// let mut block = [0.0; 2 * 256];
    /// let report = renderer.render(&mut block);
    /// assert_eq!(report.frames, 256);
    /// # Ok(())
    /// # }
    /// ```
    pub fn render(&mut self, output: &mut [f32]) -> RenderReport {
        let whole = output.len() / self.channels() * self.channels();
        let (whole, rest) = output.split_at_mut(whole);
        rest.fill(0.0);
        self.render_all(whole, 1)
    }

    /// Number of listeners; constant.
    pub fn listeners(&self) -> usize {
        self.frames.len()
    }

    /// [`Self::render`] with an output for each listener, one after the other in `output`: each has the same number of
    /// interleaved frames of [`Self::channels`], and its own limiter. [`Self::render`] gives their mix, for listeners at one
    /// pair of loudspeakers. Samples that do not fill a frame of every listener are silent. Wait-free; audio thread.
    pub fn render_listeners(&mut self, output: &mut [f32]) -> RenderReport {
        let all = self.listeners() * self.channels();
        let whole = output.len() / all * all;
        let (whole, rest) = output.split_at_mut(whole);
        rest.fill(0.0);
        self.render_all(whole, self.listeners())
    }

    /// Fills so many outputs, one after the other.
    fn render_all(&mut self, output: &mut [f32], count: usize) -> RenderReport {
        let _flush = FlushToZero::begin();
        self.end_open_block();
        let started = now();
        let mut report = RenderReport::default();
        self.take_source_changes();
        let frames = output.len() / count / self.channels();
        let mut start = 0;
        while start < frames {
            let end = frames.min(start + self.parts.settings.block_frames);
            self.advance_frame(end - start, &mut report);
            self.render_block((&mut *output, count), start..end, &mut report);
            start = end;
        }
        self.return_output();
        self.complete(&mut report, started, started.elapsed());
        report
    }

    /// Completes the report of a call or of a block that took `elapsed`, and counts it unless it has no frames: no sound was due
    /// then.
    fn complete(&mut self, report: &mut RenderReport, started: Instant, elapsed: Duration) {
        let metrics = &self.parts.metrics;
        report.extrapolation_level = metrics.extrapolation_level.load(Ordering::Relaxed);
        report.controller_dropped = self.parts.frames.is_abandoned();
        if report.frames == 0 {
            return;
        }
        let lasts_s = f64::from(report.frames) / f64::from(self.rate_hz());
        report.missed_deadline = elapsed.as_secs_f64() > lasts_s;
        self.core_share += SHARE_WEIGHT * (elapsed.as_secs_f64() / lasts_s - self.core_share);
        let millicores = (1e3 * self.core_share) as u32;
        metrics
            .sound_millicores
            .store(millicores, Ordering::Relaxed);
        self.parts.spans.record(
            SpanKind::Block,
            started,
            elapsed,
            report.extrapolation_level.into(),
        );
        metrics.block.record(elapsed);
        let lasts_ns = (1e9 * lasts_s) as u64;
        metrics.block_lasts_ns.store(lasts_ns, Ordering::Relaxed);
        metrics
            .block_peak_ns
            .fetch_max(nanoseconds(elapsed), Ordering::Relaxed);
        add(&metrics.blocks, 1);
        add(&metrics.missed, u64::from(report.missed_deadline));
        add(&metrics.dropped_paths, u64::from(report.dropped_paths));
        add(
            &metrics.underrun_samples,
            u64::from(report.underrun_samples),
        );
    }

    /// Takes new sample sources while the return ring has room for the old ones.
    fn take_source_changes(&mut self) {
        while !self.parts.retired.is_full() {
            let Ok(change) = self.parts.source_changes.pop() else {
                return;
            };
            let old = self.mixer.replace(change);
            // There is room: only this side fills the ring.
            if let Err(rtrb::PushError::Full(old)) = self.parts.retired.push(old) {
                std::mem::forget(old);
            }
        }
    }

    /// Begins to fade to a new output with the frame in progress.
    fn take_output(&mut self) {
        let generator = &mut self.parts.generator;
        if self.output_change.is_some() || !generator.can_change_stage() {
            return;
        }
        let Some(mut change) = self.parts.outputs.take() else {
            return;
        };
        generator.change_stages(&mut change.stages);
        self.output_change = Some(change);
    }

    /// Returns the last output after its fade.
    fn return_output(&mut self) {
        let Some(change) = &mut self.output_change else {
            return;
        };
        let generator = &mut self.parts.generator;
        if generator.take_retired_stages(&mut change.stages)
            && let Some(change) = self.output_change.take()
        {
            self.parts.outputs.give_back(change);
        }
    }

    fn render_block(
        &mut self,
        (output, count): (&mut [f32], usize),
        range: Range<usize>,
        report: &mut RenderReport,
    ) {
        let (channels, frames) = (self.channels(), range.len());
        let parts = channels * range.start..channels * range.end;
        let whole = output.len() / count;
        report.frames += frames as u32;
        if self.is_silent() {
            for own in output.chunks_exact_mut(whole) {
                own[parts.clone()].fill(0.0);
            }
            return;
        }
        let started = now();
        report.underrun_samples += self.mixer.mix(frames);
        add(&self.parts.metrics.mixed_frames, frames as u64);
        let mut inputs: [&[f32]; MAX_SLOTS] = [&[]; MAX_SLOTS];
        let slots = self.mixer.inputs(frames, &mut inputs);
        let generator = &mut self.parts.generator;
        let bed = self.mixer.bed(frames);
        let made = generator.render_range(&inputs[..slots], bed, (&mut *output, count), range);
        report.voices = made.voices;
        self.voices = made.voices;
        report.dropped_paths += made.dropped_paths + made.dropped_delays;
        let (target, gain) = (self.target_pause_gain(), self.pause_gain);
        for own in output.chunks_exact_mut(whole) {
            self.pause_gain = gain;
            self.apply_pause_gain(&mut own[parts.clone()], target);
        }
        let elapsed = started.elapsed();
        self.parts.metrics.generation.record(elapsed);
        self.parts
            .spans
            .record(SpanKind::Generation, started, elapsed, made.voices.into());
    }

    /// Gain of the output that a pause fades to.
    fn target_pause_gain(&self) -> f32 {
        if self.parts.frame.paused { 0.0 } else { 1.0 }
    }

    /// Whether a pause has faded out.
    fn is_silent(&self) -> bool {
        self.parts.frame.paused && self.pause_gain == 0.0
    }

    fn apply_pause_gain(&mut self, output: &mut [f32], target: f32) {
        if self.pause_gain == target {
            return;
        }
        let step = 1.0 / (PAUSE_FADE_S * self.rate_hz() as f32);
        for frame in output.chunks_exact_mut(self.channels()) {
            self.pause_gain += (target - self.pause_gain).clamp(-step, step);
            for sample in frame {
                *sample *= self.pause_gain;
            }
        }
    }
}
