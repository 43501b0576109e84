//! A first-order sound field around the listener: the signals of Ambisonic clips, fixed in the world, in the layout of the
//! output.
//!
//! [`FieldRotation`] and [`FieldDecoder`] run on the audio side, wait-free, bounded by the chunk; a decoder is made on the control
//! side. The four signals of a frame are the pressure and its components along +x, +y and +z. They are turned into head
//! coordinates once, for all outputs. Loudspeakers get what plane waves from all directions would give them by the layout's own panning
//! law (\[ZOTTER12\]); Ambisonics passes on; ears have filters ([`field_filters`]).

use glam::{Mat3, Quat, Vec3};

use crate::generation::CHUNK;
use crate::generation::Hrtf;
use crate::generation::binaural::field_filters::field_filters;
use crate::generation::binaural::filter_bank::filter;
use crate::generation::panning::direction_table::{CHANNEL_GAIN, DirectionTable};
use crate::generation::panning::layout::Layout;
use crate::generation::reverb::wave_shares::wave_directions;
use crate::simd::{F32x8, LaneSet};

/// Signals of a field.
pub(crate) const FIELD_SIGNALS: usize = 4;

/// Samples of at least this magnitude and NaN are replaced by zero: sums stay finite.
const MAX_SAMPLE: f32 = 1e6;

/// Weight of the components for loudspeakers: the most concentrated energy, without loud loudspeakers opposite to the sound.
const MAX_ENERGY_VECTOR: f32 = 0.577_350_3;

/// Turns the field into head coordinates, smoothly from graphics frame to graphics frame.
#[derive(Debug)]
pub(crate) struct FieldRotation {
    now: Mat3,
    target: Mat3,
    growth: Mat3,
    left: u32,
    has_orientation: bool,
}

impl FieldRotation {
    pub(crate) fn new() -> Self {
        Self {
            now: Mat3::IDENTITY,
            target: Mat3::IDENTITY,
            growth: Mat3::ZERO,
            left: 0,
            has_orientation: false,
        }
    }

    /// Ramps to an orientation; the first one applies at once.
    pub(crate) fn set_orientation(&mut self, to_head: Quat, ramp: u32) {
        self.target = Mat3::from_quat(to_head);
        if !std::mem::replace(&mut self.has_orientation, true) {
            self.now = self.target;
        }
        self.left = ramp;
        self.growth = (self.target - self.now) * (1.0 / ramp as f32);
    }

    fn advance(&mut self) -> Mat3 {
        if self.left > 0 {
            self.left -= 1;
            self.now = match self.left {
                0 => self.target,
                _ => self.now + self.growth,
            };
        }
        self.now
    }

    /// Advances without sound.
    pub(crate) fn skip(&mut self, frames: usize) {
        let passed = self.left.min(frames as u32);
        self.left -= passed;
        self.now = match self.left {
            0 => self.target,
            _ => self.now + self.growth * passed as f32,
        };
    }

    /// Writes the field of AmbiX signals (W, Y, Z, X) in head coordinates, each frame twice side by side. A missing signal is
    /// silence.
    pub(crate) fn turn(&mut self, signals: [&[f32]; FIELD_SIGNALS], field: &mut [F32x8]) {
        for (n, lanes) in field.iter_mut().enumerate() {
            let sample = |signal: &[f32]| signal.get(n).copied().filter(|s| s.abs() < MAX_SAMPLE);
            let [w, y, z, x] = signals.map(|signal| sample(signal).unwrap_or(0.0));
            // AmbiX: x ahead, y to the left, z up; here ahead is −z.
            let turned = self.advance() * Vec3::new(-y, z, -x);
            let four = [w, turned.x, turned.y, turned.z];
            let [w, x, y, z] = four;
            *lanes = F32x8([w, x, y, z, w, x, y, z]);
        }
    }
}

/// What becomes of the field.
#[derive(Debug)]
enum Decoding {
    /// Gains of the signals in each channel.
    Channels(Vec<[f32; FIELD_SIGNALS]>),
    /// Filters of both ears.
    Ears {
        taps: Vec<F32x8>,
        /// Past frames, then the present chunk.
        signals: Vec<F32x8>,
        filtered: Vec<F32x8>,
    },
}

/// The field in one output.
#[derive(Debug)]
pub(crate) struct FieldDecoder {
    set: LaneSet,
    decoding: Decoding,
    /// Frames since the last sound.
    quiet_frames: usize,
    gain: f32,
    target_gain: f32,
    growth: f32,
}

impl FieldDecoder {
    /// For a layout with this table, of `channels` channels in use; an HRTF set of binaural sound.
    pub(crate) fn new(
        layout: Layout,
        table: &DirectionTable,
        channels: usize,
        hrtf: &Hrtf,
    ) -> Self {
        let decoding = match layout {
            Layout::Binaural => {
                let taps = field_filters(hrtf);
                Decoding::Ears {
                    signals: vec![F32x8::ZERO; taps.len() - 1 + CHUNK],
                    filtered: vec![F32x8::ZERO; CHUNK],
                    taps,
                }
            }
            _ if layout.ambisonics_order().is_some() => Decoding::Channels(passed_on()),
            _ => Decoding::Channels(channel_gains(table, channels)),
        };
        let mut decoder = Self {
            set: LaneSet::best(),
            decoding,
            quiet_frames: 0,
            gain: 1.0,
            target_gain: 1.0,
            growth: 0.0,
        };
        decoder.quiet_frames = decoder.tail_frames();
        decoder
    }

    /// Frames until silence after the last sound.
    pub(crate) fn tail_frames(&self) -> usize {
        match &self.decoding {
            Decoding::Channels(_) => 0,
            Decoding::Ears { taps, .. } => taps.len() - 1,
        }
    }

    /// Is silent until [`Self::ramp_to`].
    pub(crate) fn start_silent(&mut self) {
        (self.gain, self.target_gain) = (0.0, 0.0);
    }

    /// Ramps its gain within so many frames.
    pub(crate) fn ramp_to(&mut self, gain: f32, ramp: u32) {
        self.target_gain = gain;
        self.growth = (gain - self.gain) / ramp.max(1) as f32;
    }

    /// The gain of the next frame.
    fn advance_gain(&mut self) -> f32 {
        let left = self.target_gain - self.gain;
        self.gain = match left.abs() <= self.growth.abs() || self.growth == 0.0 {
            true => self.target_gain,
            false => self.gain + self.growth,
        };
        self.gain
    }

    /// Adds a chunk to interleaved frames of `stride` channels. `field` is as of [`FieldRotation::turn`]; `None` is silence.
    pub(crate) fn add(&mut self, field: Option<&[F32x8]>, output: &mut [f32], stride: usize) {
        let frames = output.len() / stride;
        if field.is_none() {
            let tail = self.tail_frames();
            if self.quiet_frames >= tail {
                for _ in 0..frames {
                    self.advance_gain();
                }
                return;
            }
            self.quiet_frames += frames;
        } else {
            self.quiet_frames = 0;
        }
        let mut decoding = std::mem::replace(&mut self.decoding, Decoding::Channels(Vec::new()));
        match &mut decoding {
            Decoding::Channels(gains) => {
                let field = field.unwrap_or_default();
                for (frame, lanes) in output.chunks_exact_mut(stride).zip(field) {
                    let gain = self.advance_gain();
                    for (sample, gains) in frame.iter_mut().zip(gains.iter()) {
                        let parts = lanes.0.iter().zip(gains);
                        *sample += gain * parts.map(|(signal, gain)| signal * gain).sum::<f32>();
                    }
                }
            }
            Decoding::Ears {
                taps,
                signals,
                filtered,
            } => {
                let history = taps.len() - 1;
                for (n, slot) in signals[history..history + frames].iter_mut().enumerate() {
                    let gain = self.advance_gain();
                    let lanes = field.map_or(F32x8::ZERO, |field| field[n]);
                    *slot = F32x8(lanes.0.map(|signal| gain * signal));
                }
                let filtered = &mut filtered[..frames];
                filtered.fill(F32x8::ZERO);
                filter(self.set, taps, &signals[..history + frames], filtered);
                signals.copy_within(frames..frames + history, 0);
                for (frame, lanes) in output.chunks_exact_mut(stride).zip(filtered.iter()) {
                    let (left, right) = lanes.0.split_at(FIELD_SIGNALS);
                    for (sample, ear) in frame.iter_mut().zip([left, right]) {
                        *sample += ear.iter().sum::<f32>();
                    }
                }
            }
        }
        self.decoding = decoding;
    }
}

/// Ambisonics: W, Y, Z, X.
fn passed_on() -> Vec<[f32; FIELD_SIGNALS]> {
    let gains = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, -1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, -1.0],
    ];
    gains
        .map(|row| row.map(|gain| CHANNEL_GAIN * gain))
        .to_vec()
}

/// Gains of plane waves from all directions, with the energy of two ears in the mean over a sound's directions.
fn channel_gains(table: &DirectionTable, channels: usize) -> Vec<[f32; FIELD_SIGNALS]> {
    let mut gains = vec![[0.0; FIELD_SIGNALS]; channels];
    let mut weights = vec![F32x8::ZERO; table.width()];
    for direction in wave_directions() {
        table.look_up(direction, &mut weights);
        let side = 3.0 * MAX_ENERGY_VECTOR * direction;
        let factors = [1.0, side.x, side.y, side.z];
        let lanes = weights.iter().flat_map(|group| group.0);
        for (row, weight) in gains.iter_mut().zip(lanes) {
            for (gain, factor) in row.iter_mut().zip(factors) {
                *gain += weight * factor;
            }
        }
    }
    let energy: f32 = gains
        .iter()
        .map(|[w, x, y, z]| w * w + (x * x + y * y + z * z) / 3.0)
        .sum();
    let scale = CHANNEL_GAIN / energy.max(f32::MIN_POSITIVE).sqrt();
    for gain in gains.as_flattened_mut() {
        *gain *= scale;
    }
    gains
}
