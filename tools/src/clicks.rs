//! Finds clicks and direct current in sound that should have neither.
//!
//! Made for recordings of smooth sounds (nothing above some 300 Hz, as `soak --detect` plays): there the fourth difference
//! of a sample with its neighbours is next to nothing, whatever gains and delays do in their ramps, and a step of the
//! wave shows at three times its height. Own. Allocates at birth only and may run beside an audio thread.

/// Fourth difference, as a share of the loudest sample of late, that counts as a click: a step of one part in thirty, or
/// a gain that goes from nothing to full within some sixty samples.
const STEP_SHARE: f32 = 0.1;

/// Fourth difference below which nothing counts, however silent it was before: 80 dB below full scale.
const QUIETEST: f32 = 1e-4;

/// Seconds after which a loud sample counts half in "of late".
const LATE_S: f32 = 0.02;

/// Seconds over which [`ClickDetector::worst_second`] averages.
const WINDOW_S: f32 = 1.0;

/// Samples within which a click is counted once: a step rings in delays of both ears.
const ONE_CLICK_S: f32 = 0.01;

/// What one channel has done lately.
#[derive(Debug, Clone, Copy, Default)]
struct Channel {
    last: [f32; 4],
    loudest: f32,
    sum: f64,
    /// Of all whole windows before.
    sums: f64,
    quiet_until: u64,
}

/// Listens to interleaved stereo.
#[derive(Debug, Clone)]
pub struct ClickDetector {
    channels: [Channel; 2],
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
    /// For sound at a rate in Hz.
    pub fn new(rate_hz: u32) -> Self {
        let rate_hz = rate_hz as f32;
        Self {
            channels: [Channel::default(); 2],
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

    /// Listens on.
    pub fn push(&mut self, block: &[f32]) {
        for pair in block.as_chunks::<2>().0 {
            self.frames += 1;
            for (channel, &sample) in self.channels.iter_mut().zip(pair) {
                let [a, b, c, d] = channel.last;
                let bend = (sample - 4.0 * d + 6.0 * c - 4.0 * b + a).abs();
                channel.last = [b, c, d, sample];
                channel.loudest = (channel.loudest * self.decay).max(sample.abs());
                channel.sum += f64::from(sample);
                self.peak = self.peak.max(sample.abs());
                let share = bend / channel.loudest.max(QUIETEST / STEP_SHARE);
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

    /// Clicks so far, of both channels.
    pub fn clicks(&self) -> u64 {
        self.clicks
    }

    /// When the first one was, in seconds.
    pub fn first_click_s(&self) -> Option<f64> {
        self.first_s
    }

    /// The mean of everything so far, of full scale, in the channel where it is larger.
    pub fn dc(&self) -> f64 {
        let frames = self.frames.max(1) as f64;
        let mean = |channel: &Channel| ((channel.sums + channel.sum) / frames).abs();
        self.channels.iter().map(mean).fold(0.0, f64::max)
    }

    /// The largest mean of a second so far: swelling sounds and a limiter at work leave some of their own.
    pub fn worst_second(&self) -> f64 {
        self.worst_second
    }

    /// The loudest sample so far.
    pub fn peak(&self) -> f32 {
        self.peak
    }

    /// The largest share so far of what [`Self::clicks`] counts from a tenth on.
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
        // From nothing to full within a graphics frame, and back.
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
