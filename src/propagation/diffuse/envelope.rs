//! Energy envelope of the late reverb: a few time segments, each with its energy.
//!
//! Own. The generator's network can start a decay but not end one: the late reverb is a sum of decays that start
//! [`LATE_SEGMENT_STARTS`] after the straight line's arrival. Between two starts the envelope is one level of the common
//! decay. Levels cannot fall; where the arrivals do, neighbours are pooled (isotonic regression, \[BARLOW72\]), which
//! keeps their energy. A segment's energy is what arrives in its time less what discrete paths carry, so early and late
//! sound join without a gap.

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffuse::decay_fit::NEPERS_OF_60_DB;
use crate::propagation::path::{LATE_SEGMENTS, LateEnergy};

/// Starts of the segments, in mean free times after the straight line's arrival.
pub const LATE_SEGMENT_STARTS: [f64; LATE_SEGMENTS] = [0.0, 2.0, 5.0, 10.0];

/// End of the last segment's arrivals in mean free times; rays with 32 bounces last so long.
const LAST_FREE_TIME: f64 = 20.0;

/// Width of the transition between segments in mean free times, which avoids steps while the listener moves.
const CROSSFADE_FREE_TIMES: f64 = 1.0;

/// Arrivals added at once.
pub(crate) const ARRIVAL_LANES: usize = 16;

/// Arriving energy per segment.
pub(crate) struct ArrivalHistogram {
    free_time_s: f64,
    /// Arrival of the straight line: delays count from here.
    nearest_s: f64,
    sums: [[f64; BANDS]; LATE_SEGMENTS],
}

impl ArrivalHistogram {
    pub(crate) fn new(free_time_s: f64, nearest_s: f64) -> Self {
        Self {
            free_time_s,
            nearest_s,
            sums: [[0.0; BANDS]; LATE_SEGMENTS],
        }
    }

    /// Adds the first `count` arrivals. Branch-free: every arrival is added to every segment, to most with a weight of 0.
    #[inline(always)]
    pub(crate) fn add(
        &mut self,
        delay_s: &[f64; ARRIVAL_LANES],
        energies: &[BandArray; ARRIVAL_LANES],
        count: usize,
    ) {
        let mut shares = [[0.0; ARRIVAL_LANES]; LATE_SEGMENTS];
        let mut first = [1.0; ARRIVAL_LANES];
        for step in 0..LATE_SEGMENTS {
            let next = match step + 1 < LATE_SEGMENTS {
                true => LATE_SEGMENT_STARTS[step + 1],
                false => LAST_FREE_TIME,
            };
            for l in 0..ARRIVAL_LANES {
                let at = (delay_s[l] - self.nearest_s) / self.free_time_s;
                let beyond = ((at - next) / CROSSFADE_FREE_TIMES + 0.5).clamp(0.0, 1.0);
                let share = first[l] - beyond;
                shares[step][l] = if share > 0.0 { share } else { 0.0 };
                first[l] = beyond;
            }
        }
        let mut sums = self.sums;
        for (l, energy) in energies[..count].iter().enumerate() {
            // A source at an infinite distance is silent.
            let mut is_finite = true;
            for e in energy {
                is_finite &= e.is_finite();
            }
            if !is_finite {
                continue;
            }
            for step in 0..LATE_SEGMENTS {
                for b in 0..BANDS {
                    sums[step][b] += shares[step][l] * f64::from(energy[b]);
                }
            }
        }
        self.sums = sums;
    }

    /// Writes the energies of `late`; `updates` is the sum of the arrivals' weights.
    pub(crate) fn write_energy(&self, updates: f64, late: &mut LateEnergy) {
        for (step, sum) in self.sums.iter().enumerate() {
            for b in 0..BANDS {
                let mut energy = sum[b] / updates;
                if step == LATE_SEGMENTS - 1 {
                    // The decay beyond the last arrivals.
                    let window_s = (LAST_FREE_TIME - LATE_SEGMENT_STARTS[step]) * self.free_time_s;
                    let nepers = NEPERS_OF_60_DB / f64::from(late.decay_time_s[b]) * window_s;
                    energy /= 1.0 - (-nepers).exp();
                }
                late.energy[step][b] = energy as f32;
            }
        }
    }
}

/// One start of the late reverb's decay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LateSegment {
    /// Seconds from emission.
    pub start_s: f32,
    /// Energy per second added to the envelope by this start, extrapolated back to emission, in 1/s.
    pub energy_per_s: BandArray,
}

/// The late energy of one source as starts of decays of `decay_time_s` (T60 in seconds), which need not be its own: the
/// energy is kept. Real-time safe.
pub fn late_segments(late: &LateEnergy, decay_time_s: &BandArray) -> [LateSegment; LATE_SEGMENTS] {
    let start = |step: usize| {
        f64::from(late.start_s) + LATE_SEGMENT_STARTS[step] * f64::from(late.mean_free_time_s)
    };
    let mut steps: [LateSegment; LATE_SEGMENTS] = std::array::from_fn(|step| LateSegment {
        start_s: start(step) as f32,
        energy_per_s: [0.0; BANDS],
    });
    for b in 0..BANDS {
        let nepers_per_s = NEPERS_OF_60_DB / f64::from(decay_time_s[b]).max(1e-3);
        // Integral of the decay from a segment's start on; the last has no end.
        let left = |step: usize| match step {
            LATE_SEGMENTS => 0.0,
            _ => (-nepers_per_s * start(step)).exp() / nepers_per_s,
        };
        let energy = std::array::from_fn(|step| f64::from(late.energy[step][b]));
        let room = std::array::from_fn(|step| left(step) - left(step + 1));
        let levels = monotone_levels(energy, room);
        let mut below = 0.0;
        for (step, level) in steps.iter_mut().zip(levels) {
            step.energy_per_s[b] = (level - below).clamp(0.0, MAX_ENERGY_PER_S) as f32;
            below = level;
        }
    }
    steps
}

/// Bound for finite single precision, far above audible decays.
const MAX_ENERGY_PER_S: f64 = 1e30;

/// Monotone levels; in each pool of segments their products with `room` sum up to the pool's `energy`.
fn monotone_levels(
    energy: [f64; LATE_SEGMENTS],
    room: [f64; LATE_SEGMENTS],
) -> [f64; LATE_SEGMENTS] {
    // Pools as (energy, room, steps), last on top.
    let mut pools: [(f64, f64, usize); LATE_SEGMENTS] = [(0.0, 0.0, 0); LATE_SEGMENTS];
    let mut count = 0;
    for step in 0..LATE_SEGMENTS {
        let mut pool = (energy[step], room[step].max(f64::MIN_POSITIVE), 1);
        while count > 0 && pools[count - 1].0 * pool.1 > pool.0 * pools[count - 1].1 {
            count -= 1;
            let below = pools[count];
            pool = (pool.0 + below.0, pool.1 + below.1, pool.2 + below.2);
        }
        pools[count] = pool;
        count += 1;
    }
    let mut levels = [0.0; LATE_SEGMENTS];
    let mut step = 0;
    for (energy, room, steps) in &pools[..count] {
        levels[step..step + steps].fill(energy / room);
        step += steps;
    }
    levels
}

/// Energy-weighted reverberation time of several sources per band, in seconds; 0 without energy. Real-time safe.
pub fn common_decay(late: &[LateEnergy]) -> BandArray {
    let energy = |late: &LateEnergy, b: usize| late.energy.iter().map(|e| e[b]).sum::<f32>();
    std::array::from_fn(|b| {
        let total: f32 = late.iter().map(|l| energy(l, b)).sum();
        if total > 0.0 {
            let sum: f32 = late.iter().map(|l| energy(l, b) * l.decay_time_s[b]).sum();
            sum / total
        } else {
            0.0
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SourceId;

    #[test]
    fn levels_are_monotone_and_keep_their_energy() {
        let (energy, room) = ([4.0, 1.0, 3.0, 0.5], [1.0, 1.0, 0.5, 0.25]);
        let levels = monotone_levels(energy, room);
        assert!(
            levels.windows(2).all(|pair| pair[0] <= pair[1]),
            "{levels:?}"
        );
        let total: f64 = levels.iter().zip(room).map(|(l, r)| l * r).sum();
        assert!((total - 8.5).abs() < 1e-12, "{total}");
        assert_eq!(
            monotone_levels([0.0, 1.0, 2.0, 3.0], [1.0; 4]),
            [0.0, 1.0, 2.0, 3.0]
        );
    }

    #[test]
    fn late_energy_is_kept_for_any_common_decay() {
        let late = LateEnergy {
            energy: [[0.1; BANDS], [0.2; BANDS], [0.2; BANDS], [0.1; BANDS]],
            start_s: 0.03,
            mean_free_time_s: 0.01,
            ..LateEnergy::silent(SourceId::default())
        };
        for decay_s in [0.3f32, 1.0, 4.0] {
            let steps = late_segments(&late, &[decay_s; BANDS]);
            let k = 6.0 * std::f64::consts::LN_10 / f64::from(decay_s);
            let total: f64 = steps
                .iter()
                .map(|s| f64::from(s.energy_per_s[3]) * (-k * f64::from(s.start_s)).exp() / k)
                .sum();
            // Single precision of energies up to 1e3 in four segments.
            assert!((total - 0.6).abs() < 1e-4, "{total}");
        }
    }
}
