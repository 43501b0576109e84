//! Detects clicks and direct current.
//!
//! For smooth sounds (nothing above some 300 Hz, as `soak --detect` plays): the fourth difference of neighbouring samples
//! is near zero even during ramps of gain and delay, and a step shows at three times its height. Own method. Allocates at
//! construction only and may run on an audio thread.

/// Fourth difference, relative to the recent peak, that counts as a click: a step of one part in thirty, or a gain that
/// rises from zero to full within some sixty samples.
const STEP_SHARE: f32 = 0.1;

/// Least fourth difference that counts: 80 dB below full scale.
const QUIETEST: f32 = 1e-4;

/// Half-life of the recent peak, in seconds.
const LATE_S: f32 = 0.02;

/// Seconds over which [`ClickDetector::worst_second`] averages.
const WINDOW_S: f32 = 1.0;

/// Seconds within which a click counts once: a step rings in the delays of both ears.
const ONE_CLICK_S: f32 = 0.01;

/// State of one channel.
#[derive(Debug, Clone, Copy, Default)]
struct Channel {
    last: [f32; 4],
    loudest: f32,
    sum: f64,
    /// Over all complete windows before.
    sums: f64,
    quiet_until: u64,
}

/// Detector for interleaved channels.
#[derive(Debug, Clone)]
pub struct ClickDetector {
    channels: Vec<Channel>,
    /// Whether differences are relative to the loudest channel instead of the own one.
    is_one_field: bool,
    decay: f32,
    one_click: u64,
    window: u64,
    frames: u64,
    clicks: u64,
    worst_second: f64,
    peak: f32,
    worst: f32,
    first_s: Option<f64>,
    rate_hz: f32,
}

impl ClickDetector {
    /// For stereo at a rate in Hz.
    pub fn new(rate_hz: u32) -> Self {
        Self::of(rate_hz, 2)
    }

    /// For so many channels of one sound field at a rate in Hz: differences are relative to the loudest of them, as a channel
    /// that begins to sound is silent before.
    pub fn with_channels(rate_hz: u32, channels: usize) -> Self {
        Self {
            is_one_field: true,
            ..Self::of(rate_hz, channels)
        }
    }

    fn of(rate_hz: u32, channels: usize) -> Self {
        let rate_hz = rate_hz as f32;
        Self {
            channels: vec![Channel::default(); channels.max(1)],
            is_one_field: false,
            decay: (-std::f32::consts::LN_2 / (LATE_S * rate_hz)).exp(),
            one_click: (ONE_CLICK_S * rate_hz) as u64,
            window: (WINDOW_S * rate_hz) as u64,
            frames: 0,
            clicks: 0,
            worst_second: 0.0,
            peak: 0.0,
            worst: 0.0,
            first_s: None,
            rate_hz,
        }
    }

    /// Analyses a block.
    pub fn push(&mut self, block: &[f32]) {
        for frame in block.chunks_exact(self.channels.len()) {
            self.frames += 1;
            let loudest = match self.is_one_field {
                true => self.channels.iter().map(|c| c.loudest).fold(0.0, f32::max),
                false => 0.0,
            };
            for (channel, &sample) in self.channels.iter_mut().zip(frame) {
                let [a, b, c, d] = channel.last;
                let difference = (sample - 4.0 * d + 6.0 * c - 4.0 * b + a).abs();
                channel.last = [b, c, d, sample];
                channel.loudest = (channel.loudest * self.decay).max(sample.abs());
                channel.sum += f64::from(sample);
                self.peak = self.peak.max(sample.abs());
                let share = difference / channel.loudest.max(loudest).max(QUIETEST / STEP_SHARE);
                self.worst = self.worst.max(share);
                if share > STEP_SHARE && self.frames >= channel.quiet_until {
                    channel.quiet_until = self.frames + self.one_click;
                    self.clicks += 1;
                    self.first_s
                        .get_or_insert(self.frames as f64 / f64::from(self.rate_hz));
                }
            }
            if self.frames.is_multiple_of(self.window) {
                for channel in &mut self.channels {
                    let mean = (channel.sum / self.window as f64).abs();
                    self.worst_second = self.worst_second.max(mean);
                    channel.sums += std::mem::take(&mut channel.sum);
                }
            }
        }
    }

    /// Clicks so far, of all channels.
    pub fn clicks(&self) -> u64 {
        self.clicks
    }

    /// Time of the first click in seconds.
    pub fn first_click_s(&self) -> Option<f64> {
        self.first_s
    }

    /// The mean of everything so far, of full scale, in the channel where it is larger.
    pub fn dc(&self) -> f64 {
        let frames = self.frames.max(1) as f64;
        let mean = |channel: &Channel| ((channel.sums + channel.sum) / frames).abs();
        self.channels.iter().map(mean).fold(0.0, f64::max)
    }

    /// The largest mean over a second so far. Swelling sounds and an active limiter cause some.
    pub fn worst_second(&self) -> f64 {
        self.worst_second
    }

    /// The loudest sample so far.
    pub fn peak(&self) -> f32 {
        self.peak
    }

    /// The largest relative fourth difference so far; from a tenth on it is a click.
    pub fn worst(&self) -> f32 {
        self.worst
    }
}

/// A loop of two seconds without clicks or direct current: three tones below 300 Hz, faded in and out.
pub fn smooth_loop(rate_hz: u32) -> Vec<f32> {
    let length = 2 * rate_hz;
    let time = |n: u32| f64::from(n) / f64::from(rate_hz);
    let tone = |n: u32, hz: f64| (std::f64::consts::TAU * hz * time(n)).sin();
    (0..length)
        .map(|n| {
            let fade = (std::f64::consts::PI * time(n) / 2.0).sin().powi(2);
            let sum = tone(n, 90.0) + 0.7 * tone(n, 160.0) + 0.5 * tone(n, 270.0);
            (0.05 * fade * sum) as f32
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heard(change: impl Fn(usize, f32) -> f32) -> ClickDetector {
        let mut detector = ClickDetector::new(44_100);
        let sound = smooth_loop(44_100);
        for (block, chunk) in sound.chunks(256).enumerate() {
            let stereo: Vec<f32> = chunk
                .iter()
                .enumerate()
                .flat_map(|(n, &sample)| [sample, change(256 * block + n, sample)])
                .collect();
            detector.push(&stereo);
        }
        detector
    }

    #[test]
    fn smooth_sound_and_ramps_have_no_clicks() {
        assert_eq!(heard(|_, sample| sample).clicks(), 0);
        // From silence to full within a graphics frame, and back.
        let ramp = |n: usize, sample: f32| {
            let phase = (n % 2940) as f32 / 735.0;
            sample * phase.min(1.0).min((4.0 - phase).min(1.0))
        };
        let detector = heard(ramp);
        assert_eq!(detector.clicks(), 0, "{}", detector.worst());
        // Ramps fifteen times a second leave a little of the lowest tone.
        assert!(detector.worst_second() < 5e-4);
        assert!(detector.dc() < 5e-4, "{}", detector.dc());
    }

    #[test]
    fn steps_gaps_and_offsets_are_found() {
        let at = 40_000;
        // A gap of one sample, a gain that jumps by a tenth, and a wave cut off.
        let gap = heard(|n, sample| if n == at { 0.0 } else { sample });
        assert_eq!(gap.clicks(), 1);
        let first_s = gap.first_click_s().expect("one");
        assert!((first_s - at as f64 / 44_100.0).abs() < 1e-3);
        assert_eq!(heard(|n, s| if n > at { 0.9 * s } else { s }).clicks(), 1);
        assert_eq!(heard(|n, s| if n > at { 0.0 } else { s }).clicks(), 1);
        let offset = heard(|_, sample| sample + 0.01);
        assert!((offset.dc() - 0.01).abs() < 1e-3, "{}", offset.dc());
        assert!((offset.worst_second() - 0.01).abs() < 1e-3);
    }
}
