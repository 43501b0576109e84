//! Gains and delays of an arrival for a grid of directions: the panning law of a layout, or an HRTF set.
//!
//! Construction: control side. Look-up: audio side, wait-free. Input: directions in head coordinates; output: delays and
//! weights by bilinear interpolation in azimuth and elevation.
//!
//! An arrival is read once an ear in binaural sound, each at its own delay, and once without a further delay in all other
//! layouts. Each reading has groups of eight weights: those of the shared filters of an HRTF set, or of eight channels.

use std::f32::consts::{PI, SQRT_2, TAU};

use glam::Vec3;

use crate::generation::panning::ambisonics;
use crate::generation::panning::angle::angle;
use crate::generation::panning::layout::Layout;
use crate::generation::panning::loudspeakers::{Loudspeakers, stereo};
use crate::simd::{F32x8, LaneSet, kernel, prefetch};

/// Weights per group.
pub(crate) const LANES: usize = 8;

/// Grid of channel layouts: 2 degrees. Linear interpolation is then off by `n (n + 1) / 8` times the square of the step for
/// harmonics of order n: 0.002 for order 3.
const AZIMUTHS: usize = 180;
const ELEVATIONS: usize = 91;

/// Gain of channel layouts: the energy of both ears in a diffuse field (see [`Layout`]).
pub(crate) const CHANNEL_GAIN: f32 = SQRT_2;

/// Readings, delays and weights by direction.
#[derive(Debug, Clone)]
pub(crate) struct DirectionTable {
    set: LaneSet,
    /// Readings of an arrival: 2 in binaural sound, otherwise 1.
    ears: usize,
    /// Groups of weights per reading, and how many of them are enough for quiet arrivals.
    groups: usize,
    coarse_groups: usize,
    azimuths: usize,
    elevations: usize,
    /// Delays of the readings in frames, ordered by elevation, then by azimuth.
    delays: Vec<[f32; 2]>,
    /// In the same order; per direction the groups of the first reading, then those of the second.
    weights: Vec<F32x8>,
    max_delay: f32,
    energy: Energy,
}

/// What the energy of a reading is.
#[derive(Debug, Clone)]
enum Energy {
    /// The squares of its first weights: of Ambisonics the omnidirectional channel, otherwise all.
    Squares(usize),
    /// Weights times the products of the shared filters with each other, by filter.
    Filtered(Vec<F32x8>),
}

/// Sizes of a table.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TableSize {
    pub(crate) ears: usize,
    pub(crate) groups: usize,
    pub(crate) coarse_groups: usize,
    pub(crate) azimuths: usize,
    pub(crate) elevations: usize,
}

impl DirectionTable {
    /// A table from its values; their numbers must fit the size.
    pub(crate) fn new(size: TableSize, delays: Vec<[f32; 2]>, weights: Vec<F32x8>) -> Self {
        debug_assert_eq!(delays.len(), size.azimuths * size.elevations);
        debug_assert_eq!(weights.len(), delays.len() * size.ears * size.groups);
        let max_delay = delays.iter().flatten().copied().fold(0.0, f32::max);
        Self {
            set: LaneSet::best(),
            ears: size.ears,
            groups: size.groups,
            coarse_groups: size.coarse_groups,
            azimuths: size.azimuths,
            elevations: size.elevations,
            delays,
            weights,
            max_delay,
            energy: Energy::Squares(LANES * size.groups),
        }
    }

    /// With the products of the shared filters, [`Self::groups`] entries a filter, from which the energy of a sum of filters follows.
    pub(crate) fn with_filter_products(self, products: Vec<F32x8>) -> Self {
        debug_assert_eq!(products.len(), LANES * self.groups * self.groups);
        Self {
            energy: Energy::Filtered(products),
            ..self
        }
    }

    /// The panning law of a layout other than binaural, in an output of `channels` channels. Allocates up to a megabyte.
    pub(crate) fn of_layout(layout: Layout, channels: usize) -> Self {
        let law = PanningLaw::of(layout, channels);
        let used = law.channels(layout);
        let groups = used.div_ceil(LANES);
        let size = TableSize {
            ears: 1,
            groups,
            coarse_groups: groups,
            azimuths: AZIMUTHS,
            elevations: ELEVATIONS,
        };
        let directions = AZIMUTHS * ELEVATIONS;
        let mut weights = Vec::with_capacity(directions * groups);
        let mut gains = vec![0.0; groups * LANES];
        for elevation in 0..ELEVATIONS {
            for azimuth in 0..AZIMUTHS {
                gains.fill(0.0);
                law.gains(size.direction(azimuth, elevation), &mut gains[..used]);
                let scaled = |lane: &f32| CHANNEL_GAIN * lane;
                let each = gains.as_chunks::<LANES>().0.iter();
                weights.extend(each.map(|group| F32x8(group.each_ref().map(scaled))));
            }
        }
        Self {
            energy: Energy::Squares(match layout.ambisonics_order() {
                Some(_) => 1,
                None => LANES * groups,
            }),
            ..Self::new(size, vec![[0.0; 2]; directions], weights)
        }
    }

    /// Readings of an arrival.
    pub(crate) fn ears(&self) -> usize {
        self.ears
    }

    /// Groups of weights per reading.
    pub(crate) fn groups(&self) -> usize {
        self.groups
    }

    /// Groups that are enough for quiet arrivals and for sums over many directions.
    pub(crate) fn coarse_groups(&self) -> usize {
        self.coarse_groups
    }

    /// Groups of all readings.
    pub(crate) fn width(&self) -> usize {
        self.ears * self.groups
    }

    /// Azimuths and elevations of the grid, its delays, and its weights.
    pub(crate) fn grid(&self) -> ([usize; 2], &[[f32; 2]], &[F32x8]) {
        (
            [self.azimuths, self.elevations],
            &self.delays,
            &self.weights,
        )
    }

    /// Longest delay in frames.
    pub(crate) fn max_delay(&self) -> f32 {
        self.max_delay
    }

    /// Returns the delays of the readings in frames for a direction in head coordinates (+x right, +y up, −z ahead) and
    /// writes their weights, [`Self::width`] of them.
    ///
    /// The direction may have any length; the zero vector and NaN return the values of a grid point. Panics if `weights`
    /// is shorter. Real-time: no allocation, four grid points.
    pub(crate) fn look_up(&self, direction: Vec3, weights: &mut [F32x8]) -> [f32; 2] {
        self.blend(&self.find(direction), self.groups, weights)
    }

    /// [`Self::find`] for several directions at once.
    #[inline]
    pub(crate) fn find_batch(
        &self,
        directions: &[Vec3; FIND_BATCH],
        corners: &mut [Corners; FIND_BATCH],
    ) {
        // Loops over arrays become vector instructions.
        let (mut turns, mut rises) = ([0.0; FIND_BATCH], [0.0; FIND_BATCH]);
        for n in 0..FIND_BATCH {
            let Vec3 { x, y, z } = directions[n];
            let horizontal = (x * x + z * z).sqrt();
            turns[n] = angle(-x, -z);
            rises[n] = angle(y, horizontal);
        }
        for (corners, (turn, rise)) in corners.iter_mut().zip(turns.into_iter().zip(rises)) {
            *corners = self.corners_at(turn, rise);
        }
    }

    /// Prefetches the input of [`Self::blend`].
    #[inline]
    pub(crate) fn prefetch(&self, corners: &Corners) {
        let width = self.width();
        // Neighbours of one elevation are adjacent in memory, except for the last azimuth.
        for &(direction, _) in corners {
            let of_corner = &self.weights[direction * width..][..width];
            for group in of_corner.iter().step_by(2) {
                prefetch(group);
            }
            prefetch(&self.delays[direction]);
        }
    }

    /// Second part of [`Self::look_up`]; groups from `groups` on are zero.
    pub(crate) fn blend(
        &self,
        corners: &Corners,
        groups: usize,
        weights: &mut [F32x8],
    ) -> [f32; 2] {
        let width = self.width();
        let groups = groups.min(self.groups);
        let mut delays = [0.0; 2];
        for (sum, ear) in delays.iter_mut().zip(0..self.ears) {
            for &(direction, share) in corners {
                *sum += self.delays[direction][ear] * share;
            }
        }
        let mut shares = [0.0; 4];
        let mut grid: [&[F32x8]; 4] = [&[]; 4];
        let readings = weights[..width].chunks_exact_mut(self.groups);
        for (ear, weights) in readings.enumerate() {
            for (corner, &(direction, share)) in corners.iter().enumerate() {
                let first = direction * width + ear * self.groups;
                grid[corner] = &self.weights[first..][..self.groups];
                shares[corner] = share;
            }
            let (used, unused) = weights.split_at_mut(groups);
            blend_weights(self.set, &grid, &shares, used);
            unused.fill(F32x8::ZERO);
        }
        delays
    }

    /// [`Self::blend`] of a sound from several directions, each with its share of the energy; the shares sum to 1. As in
    /// \[PULKKI99\] the mean of the weights, with the energy that the directions have in the mean; the delays are their mean.
    /// `scratch` is as long as `weights`.
    pub(crate) fn blend_wide(
        &self,
        directions: impl Iterator<Item = (Vec3, f32)>,
        groups: usize,
        weights: &mut [F32x8],
        scratch: &mut [F32x8],
    ) -> [f32; 2] {
        let width = self.width();
        let (weights, scratch) = (&mut weights[..width], &mut scratch[..width]);
        weights.fill(F32x8::ZERO);
        let (mut delays, mut energies) = ([0.0; 2], [0.0; 2]);
        for (direction, share) in directions {
            let ears = self.blend(&self.find(direction), groups, scratch);
            for (sum, delay) in delays.iter_mut().zip(ears) {
                *sum += share * delay;
            }
            let readings = scratch.chunks_exact(self.groups);
            for (sum, reading) in energies.iter_mut().zip(readings) {
                *sum += share * self.energy(reading);
            }
            for (sum, own) in weights.iter_mut().zip(scratch.iter()) {
                for (sum, own) in sum.0.iter_mut().zip(own.0) {
                    *sum += share * own;
                }
            }
        }
        for (energy, reading) in energies.iter().zip(weights.chunks_exact_mut(self.groups)) {
            let gain = (energy.max(0.0) / self.energy(reading).max(f32::MIN_POSITIVE)).sqrt();
            for lane in reading.iter_mut().flat_map(|group| &mut group.0) {
                *lane *= gain;
            }
        }
        delays
    }

    /// Energy of a reading.
    fn energy(&self, reading: &[F32x8]) -> f32 {
        match &self.energy {
            Energy::Squares(count) => {
                let lanes = reading.iter().flat_map(|group| group.0);
                lanes.take(*count).map(|lane| lane * lane).sum()
            }
            Energy::Filtered(products) => {
                let mut sums = F32x8::ZERO;
                quadratic(self.set, products, reading, &mut sums);
                sums.sum()
            }
        }
    }

    /// First part of [`Self::look_up`]: the four grid points around a direction and their interpolation weights.
    pub(crate) fn find(&self, direction: Vec3) -> Corners {
        let horizontal = (direction.x * direction.x + direction.z * direction.z).sqrt();
        let turn = angle(-direction.x, -direction.z);
        self.corners_at(turn, angle(direction.y, horizontal))
    }

    /// [`Self::find`] by azimuth and elevation in radians.
    #[inline]
    fn corners_at(&self, turn: f32, rise: f32) -> Corners {
        let (turns, rise) = (turn / TAU, rise / PI + 0.5);
        // From −½ to ½; the function `floor` is a library call on x86-64 without SSE 4.1.
        let turns = if turns < 0.0 { turns + 1.0 } else { turns };
        // `max` converts NaN to zero.
        let column = turns.clamp(0.0, 1.0).max(0.0) * self.azimuths as f32;
        let row = rise.clamp(0.0, 1.0).max(0.0) * (self.elevations - 1) as f32;
        let (a, e) = (column as usize, (row as usize).min(self.elevations - 2));
        let (across, up) = (column - a as f32, row - e as f32);
        let (a, next) = (a % self.azimuths, (a + 1) % self.azimuths);
        let (low, high) = (e * self.azimuths, (e + 1) * self.azimuths);
        [
            (low + a, (1.0 - across) * (1.0 - up)),
            (low + next, across * (1.0 - up)),
            (high + a, (1.0 - across) * up),
            (high + next, across * up),
        ]
    }
}

impl TableSize {
    /// The unit vector of a grid point.
    pub(crate) fn direction(&self, azimuth: usize, elevation: usize) -> Vec3 {
        let turn = TAU * azimuth as f32 / self.azimuths as f32;
        let rise = PI * (elevation as f32 / (self.elevations - 1) as f32 - 0.5);
        let across = rise.cos().max(0.0);
        Vec3::new(-across * turn.sin(), rise.sin(), -across * turn.cos())
    }
}

/// How a direction becomes gains of channels.
enum PanningLaw {
    /// The same gain in each of so many channels.
    Equal(usize),
    Stereo,
    Loudspeakers(Loudspeakers),
    Harmonics,
}

impl PanningLaw {
    fn of(layout: Layout, channels: usize) -> Self {
        match (layout, Loudspeakers::of(layout)) {
            (_, Some(loudspeakers)) => Self::Loudspeakers(loudspeakers),
            (Layout::Binaural | Layout::Stereo, None) => Self::Stereo,
            (Layout::Mono, None) => Self::Equal(channels.clamp(1, 2)),
            (_, None) => Self::Harmonics,
        }
    }

    /// Channels in use.
    fn channels(&self, layout: Layout) -> usize {
        match self {
            Self::Equal(channels) => *channels,
            _ => layout.channels(),
        }
    }

    /// Adds the gains of a unit vector: of unit energy, or of unit energy in the omnidirectional channel.
    fn gains(&self, direction: Vec3, gains: &mut [f32]) {
        match self {
            Self::Equal(channels) => gains.fill((*channels as f32).sqrt().recip()),
            Self::Stereo => gains.copy_from_slice(&stereo(direction)),
            Self::Loudspeakers(loudspeakers) => loudspeakers.pan(direction, gains),
            Self::Harmonics => {
                let all = ambisonics::harmonics(direction);
                gains.copy_from_slice(&all[..gains.len()]);
            }
        }
    }
}

/// Directions that are found at once.
pub(crate) const FIND_BATCH: usize = 8;

/// Four grid points around a direction and their interpolation weights.
pub(crate) type Corners = [(usize, f32); 4];

kernel! {
    /// Sums the weights of the grid points, each scaled by its share.
    fn blend_weights<L>(grid: &[&[F32x8]; 4], shares: &[f32; 4], weights: &mut [F32x8]) {
        let [a, b, c, d] = grid;
        let shares = [
            L::splat(shares[0]),
            L::splat(shares[1]),
            L::splat(shares[2]),
            L::splat(shares[3]),
        ];
        for group in 0..weights.len() {
            let sum = L::from_array(a[group]).mul(shares[0]);
            let sum = L::from_array(b[group]).mul_add(shares[1], sum);
            let sum = L::from_array(c[group]).mul_add(shares[2], sum);
            weights[group] = L::from_array(d[group]).mul_add(shares[3], sum).to_array();
        }
    }
}

kernel! {
    /// A reading times the products of the filters with each other times the reading, as sums of lanes.
    fn quadratic<L>(products: &[F32x8], reading: &[F32x8], sums: &mut F32x8) {
        let groups = reading.len();
        let mut total = L::splat(0.0);
        for (group, own) in reading.iter().enumerate() {
            let mut sum = L::splat(0.0);
            for (lanes, rows) in reading.iter().zip(products.chunks_exact(LANES * groups)) {
                let weights = L::splat_each(*lanes);
                for (lane, weight) in weights.into_iter().enumerate() {
                    sum = L::from_array(rows[groups * lane + group]).mul_add(weight, sum);
                }
            }
            total = L::from_array(*own).mul_add(sum, total);
        }
        *sums = total.to_array();
    }
}

#[cfg(test)]
#[path = "direction_table_tests.rs"]
mod tests;
