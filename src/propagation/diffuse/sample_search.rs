//! Search for the sample nearest to a point with a normal.
//!
//! Own. The cost of a sample is its squared distance and [`SampleSearch::turn_m2`] for each unit that the normals' cosine falls
//! short of one, which is a squared distance in six dimensions. Blocks of eight samples lie in a tree over these; its nodes
//! have the bounds of eight children each, in lanes. Bounds are rounded like costs, and rounding keeps order: no bound is
//! above a cost within it, and the result has the bits of a comparison with all samples.

use std::ops::Range;

use glam::Vec3;

use crate::simd::{LaneSet, kernel};

/// Samples that most searches find.
const USUAL: usize = 4;

/// Samples of a block, and children of a node.
const LANES: usize = 8;

type Lanes = [f32; LANES];

/// Rounding error of the cosine of unit vectors, with a margin.
const COSINE_ROUNDING: f32 = 1e-6;

/// Coordinates of up to eight samples: points, then normals; NaN, which nothing is near, in unused lanes.
#[derive(Debug, Clone, Copy)]
struct Block {
    columns: [Lanes; 6],
    /// Indices of the samples.
    index: [u32; LANES],
}

/// Bounds of the coordinates of up to eight children.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: [Lanes; 6],
    high: [Lanes; 6],
    children: usize,
}

impl Bounds {
    const NONE: Self = Self {
        low: [[f32::INFINITY; LANES]; 6],
        high: [[f32::NEG_INFINITY; LANES]; 6],
        children: 0,
    };

    /// Adds a child whose bounds are those of all lanes of `columns`.
    fn push(&mut self, low: &[Lanes; 6], high: &[Lanes; 6]) {
        for k in 0..6 {
            self.low[k][self.children] = low[k].iter().copied().fold(f32::INFINITY, f32::min);
            self.high[k][self.children] = high[k].iter().copied().fold(f32::NEG_INFINITY, f32::max);
        }
        self.children += 1;
    }

    /// Least cost within each child, and the bit mask of the children where it is `most` at most.
    #[inline(always)]
    fn costs(&self, query: &Query, most: f32) -> (Lanes, u32) {
        let (mut square, mut cosine) = ([0.0f32; LANES], [0.0f32; LANES]);
        for axis in 0..3 {
            let (low, high, at) = (&self.low[axis], &self.high[axis], query.point[axis]);
            let (normal, along) = (&query.normal[axis], 3 + axis);
            let furthest = match *normal > 0.0 {
                true => &self.high[along],
                false => &self.low[along],
            };
            for l in 0..LANES {
                let (below, above) = (low[l] - at, at - high[l]);
                let outside = if below > above { below } else { above };
                let outside = if outside > 0.0 { outside } else { 0.0 };
                square[l] += outside * outside;
                cosine[l] += furthest[l] * normal;
            }
        }
        let (mut cost, mut mask) = ([0.0f32; LANES], [0u32; LANES]);
        for l in 0..LANES {
            let turn = 1.0 - cosine[l];
            let turn = if turn > -COSINE_ROUNDING {
                turn
            } else {
                -COSINE_ROUNDING
            };
            cost[l] = square[l] + query.turn_m2 * turn;
            mask[l] = u32::from(cost[l] <= most) << l;
        }
        let mask = mask.iter().fold(0, |all, bit| all | bit);
        (cost, mask & ((1 << self.children) - 1))
    }
}

/// What is searched for.
#[derive(Debug)]
struct Query {
    point: [f32; 3],
    normal: [f32; 3],
    turn_m2: f32,
}

/// Cost and index of a sample as one number, which has their order: bits of the cost, then the index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Nearest(i64);

impl Nearest {
    const NONE: Self = Self::new(f32::INFINITY, u32::MAX);

    #[inline(always)]
    const fn new(cost: f32, index: u32) -> Self {
        Self((ordered(cost.to_bits() as i32) as i64) << 32 | index as i64)
    }

    #[inline(always)]
    fn cost(self) -> f32 {
        f32::from_bits(ordered((self.0 >> 32) as i32) as u32)
    }

    fn index(self) -> u32 {
        self.0 as u32
    }

    /// Inserts it into the nearest samples so far, the nearest first, of equal ones that of the lowest index.
    #[inline(always)]
    fn insert(self, nearest: &mut [Self]) {
        let mut later = self;
        for other in nearest {
            (*other, later) = (later.min(*other), later.max(*other));
        }
    }
}

/// The bits of a number, not NaN, as an integer of the same order, and back.
#[inline(always)]
const fn ordered(bits: i32) -> i32 {
    bits ^ (bits >> 31 & i32::MAX)
}

/// The largest cost of the nearest samples so far.
#[inline(always)]
fn most(nearest: &[Nearest]) -> f32 {
    nearest.last().map_or(f32::NEG_INFINITY, |last| last.cost())
}

/// Samples in a tree of three levels.
#[derive(Debug, Clone, Default)]
pub(crate) struct SampleSearch {
    blocks: Vec<Block>,
    /// Of eight blocks each.
    groups: Vec<Bounds>,
    /// Of eight groups each.
    roots: Vec<Bounds>,
    /// Squared distance in square metres that normals at a right angle count as.
    pub(crate) turn_m2: f32,
}

impl SampleSearch {
    /// Of points with unit normals.
    pub(crate) fn new(samples: &[(Vec3, Vec3)], turn_m2: f32) -> Self {
        let coordinates = |(point, normal): &(Vec3, Vec3)| {
            let [x, y, z] = point.to_array();
            let [nx, ny, nz] = normal.to_array();
            [x, y, z, nx, ny, nz]
        };
        let coordinates: Vec<[f32; 6]> = samples.iter().map(coordinates).collect();
        let mut order: Vec<u32> = (0..samples.len() as u32).collect();
        arrange(&mut order, &coordinates, (0.5 * turn_m2).sqrt());
        let mut search = Self {
            turn_m2,
            ..Self::default()
        };
        for indices in order.chunks(LANES) {
            let mut index = [u32::MAX; LANES];
            index[..indices.len()].copy_from_slice(indices);
            let coordinate = |index: u32, k: usize| {
                let of = coordinates.get(index as usize);
                of.map_or(f32::NAN, |of| of[k])
            };
            let columns = std::array::from_fn(|k| index.map(|index| coordinate(index, k)));
            search.blocks.push(Block { columns, index });
        }
        for blocks in search.blocks.chunks(LANES) {
            let mut bounds = Bounds::NONE;
            let columns = blocks.iter().map(|block| &block.columns);
            columns.for_each(|columns| bounds.push(columns, columns));
            search.groups.push(bounds);
        }
        for groups in search.groups.chunks(LANES) {
            let mut bounds = Bounds::NONE;
            let children = groups.iter();
            children.for_each(|group| bounds.push(&group.low, &group.high));
            search.roots.push(bounds);
        }
        search
    }

    /// The `N` samples nearest to a point with a normal, the nearest first, of several the first one; fewer if there are no more.
    pub(crate) fn nearest<const N: usize>(
        &self,
        point: Vec3,
        normal: Vec3,
    ) -> impl Iterator<Item = usize> + use<N> {
        let query = Query {
            point: point.to_array(),
            normal: normal.to_array(),
            turn_m2: self.turn_m2,
        };
        let mut nearest = [Nearest::NONE; N];
        search(LaneSet::best(), self, &query, &mut nearest);
        let found = nearest.into_iter().map(Nearest::index);
        let found = found.take_while(|index| *index != u32::MAX);
        found.map(|index| index as usize)
    }

    /// Compares all samples with the nearest ones.
    #[inline(always)]
    fn compare(&self, query: &Query, nearest: &mut [Nearest]) {
        for root in 0..self.roots.len() {
            self.search_root(root, query, nearest);
        }
    }

    /// Compares the samples below a root with the nearest ones.
    #[inline(always)]
    fn search_root(&self, number: usize, query: &Query, nearest: &mut [Nearest]) {
        let (costs, mask) = self.roots[number].costs(query, most(nearest));
        let mut left = NearestFirst::of(&costs, mask);
        while let Some(child) = left.next(&costs, most(nearest)) {
            let group = number * LANES + child;
            let (costs, mask) = self.groups[group].costs(query, most(nearest));
            let mut left = NearestFirst::of(&costs, mask);
            while let Some(child) = left.next(&costs, most(nearest)) {
                self.blocks[group * LANES + child].search(query, nearest);
            }
        }
    }
}

/// Children of a node that are left to visit: the nearest one comes first.
struct NearestFirst {
    mask: u32,
    first: Option<usize>,
}

impl NearestFirst {
    #[inline(always)]
    fn of(costs: &Lanes, mask: u32) -> Self {
        let (mut first, mut least, mut left) = (None, f32::INFINITY, mask);
        while left != 0 {
            let lane = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            if costs[lane] < least {
                (first, least) = (Some(lane), costs[lane]);
            }
        }
        Self { mask, first }
    }

    /// The next child with costs of `most` at most.
    #[inline(always)]
    fn next(&mut self, costs: &Lanes, most: f32) -> Option<usize> {
        if let Some(first) = self.first.take() {
            self.mask &= !(1 << first);
            return Some(first);
        }
        while self.mask != 0 {
            let lane = self.mask.trailing_zeros() as usize % LANES;
            self.mask &= self.mask - 1;
            if costs[lane] <= most {
                return Some(lane);
            }
        }
        None
    }
}

impl Block {
    #[inline(always)]
    fn search(&self, query: &Query, nearest: &mut [Nearest]) {
        let ([x, y, z], [nx, ny, nz]) = (query.point, query.normal);
        let c = &self.columns;
        let (mut cost, mut mask) = ([0.0f32; LANES], [0u32; LANES]);
        let most = most(nearest);
        for l in 0..LANES {
            let (dx, dy, dz) = (c[0][l] - x, c[1][l] - y, c[2][l] - z);
            let cosine = c[3][l] * nx + c[4][l] * ny + c[5][l] * nz;
            cost[l] = dx * dx + dy * dy + dz * dz + query.turn_m2 * (1.0 - cosine);
            mask[l] = u32::from(cost[l] <= most) << l;
        }
        let mut left = mask.iter().fold(0, |all, bit| all | bit);
        while left != 0 {
            let lane = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            Nearest::new(cost[lane], self.index[lane]).insert(nearest);
        }
    }
}

kernel! {
    /// Compares all samples with the nearest ones. No fused products: all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn search<L>(tree: &SampleSearch, query: &Query, nearest: &mut [Nearest]) {
        // A function of its own for the usual number: its lists stay in registers.
        match nearest.len() {
            USUAL => tree.compare(query, &mut nearest[..USUAL]),
            _ => tree.compare(query, nearest),
        }
    }
}

/// Orders samples such that each aligned run of eight, 64, 512 … is near each other: halves along the longest extent.
fn arrange(order: &mut [u32], coordinates: &[[f32; 6]], turn_m: f32) {
    let blocks = order.len().div_ceil(LANES);
    if blocks < 2 {
        return;
    }
    let half = LANES * (blocks.next_power_of_two() / 2);
    let of = |index: &u32, axis: usize| coordinates[*index as usize][axis];
    let extent = |axis: usize| {
        let values = || order.iter().map(|index| of(index, axis));
        let (low, high) = (
            values().fold(f32::INFINITY, f32::min),
            values().fold(f32::NEG_INFINITY, f32::max),
        );
        (high - low) * if axis < 3 { 1.0 } else { turn_m }
    };
    let axes: Range<usize> = 0..6;
    let longest = axes.max_by(|a, b| extent(*a).total_cmp(&extent(*b)));
    let axis = longest.unwrap_or_default();
    let by_axis = |a: &u32, b: &u32| of(a, axis).total_cmp(&of(b, axis)).then(a.cmp(b));
    order.select_nth_unstable_by(half, by_axis);
    let (low, high) = order.split_at_mut(half);
    arrange(low, coordinates, turn_m);
    arrange(high, coordinates, turn_m);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::rays::directions::{mix, unit};

    #[test]
    fn the_search_has_the_bits_of_a_comparison_with_all_samples() {
        let random = |number: u64| unit(mix(number)) - 0.5;
        let sample = |number: u64| {
            let [x, y, z, nx, ny, nz] = std::array::from_fn(|k| random(6 * number + k as u64));
            // Walls have few normals, and several samples at one distance.
            let round = |x: f32| match number % 3 {
                0 => x,
                _ => x.round(),
            };
            let normal = Vec3::new(nx, ny, nz);
            let normal = match number % 2 {
                0 => normal.normalize(),
                _ => Vec3::AXES[number as usize % 3] * nx.signum(),
            };
            (Vec3::new(20.0 * x, round(6.0 * y), round(10.0 * z)), normal)
        };
        let turn_m2 = 30.0;
        for count in [1, 7, 8, 9, 63, 64, 65, 300, 1024, 1300] {
            let samples: Vec<(Vec3, Vec3)> = (0..count).map(sample).collect();
            let search = SampleSearch::new(&samples, turn_m2);
            for number in 0..400 {
                let (point, normal) = sample(1_000_000 + number);
                let cost = |index: usize| {
                    let (d, m) = (samples[index].0 - point, samples[index].1);
                    let cosine = m.x * normal.x + m.y * normal.y + m.z * normal.z;
                    d.x * d.x + d.y * d.y + d.z * d.z + turn_m2 * (1.0 - cosine)
                };
                let mut sorted: Vec<usize> = (0..samples.len()).collect();
                sorted.sort_by(|a, b| cost(*a).total_cmp(&cost(*b)));
                let first = search.nearest::<1>(point, normal);
                assert!(first.eq(sorted.iter().take(1).copied()), "{count}");
                let first = search.nearest::<4>(point, normal);
                assert!(first.eq(sorted.iter().take(4).copied()), "{count}");
            }
        }
    }

    #[test]
    fn what_is_no_number_has_no_nearest_sample() {
        let samples = [(Vec3::ZERO, Vec3::X); 9];
        let search = SampleSearch::new(&samples, 1.0);
        assert_eq!(search.nearest::<4>(Vec3::NAN, Vec3::X).next(), None);
        let none = SampleSearch::default();
        assert_eq!(none.nearest::<4>(Vec3::ONE, Vec3::X).next(), None);
    }
}
