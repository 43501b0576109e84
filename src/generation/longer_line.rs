//! Delay lines by need: the first line of a source is short, and becomes longer when its paths do.
//!
//! Segments are made on propagation's side and travel to the audio side, which copies no sound.

use crate::generation::GeneratorSettings;
use crate::generation::delay::delay_line::{DelayLine, Segment, segments, segments_for};

/// Longest path of a source's first line in seconds: 50 m. After a jump to a longer path what was played before is silent as far as the
/// path is longer than the line.
const FIRST_S: f64 = 0.15;

/// Longest path of a source's first line in seconds, under these settings.
pub(crate) fn first_longest_s(settings: &GeneratorSettings) -> f64 {
    settings.max_delay_s.min(FIRST_S)
}

/// Audio frames that a line keeps whose longest path takes so many seconds.
fn history(longest_s: f64, settings: &GeneratorSettings) -> usize {
    let frames = (longest_s * f64::from(settings.rate_hz)).ceil() as usize;
    frames + settings.longest_block()
}

/// A line whose longest path takes so many seconds.
pub(crate) fn line(longest_s: f64, settings: &GeneratorSettings) -> DelayLine {
    let longest = history(settings.max_delay_s, settings);
    DelayLine::new(history(longest_s, settings), longest)
}

/// More of the line of a source slot.
#[derive(Debug)]
pub(crate) struct LongerLine {
    pub(crate) slot: usize,
    /// Longest path in seconds from then on.
    pub(crate) longest_s: f64,
    pub(crate) segments: Vec<Segment>,
}

impl LongerLine {
    /// What a line lacks that is as long as for a path of `present_s` seconds.
    pub(crate) fn new(
        slot: usize,
        [present_s, longest_s]: [f64; 2],
        settings: &GeneratorSettings,
    ) -> Self {
        let [present, longest] =
            [present_s, longest_s].map(|seconds| segments_for(history(seconds, settings)));
        Self {
            slot,
            longest_s,
            segments: segments(longest.saturating_sub(present)),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;

    use super::*;
    use crate::extrapolation::{FramePath, FramePaths, PathKind};
    use crate::generation::{Generator, Hrtf};
    use crate::propagation::PathId;
    use crate::scene::SourceId;

    fn frame(delay_s: f64) -> FramePaths {
        let path = FramePath {
            id: PathId(1),
            source: SourceId::new(0, 0),
            kind: PathKind::Reflected,
            order: 1,
            amplitude: [1.0; 8],
            delay_s,
            air_delay_s: 0.0,
            arrival: Vec3::X,
            departure: Vec3::ZERO,
        };
        FramePaths {
            paths: vec![path],
            ..FramePaths::default()
        }
    }

    /// Noise of a second in blocks of a hundredth, by a path that becomes longer when the line does.
    fn rendered(generator: &mut Generator, mut longer: Option<LongerLine>) -> (Vec<f32>, u32) {
        let (mut output, mut dropped) = (Vec::new(), 0);
        let mut state = 1u32;
        for block in 0..100 {
            let delay_s = if block < 50 { 0.1 } else { 0.14 };
            if block == 50 {
                longer
                    .iter_mut()
                    .for_each(|line| generator.lengthen_line(line));
            }
            generator.set_frame(&frame(if block < 90 { delay_s } else { 0.5 }), 441);
            let input: Vec<f32> = (0..441)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    (state >> 8) as f32 / 16_777_216.0 - 0.5
                })
                .collect();
            let mut stereo = [0.0; 2 * 441];
            dropped += generator.render(&[&input], &mut stereo).dropped_delays;
            output.extend(stereo);
        }
        (output, dropped)
    }

    #[test]
    fn a_line_that_becomes_longer_sounds_as_one_that_was_long() {
        let settings = GeneratorSettings {
            late: false,
            max_delay_s: 1.0,
            ..GeneratorSettings::default()
        };
        let hrtf = Arc::new(Hrtf::omnidirectional(44_100).expect("a set"));
        let long = Generator::new(settings.clone(), Arc::clone(&hrtf));
        let long = rendered(&mut long.expect("settings"), None);
        let short = || Generator::with_short_lines(settings.clone(), Arc::clone(&hrtf));
        let longer = LongerLine::new(0, [FIRST_S, 1.0], &settings);
        let grown = rendered(&mut short().expect("settings"), Some(longer));
        assert!(long.0 == grown.0);
        assert_eq!((long.1, grown.1), (0, 0));
        assert!(long.0.iter().any(|sample| sample.abs() > 0.01));
        // Ten frames have a path that is too long.
        assert_eq!(rendered(&mut short().expect("settings"), None).1, 10);
    }
}
