//! Speech with pauses: all voices speak at the same times and pause at the same times.
//!
//! P.862 separates speech from pauses by level and finds no utterance if sixteen voices in a hall never pause; P.862.3
//! requires 40 to 80 % of activity. The paper does not specify the pauses of its voices.

use super::clip::Clip;

/// Seconds of speech between two pauses.
pub const TALK_S: f64 = 2.4;

/// Seconds of a pause: a hall's reverb falls by 30 dB.
pub const PAUSE_S: f64 = 1.2;

/// Seconds of a fade in or out.
const FADE_S: f64 = 0.02;

/// Fills `samples` with the clip from sample `from` on, over and over, [`TALK_S`] at a time. Speech continues after a
/// pause where it stopped.
pub fn spoken(clip: &Clip, from: u64, samples: &mut [f32]) {
    let count = |seconds: f64| (seconds * f64::from(clip.rate_hz)).round() as u64;
    let (talk, turn) = (count(TALK_S), count(TALK_S + PAUSE_S));
    let mut done = 0;
    while done < samples.len() {
        let at = from + done as u64;
        let (turns, offset) = (at / turn, at % turn);
        let left = (samples.len() - done) as u64;
        let end = if offset < talk { talk } else { turn };
        let part = left.min(end - offset) as usize;
        let part = &mut samples[done..done + part];
        if offset < talk {
            clip.looped((turns * talk + offset) as usize, part);
            fade(part, offset, talk, count(FADE_S).max(1));
        } else {
            part.fill(0.0);
        }
        done += part.len();
    }
}

/// Fades samples that begin `offset` samples into a stretch of `talk` samples in and out.
fn fade(samples: &mut [f32], offset: u64, talk: u64, length: u64) {
    for (n, sample) in samples.iter_mut().enumerate() {
        let from_start = offset + n as u64;
        let from_end = talk - 1 - from_start;
        let near = from_start.min(from_end);
        if near < length {
            *sample *= near as f32 / length as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voices_pause_without_losing_samples() {
        let clip = Clip {
            rate_hz: 1000,
            samples: (1..=7000).map(|n| n as f32).collect(),
        };
        let mut whole = vec![9.0; 10_000];
        spoken(&clip, 0, &mut whole);
        assert!(whole[2400..3600].iter().all(|s| *s == 0.0));
        assert!(whole[6000..7200].iter().all(|s| *s == 0.0));
        assert_eq!((whole[0], whole[100], whole[2399]), (0.0, 101.0, 0.0));
        // After the pause the clip continues from the cut.
        assert_eq!(whole[3700], 2501.0);
        // The clip's end is followed by its beginning.
        assert_eq!(whole[2 * 3600 + 2300], (4800 + 2300 - 7000 + 1) as f32);
        let mut pieces = Vec::new();
        let mut from = 0;
        for length in [1, 700, 1699, 1, 1199, 2400, 4000] {
            let mut piece = vec![0.0; length];
            spoken(&clip, from, &mut piece);
            from += length as u64;
            pieces.extend(piece);
        }
        assert_eq!(pieces, whole);
    }
}
