//! Renders the paths of each graphics frame in the layout of the output.
//!
//! Audio side: one thread alternately calls [`Generator::set_frame`], or the functions that prepare a frame in parts, and
//! [`Generator::render`]. They are wait-free: no allocation, lock, panic or clock. Input: [`FramePaths`] and one mono signal
//! per source; output: interleaved channels and a [`BlockReport`].

mod slot_input;
mod source_buses;

use std::ops::Range;
use std::sync::Arc;

use crate::error::Result;
use crate::extrapolation::FramePaths;
use crate::simd::F32x8;

use super::longer_line::line;
use super::{BandCorrection, BandFilter, BlockReport, CHUNK, GeneratorSettings, Hrtf};
use super::{LongerLine, first_longest_s};
use crate::generation::bands::air_filter::AirFilter;
use crate::generation::bands::band_filter::SIGNALS;
use crate::generation::bed::Bed;
use crate::generation::delay::delay_line::DelayLine;
use crate::generation::delay::interpolation::AHEAD;
use crate::generation::generator::slot_input::{MAX_SAMPLE, SlotInput};
use crate::generation::listener_output::{CommonInputs, ListenerOutput};
use crate::generation::output_stage::OutputStage;
use crate::generation::ramp::{Chunk, Chunks};
use crate::generation::render_context::SlotOwner;

/// What all listeners have in common, borrowed field by field.
macro_rules! common {
    ($generator:ident) => {
        CommonInputs {
            correction: &$generator.correction,
            air: &$generator.air,
            owners: &$generator.owners,
            rate_hz: $generator.rate_hz,
            longest_s: &$generator.longest_s,
            now: $generator.now,
        }
    };
}

/// The sound generation stage.
///
/// ```
/// use std::sync::Arc;
/// use foresound::generation::Generator;
/// use foresound::paths::FramePaths;
/// use foresound::{GeneratorSettings, Hrtf};
///
/// # fn main() -> foresound::Result<()> {
/// let hrtf = Arc::new(Hrtf::omnidirectional(44_100)?);
/// let mut generator = Generator::new(GeneratorSettings::default(), hrtf)?;
/// generator.set_frame(&FramePaths::default(), 588);
/// let mut output = [1.0; 2 * 256];
/// let report = generator.render(&[], &mut output);
/// assert_eq!(report.frames, 256);
/// assert!(output.iter().all(|&sample| sample == 0.0));
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Generator {
    rate_hz: f64,
    /// Channels of the output.
    channels: usize,
    correction: BandCorrection,
    air: AirFilter,
    /// Sources per filter: four, or one if sources can be rendered apart.
    signals: usize,
    filters: Vec<BandFilter>,
    lines: Vec<DelayLine>,
    /// Longest path of each line in seconds.
    longest_s: Vec<f64>,
    owners: Vec<SlotOwner>,
    inputs: Vec<SlotInput>,
    /// By listener.
    outputs: Vec<ListenerOutput>,
    /// Audio frames since the start.
    now: i64,
    /// Input of four sources with invalid samples replaced, and its bands.
    clean: [Vec<f32>; SIGNALS],
    bands: [Vec<F32x8>; SIGNALS],
    report: BlockReport,
}

impl Generator {
    /// A silent generator. Control side; allocates.
    ///
    /// The HRTF set matters in [`Layout::Binaural`](crate::Layout::Binaural) only.
    ///
    /// Errors: [`Error::Setting`](crate::Error::Setting) for a setting out of range, or an HRTF set with a different sample
    /// rate.
    pub fn new(settings: GeneratorSettings, hrtf: Arc<Hrtf>) -> Result<Self> {
        let longest_s = settings.max_delay_s;
        Self::with_lines(settings, hrtf, longest_s)
    }

    /// [`Self::new`] with short delay lines; [`Self::lengthen_line`] makes them longer.
    pub(crate) fn with_short_lines(settings: GeneratorSettings, hrtf: Arc<Hrtf>) -> Result<Self> {
        let longest_s = first_longest_s(&settings);
        Self::with_lines(settings, hrtf, longest_s)
    }

    fn with_lines(settings: GeneratorSettings, hrtf: Arc<Hrtf>, longest_s: f64) -> Result<Self> {
        settings.check()?;
        let output = |_| ListenerOutput::new(&settings, &hrtf);
        let outputs = (0..settings.listeners).map(output).collect::<Result<_>>()?;
        let channels = settings.output_channels();
        let rate_hz = f64::from(settings.rate_hz);
        let sources = settings.max_sources;
        let signals = if settings.source_buses { 1 } else { SIGNALS };
        Ok(Self {
            rate_hz,
            channels,
            correction: BandCorrection::new(settings.rate_hz),
            air: AirFilter::new(settings.rate_hz),
            signals,
            filters: (0..sources.div_ceil(signals))
                .map(|_| BandFilter::new(settings.rate_hz))
                .collect(),
            lines: (0..sources).map(|_| line(longest_s, &settings)).collect(),
            longest_s: vec![longest_s; sources],
            owners: vec![SlotOwner::NONE; sources],
            inputs: vec![SlotInput::default(); sources],
            outputs,
            now: 0,
            clean: std::array::from_fn(|_| vec![0.0; CHUNK]),
            bands: std::array::from_fn(|_| vec![F32x8::ZERO; CHUNK]),
            report: BlockReport::default(),
        })
    }

    /// Channels of the output; constant.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Makes the delay line of a slot longer. Real-time.
    pub(crate) fn lengthen_line(&mut self, longer: &mut LongerLine) {
        if let Some(line) = self.lines.get_mut(longer.slot) {
            line.lengthen(&mut longer.segments, self.now);
            let longest_s = &mut self.longest_s[longer.slot];
            *longest_s = longest_s.max(longer.longest_s);
        }
    }

    /// Renders each listener by another stage from the next frame on: all paths start in it and fade out in the present one. Only
    /// while [`Self::can_change_stage`]. Takes a stage for each listener. Real-time.
    pub(crate) fn change_stages(&mut self, stages: &mut Vec<Box<OutputStage>>) {
        debug_assert!(self.can_change_stage(), "a stage is still fading");
        for (output, stage) in self.outputs.iter_mut().zip(stages.drain(..)) {
            output.change_stage(stage);
        }
    }

    /// Whether no stage fades out or waits. Real-time.
    pub(crate) fn can_change_stage(&self) -> bool {
        self.outputs.iter().all(ListenerOutput::can_change_stage)
    }

    /// Adds stages that have faded out to a list that has room for them, for the control side to free; returns whether all have now.
    /// Real-time.
    pub(crate) fn take_retired_stages(&mut self, stages: &mut Vec<Box<OutputStage>>) -> bool {
        for output in &mut self.outputs {
            stages.extend(output.take_retired_stage());
        }
        stages.len() == self.outputs.len()
    }

    /// Latency in frames besides path and ear delays: interpolation and limiter.
    pub fn latency_frames(&self) -> usize {
        let limiter = self.outputs.first();
        AHEAD + limiter.map_or(0, ListenerOutput::latency_frames)
    }

    /// Sets a graphics frame: all values ramp linearly to those of the frame within `ramp_frames` audio frames, usually the
    /// length of a graphics frame, and then stay constant. 0 counts as 1.
    ///
    /// A new path starts from silence at its own delay; a missing one fades out at its last delay; one whose delay changes
    /// by more than a quarter of `ramp_frames` does both.
    ///
    /// Real-time: no allocation; time grows at most as n log n with the number n of paths.
    pub fn set_frame(&mut self, frame: &FramePaths, ramp_frames: u32) {
        if let Some(output) = self.outputs.first_mut() {
            output.discard();
        }
        self.set_prepared_frame(frame, ramp_frames);
    }

    /// Prepares up to `most` further paths of a graphics frame; returns whether all are prepared. All calls until
    /// [`Self::set_prepared_frame`] must have the same frame; [`Self::set_frame`] discards the preparation.
    ///
    /// Real-time, on the rendering thread: no allocation; time grows with `most`, and slowly with the number of paths.
    pub fn prepare_frame(&mut self, frame: &FramePaths, most: usize) -> bool {
        self.prepare_frame_of(0, frame, most)
    }

    /// [`Self::prepare_frame`] of a listener.
    pub(crate) fn prepare_frame_of(
        &mut self,
        listener: usize,
        frame: &FramePaths,
        most: usize,
    ) -> bool {
        let common = common!(self);
        let output = self.outputs.get_mut(listener);
        output.is_none_or(|output| output.prepare(&common, frame, most))
    }

    /// [`Self::set_frame`] for a frame of [`Self::prepare_frame`]: the same result, bit for bit, in less time. Prepares the
    /// remaining paths. Real-time, as [`Self::set_frame`].
    pub fn set_prepared_frame(&mut self, frame: &FramePaths, ramp_frames: u32) {
        self.set_prepared_frame_of(0, frame, ramp_frames);
    }

    /// [`Self::set_prepared_frame`] of a listener. All listeners' frames are set before the same chunk.
    pub(crate) fn set_prepared_frame_of(
        &mut self,
        listener: usize,
        frame: &FramePaths,
        ramp_frames: u32,
    ) {
        self.update_owners(frame);
        let common = common!(self);
        if let Some(output) = self.outputs.get_mut(listener) {
            output.set(&common, frame, ramp_frames.max(1));
        }
    }

    /// [`Self::set_prepared_frame`], except that new and jumping paths wait for [`Self::start_voices`]; returns their number.
    /// The next frame discards paths that still wait, unless it has them too.
    ///
    /// Real-time, as [`Self::set_prepared_frame`].
    pub fn take_prepared_frame(&mut self, frame: &FramePaths, ramp_frames: u32) -> usize {
        self.take_prepared_frame_of(0, frame, ramp_frames)
    }

    /// [`Self::take_prepared_frame`] of a listener.
    pub(crate) fn take_prepared_frame_of(
        &mut self,
        listener: usize,
        frame: &FramePaths,
        ramp_frames: u32,
    ) -> usize {
        self.update_owners(frame);
        let common = common!(self);
        let output = self.outputs.get_mut(listener);
        output.map_or(0, |output| output.take(&common, frame, ramp_frames.max(1)))
    }

    /// Starts the voices of up to `most` waiting paths, the loudest first; returns the number of paths still waiting.
    ///
    /// The voices reach their values at the end of the frame's ramp, but after at least 256 audio frames. Voices start only
    /// while fewer are active or fading than the larger path count of this and the previous frame, plus 64: when all
    /// paths change, new voices start as the fades end. Call before every [`Self::render`] until no path waits, and before
    /// [`Self::prepare_frame`] of the next frame.
    ///
    /// Real-time, on the rendering thread: no allocation; time grows with `most`, and slowly with the number of voices.
    pub fn start_voices(&mut self, most: usize) -> usize {
        self.start_voices_of(0, most)
    }

    /// [`Self::start_voices`] of a listener.
    pub(crate) fn start_voices_of(&mut self, listener: usize, most: usize) -> usize {
        let common = common!(self);
        let output = self.outputs.get_mut(listener);
        output.map_or(0, |output| output.start_voices(&common, most))
    }

    /// Updates the owners of the slots; a new owner starts from silence.
    fn update_owners(&mut self, frame: &FramePaths) {
        let paths = frame.paths.iter().map(|path| path.source);
        let late = frame.late.iter().map(|send| send.source);
        for id in paths.chain(late) {
            let Some(owner) = self.owners.get_mut(id.slot()) else {
                continue;
            };
            let bits = Some(id.bits());
            if owner.bits != bits {
                if owner.bits.is_some() {
                    owner.since = self.now;
                    self.inputs[id.slot()].begin();
                    self.filters[id.slot() / self.signals].reset(id.slot() % self.signals);
                }
                owner.bits = bits;
            }
        }
    }

    /// Renders `output.len() / channels` frames of interleaved [`Self::channels`], overwriting `output`.
    ///
    /// `inputs` holds one mono signal per source slot, in which 1 is the pressure at 1 m in the free field. An empty or
    /// missing signal is silence; a short one is padded with silence.
    ///
    /// Real-time: no allocation; time grows with frames, active sources and voices. Sources with an empty delay line and a
    /// decayed late reverb are skipped.
    pub fn render(&mut self, inputs: &[&[f32]], output: &mut [f32]) -> BlockReport {
        self.render_with_bed(inputs, Bed::default(), output)
    }

    /// [`Self::render`] with signals without a position.
    pub fn render_with_bed(
        &mut self,
        inputs: &[&[f32]],
        bed: Bed<'_>,
        output: &mut [f32],
    ) -> BlockReport {
        let frames = output.len() / self.channels;
        output[self.channels * frames..].fill(0.0);
        self.render_range(inputs, bed, (output, 1), 0..frames)
    }

    /// Renders frames of several outputs of equal length, one after the other: one for the mix of all listeners, or one for each.
    pub(crate) fn render_range(
        &mut self,
        inputs: &[&[f32]],
        bed: Bed<'_>,
        (output, count): (&mut [f32], usize),
        range: Range<usize>,
    ) -> BlockReport {
        let (channels, whole) = (self.channels, output.len() / count.max(1));
        let part = channels * range.start..channels * range.end;
        let frames = range.len();
        for own in output.chunks_exact_mut(whole.max(1)) {
            own[part.clone()].fill(0.0);
        }
        for chunk in self.chunks(frames) {
            for group in 0..self.filters.len() {
                let own = inputs.get(group * self.signals..).unwrap_or_default();
                self.write_sources(group, own, &chunk);
            }
            for (listener, own) in self.outputs.iter_mut().enumerate() {
                let at = whole * (listener % count) + part.start + channels * chunk.start;
                let output = &mut output[at..at + channels * chunk.frames];
                own.render(&self.lines, chunk.span(listener), output, channels);
            }
            self.advance(&chunk);
        }
        let mut limiter_gain_min = 1.0f32;
        for (listener, own) in output.chunks_exact_mut(whole.max(1)).enumerate() {
            let own = &mut own[part.clone()];
            self.silence_non_finite(own);
            let Some(output) = self.outputs.get_mut(listener) else {
                continue;
            };
            output.add_bed(bed, MAX_SAMPLE, own, channels);
            limiter_gain_min = limiter_gain_min.min(output.limit(own));
        }
        BlockReport {
            limiter_gain_min,
            ..self.take_report(frames)
        }
    }

    /// The chunks of the next `frames` frames.
    fn chunks(&self, frames: usize) -> Chunks {
        let left = |listener: usize| self.outputs.get(listener).map_or(0, |output| output.left);
        Chunks::new(self.now, std::array::from_fn(left), frames)
    }

    /// The counts since the last report.
    fn take_report(&mut self, frames: usize) -> BlockReport {
        let mut report = BlockReport {
            frames: frames as u32,
            ..std::mem::take(&mut self.report)
        };
        for output in &mut self.outputs {
            let dropped = output.take_dropped();
            report.dropped_paths += dropped.paths;
            report.dropped_delays += dropped.delays;
            report.late_starts += dropped.late_starts;
            report.voices += output.voices();
        }
        report
    }

    /// Replaces values that are not finite by zero, and counts them.
    fn silence_non_finite(&mut self, output: &mut [f32]) {
        for value in output {
            if !value.is_finite() {
                *value = 0.0;
                self.report.non_finite += 1;
            }
        }
    }

    /// Advances the time behind a chunk.
    fn advance(&mut self, chunk: &Chunk) {
        self.now = chunk.now + chunk.frames as i64;
        for output in &mut self.outputs {
            output.left = output.left.saturating_sub(chunk.frames as u32);
        }
    }

    /// Splits a chunk of the sources of one filter into bands and appends it to their delay lines.
    fn write_sources(&mut self, group: usize, inputs: &[&[f32]], chunk: &Chunk) {
        let (first, start, frames) = (group * self.signals, chunk.start, chunk.frames);
        let filter = &mut self.filters[group];
        let mut sounding: [bool; SIGNALS] = std::array::from_fn(|n| filter.is_sounding(n));
        for (n, clean) in self.clean.iter_mut().enumerate().take(self.signals) {
            let input = inputs.get(n).and_then(|input| input.get(start..));
            let input = input.unwrap_or_default();
            let Some(own) = self.inputs.get_mut(first + n) else {
                continue;
            };
            let taken = own.take(input, &mut clean[..frames]);
            self.report.non_finite += taken.non_finite;
            sounding[n] |= !taken.is_silent;
        }
        if sounding.contains(&true) {
            let clean = self.clean.each_ref().map(|clean| &clean[..frames]);
            filter.process(clean, self.bands.each_mut().map(|b| &mut b[..frames]));
        }
        let lines = self.lines.iter_mut().skip(first).take(self.signals);
        for ((line, bands), sounds) in lines.zip(&self.bands).zip(sounding) {
            if sounds {
                line.write(chunk.now, &bands[..frames]);
            } else if !line.is_empty(chunk.now) {
                line.write_silence(chunk.now, frames);
            }
        }
    }
}
