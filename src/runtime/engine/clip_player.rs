//! A clip that plays: position, loop, pitch, pause, seek and scheduled start.
//!
//! [`ClipPlayer::fill`] and [`ClipPlayer::skip`] run on the audio side and are wait-free, bounded by the block; made and freed on
//! the control side. At pitch 1 samples are copied. Otherwise they are resampled by a windowed sinc, widened by the pitch
//! where it is above 1, so that nothing folds back; the pitch glides from block to block, so neither signal nor phase has a
//! step. A seek cross-fades. A window of Kaiser \[KAISER74\]; the rest is own.

use std::sync::Arc;

use super::playback::{PlayState, PlaybackCell, PlaybackState};
use crate::error::{Error, Result};

/// Audio frames of a fade at a pause or seek.
const FADE_FRAMES: usize = 256;
/// Zero crossings of the kernel on either side at pitch 1.
const CROSSINGS: usize = 8;
/// Table entries from one zero crossing to the next.
const STEPS: usize = 128;
/// Shape of the Kaiser window: side lobes at −80 dB.
const BETA: f64 = 7.86;
/// Greatest change of the pitch per audio frame: an octave in some 20 ms.
const PITCH_SLOPE: f64 = 1.0 / 1024.0;

/// Samples of a clip, at the engine's rate.
#[derive(Debug, Clone)]
pub struct Clip {
    samples: Arc<[f32]>,
    channels: usize,
}

impl Clip {
    /// A clip of one channel; 1 is the pressure at 1 m.
    pub fn mono(samples: impl Into<Arc<[f32]>>) -> Self {
        let samples = samples.into();
        Self {
            samples,
            channels: 1,
        }
    }

    /// A clip of two channels, interleaved, left first. A source with a position plays their mean, a 2D source both. An odd
    /// last sample is left out.
    pub fn stereo(samples: impl Into<Arc<[f32]>>) -> Self {
        let samples = samples.into();
        Self {
            samples,
            channels: 2,
        }
    }

    /// A clip of a first-order sound field in AmbiX form: four interleaved channels W, Y, Z, X in SN3D. On a 2D source it is the
    /// sound around the listener, fixed in the world: its front is −z, its left −x, its top +y, and it turns as the listener's head
    /// does. A source with a position plays W. The last samples, if they are less than four, are left out.
    pub fn ambisonic(samples: impl Into<Arc<[f32]>>) -> Self {
        let samples = samples.into();
        Self {
            samples,
            channels: 4,
        }
    }

    /// A clip of as many interleaved channels as there are: [`Self::mono`], [`Self::stereo`] or [`Self::ambisonic`].
    ///
    /// # Errors
    /// [`Error::Setting`] for another number than 1, 2 and 4.
    pub fn with_channels(samples: impl Into<Arc<[f32]>>, channels: usize) -> Result<Self> {
        match channels {
            1 => Ok(Self::mono(samples)),
            2 => Ok(Self::stereo(samples)),
            4 => Ok(Self::ambisonic(samples)),
            _ => Err(Error::setting(
                "channels",
                format!("{channels} are no clip"),
                "give 1 (mono), 2 (stereo) or 4 (first-order Ambisonics in AmbiX form)",
            )),
        }
    }

    /// Audio frames.
    pub fn frames(&self) -> usize {
        self.samples.len() / self.channels
    }

    /// The samples, interleaved.
    pub fn samples(&self) -> &[f32] {
        &self.samples
    }

    /// Channels: 1, 2 or 4.
    pub fn channels(&self) -> usize {
        self.channels
    }
}

impl From<Arc<[f32]>> for Clip {
    fn from(samples: Arc<[f32]>) -> Self {
        Self::mono(samples)
    }
}

impl From<Vec<f32>> for Clip {
    fn from(samples: Vec<f32>) -> Self {
        Self::mono(samples)
    }
}

/// Signals of a clip beside its first.
pub(crate) const OTHERS: usize = 3;

/// One audio frame: of a stereo clip middle and side (left = middle + side), of a sound field W, Y, Z, X.
type Frame = [f32; 1 + OTHERS];

const SILENT: Frame = [0.0; 1 + OTHERS];

/// Half of the kernel: the sinc times the window, from the middle to the end.
#[derive(Debug)]
pub(crate) struct Kernel {
    values: Vec<f32>,
}

impl Kernel {
    /// Control side; allocates.
    pub(crate) fn new() -> Self {
        let value = |n: usize| {
            let x = n as f64 / STEPS as f64;
            let sinc = match n {
                0 => 1.0,
                _ => (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x),
            };
            let inside = (1.0 - (x / CROSSINGS as f64).powi(2)).max(0.0);
            (sinc * bessel_i0(BETA * inside.sqrt()) / bessel_i0(BETA)) as f32
        };
        let mut values: Vec<f32> = (0..CROSSINGS * STEPS).map(value).collect();
        // The last entry and one beyond it for the interpolation.
        values.extend([0.0; 2]);
        Self { values }
    }

    /// The value at a distance in zero crossings, 0 to [`CROSSINGS`].
    fn at(&self, distance: f32) -> f32 {
        let position = distance * STEPS as f32;
        let below = (position as usize).min(CROSSINGS * STEPS);
        let share = position - below as f32;
        let [from, to] = [self.values[below], self.values[below + 1]];
        from + share * (to - from)
    }
}

/// The modified Bessel function of the first kind of order zero, by its power series.
fn bessel_i0(x: f64) -> f64 {
    let (mut sum, mut term) = (1.0, 1.0);
    for k in 1..40 {
        term *= (x / 2.0 / f64::from(k)).powi(2);
        sum += term;
    }
    sum
}

/// A clip and its position.
pub(crate) struct ClipPlayer {
    clip: Clip,
    /// Frames between which it repeats.
    looped: Option<[usize; 2]>,
    /// Audio frame of the engine at which it starts.
    start_at: u64,
    position: f64,
    /// Whether the loop's end was passed: samples before its start are those before its end.
    has_wrapped: bool,
    pitch: f64,
    /// Gain of a pause, 0 to 1, in [`FADE_FRAMES`] steps.
    pause: usize,
    /// Position before a seek, and frames left of the cross-fade.
    before_seek: f64,
    seek_left: usize,
    /// Serial of the last seek.
    seek: u32,
    /// Number of this playback, which its state names.
    serial: u32,
    cell: Arc<PlaybackCell>,
    kernel: Arc<Kernel>,
}

impl ClipPlayer {
    /// A clip that starts at `position`, at an audio frame of the engine. Control side.
    pub(crate) fn new(
        clip: Clip,
        looped: Option<[usize; 2]>,
        [position, start_at]: [u64; 2],
        serial: u32,
        cell: Arc<PlaybackCell>,
        kernel: Arc<Kernel>,
    ) -> Self {
        Self {
            clip,
            looped,
            start_at,
            position: position as f64,
            has_wrapped: false,
            pitch: 0.0,
            pause: FADE_FRAMES,
            before_seek: 0.0,
            seek_left: 0,
            seek: 0,
            serial,
            cell,
            kernel,
        }
    }

    /// Fills a block with the first signal, the mono mix, and `others` with the rest of a stereo clip or a sound field; returns
    /// the number of signals. `now` is the engine's audio frame at its start.
    pub(crate) fn fill(
        &mut self,
        block: &mut [f32],
        others: [&mut [f32]; OTHERS],
        state: &PlayState,
        now: u64,
    ) -> usize {
        let others = &mut others.map(|other| &mut other[..block.len()])[..self.clip.channels - 1];
        self.apply(state);
        let wait = self.start_at.saturating_sub(now).min(block.len() as u64) as usize;
        block[..wait].fill(0.0);
        for other in others.iter_mut() {
            other[..wait].fill(0.0);
        }
        let is_copied = self.pitch == 1.0
            && state.pitch == 1.0
            && self.position.fract() == 0.0
            && self.seek_left == 0
            && self.pause == if state.is_paused { 0 } else { FADE_FRAMES };
        if is_copied && !state.is_paused && self.clip.channels == 1 {
            self.copy(&mut block[wait..]);
        } else {
            for n in wait..block.len() {
                let frame = match is_copied {
                    true if state.is_paused => SILENT,
                    true => self.copied(),
                    false => self.resampled(state),
                };
                block[n] = frame[0];
                for (other, sample) in others.iter_mut().zip(&frame[1..]) {
                    other[n] = *sample;
                }
            }
        }
        self.report(wait < block.len());
        self.clip.channels
    }

    /// Advances without sound.
    pub(crate) fn skip(&mut self, frames: usize, state: &PlayState, now: u64) {
        self.apply(state);
        let wait = self.start_at.saturating_sub(now).min(frames as u64) as usize;
        let passed = frames - wait;
        (self.seek_left, self.pitch) = (0, f64::from(state.pitch));
        self.pause = if state.is_paused { 0 } else { FADE_FRAMES };
        if !state.is_paused {
            self.position = self.wrapped(self.position + passed as f64 * self.pitch);
        }
        self.report(passed > 0);
    }

    /// The position in whole frames.
    #[cfg(test)]
    pub(crate) fn frame_position(&self) -> u64 {
        self.position as u64
    }

    /// Takes over a seek; the first pitch applies at once.
    fn apply(&mut self, state: &PlayState) {
        if self.pitch == 0.0 {
            self.pitch = f64::from(state.pitch);
        }
        let seek = state.seek_of(self.serial);
        if seek != self.seek {
            self.seek = seek;
            // In a pause nothing is heard that could fade.
            let left = if self.pause == 0 { 0 } else { FADE_FRAMES };
            (self.before_seek, self.seek_left) = (self.position, left);
            self.position = (state.seek_to as f64).min(self.clip.frames() as f64);
            self.has_wrapped = false;
        }
    }

    /// Reports position and state to the control side.
    fn report(&self, has_started: bool) {
        let state = match () {
            () if self.is_over() => PlaybackState::Finished,
            () if !has_started => PlaybackState::Scheduled,
            () if self.pause == 0 => PlaybackState::Paused,
            () => PlaybackState::Playing,
        };
        let playback = [self.serial, self.seek];
        self.cell.store(playback, state, self.position as u64);
    }

    fn is_over(&self) -> bool {
        let tail = CROSSINGS as f64 * self.pitch.max(1.0);
        self.looped.is_none()
            && self.seek_left == 0
            && self.position >= self.clip.frames() as f64 + tail
    }

    /// The frame at an index: of a loop the repeated one, outside the clip silence.
    fn frame(&self, index: i64) -> Frame {
        let mut index = index;
        if let Some([start, end]) = self.looped.map(|range| range.map(|frame| frame as i64)) {
            if index >= end {
                index = start + (index - end) % (end - start);
            } else if index < start && self.has_wrapped {
                index = end - 1 - (start - 1 - index) % (end - start);
            }
        }
        let samples = &self.clip.samples;
        let Ok(index) = usize::try_from(index) else {
            return SILENT;
        };
        match self.clip.channels {
            1 => [samples.get(index).copied().unwrap_or(0.0), 0.0, 0.0, 0.0],
            2 => match samples.get(2 * index..2 * index + 2) {
                Some([a, b]) => [0.5 * (a + b), 0.5 * (a - b), 0.0, 0.0],
                _ => SILENT,
            },
            _ => match samples.get(4 * index..4 * index + 4) {
                Some([w, y, z, x]) => [*w, *y, *z, *x],
                _ => SILENT,
            },
        }
    }

    /// A position within the loop.
    fn wrapped(&mut self, position: f64) -> f64 {
        let length = self.clip.frames() as f64;
        match self.looped.map(|range| range.map(|frame| frame as f64)) {
            Some([start, end]) if position >= end => {
                self.has_wrapped = true;
                start + (position - end) % (end - start)
            }
            Some(_) => position,
            // Beyond the end there is silence; the position stays exact.
            None => position.min(length + 1e6),
        }
    }

    /// The next frames of one channel at pitch 1.
    fn copy(&mut self, block: &mut [f32]) {
        let end = self.looped.map_or(self.clip.frames(), |[_, end]| end);
        let mut done = 0;
        while done < block.len() {
            let first = self.position as usize;
            let count = end.saturating_sub(first).min(block.len() - done);
            if count == 0 {
                break;
            }
            let samples = &self.clip.samples[first..first + count];
            block[done..done + count].copy_from_slice(samples);
            done += count;
            self.position = self.wrapped((first + count) as f64);
        }
        let rest = block.len() - done;
        block[done..].fill(0.0);
        self.position = self.wrapped(self.position + rest as f64);
    }

    fn copied(&mut self) -> Frame {
        let frame = self.frame(self.position as i64);
        self.position = self.wrapped(self.position + 1.0);
        frame
    }

    /// The next frame with its fades.
    fn resampled(&mut self, state: &PlayState) -> Frame {
        self.pause = match state.is_paused {
            true => self.pause.saturating_sub(1),
            false => (self.pause + 1).min(FADE_FRAMES),
        };
        if self.pause == 0 {
            return SILENT;
        }
        let target = f64::from(state.pitch);
        let change = target - self.pitch;
        self.pitch = match change.abs() <= PITCH_SLOPE {
            true => target,
            false => self.pitch + PITCH_SLOPE.copysign(change),
        };
        let mut frame = self.read(self.position);
        if self.seek_left > 0 {
            let before = self.read(self.before_seek);
            let share = smooth(self.seek_left);
            frame = std::array::from_fn(|c| frame[c] + share * (before[c] - frame[c]));
            self.seek_left -= 1;
            self.before_seek += self.pitch;
        }
        let gain = smooth(self.pause);
        self.position = self.wrapped(self.position + self.pitch);
        frame.map(|sample| gain * sample)
    }

    /// The signal at a position between frames.
    fn read(&self, position: f64) -> Frame {
        let below = position.floor();
        let fraction = (position - below) as f32;
        if fraction == 0.0 && self.pitch <= 1.0 {
            return self.frame(below as i64);
        }
        // Above pitch 1 the kernel is wider, and its band narrower.
        let narrowing = 1.0 / (self.pitch as f32).max(1.0);
        let reach = (CROSSINGS as f32 / narrowing) as i64;
        let mut sum = SILENT;
        for offset in 1 - reach..=reach {
            let distance = (offset as f32 - fraction).abs() * narrowing;
            if distance < CROSSINGS as f32 {
                let weight = narrowing * self.kernel.at(distance);
                let frame = self.frame(below as i64 + offset);
                for (sum, sample) in sum.iter_mut().zip(frame) {
                    *sum += weight * sample;
                }
            }
        }
        sum
    }
}

/// Smooth gain of a fade with this many of its frames done.
fn smooth(frames: usize) -> f32 {
    let share = frames as f32 / FADE_FRAMES as f32;
    share * share * (3.0 - 2.0 * share)
}

#[cfg(test)]
#[path = "clip_player_tests.rs"]
mod tests;
