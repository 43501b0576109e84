//! The orthogonal matrix that mixes the lines of the late reverb.
//!
//! Audio side; wait-free; allocates nothing.
//!
//! Three Hadamard matrices of order eight, then a Householder reflection of each three lines of equal index: no entry is zero,
//! and a line costs five additions and a multiplication.

use crate::simd::{Lanes, kernel};

use crate::generation::CHUNK;

/// Lines of a network, and directions from which they arrive.
pub(crate) const LINES: usize = 24;

/// Lines of a Hadamard matrix.
const BLOCK: usize = 8;

/// One over the square root of [`BLOCK`].
const NORM: f32 = 0.353_553_4;

/// A chunk of every line.
pub(crate) type Rows = [[f32; CHUNK]; LINES];

/// Signs of the lines, scaled for the mixture to keep the energy.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Signs([f32; LINES]);

impl Signs {
    /// Pseudo-random signs, by the low bits of a hash.
    pub(crate) fn new(seed: u64) -> Self {
        Self(std::array::from_fn(|line| {
            NORM * sign(seed * LINES as u64 + line as u64)
        }))
    }
}

/// The mixture of single frames, without signs.
pub(crate) fn mix_frame(frame: &[f32; LINES]) -> [f32; LINES] {
    std::array::from_fn(|line| {
        let part = |other: usize| {
            let is_same = line / BLOCK == other / BLOCK;
            let entry = if is_same { 1.0 / 3.0 } else { -2.0 / 3.0 };
            let is_even = (line & other & (BLOCK - 1)).count_ones().is_multiple_of(2);
            NORM * if is_even { entry } else { -entry } * frame[other]
        };
        (0..LINES).map(part).sum()
    })
}

/// A pseudo-random sign (\[STEELE14\]).
pub(crate) fn sign(index: u64) -> f32 {
    if hash(index) & 1 == 0 { 1.0 } else { -1.0 }
}

/// A pseudo-random number of 64 bits (\[STEELE14\]).
pub(crate) fn hash(index: u64) -> u64 {
    let mut z = index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

kernel! {
    /// Mixes the first `frames` frames in place, up to seven more with them.
    pub(crate) fn mix<L>(signs: &Signs, frames: usize, rows: &mut Rows) {
        let mut position = 0;
        while position < frames {
            for block in 0..LINES / BLOCK {
                let mut values = [L::splat(0.0); BLOCK];
                for line in 0..BLOCK {
                    let index = BLOCK * block + line;
                    values[line] = L::load_at(&rows[index], position).mul(L::splat(signs.0[index]));
                }
                butterflies::<L, 1>(&mut values);
                butterflies::<L, 2>(&mut values);
                butterflies::<L, 4>(&mut values);
                for line in 0..BLOCK {
                    values[line].store_at(&mut rows[BLOCK * block + line], position);
                }
            }
            let share = L::splat(2.0 / 3.0);
            for line in 0..BLOCK {
                let a = L::load_at(&rows[line], position);
                let b = L::load_at(&rows[BLOCK + line], position);
                let c = L::load_at(&rows[2 * BLOCK + line], position);
                let sum = a.add(b).add(c);
                sum.neg_mul_add(share, a).store_at(&mut rows[line], position);
                sum.neg_mul_add(share, b).store_at(&mut rows[BLOCK + line], position);
                sum.neg_mul_add(share, c).store_at(&mut rows[2 * BLOCK + line], position);
            }
            position += 8;
        }
    }
}

#[inline(always)]
fn butterflies<L: Lanes, const SPAN: usize>(values: &mut [L; BLOCK]) {
    for line in 0..BLOCK {
        if line & SPAN == 0 {
            let (a, b) = (values[line], values[line + SPAN]);
            values[line] = a.add(b);
            values[line + SPAN] = a.sub(b);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::LaneSet;

    fn rows() -> Box<Rows> {
        Box::new(std::array::from_fn(|line| {
            std::array::from_fn(|frame| ((line * 31 + frame * frame) as f32 * 0.37).sin())
        }))
    }

    #[test]
    fn mixing_follows_its_definition() {
        let signs = Signs::new(3);
        let before = rows();
        for frames in [1, 8, 20, CHUNK] {
            let with = |set: LaneSet| {
                let mut rows = before.clone();
                mix(set, &signs, frames, &mut rows);
                rows
            };
            for set in LaneSet::vector_units() {
                let (found, specified) = (with(set), with(LaneSet::Fused));
                assert!((0..LINES).all(|line| found[line][..frames] == specified[line][..frames]));
            }
            for found in [with(LaneSet::best()), with(LaneSet::Portable)] {
                for frame in 0..frames {
                    let exact = mix_frame(&std::array::from_fn(|line| {
                        signs.0[line] / NORM * before[line][frame]
                    }));
                    for line in 0..LINES {
                        // Some twenty roundings of sums below ten.
                        assert!((found[line][frame] - exact[line]).abs() < 1e-5);
                    }
                }
            }
        }
    }

    #[test]
    fn mixing_keeps_the_energy() {
        let frame: [f32; LINES] = std::array::from_fn(|line| (line as f32).sin());
        let energy =
            |frame: &[f32; LINES]| frame.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
        // Thirty roundings of relative size 6e-8.
        assert!((energy(&mix_frame(&frame)) / energy(&frame) - 1.0).abs() < 2e-6);
    }
}
