//! Low shelves of second order for all lines of the late reverb: coefficients, states, and the kernel that filters.
//!
//! Audio side; wait-free. State-variable filters with trapezoidal integrators (\[ZAVALISHIN12\]). Eight lines are lanes.

use std::f32::consts::SQRT_2;

use crate::acoustics::BANDS;
use crate::simd::{F32x8, Lanes, kernel};

use crate::generation::CHUNK;
use crate::generation::reverb::mixing::{LINES, Rows};

/// Shelves of a filter.
pub(crate) const SHELVES: usize = BANDS - 1;

/// Lanes of the lines.
pub(crate) const BUNDLES: usize = LINES / 8;

/// Coefficients of one shelf for eight lines.
///
/// With `g = tan(π f / rate) / r`, `r⁴` the gain, and `d = 1 / (1 + √2 g + g²)` an input x has the band-pass output
/// `v = d s + d g (x − l)` of the integrators' states s and l. These become `2 v − s` and `l + 2 g v`, and the shelf's output is
/// `x + (r⁴ − 1) l + (√2 (r² − 1) + (r⁴ − 1) g) v`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shelf {
    /// d.
    damping: F32x8,
    /// `d g`.
    driven: F32x8,
    /// `2 d`.
    returned: F32x8,
    /// `2 g`.
    integrated: F32x8,
    /// `r⁴ − 1`.
    low: F32x8,
    /// `√2 (r² − 1) + (r⁴ − 1) g`.
    band: F32x8,
}

impl Default for Shelf {
    /// Without effect.
    fn default() -> Self {
        Self {
            damping: F32x8::splat(1.0),
            driven: F32x8::ZERO,
            returned: F32x8::splat(2.0),
            integrated: F32x8::ZERO,
            low: F32x8::ZERO,
            band: F32x8::ZERO,
        }
    }
}

impl Shelf {
    /// Sets them for `r` as a power of two, at the tangent of an edge, and what is held of the state for them.
    #[inline(always)]
    pub(crate) fn set(&mut self, exponent: F32x8, tangent: f32, state: &mut State) {
        let (root, one, sqrt_2) = (exponent.exp2(), F32x8::splat(1.0), F32x8::splat(SQRT_2));
        let square = root * root;
        let g = F32x8::splat(tangent) / root;
        let before = self.damping;
        self.damping = one / (one + g * (sqrt_2 + g));
        // Exactly one without a change: it does not matter how often they are set.
        state.band *= self.damping / before;
        self.driven = self.damping * g;
        self.returned = self.damping + self.damping;
        self.integrated = g + g;
        self.low = square * square - one;
        self.band = sqrt_2 * (square - one) + self.low * g;
    }
}

/// Coefficients of all lines.
#[derive(Debug, Clone, Default)]
pub(crate) struct Coefficients {
    pub(crate) gain: [F32x8; BUNDLES],
    pub(crate) shelves: [[Shelf; BUNDLES]; SHELVES],
}

/// The two integrators of one shelf for eight lines; that of the band times [`Shelf::damping`].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct State {
    pub(crate) band: F32x8,
    pub(crate) low: F32x8,
}

pub(crate) type States = [[State; BUNDLES]; SHELVES];

/// A run of frames of a chunk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stretch {
    pub(crate) start: usize,
    pub(crate) count: usize,
}

/// Applies the gains alone.
pub(crate) fn scale(coefficients: &Coefficients, range: Stretch, rows: &mut Rows) {
    for (line, row) in rows.iter_mut().enumerate() {
        let gain = coefficients.gain[line / 8].0[line % 8];
        for value in &mut row[range.start..range.start + range.count] {
            *value *= gain;
        }
    }
}

kernel! {
    /// Filters a stretch in place: eight frames of eight lines are transposed, and all shelves are applied to them. The bundles take
    /// turns frame by frame: the steps of one wait for each other, those of different bundles do not.
    pub(crate) fn filter<L>(coefficients: &Coefficients, states: &mut States, range: Stretch, rows: &mut Rows) {
        let mut done = 0;
        while done < range.count {
            let count = (range.count - done).min(8);
            // The last tile of a chunk begins early enough to fit; frames before `skip` are not its own.
            let at = (range.start + done).min(CHUNK - 8);
            let skip = range.start + done - at;
            let mut tiles = [[L::splat(0.0); 8]; BUNDLES];
            for bundle in 0..BUNDLES {
                let mut lines = [L::splat(0.0); 8];
                for lane in 0..8 {
                    lines[lane] = L::load_at(&rows[8 * bundle + lane], at);
                }
                let tile = L::transpose(lines);
                let gain = L::from_array(coefficients.gain[bundle]);
                for frame in 0..8 {
                    tiles[bundle][frame] = tile[frame].mul(gain);
                }
            }
            for shelf in 0..SHELVES {
                let of_lines = &coefficients.shelves[shelf];
                let states = &mut states[shelf];
                let mut running = [Running::<L>::of(&states[0]); BUNDLES];
                for bundle in 1..BUNDLES {
                    running[bundle] = Running::of(&states[bundle]);
                }
                if count == 8 {
                    for pair in 0..4 {
                        for bundle in 0..BUNDLES {
                            let frame = &mut tiles[bundle][2 * pair];
                            *frame = running[bundle].step(&of_lines[bundle], *frame);
                        }
                        for bundle in 0..BUNDLES {
                            let frame = &mut tiles[bundle][2 * pair + 1];
                            *frame = running[bundle].step_back(&of_lines[bundle], *frame);
                        }
                    }
                } else {
                    for bundle in 0..BUNDLES {
                        running[bundle].run(&of_lines[bundle], &mut tiles[bundle][skip..skip + count]);
                    }
                }
                for bundle in 0..BUNDLES {
                    states[bundle] = running[bundle].state(count % 2 == 1);
                }
            }
            for bundle in 0..BUNDLES {
                let lines = L::transpose(tiles[bundle]);
                for lane in 0..8 {
                    let row = &mut rows[8 * bundle + lane];
                    if count == 8 {
                        lines[lane].store_at(row, at);
                    } else {
                        let values = lines[lane].to_array();
                        row[at + skip..at + skip + count]
                            .copy_from_slice(&values.0[skip..skip + count]);
                    }
                }
            }
            done += count;
        }
    }
}

/// [`State`] in registers. After every other frame that of the band has the opposite sign: each result is a product and a sum.
#[derive(Clone, Copy)]
struct Running<L> {
    band: L,
    low: L,
}

impl<L: Lanes> Running<L> {
    #[inline(always)]
    fn of(state: &State) -> Self {
        Self {
            band: L::from_array(state.band),
            low: L::from_array(state.low),
        }
    }

    #[inline(always)]
    fn state(self, is_opposite: bool) -> State {
        let band = match is_opposite {
            true => L::splat(0.0).sub(self.band),
            false => self.band,
        };
        State {
            band: band.to_array(),
            low: self.low.to_array(),
        }
    }

    /// Filters frames in place.
    #[inline(always)]
    fn run(&mut self, shelf: &Shelf, frames: &mut [L]) {
        let (pairs, last) = frames.as_chunks_mut::<2>();
        for [first, second] in pairs {
            *first = self.step(shelf, *first);
            *second = self.step_back(shelf, *second);
        }
        if let [last] = last {
            *last = self.step(shelf, *last);
        }
    }

    /// A frame after which the band's state has the opposite sign.
    #[inline(always)]
    fn step(&mut self, shelf: &Shelf, input: L) -> L {
        let driven = L::from_array(shelf.driven);
        let band = input.sub(self.low).mul_add(driven, self.band);
        let sum = self.low.mul_add(L::from_array(shelf.low), input);
        self.band = band.neg_mul_add(L::from_array(shelf.returned), self.band);
        self.low = band.mul_add(L::from_array(shelf.integrated), self.low);
        band.mul_add(L::from_array(shelf.band), sum)
    }

    /// The next one, after which it has its own again.
    #[inline(always)]
    fn step_back(&mut self, shelf: &Shelf, input: L) -> L {
        let driven = L::from_array(shelf.driven);
        let opposite = input.sub(self.low).neg_mul_add(driven, self.band);
        let sum = self.low.mul_add(L::from_array(shelf.low), input);
        self.band = opposite.neg_mul_add(L::from_array(shelf.returned), self.band);
        self.low = opposite.neg_mul_add(L::from_array(shelf.integrated), self.low);
        opposite.neg_mul_add(L::from_array(shelf.band), sum)
    }
}
