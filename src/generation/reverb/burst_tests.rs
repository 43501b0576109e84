//! No change of what propagation reports makes the late reverb burst out.

use super::*;
use crate::acoustics::BANDS;
use crate::extrapolation::{LATE_DIRECTIONS, LateGroup, LateSend};
use crate::scene::SourceId;
use crate::simd::F32x8;

const RATE_HZ: u32 = 44_100;
/// Frames of a graphics frame, and of both runs.
const RAMP: usize = 600;
const FRAMES: usize = 6 * RATE_HZ as usize;
/// Frames over which energy is summed: 50 ms.
const WINDOW: usize = 2205;
/// The longest decay time that is drawn, and the one of the steady run.
const LONGEST_S: f32 = 3.0;

/// Uniform in 0 to 1.
struct Random(u32);

impl Random {
    fn draw(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / (1 << 24) as f32
    }
}

/// A group as a few rays might make it up: most directions have almost nothing, each band its own.
fn jagged(random: &mut Random) -> LateGroup {
    let mut group = LateGroup::isotropic([0.0; BANDS]);
    for b in 0..BANDS {
        group.decay_time_s[b] = LONGEST_S * 10f32.powf(-1.2 * random.draw());
        let energies: [f32; LATE_DIRECTIONS] =
            std::array::from_fn(|_| 10f32.powf(-4.0 * random.draw()));
        let sum: f32 = energies.iter().sum();
        for (direction, energy) in group.directions.iter_mut().zip(energies) {
            direction[b] = energy / sum;
        }
    }
    group
}

/// Energies of all waves together by window, for noise and a group by graphics frame.
fn energies(mut group: impl FnMut(&mut Random) -> LateGroup) -> Vec<f64> {
    let mut reverb = LateReverb::new(RATE_HZ, 1);
    let mut line = DelayLine::new(RATE_HZ as usize, RATE_HZ as usize);
    let correction = BandCorrection::new(RATE_HZ);
    let (mut noise, mut drawn) = (Random(5), Random(9));
    let mut energies = vec![0.0f64; FRAMES / WINDOW + 1];
    let mut left = 0u32;
    for now in (0..FRAMES).step_by(CHUNK) {
        if now % RAMP < CHUNK {
            let frame = FramePaths {
                late: vec![LateSend {
                    source: SourceId::new(0, 0),
                    group: 0,
                    energy_per_s: [0.4; BANDS],
                    start_s: 0.08,
                }],
                late_groups: [
                    group(&mut drawn),
                    LateGroup::default(),
                    LateGroup::default(),
                ],
                ..FramePaths::default()
            };
            reverb.set_frame(&frame, &[1.0], &correction, left, RAMP as u32);
            left = RAMP as u32;
        }
        let bands: [F32x8; CHUNK] = std::array::from_fn(|_| F32x8::splat(noise.draw() - 0.5));
        line.write(now as i64, &bands);
        let chunk = ChunkSpan {
            now: now as i64,
            left,
            frames: CHUNK,
        };
        reverb.collect(0, &line, chunk);
        if let Some(waves) = reverb.process(left, CHUNK) {
            let values = waves.iter().flat_map(|wave| wave.iter());
            energies[now / WINDOW] += values.map(|value| f64::from(*value).powi(2)).sum::<f64>();
        }
        left = left.saturating_sub(CHUNK as u32);
    }
    energies
}

#[test]
fn jagged_groups_are_no_louder_than_the_longest_steady_decay() {
    let highest = |energies: Vec<f64>| energies.into_iter().fold(0.0, f64::max);
    let steady = highest(energies(|_| LateGroup::isotropic([LONGEST_S; BANDS])));
    let jagged = highest(energies(jagged));
    println!("{:.2} of the steady one", jagged / steady);
    // In a ramp each wave has at most the energy of its louder end, all together that of both; another factor of two for
    // the fluctuations of noise.
    assert!(jagged > 0.0 && jagged < 4.0 * steady, "{jagged} {steady}");
}
