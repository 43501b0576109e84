//! What generation has of one listener: voices, plane waves, buses, late reverb and limiter. Delay lines are common to all listeners.
//!
//! Construction: control side; allocates. The rest: audio side, wait-free. Input: a listener's [`FramePaths`] and the delay lines;
//! output: interleaved channels.

use std::sync::Arc;

use glam::Quat;

use crate::error::Result;
use crate::extrapolation::FramePaths;
use crate::generation::bands::air_filter::AirFilter;
use crate::generation::delay::delay_line::DelayLine;
use crate::generation::output_stage::OutputStage;
use crate::generation::ramp::ChunkSpan;
use crate::generation::render_context::{Dropped, RenderContext, SlotOwner};
use crate::generation::reverb::late_reverb::LateReverb;
use crate::generation::sound_field::FieldRotation;
use crate::generation::{BandCorrection, Bed, CHUNK, GeneratorSettings, Hrtf, Limiter};
use crate::simd::F32x8;

/// What all listeners have in common at a new frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CommonInputs<'a> {
    pub(crate) correction: &'a BandCorrection,
    pub(crate) air: &'a AirFilter,
    pub(crate) owners: &'a [SlotOwner],
    pub(crate) rate_hz: f64,
    /// Longest path in seconds, by source slot.
    pub(crate) longest_s: &'a [f64],
    pub(crate) now: i64,
}

/// The voices' inputs, borrowed field by field.
macro_rules! context {
    ($common:expr, $left:expr, $table:expr, $frame:expr, $ramp:expr) => {
        RenderContext {
            table: &$table,
            correction: $common.correction,
            air: $common.air,
            air_np_per_s: $frame.high_air_np_per_s,
            wide: &$frame.wide,
            to_head: orientation(&$frame.orientation).conjugate(),
            rate_hz: $common.rate_hz,
            longest_s: $common.longest_s,
            now: $common.now,
            left: $left,
            ramp: $ramp,
        }
    };
}

/// A frame's orientation normalised, or the identity if it is not a rotation.
fn orientation(given: &Quat) -> Quat {
    if given.is_finite() && given.length_squared() > 0.0 {
        given.normalize()
    } else {
        Quat::IDENTITY
    }
}

/// One listener's part of a generator.
#[derive(Debug)]
pub(crate) struct ListenerOutput {
    late: Option<LateReverb>,
    stage: Box<OutputStage>,
    /// The stage from the next frame on.
    next_stage: Option<Box<OutputStage>>,
    /// The stage before the last change, while it fades out and until it is retired.
    last_stage: Option<Box<OutputStage>>,
    limiter: Option<Limiter>,
    /// Frames left of the present ramp.
    pub(crate) left: u32,
    /// Gains of a signal without position in the first two channels.
    bed_gains: [[f32; 2]; 2],
    rotation: FieldRotation,
    /// A chunk of the sound field in head coordinates.
    field: Vec<F32x8>,
    dropped: Dropped,
}

impl ListenerOutput {
    /// A silent one.
    pub(crate) fn new(settings: &GeneratorSettings, hrtf: &Hrtf) -> Result<Self> {
        let stage = Box::new(OutputStage::new(settings, hrtf)?);
        let (rate_hz, channels) = (settings.rate_hz, settings.output_channels());
        let limiter = match settings.limiter {
            true => Some(Limiter::new(rate_hz, channels, settings.ceiling_db)?),
            false => None,
        };
        Ok(Self {
            late: settings
                .late
                .then(|| LateReverb::new(rate_hz, settings.max_sources)),
            bed_gains: stage.bed_gains(),
            rotation: FieldRotation::new(),
            field: vec![F32x8::ZERO; CHUNK],
            stage,
            next_stage: None,
            last_stage: None,
            limiter,
            left: 0,
            dropped: Dropped::default(),
        })
    }

    /// See [`super::Generator::change_stages`].
    pub(crate) fn change_stage(&mut self, mut stage: Box<OutputStage>) {
        stage.start_silent();
        self.next_stage = Some(stage);
    }

    /// Whether no stage fades out or waits.
    pub(crate) fn can_change_stage(&self) -> bool {
        self.next_stage.is_none() && self.last_stage.is_none()
    }

    /// The stage that has faded out, once.
    pub(crate) fn take_retired_stage(&mut self) -> Option<Box<OutputStage>> {
        self.last_stage.take_if(|stage| stage.is_over())
    }

    /// Latency of the limiter in frames.
    pub(crate) fn latency_frames(&self) -> usize {
        self.limiter.as_ref().map_or(0, Limiter::latency_frames)
    }

    /// Discards what was prepared.
    pub(crate) fn discard(&mut self) {
        let stage = self.next_stage.as_mut().unwrap_or(&mut self.stage);
        stage.voices.discard_paths();
    }

    /// See [`super::Generator::prepare_frame`].
    pub(crate) fn prepare(
        &mut self,
        common: &CommonInputs,
        frame: &FramePaths,
        most: usize,
    ) -> bool {
        let stage = self.next_stage.as_mut().unwrap_or(&mut self.stage);
        let context = context!(common, self.left, stage.table, frame, 1);
        let voices = &mut stage.voices;
        voices.prepare_paths(&frame.paths, &context, most)
    }

    /// See [`super::Generator::set_prepared_frame`].
    pub(crate) fn set(&mut self, common: &CommonInputs, frame: &FramePaths, ramp: u32) {
        self.apply_next_stage(common, frame, ramp);
        let stage = &mut self.stage;
        let context = context!(common, self.left, stage.table, frame, ramp);
        let voices = &mut stage.voices;
        let dropped = voices.set_paths(&frame.paths, common.owners, &context);
        self.update_late(common, frame, dropped, ramp);
    }

    /// See [`super::Generator::take_prepared_frame`].
    pub(crate) fn take(&mut self, common: &CommonInputs, frame: &FramePaths, ramp: u32) -> usize {
        self.apply_next_stage(common, frame, ramp);
        let stage = &mut self.stage;
        let context = context!(common, self.left, stage.table, frame, ramp);
        let voices = &mut stage.voices;
        let dropped = voices.take_paths(&frame.paths, common.owners, &context);
        self.update_late(common, frame, dropped, ramp);
        self.stage.voices.pending_count()
    }

    /// See [`super::Generator::start_voices`].
    pub(crate) fn start_voices(&mut self, common: &CommonInputs, most: usize) -> usize {
        let context = RenderContext {
            table: &self.stage.table,
            correction: common.correction,
            air: common.air,
            air_np_per_s: Default::default(),
            wide: &[],
            to_head: Quat::IDENTITY,
            rate_hz: common.rate_hz,
            longest_s: common.longest_s,
            now: common.now,
            left: self.left,
            ramp: self.left.max(CHUNK as u32),
        };
        self.stage.voices.start(most, common.owners, &context)
    }

    /// Exchanges the stages at the frame of a change, and fades the last one.
    fn apply_next_stage(&mut self, common: &CommonInputs, frame: &FramePaths, ramp: u32) {
        let Some(next) = self.next_stage.take() else {
            return;
        };
        let mut last = std::mem::replace(&mut self.stage, next);
        let table = Arc::clone(&last.table);
        last.fade(
            common.owners,
            &context!(common, self.left, table, frame, ramp),
        );
        self.stage.raise_field(ramp);
        self.last_stage = Some(last);
    }

    /// Applies a frame's late reverb and orientation.
    fn update_late(
        &mut self,
        common: &CommonInputs,
        frame: &FramePaths,
        dropped: Dropped,
        ramp: u32,
    ) {
        self.dropped.paths += dropped.paths;
        self.dropped.delays += dropped.delays;
        self.dropped.late_starts += dropped.late_starts;
        let to_head = orientation(&frame.orientation).conjugate();
        self.rotation.set_orientation(to_head, ramp);
        if let Some(late) = &mut self.late {
            self.stage.set_orientation(to_head, self.left, ramp);
            late.set_frame(frame, common.longest_s, common.correction, self.left, ramp);
        }
        self.left = ramp;
    }

    /// Adds a chunk to interleaved frames of `channels` channels.
    pub(crate) fn render(
        &mut self,
        lines: &[DelayLine],
        chunk: ChunkSpan,
        output: &mut [f32],
        channels: usize,
    ) {
        let late = &mut self.late;
        self.stage.add_voices(lines, chunk, &mut |slot| {
            if let (Some(reverb), Some(line)) = (late.as_mut(), lines.get(slot)) {
                reverb.collect(slot, line, chunk);
            }
        });
        if let Some(last) = self.last_stage.as_mut().filter(|stage| !stage.is_over()) {
            last.add_voices(lines, chunk, &mut |_| ());
        }
        self.add_waves(chunk);
        self.stage.finish(output, channels);
        if let Some(last) = self.last_stage.as_mut().filter(|stage| !stage.is_over()) {
            last.finish(output, channels);
        }
    }

    /// Adds a chunk of one source's voices; see [`OutputStage::render_slot`].
    pub(crate) fn render_slot(
        &mut self,
        slot: usize,
        lines: &[DelayLine],
        chunk: ChunkSpan,
        output: &mut [f32],
        channels: usize,
    ) {
        let last_stage = self.last_stage.as_mut().filter(|stage| !stage.is_over());
        for stage in [Some(&mut self.stage), last_stage].into_iter().flatten() {
            stage.render_slot(slot, lines, chunk, (&mut *output, channels));
        }
    }

    /// Ends the sources of a block that were rendered apart.
    pub(crate) fn end_slots(&mut self) {
        self.stage.end_slots();
        if let Some(last) = &mut self.last_stage {
            last.end_slots();
        }
    }

    /// Adds a chunk of the late reverb.
    pub(crate) fn render_reverb(
        &mut self,
        lines: &[DelayLine],
        chunk: ChunkSpan,
        output: &mut [f32],
        channels: usize,
    ) {
        if let Some(reverb) = &mut self.late {
            for (slot, line) in lines.iter().enumerate() {
                reverb.collect(slot, line, chunk);
            }
        }
        self.add_waves(chunk);
        self.stage.finish_waves(output, channels);
        if let Some(last) = self.last_stage.as_mut().filter(|stage| !stage.is_over()) {
            last.finish_waves(output, channels);
        }
    }

    /// Runs the late reverb for a chunk, into the buses, after its sends have been collected.
    fn add_waves(&mut self, chunk: ChunkSpan) {
        let Some(reverb) = &mut self.late else {
            return;
        };
        let waves = reverb.process(chunk.left, chunk.frames);
        self.stage.add_waves(chunk, waves);
        if let Some(last) = self.last_stage.as_mut().filter(|stage| !stage.is_over()) {
            last.add_waves(chunk, waves);
        }
    }

    /// Adds signals without position, below a magnitude of `most`; gains glide where the layout has changed.
    pub(crate) fn add_bed(&mut self, bed: Bed<'_>, most: f32, output: &mut [f32], channels: usize) {
        const STEP: f32 = 1.0 / CHUNK as f32;
        self.add_field(bed, output, channels);
        let bed = bed.stereo;
        let targets = self.stage.bed_gains();
        for (signal, (gains, targets)) in bed.iter().zip(self.bed_gains.iter_mut().zip(targets)) {
            for (frame, sample) in output.chunks_exact_mut(channels).zip(*signal) {
                let gains = gains.iter_mut().zip(targets);
                for (value, (gain, target)) in frame.iter_mut().zip(gains) {
                    *gain += (target - *gain).clamp(-STEP, STEP);
                    if sample.abs() < most {
                        *value += *gain * sample;
                    }
                }
            }
        }
    }

    /// Adds the sound field, turned with the listener's head.
    fn add_field(&mut self, bed: Bed<'_>, output: &mut [f32], channels: usize) {
        let is_silent = bed.field.iter().all(|signal| signal.is_empty());
        for (chunk, output) in output.chunks_mut(channels * CHUNK).enumerate() {
            let frames = output.len() / channels;
            let field = match is_silent {
                true => {
                    self.rotation.skip(frames);
                    None
                }
                false => {
                    let rest = |signal: &'_ [f32]| signal.len().min(chunk * CHUNK);
                    let signals = bed.field.map(|signal| &signal[rest(signal)..]);
                    self.rotation.turn(signals, &mut self.field[..frames]);
                    Some(&self.field[..frames])
                }
            };
            self.stage.add_field(field, output, channels);
            if let Some(last) = &mut self.last_stage {
                last.add_field(field, output, channels);
            }
        }
    }

    /// Limits a block; returns the smallest gain.
    pub(crate) fn limit(&mut self, output: &mut [f32]) -> f32 {
        self.limiter
            .as_mut()
            .map_or(1.0, |limiter| limiter.process(output))
    }

    /// Counts since the last call.
    pub(crate) fn take_dropped(&mut self) -> Dropped {
        std::mem::take(&mut self.dropped)
    }

    /// Active and fading voices.
    pub(crate) fn voices(&self) -> u32 {
        let stages = self.last_stage.iter().chain([&self.stage]);
        stages.map(|stage| stage.voices.count() as u32).sum()
    }
}
