//! Renders the paths of each graphics frame in the layout of the output.
//!
//! Audio side: one thread alternately calls [`Generator::set_frame`], or the functions that prepare a frame in parts, and
//! [`Generator::render`]. They are wait-free: no allocation, lock, panic or clock. Input: [`FramePaths`] and one mono signal
//! per source; output: interleaved channels and a [`BlockReport`].

mod source_buses;

use std::sync::Arc;

use glam::Quat;

use crate::error::Result;
use crate::extrapolation::FramePaths;
use crate::simd::F32x8;

use super::{BandCorrection, BandFilter, BlockReport, CHUNK, GeneratorSettings, Hrtf, Limiter};
use crate::generation::bands::air_filter::AirFilter;
use crate::generation::bands::band_filter::SIGNALS;
use crate::generation::delay::delay_line::DelayLine;
use crate::generation::delay::interpolation::AHEAD;
use crate::generation::output_stage::OutputStage;
use crate::generation::ramp::{ChunkSpan, Chunks};
use crate::generation::render_context::{Dropped, RenderContext, SlotOwner};
use crate::generation::reverb::late_reverb::LateReverb;

/// Longest block in audio frames whose sources are rendered apart.
const MAX_BLOCK: usize = 4096;

/// Input samples of at least this magnitude and NaN are replaced by zero: squares stay finite.
const MAX_SAMPLE: f32 = 1e6;

/// The voices' inputs, borrowed field by field.
macro_rules! context {
    ($generator:ident, $table:expr, $frame:expr, $ramp:expr) => {
        RenderContext {
            table: &$table,
            correction: &$generator.correction,
            air: &$generator.air,
            air_np_per_s: $frame.high_air_np_per_s,
            to_head: orientation(&$frame.orientation).conjugate(),
            rate_hz: $generator.rate_hz,
            max_delay: $generator.max_delay,
            now: $generator.now,
            left: $generator.left,
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
    max_delay: f64,
    /// Channels of the output.
    channels: usize,
    correction: BandCorrection,
    air: AirFilter,
    /// Sources per filter: four, or one if sources can be rendered apart.
    signals: usize,
    filters: Vec<BandFilter>,
    lines: Vec<DelayLine>,
    owners: Vec<SlotOwner>,
    late: Option<LateReverb>,
    stage: Box<OutputStage>,
    /// The stage from the next frame on.
    next_stage: Option<Box<OutputStage>>,
    /// The stage before the last change, while it fades out and until it is retired.
    last_stage: Option<Box<OutputStage>>,
    limiter: Option<Limiter>,
    /// Audio frames since the start.
    now: i64,
    /// Frames left of the present ramp.
    left: u32,
    /// Input of four sources with invalid samples replaced, and its bands.
    clean: [Vec<f32>; SIGNALS],
    bands: [Vec<F32x8>; SIGNALS],
    /// Gains of a signal without position in the first two channels.
    bed_gains: [[f32; 2]; 2],
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
        settings.check()?;
        let stage = Box::new(OutputStage::new(&settings, &hrtf)?);
        let channels = settings.output_channels();
        let rate_hz = f64::from(settings.rate_hz);
        let max_delay = (settings.max_delay_s * rate_hz).ceil();
        let limiter = match settings.limiter {
            true => Some(Limiter::new(
                settings.rate_hz,
                channels,
                settings.ceiling_db,
            )?),
            false => None,
        };
        let sources = settings.max_sources;
        let (signals, block) = match settings.source_buses {
            true => (1, MAX_BLOCK),
            false => (SIGNALS, 0),
        };
        Ok(Self {
            rate_hz,
            max_delay,
            channels,
            correction: BandCorrection::new(settings.rate_hz),
            air: AirFilter::new(settings.rate_hz),
            signals,
            filters: (0..sources.div_ceil(signals))
                .map(|_| BandFilter::new(settings.rate_hz))
                .collect(),
            lines: (0..sources)
                .map(|_| DelayLine::new(max_delay as usize + block))
                .collect(),
            owners: vec![SlotOwner::NONE; sources],
            late: settings
                .late
                .then(|| LateReverb::new(settings.rate_hz, sources)),
            bed_gains: stage.bed_gains(),
            stage,
            next_stage: None,
            last_stage: None,
            limiter,
            now: 0,
            left: 0,
            clean: std::array::from_fn(|_| vec![0.0; CHUNK]),
            bands: std::array::from_fn(|_| vec![F32x8::ZERO; CHUNK]),
            report: BlockReport::default(),
        })
    }

    /// Channels of the output; constant.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Renders by another stage from the next frame on: all paths start in it and fade out in the present one. Only while
    /// [`Self::can_change_stage`]. Real-time.
    pub(crate) fn change_stage(&mut self, mut stage: Box<OutputStage>) {
        debug_assert!(self.can_change_stage(), "a stage is still fading");
        stage.start_silent();
        self.next_stage = Some(stage);
    }

    /// Whether no stage fades out or waits. Real-time.
    pub(crate) fn can_change_stage(&self) -> bool {
        self.next_stage.is_none() && self.last_stage.is_none()
    }

    /// The stage that has faded out, once, for the control side to free. Real-time.
    pub(crate) fn take_retired_stage(&mut self) -> Option<Box<OutputStage>> {
        self.last_stage.take_if(|stage| stage.is_over())
    }

    /// Latency in frames besides path and ear delays: interpolation and limiter.
    pub fn latency_frames(&self) -> usize {
        AHEAD + self.limiter.as_ref().map_or(0, Limiter::latency_frames)
    }

    /// Sets a graphics frame: all values ramp linearly to those of the frame within `ramp_frames` audio frames, usually the
    /// length of a graphics frame, and then stay constant. 0 counts as 1.
    ///
    /// A new path starts from silence at its own delay; a missing one fades out at its last delay; one whose delay changes
    /// by more than a quarter of `ramp_frames` does both.
    ///
    /// Real-time: no allocation; time grows at most as n log n with the number n of paths.
    pub fn set_frame(&mut self, frame: &FramePaths, ramp_frames: u32) {
        let stage = self.next_stage.as_mut().unwrap_or(&mut self.stage);
        stage.voices.discard_paths();
        self.set_prepared_frame(frame, ramp_frames);
    }

    /// Prepares up to `most` further paths of a graphics frame; returns whether all are prepared. All calls until
    /// [`Self::set_prepared_frame`] must have the same frame; [`Self::set_frame`] discards the preparation.
    ///
    /// Real-time, on the rendering thread: no allocation; time grows with `most`, and slowly with the number of paths.
    pub fn prepare_frame(&mut self, frame: &FramePaths, most: usize) -> bool {
        let stage = self.next_stage.as_mut().unwrap_or(&mut self.stage);
        let context = context!(self, stage.table, frame, 1);
        let paths = &frame.paths;
        let voices = &mut stage.voices;
        voices.prepare_paths(paths, &self.owners, &context, most)
    }

    /// [`Self::set_frame`] for a frame of [`Self::prepare_frame`]: the same result, bit for bit, in less time. Prepares the
    /// remaining paths. Real-time, as [`Self::set_frame`].
    pub fn set_prepared_frame(&mut self, frame: &FramePaths, ramp_frames: u32) {
        let ramp = ramp_frames.max(1);
        self.update_owners(frame);
        self.apply_next_stage(frame, ramp);
        let stage = &mut self.stage;
        let context = context!(self, stage.table, frame, ramp);
        let voices = &mut stage.voices;
        let dropped = voices.set_paths(&frame.paths, &self.owners, &context);
        self.update_late(frame, dropped, ramp);
    }

    /// [`Self::set_prepared_frame`], except that new and jumping paths wait for [`Self::start_voices`]; returns their number.
    /// The next frame discards paths that still wait, unless it has them too.
    ///
    /// Real-time, as [`Self::set_prepared_frame`].
    pub fn take_prepared_frame(&mut self, frame: &FramePaths, ramp_frames: u32) -> usize {
        let ramp = ramp_frames.max(1);
        self.update_owners(frame);
        self.apply_next_stage(frame, ramp);
        let stage = &mut self.stage;
        let context = context!(self, stage.table, frame, ramp);
        let voices = &mut stage.voices;
        let dropped = voices.take_paths(&frame.paths, &self.owners, &context);
        self.update_late(frame, dropped, ramp);
        self.stage.voices.pending_count()
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
        let context = RenderContext {
            table: &self.stage.table,
            correction: &self.correction,
            air: &self.air,
            air_np_per_s: Default::default(),
            to_head: Quat::IDENTITY,
            rate_hz: self.rate_hz,
            max_delay: self.max_delay,
            now: self.now,
            left: self.left,
            ramp: self.left.max(CHUNK as u32),
        };
        self.stage.voices.start(most, &self.owners, &context)
    }

    /// Exchanges the stages at the frame of a change, and fades the last one.
    fn apply_next_stage(&mut self, frame: &FramePaths, ramp: u32) {
        let Some(next) = self.next_stage.take() else {
            return;
        };
        let mut last = std::mem::replace(&mut self.stage, next);
        let table = Arc::clone(&last.table);
        last.fade(&self.owners, &context!(self, table, frame, ramp));
        self.last_stage = Some(last);
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
                    self.filters[id.slot() / self.signals].reset(id.slot() % self.signals);
                }
                owner.bits = bits;
            }
        }
    }

    /// Applies a frame's late reverb.
    fn update_late(&mut self, frame: &FramePaths, dropped: Dropped, ramp: u32) {
        self.report.dropped_paths += dropped.paths;
        self.report.dropped_delays += dropped.delays;
        self.report.late_starts += dropped.late_starts;
        if let Some(late) = &mut self.late {
            let to_head = orientation(&frame.orientation).conjugate();
            self.stage.set_orientation(to_head, self.left, ramp);
            late.set_frame(
                frame,
                self.max_delay as i64,
                &self.correction,
                self.left,
                ramp,
            );
        }
        self.left = ramp;
    }

    /// Renders `output.len() / channels` frames of interleaved [`Self::channels`], overwriting `output`.
    ///
    /// `inputs` holds one mono signal per source slot, in which 1 is the pressure at 1 m in the free field. An empty or
    /// missing signal is silence; a short one is padded with silence.
    ///
    /// Real-time: no allocation; time grows with frames, active sources and voices. Sources with an empty delay line and a
    /// decayed late reverb are skipped.
    pub fn render(&mut self, inputs: &[&[f32]], output: &mut [f32]) -> BlockReport {
        self.render_with_bed(inputs, [&[]; 2], output)
    }

    /// [`Self::render`] with a signal that is heard as it is, without a position, in front of the limiter: the mean of left and
    /// right, and half their difference. Either may be empty.
    pub fn render_with_bed(
        &mut self,
        inputs: &[&[f32]],
        bed: [&[f32]; 2],
        output: &mut [f32],
    ) -> BlockReport {
        let channels = self.channels;
        let frames = output.len() / channels;
        for (start, chunk) in Chunks::new(self.now, self.left, frames) {
            let end = start + chunk.frames;
            self.render_chunk(
                inputs,
                start,
                chunk,
                &mut output[channels * start..channels * end],
            );
        }
        output[channels * frames..].fill(0.0);
        self.add_bed(bed, output);
        let mut report = self.take_report(frames);
        if let Some(limiter) = &mut self.limiter {
            report.limiter_gain_min = limiter.process(output);
        }
        report
    }

    /// The counts since the last report.
    fn take_report(&mut self, frames: usize) -> BlockReport {
        let stages = self.last_stage.iter().chain([&self.stage]);
        BlockReport {
            frames: frames as u32,
            voices: stages.map(|stage| stage.voices.count() as u32).sum(),
            ..std::mem::take(&mut self.report)
        }
    }

    /// Adds a signal without position; its gains glide where the layout has changed.
    fn add_bed(&mut self, bed: [&[f32]; 2], output: &mut [f32]) {
        const STEP: f32 = 1.0 / CHUNK as f32;
        let targets = self.stage.bed_gains();
        for (signal, (gains, targets)) in bed.iter().zip(self.bed_gains.iter_mut().zip(targets)) {
            for (frame, sample) in output.chunks_exact_mut(self.channels).zip(*signal) {
                let gains = gains.iter_mut().zip(targets);
                for (value, (gain, target)) in frame.iter_mut().zip(gains) {
                    *gain += (target - *gain).clamp(-STEP, STEP);
                    if sample.abs() < MAX_SAMPLE {
                        *value += *gain * sample;
                    }
                }
            }
        }
    }

    /// Renders a chunk within which no ramp ends.
    fn render_chunk(
        &mut self,
        inputs: &[&[f32]],
        start: usize,
        chunk: ChunkSpan,
        output: &mut [f32],
    ) {
        for group in 0..self.filters.len() {
            let first = group * self.signals;
            self.write_sources(group, inputs.get(first..).unwrap_or_default(), start, chunk);
        }
        output.fill(0.0);
        self.stage.add_voices(&self.lines, chunk);
        let mut last_stage = self.last_stage.as_mut().filter(|stage| !stage.is_over());
        if let Some(last) = &mut last_stage {
            last.add_voices(&self.lines, chunk);
        }
        if let Some(reverb) = &mut self.late {
            for (slot, line) in self.lines.iter().enumerate() {
                reverb.collect(slot, line, chunk);
            }
            let waves = reverb.process(chunk.left, chunk.frames);
            self.stage.add_waves(chunk, waves);
            if let Some(last) = &mut last_stage {
                last.add_waves(chunk, waves);
            }
        }
        self.stage.finish(output, self.channels);
        if let Some(last) = last_stage {
            last.finish(output, self.channels);
        }
        self.silence_non_finite(output);
        self.advance(chunk);
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
    fn advance(&mut self, chunk: ChunkSpan) {
        self.now = chunk.now + chunk.frames as i64;
        self.left = chunk.left.saturating_sub(chunk.frames as u32);
    }

    /// Splits a chunk of the sources of one filter into bands and appends it to their delay lines.
    fn write_sources(&mut self, group: usize, inputs: &[&[f32]], start: usize, chunk: ChunkSpan) {
        let (first, frames) = (group * self.signals, chunk.frames);
        let filter = &mut self.filters[group];
        let mut sounding: [bool; SIGNALS] = std::array::from_fn(|n| filter.is_sounding(n));
        for (n, clean) in self.clean.iter_mut().enumerate().take(self.signals) {
            let input = inputs.get(n).and_then(|input| input.get(start..));
            let input = input.unwrap_or_default();
            let clean = &mut clean[..frames];
            clean[input.len().min(frames)..].fill(0.0);
            let mut non_finite = 0;
            let mut is_silent = true;
            for (clean, &sample) in clean.iter_mut().zip(input) {
                let is_sample = sample.abs() < MAX_SAMPLE;
                *clean = if is_sample { sample } else { 0.0 };
                is_silent &= *clean == 0.0;
                non_finite += u32::from(!is_sample);
            }
            self.report.non_finite += non_finite;
            sounding[n] |= !is_silent;
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
