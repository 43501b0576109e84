//! Filters whose level is given at the eight band centres, one for each line of the late reverb.
//!
//! Audio side; wait-free; allocates at construction only.
//!
//! After \[JOT91\] and \[SCHLECHT17\]: a gain and seven low shelves at the edges of the bands. A shelf of second order with the
//! gain ρ² has the squared magnitude `(u² + ρ) / (u² + 1/ρ)`, u the squared ratio of warped frequency and edge. Its level in
//! decibels is nearly proportional to its gain, so the gains of the shelves solve eight linear equations; corrections with the
//! same matrix take up the rest, as long as they reduce it. Shelves are state-variable filters with trapezoidal integrators
//! (`shelves.rs`), whose coefficients may move.

use std::f32::consts::SQRT_2;
use std::f64::consts::PI;

use crate::acoustics::bands::{CENTRES_HZ, EDGES_HZ};
use crate::acoustics::{BANDS, BandArray};
use crate::simd::{F32x8, LaneSet};

use crate::generation::bands::band_correction::invert;
use crate::generation::reverb::mixing::{LINES, Rows};
use crate::generation::reverb::shelves::{
    BUNDLES, Coefficients, SHELVES, States, Stretch, filter, scale,
};

/// Largest change of the level from one band to the next in dB: a shelf of second order cannot be steeper.
const MAX_STEP_DB: f64 = 12.0;

/// Lowest level in dB.
const MIN_LEVEL_DB: f64 = -90.0;

/// Most corrections of the gains, and the error in dB from which on there is none.
const MAX_CORRECTIONS: usize = 3;
const EXACT_DB: f64 = 0.01;

/// Levels within this of one another, in dB, are one level.
const FLAT_DB: f64 = 0.01;

/// Most frames between two changes of the coefficients during a ramp, counted from its end, a power of two; fewer where a
/// coefficient would change by more than [`HELD_CHANGE`].
const HOLD: usize = 32;
const HELD_CHANGE: f32 = 0.003;

/// Frequencies at which [`ShelfDesign::limit`] evaluates a response: zero, half the sample rate, and this many an octave
/// from 22 Hz to 19 kHz between them.
const LIMIT_POINTS_PER_OCTAVE: usize = 4;
const LIMIT_POINTS: usize = 42;
/// Margin of the same limit in dB per dB of the largest shelf, for the response between two of its frequencies.
const LIMIT_MARGIN: f64 = 0.01;

/// States below this are zeroed between chunks, before they become subnormal: −400 dB.
const STATE_FLOOR: f32 = 1e-20;

/// Gains in dB: those of the shelves, then the common one.
type Gains = [f64; BANDS];

/// What the designs of a sample rate share.
#[derive(Debug)]
pub(crate) struct ShelfDesign {
    /// u² of each shelf at each band centre.
    centres: [[f64; SHELVES]; BANDS],
    /// u² of each shelf at the frequencies of [`Self::limit`].
    points: [[f64; SHELVES]; LIMIT_POINTS],
    /// Gains for a level of 1 dB at one centre.
    inverse: [[f64; BANDS]; BANDS],
    /// Tangents of the edges' half angular frequencies per frame.
    tangents: [f64; SHELVES],
}

impl ShelfDesign {
    pub(crate) fn new(rate_hz: f64) -> Self {
        let warped = |hz: f64| (PI * (hz / rate_hz).min(0.499)).tan();
        let tangents = std::array::from_fn(|k| warped(EDGES_HZ[k]));
        let squares = |hz: f64| std::array::from_fn(|k| (warped(hz) / tangents[k]).powi(4));
        let centres = CENTRES_HZ.map(squares);
        let small_gain = centres.map(|of_shelf: [f64; SHELVES]| {
            std::array::from_fn(|k| of_shelf.get(k).map_or(1.0, |u| 1.0 / (1.0 + u)))
        });
        let points = std::array::from_fn(|n| match n {
            0 => squares(0.0),
            1 => squares(rate_hz),
            _ => {
                let octaves = (n - 2) as f64 / LIMIT_POINTS_PER_OCTAVE as f64;
                squares(0.25 * EDGES_HZ[0] * octaves.exp2())
            }
        });
        Self {
            centres,
            points,
            inverse: invert(small_gain),
            tangents,
        }
    }

    /// Gains for levels in dB at the band centres, after these are limited to [`MIN_LEVEL_DB`] and [`MAX_STEP_DB`].
    fn gains(&self, level_db: &[f64; BANDS]) -> Gains {
        let mut level_db = level_db.map(|level| level.clamp(MIN_LEVEL_DB, -MIN_LEVEL_DB));
        for b in 1..BANDS {
            level_db[b] = level_db[b].max(level_db[b - 1] - MAX_STEP_DB);
        }
        for b in (0..BANDS - 1).rev() {
            level_db[b] = level_db[b].max(level_db[b + 1] - MAX_STEP_DB);
        }
        let mut gains = [0.0; BANDS];
        self.correct(&mut gains, &level_db);
        let (mut before, mut worst_before_db) = (gains, f64::INFINITY);
        for step in 0..=MAX_CORRECTIONS {
            let powers = powers(&gains);
            let mut rest_db = level_db;
            for (rest, squares) in rest_db.iter_mut().zip(&self.centres) {
                *rest -= level_at(squares, &powers, gains[SHELVES]);
            }
            let worst_db = rest_db.iter().fold(0.0, |m, rest| f64::max(m, rest.abs()));
            if worst_db >= worst_before_db {
                return before;
            }
            if worst_db < EXACT_DB || step == MAX_CORRECTIONS {
                break;
            }
            (before, worst_before_db) = (gains, worst_db);
            self.correct(&mut gains, &rest_db);
        }
        gains
    }

    /// Adds to the gains what changes the levels by `rest_db`, as if they were proportional.
    fn correct(&self, gains: &mut Gains, rest_db: &[f64; BANDS]) {
        for (gain, row) in gains.iter_mut().zip(&self.inverse) {
            *gain += row.iter().zip(rest_db).map(|(a, b)| a * b).sum::<f64>();
        }
    }

    /// Lowers the common gain until the response is at most `most_db` everywhere.
    fn limit(&self, gains: &mut Gains, most_db: f64) {
        let raised: f64 = gains[..SHELVES].iter().map(|gain| gain.max(0.0)).sum();
        if gains[SHELVES] + raised < most_db {
            return;
        }
        let powers = powers(gains);
        let most = |most: f64, squares| f64::max(most, ratio_at(squares, &powers));
        let highest = self.points.iter().fold(0.0, most);
        let highest_db = 10.0 * highest.log10() + gains[SHELVES];
        let largest = gains[..SHELVES]
            .iter()
            .fold(0.0, |m, g| f64::max(m, g.abs()));
        gains[SHELVES] -= (highest_db + LIMIT_MARGIN * largest - most_db).max(0.0);
    }
}

/// ρ of each shelf.
fn powers(gains: &Gains) -> [f64; SHELVES] {
    std::array::from_fn(|k| (gains[k] * (std::f64::consts::LN_10 / 20.0)).exp())
}

/// Squared magnitude of the shelves at a frequency.
fn ratio_at(squares: &[f64; SHELVES], powers: &[f64; SHELVES]) -> f64 {
    let (mut above, mut below) = (1.0, 1.0);
    for (square, power) in squares.iter().zip(powers) {
        above *= power * (square + power);
        below *= square * power + 1.0;
    }
    above / below
}

/// Level in dB at a frequency.
fn level_at(squares: &[f64; SHELVES], powers: &[f64; SHELVES], common_db: f64) -> f64 {
    10.0 * ratio_at(squares, powers).log10() + common_db
}

/// Gains of all lines as powers of two: of the common gain, and of each shelf's `r`.
///
/// In a ramp these grow evenly, so levels in decibels, nearly proportional to the shelves' gains, stay between the ramp's ends.
/// If coefficients grew evenly, some would still be high while others already are: up to 140 dB more than at either end,
/// where levels go up and down from band to band.
#[derive(Debug, Clone, Default)]
struct Exponents {
    gain: [F32x8; BUNDLES],
    shelves: [[F32x8; BUNDLES]; SHELVES],
}

impl Exponents {
    fn each(&self) -> impl Iterator<Item = &F32x8> {
        self.gain.iter().chain(self.shelves.as_flattened())
    }

    fn each_mut(&mut self) -> impl Iterator<Item = &mut F32x8> {
        let shelves = self.shelves.as_flattened_mut();
        self.gain.iter_mut().chain(shelves)
    }

    /// Those some time before these are reached, at this growth.
    fn before(&self, growth: &Self, time: f32) -> Self {
        let (mut before, time) = (self.clone(), F32x8::splat(time));
        for (exponent, growth) in before.each_mut().zip(growth.each()) {
            *exponent = *exponent - *growth * time;
        }
        before
    }

    /// Growth per frame from `start` to these.
    fn growth_from(&self, start: &Self, ramp: u32) -> Self {
        let (mut growth, share) = (self.clone(), F32x8::splat(1.0 / ramp as f32));
        for (growth, start) in growth.each_mut().zip(start.each()) {
            *growth = (*growth - *start) * share;
        }
        growth
    }

    /// Sets coefficients to these gains, and the states for them.
    fn set(&self, coefficients: &mut Coefficients, states: &mut States, tangents: &[f32; SHELVES]) {
        for (gain, exponent) in coefficients.gain.iter_mut().zip(&self.gain) {
            *gain = exponent.exp2();
        }
        let of_shelves = self.shelves.iter().zip(tangents).zip(states);
        for (shelves, ((exponents, tangent), states)) in
            coefficients.shelves.iter_mut().zip(of_shelves)
        {
            for ((shelf, exponent), state) in shelves.iter_mut().zip(exponents).zip(states) {
                shelf.set(*exponent, *tangent, state);
            }
        }
    }
}

/// A filter for each line, with ramped gains.
#[derive(Debug)]
pub(crate) struct ShelfFilter {
    set: LaneSet,
    /// Levels as designed, in dB by line.
    levels_db: Box<[BandArray; LINES]>,
    /// Tangents of the edges, as designed.
    tangents: [f32; SHELVES],
    start: Box<Exponents>,
    target: Box<Exponents>,
    growth: Box<Exponents>,
    /// Coefficients in use.
    present: Box<Coefficients>,
    states: Box<States>,
    is_moving: bool,
    /// Frames between two changes of the coefficients in use.
    hold_frames: usize,
    /// Whether all levels of a line are equal, now and at the start of the ramp: the shelves are without effect.
    is_flat: [bool; 2],
}

impl ShelfFilter {
    /// Filters without effect.
    pub(crate) fn new() -> Self {
        let target = Box::<Exponents>::default();
        let mut filter = Self {
            set: LaneSet::best(),
            levels_db: Box::new([[0.0; BANDS]; LINES]),
            tangents: [1.0; SHELVES],
            start: target.clone(),
            growth: target.clone(),
            present: Box::default(),
            target,
            states: Box::default(),
            is_moving: false,
            hold_frames: HOLD,
            is_flat: [true; 2],
        };
        filter.end_ramp();
        filter
    }

    /// Ramps to levels in dB by line, with responses nowhere above `most_db`; `left` frames of the last ramp remain. Free
    /// without a change.
    pub(crate) fn retarget(
        &mut self,
        design: &ShelfDesign,
        levels_db: &[BandArray; LINES],
        most_db: Option<&[f32; LINES]>,
        left: u32,
        ramp: u32,
    ) {
        if *levels_db == *self.levels_db {
            self.keep_levels(left, ramp);
            return;
        }
        let starts_flat = self.begin_ramp(left);
        *self.levels_db = *levels_db;
        self.tangents = design.tangents.map(|tangent| tangent as f32);
        let mut is_flat = true;
        for (line, levels) in levels_db.iter().enumerate() {
            let levels = levels.map(f64::from);
            let mut gains = design.gains(&levels);
            if let Some(most_db) = most_db {
                design.limit(&mut gains, f64::from(most_db[line]));
            }
            is_flat &= gains[..SHELVES].iter().all(|gain| gain.abs() < FLAT_DB);
            self.set_line(line, &gains);
        }
        self.is_flat = [is_flat, starts_flat];
        self.set_growth(ramp);
    }

    /// Goes on ramping to the levels of the last [`Self::retarget`]: a graphics frame may come before the last one's ramp has
    /// ended, of which `left` frames remain.
    pub(crate) fn keep_levels(&mut self, left: u32, ramp: u32) {
        if self.is_moving && left > 0 {
            self.is_flat[1] = self.begin_ramp(left);
            self.set_growth(ramp);
        } else if self.is_moving {
            self.end_ramp();
            self.is_flat[1] = self.is_flat[0];
        }
    }

    /// Sets the gains from which the next ramp starts; returns whether the shelves are without effect there.
    fn begin_ramp(&mut self, left: u32) -> bool {
        let is_in_ramp = self.is_moving && left > 0;
        *self.start = match is_in_ramp {
            true => self.target.before(&self.growth, left as f32),
            false => (*self.target).clone(),
        };
        self.is_flat[0] && (self.is_flat[1] || !is_in_ramp)
    }

    /// Sets the growth from the start to the target.
    fn set_growth(&mut self, ramp: u32) {
        self.is_moving = true;
        *self.growth = self.target.growth_from(&self.start, ramp);
        let fastest = self.fastest_change();
        self.hold_frames = HOLD;
        while self.hold_frames > 1 && self.hold_frames as f32 * fastest > HELD_CHANGE {
            self.hold_frames /= 2;
        }
    }

    /// The largest change per frame of a factor of signals.
    fn fastest_change(&self) -> f32 {
        let mut fastest = 0.0f32;
        let ends = self.start.each().zip(self.target.each());
        for (n, (growth, (start, target))) in self.growth.each().zip(ends).enumerate() {
            let highest = std::array::from_fn(|lane| start.0[lane].max(target.0[lane]));
            let highest = F32x8(highest).exp2();
            for lane in 0..8 {
                let (root, square) = (highest.0[lane], highest.0[lane] * highest.0[lane]);
                // The common gain is 2 to its exponent; a shelf has the factors √2 r² and r⁴.
                let slope = match n < BUNDLES {
                    true => root,
                    false => (4.0 * square).max(2.0 * SQRT_2) * square,
                };
                fastest = fastest.max(growth.0[lane].abs() * std::f32::consts::LN_2 * slope);
            }
        }
        fastest
    }

    fn set_line(&mut self, line: usize, gains: &Gains) {
        let (bundle, lane) = (line / 8, line % 8);
        // Of 2 to this power the fourth power is the gain.
        let exponent = |gain_db: f64| (gain_db * std::f64::consts::LOG2_10 / 80.0) as f32;
        self.target.gain[bundle].0[lane] = 4.0 * exponent(gains[SHELVES]);
        for (shelves, gain_db) in self.target.shelves.iter_mut().zip(gains) {
            shelves[bundle].0[lane] = exponent(*gain_db);
        }
    }

    /// Sets the coefficients in use to those `to_come` frames before the ramp's end.
    fn hold(&mut self, to_come: f32) {
        let gains = self.target.before(&self.growth, to_come);
        gains.set(&mut self.present, &mut self.states, &self.tangents);
    }

    fn end_ramp(&mut self) {
        self.is_moving = false;
        self.target
            .set(&mut self.present, &mut self.states, &self.tangents);
    }

    /// Filters the first `frames` frames of every line in place; `left` frames of the ramp remain.
    pub(crate) fn process(&mut self, rows: &mut Rows, left: u32, frames: usize) {
        let is_flat = self.is_flat == [true; 2];
        let mut start = 0;
        while start < frames {
            let mut count = frames - start;
            let to_come = left as usize - start.min(left as usize);
            if self.is_moving {
                if to_come == 0 {
                    self.end_ramp();
                } else {
                    let hold = self.hold_frames;
                    count = count.min((to_come - 1) % hold + 1);
                    let stretch = (to_come - 1) / hold * hold;
                    self.hold(stretch as f32 + 0.5 * (hold - 1) as f32);
                }
            }
            let range = Stretch { start, count };
            if is_flat {
                scale(&self.present, range, rows);
            } else {
                filter(self.set, &self.present, &mut self.states, range, rows);
            }
            start += count;
        }
        if is_flat {
            *self.states = Default::default();
            return;
        }
        for state in self.states.as_flattened_mut() {
            for value in state.band.0.iter_mut().chain(&mut state.low.0) {
                if value.abs() < STATE_FLOOR {
                    *value = 0.0;
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "shelf_filter_tests.rs"]
mod tests;
