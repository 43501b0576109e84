//! Renders the paths of each graphics frame binaurally.
//!
//! Audio side: one thread alternately calls [`Generator::set_frame`], or the functions that prepare a frame in parts, and
//! [`Generator::render`]. They are wait-free: no allocation, lock, panic or clock. Input: [`FramePaths`] and one mono signal
//! per source; output: interleaved stereo and a [`BlockReport`].

use std::sync::Arc;

use glam::Quat;

use crate::error::{Error, Result};
use crate::extrapolation::FramePaths;
use crate::simd::F32x8;

use super::{BandCorrection, BandFilter, BlockReport, CHUNK, GeneratorSettings, Hrtf, Limiter};
use crate::generation::bands::air_filter::AirFilter;
use crate::generation::bands::band_filter::SIGNALS;
use crate::generation::binaural::far_field::FarField;
use crate::generation::binaural::filter_bank::Binaural;
use crate::generation::delay::delay_line::DelayLine;
use crate::generation::delay::interpolation::AHEAD;
use crate::generation::ramp::ChunkSpan;
use crate::generation::render_context::{Dropped, RenderContext, SlotOwner};
use crate::generation::reverb::late_reverb::LateReverb;
use crate::generation::voices::voice_set::VoiceSet;

/// Input samples of at least this magnitude and NaN are replaced by zero: squares stay finite.
const MAX_SAMPLE: f32 = 1e6;

/// The voices' inputs, borrowed field by field.
macro_rules! context {
    ($generator:ident, $frame:expr, $ramp:expr) => {
        RenderContext {
            hrtf: &$generator.hrtf,
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

/// The late reverb and its rendering.
#[derive(Debug)]
struct LateField {
    reverb: LateReverb,
    far_field: FarField,
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
    hrtf: Arc<Hrtf>,
    correction: BandCorrection,
    air: AirFilter,
    /// One filter per four sources.
    filters: Vec<BandFilter>,
    lines: Vec<DelayLine>,
    owners: Vec<SlotOwner>,
    voices: VoiceSet,
    late: Option<LateField>,
    binaural: Binaural,
    limiter: Option<Limiter>,
    /// Audio frames since the start.
    now: i64,
    /// Frames left of the present ramp.
    left: u32,
    /// Input of four sources with invalid samples replaced, and its bands.
    clean: [Vec<f32>; SIGNALS],
    bands: [Vec<F32x8>; SIGNALS],
    ears: [Vec<f32>; 2],
    report: BlockReport,
}

impl Generator {
    /// A silent generator. Control side; allocates.
    ///
    /// Errors: [`Error::Setting`] for a setting out of range, or an HRTF set with a different sample rate.
    pub fn new(settings: GeneratorSettings, hrtf: Arc<Hrtf>) -> Result<Self> {
        settings.check()?;
        if hrtf.rate_hz() != settings.rate_hz {
            return Err(Error::setting(
                "rate_hz",
                format!(
                    "{} Hz, but the HRTF set is for {} Hz",
                    settings.rate_hz,
                    hrtf.rate_hz()
                ),
                "load the set that is baked for this rate",
            ));
        }
        let rate_hz = f64::from(settings.rate_hz);
        let max_delay = (settings.max_delay_s * rate_hz).ceil();
        let limiter = match settings.limiter {
            true => Some(Limiter::new(settings.rate_hz, settings.ceiling_db)?),
            false => None,
        };
        let sources = settings.max_sources;
        Ok(Self {
            rate_hz,
            max_delay,
            correction: BandCorrection::new(settings.rate_hz),
            air: AirFilter::new(settings.rate_hz),
            filters: (0..sources.div_ceil(SIGNALS))
                .map(|_| BandFilter::new(settings.rate_hz))
                .collect(),
            lines: (0..sources)
                .map(|_| DelayLine::new(max_delay as usize))
                .collect(),
            owners: vec![SlotOwner::NONE; sources],
            voices: VoiceSet::new(
                settings.max_voices,
                settings.fine_voices.min(settings.max_voices),
                &hrtf,
            ),
            late: settings.late.then(|| LateField {
                reverb: LateReverb::new(settings.rate_hz, sources),
                far_field: FarField::new(&hrtf),
            }),
            binaural: Binaural::new(&hrtf),
            limiter,
            now: 0,
            left: 0,
            clean: std::array::from_fn(|_| vec![0.0; CHUNK]),
            bands: std::array::from_fn(|_| vec![F32x8::ZERO; CHUNK]),
            ears: std::array::from_fn(|_| vec![0.0; CHUNK]),
            report: BlockReport::default(),
            hrtf,
        })
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
        self.voices.discard_paths();
        self.set_prepared_frame(frame, ramp_frames);
    }

    /// Prepares up to `most` further paths of a graphics frame; returns whether all are prepared. All calls until
    /// [`Self::set_prepared_frame`] must have the same frame; [`Self::set_frame`] discards the preparation.
    ///
    /// Real-time, on the rendering thread: no allocation; time grows with `most`, and slowly with the number of paths.
    pub fn prepare_frame(&mut self, frame: &FramePaths, most: usize) -> bool {
        let context = context!(self, frame, 1);
        let paths = &frame.paths;
        self.voices
            .prepare_paths(paths, &self.owners, &context, most)
    }

    /// [`Self::set_frame`] for a frame of [`Self::prepare_frame`]: the same result, bit for bit, in less time. Prepares the
    /// remaining paths. Real-time, as [`Self::set_frame`].
    pub fn set_prepared_frame(&mut self, frame: &FramePaths, ramp_frames: u32) {
        let ramp = ramp_frames.max(1);
        self.update_owners(frame);
        let context = context!(self, frame, ramp);
        let dropped = self.voices.set_paths(&frame.paths, &self.owners, &context);
        self.update_late(frame, dropped, ramp);
    }

    /// [`Self::set_prepared_frame`], except that new and jumping paths wait for [`Self::start_voices`]; returns their number.
    /// The next frame discards paths that still wait, unless it has them too.
    ///
    /// Real-time, as [`Self::set_prepared_frame`].
    pub fn take_prepared_frame(&mut self, frame: &FramePaths, ramp_frames: u32) -> usize {
        let ramp = ramp_frames.max(1);
        self.update_owners(frame);
        let context = context!(self, frame, ramp);
        let dropped = self.voices.take_paths(&frame.paths, &self.owners, &context);
        self.update_late(frame, dropped, ramp);
        self.voices.pending_count()
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
            hrtf: &self.hrtf,
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
        self.voices.start(most, &self.owners, &context)
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
                    self.filters[id.slot() / SIGNALS].reset(id.slot() % SIGNALS);
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
            late.far_field
                .set_orientation(&self.hrtf, to_head, self.left, ramp);
            late.reverb.set_frame(
                frame,
                self.max_delay as i64,
                &self.correction,
                self.left,
                ramp,
            );
        }
        self.left = ramp;
    }

    /// Renders `output.len() / 2` frames of interleaved stereo, overwriting `output`.
    ///
    /// `inputs` holds one mono signal per source slot, in which 1 is the pressure at 1 m in the free field. An empty or
    /// missing signal is silence; a short one is padded with silence.
    ///
    /// Real-time: no allocation; time grows with frames, active sources and voices. Sources with an empty delay line and a
    /// decayed late reverb are skipped.
    pub fn render(&mut self, inputs: &[&[f32]], output: &mut [f32]) -> BlockReport {
        self.render_with_bed(inputs, &[], output)
    }

    /// [`Self::render`] with a mono signal that is heard as it is, without a position, in front of the limiter.
    pub fn render_with_bed(
        &mut self,
        inputs: &[&[f32]],
        bed: &[f32],
        output: &mut [f32],
    ) -> BlockReport {
        let frames = output.len() / 2;
        let mut start = 0;
        while start < frames {
            let mut count = (frames - start).min(CHUNK);
            if self.left > 0 {
                count = count.min(self.left as usize);
            }
            self.render_chunk(inputs, start, &mut output[2 * start..2 * (start + count)]);
            start += count;
        }
        output[2 * frames..].fill(0.0);
        for (pair, sample) in output.chunks_exact_mut(2).zip(bed) {
            if sample.abs() < MAX_SAMPLE {
                pair.iter_mut().for_each(|value| *value += sample);
            }
        }
        let mut report = std::mem::take(&mut self.report);
        if let Some(limiter) = &mut self.limiter {
            report.limiter_gain_min = limiter.process(output);
        }
        report.frames = frames as u32;
        report.voices = self.voices.count() as u32;
        report
    }

    /// Renders a chunk within which no ramp ends.
    fn render_chunk(&mut self, inputs: &[&[f32]], start: usize, output: &mut [f32]) {
        let frames = output.len() / 2;
        for quartet in 0..self.filters.len() {
            self.write_sources(quartet, inputs, start, frames);
        }
        let chunk = ChunkSpan {
            now: self.now,
            left: self.left,
            frames,
        };
        self.voices.render(&self.lines, chunk, &mut self.binaural);
        if let Some(LateField { reverb, far_field }) = &mut self.late {
            for (slot, line) in self.lines.iter().enumerate() {
                reverb.collect(slot, line, chunk);
            }
            let left = self.left;
            far_field.render(left, frames, &mut self.binaural, |signals, at| {
                reverb.process(left, signals, at, frames)
            });
        }
        let [ear_l, ear_r] = &mut self.ears;
        let (ear_l, ear_r) = (&mut ear_l[..frames], &mut ear_r[..frames]);
        self.binaural.finish([ear_l, ear_r]);
        for (pair, (&l, &r)) in output
            .chunks_exact_mut(2)
            .zip(ear_l.iter().zip(ear_r.iter()))
        {
            pair[0] = l;
            pair[1] = r;
            for value in pair {
                if !value.is_finite() {
                    *value = 0.0;
                    self.report.non_finite += 1;
                }
            }
        }
        self.now += frames as i64;
        self.left = self.left.saturating_sub(frames as u32);
    }

    /// Splits the chunk of four sources into bands and appends it to their delay lines.
    fn write_sources(&mut self, quartet: usize, inputs: &[&[f32]], start: usize, frames: usize) {
        let first = quartet * SIGNALS;
        let filter = &mut self.filters[quartet];
        let mut sounding: [bool; SIGNALS] = std::array::from_fn(|n| filter.is_sounding(n));
        for (n, clean) in self.clean.iter_mut().enumerate() {
            let input = inputs.get(first + n).and_then(|input| input.get(start..));
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
        let lines = self.lines.iter_mut().skip(first);
        for ((line, bands), sounds) in lines.zip(&self.bands).zip(sounding) {
            if sounds {
                line.write(self.now, &bands[..frames]);
            } else if !line.is_empty(self.now) {
                line.write_silence(self.now, frames);
            }
        }
    }
}
