//! Head-related responses: for every direction a delay and a few weights an ear, over shared filters.
//!
//! Control side at birth; [`Hrtf::look_up`] is wait-free and belongs to the audio side. Takes a baked file (layout in
//! assets/hrtf/README.md), gives ear delays and weights for directions in head coordinates.
//!
//! Own form of the usual separation into delays and minimum-phase principal components (\[KISTLER92\]):
//! both vary smoothly with direction, so bilinear interpolation on the grid adds no comb filtering, and a crowd of
//! paths shares one bank of filters an ear.

use glam::Vec3;

use crate::error::{Error, Result};
use crate::simd::{F32x8, LaneSet, kernel, prefetch};

const MAGIC: &[u8; 8] = b"FSHRTF1\0";
const HEADER_BYTES: usize = 28;
/// Components come in lanes of eight.
const LANES: usize = 8;
/// Longest ear delay a file may hold, in seconds: five times what a head makes.
const MAX_DELAY_S: f32 = 0.004;
/// Largest weight or tap magnitude a file may hold: 60 dB.
const MAX_VALUE: f32 = 1000.0;
const ADVICE: &str = "bake the file anew with assets/hrtf/bake.py";

/// A set of head-related responses.
#[derive(Debug, Clone)]
pub struct Hrtf {
    set: LaneSet,
    rate_hz: u32,
    taps: usize,
    groups: usize,
    azimuths: usize,
    elevations: usize,
    /// Group after group, tap after tap, a component a lane.
    basis: Vec<F32x8>,
    /// In frames: elevation after elevation, azimuth after azimuth, left and right.
    delays: Vec<[f32; 2]>,
    /// In the same order; of each direction the groups of the left ear, then of the right.
    weights: Vec<F32x8>,
    max_delay: f32,
}

impl Hrtf {
    /// Reads a baked set.
    ///
    /// Errors: [`Error::Format`] naming `name` if size, header or a value is not what the format allows.
    pub fn parse(bytes: &[u8], name: &str) -> Result<Self> {
        let wrong = |problem: String| Error::format(name, None, problem, ADVICE);
        if bytes.len() < HEADER_BYTES || &bytes[..8] != MAGIC {
            return Err(wrong("this is not a baked head-related set".into()));
        }
        let mut header = Words(&bytes[8..HEADER_BYTES]);
        let rate_hz = header.u32();
        let mut size = |what: &str, low: usize, high: usize| {
            let value = header.u32() as usize;
            if (low..=high).contains(&value) {
                Ok(value)
            } else {
                Err(wrong(format!("{value} {what}, outside {low} to {high}")))
            }
        };
        let taps = size("taps", 1, 1024)?;
        let components = size("components", LANES, 64)?;
        let azimuths = size("azimuths", 4, 720)?;
        let elevations = size("elevations", 3, 361)?;
        if !(8_000..=192_000).contains(&rate_hz) {
            return Err(wrong(format!("a sample rate of {rate_hz} Hz")));
        }
        if !components.is_multiple_of(LANES) {
            return Err(wrong(format!(
                "{components} components, not a multiple of {LANES}"
            )));
        }
        let directions = azimuths * elevations;
        let values = components * taps + directions * 2 * (1 + components);
        let wanted = HEADER_BYTES + 4 * values;
        if bytes.len() != wanted {
            return Err(wrong(format!(
                "{} bytes long where its header makes it {wanted}",
                bytes.len()
            )));
        }
        let body = &bytes[HEADER_BYTES..];
        if let Some(place) = Words(body).position(|v| v.is_nan() || v.abs() > MAX_VALUE) {
            return Err(wrong(format!(
                "value {place} after the header is not a number within ±{MAX_VALUE}"
            )));
        }

        let groups = components / LANES;
        let mut words = Words(body);
        let mut basis = vec![F32x8::ZERO; groups * taps];
        for component in 0..components {
            for tap in 0..taps {
                basis[component / LANES * taps + tap].0[component % LANES] = words.f32();
            }
        }
        let mut delays = Vec::with_capacity(directions);
        let mut weights = vec![F32x8::ZERO; directions * 2 * groups];
        let mut max_delay = 0.0f32;
        for of_direction in weights.chunks_exact_mut(2 * groups) {
            let mut ears = [0.0; 2];
            for (delay, of_ear) in ears.iter_mut().zip(of_direction.chunks_exact_mut(groups)) {
                let delay_s = words.f32();
                if !(0.0..=MAX_DELAY_S).contains(&delay_s) {
                    return Err(wrong(format!(
                        "an ear delay of {delay_s} s, outside 0 to {MAX_DELAY_S} s"
                    )));
                }
                *delay = delay_s * rate_hz as f32;
                max_delay = max_delay.max(*delay);
                for group in of_ear {
                    for lane in &mut group.0 {
                        *lane = words.f32();
                    }
                }
            }
            delays.push(ears);
        }
        Ok(Self {
            set: LaneSet::best(),
            rate_hz,
            taps,
            groups,
            azimuths,
            elevations,
            basis,
            delays,
            weights,
            max_delay,
        })
    }

    /// A head that is none: both ears hear every direction alike, at once and unfiltered. For impulse responses.
    ///
    /// Range: 8,000 to 192,000 Hz.
    ///
    /// Errors: [`Error::Setting`] for any other rate.
    pub fn omnidirectional(rate_hz: u32) -> Result<Self> {
        if !(8_000..=192_000).contains(&rate_hz) {
            let problem = format!("{rate_hz} Hz is out of range");
            return Err(Error::setting(
                "rate_hz",
                problem,
                "choose a rate from 8000 to 192000",
            ));
        }
        let (azimuths, elevations) = (4, 3);
        let directions = azimuths * elevations;
        let unit = F32x8([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        Ok(Self {
            set: LaneSet::best(),
            rate_hz,
            taps: 1,
            groups: 1,
            azimuths,
            elevations,
            basis: vec![unit],
            delays: vec![[0.0; 2]; directions],
            weights: vec![unit; 2 * directions],
            max_delay: 0.0,
        })
    }

    /// Sample rate of the set in Hz.
    pub fn rate_hz(&self) -> u32 {
        self.rate_hz
    }

    /// Length of the shared filters in frames.
    pub fn taps(&self) -> usize {
        self.taps
    }

    /// Number of shared filters, in groups of eight lanes.
    pub fn groups(&self) -> usize {
        self.groups
    }

    /// One group's filters: a tap after the other, a filter a lane.
    pub fn basis(&self, group: usize) -> &[F32x8] {
        &self.basis[group * self.taps..][..self.taps]
    }

    /// The longest ear delay of the set in frames.
    pub fn max_delay(&self) -> f32 {
        self.max_delay
    }

    /// Delays of the left and right ear in frames for a direction in head coordinates (+x right, +y up, −z ahead), and
    /// their weights: [`Self::groups`] entries for the left ear, then as many for the right.
    ///
    /// Interpolates bilinearly in azimuth and elevation. The direction need not have unit length; the zero vector and
    /// not-a-number give the response of some grid point. Real-time: no allocation, four grid points.
    pub fn look_up(&self, head: Vec3, weights: &mut [F32x8]) -> [f32; 2] {
        self.blend(&self.corners(head), self.groups, weights)
    }

    /// What [`Self::look_up`] starts from, and the memory that it reads is asked for.
    pub(crate) fn find(&self, head: Vec3) -> Corners {
        let corners = self.corners(head);
        let width = 2 * self.groups;
        // Two neighbours of one elevation lie side by side, but for the last azimuth's.
        for (direction, _) in corners {
            let of_corner = &self.weights[direction * width..][..width];
            for group in of_corner.iter().step_by(2) {
                prefetch(group);
            }
            prefetch(&self.delays[direction]);
        }
        corners
    }

    /// The rest of [`Self::look_up`]; groups from `groups` on are zero.
    pub(crate) fn blend(
        &self,
        corners: &Corners,
        groups: usize,
        weights: &mut [F32x8],
    ) -> [f32; 2] {
        let width = 2 * self.groups;
        let groups = groups.min(self.groups);
        let (left, right) = weights[..width].split_at_mut(self.groups);
        let mut delays = [0.0; 2];
        for (sum, ear) in delays.iter_mut().zip(0..) {
            for &(direction, share) in corners {
                *sum += self.delays[direction][ear] * share;
            }
        }
        let mut shares = [0.0; 4];
        let mut grid: [&[F32x8]; 4] = [&[]; 4];
        for (ear, weights) in [left, right].into_iter().enumerate() {
            for (corner, &(direction, share)) in corners.iter().enumerate() {
                let first = direction * width + ear * self.groups;
                grid[corner] = &self.weights[first..][..self.groups];
                shares[corner] = share;
            }
            let (used, unused) = weights.split_at_mut(groups);
            weigh(self.set, &grid, &shares, used);
            unused.fill(F32x8::ZERO);
        }
        delays
    }

    /// The four grid points around a direction and their shares.
    fn corners(&self, head: Vec3) -> Corners {
        let level = (head.x * head.x + head.z * head.z).sqrt();
        let turns = (-head.x).atan2(-head.z) / std::f32::consts::TAU;
        let rise = head.y.atan2(level) / std::f32::consts::PI + 0.5;
        // `max` turns not-a-number into zero.
        let column = (turns - turns.floor()).clamp(0.0, 1.0).max(0.0) * self.azimuths as f32;
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

/// Four grid points around a direction and the share of each.
pub(crate) type Corners = [(usize, f32); 4];

kernel! {
    /// Weights of grid points in their shares.
    fn weigh<L>(grid: &[&[F32x8]; 4], shares: &[f32; 4], weights: &mut [F32x8]) {
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

/// Little-endian words of four bytes; zero behind the end, which the size check rules out.
struct Words<'a>(&'a [u8]);

impl Words<'_> {
    fn u32(&mut self) -> u32 {
        match self.0.split_first_chunk::<4>() {
            Some((word, rest)) => {
                self.0 = rest;
                u32::from_le_bytes(*word)
            }
            None => 0,
        }
    }

    fn f32(&mut self) -> f32 {
        f32::from_bits(self.u32())
    }

    fn position(&self, is_wrong: impl Fn(f32) -> bool) -> Option<usize> {
        self.0
            .chunks_exact(4)
            .position(|word| is_wrong(f32::from_le_bytes([word[0], word[1], word[2], word[3]])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generation::synthetic_hrtf;

    fn set() -> Hrtf {
        Hrtf::parse(&synthetic_hrtf::bytes(44_100), "synthetic").unwrap()
    }

    #[test]
    fn damaged_files_are_refused_by_name() {
        let good = synthetic_hrtf::bytes(44_100);
        let mut cases: Vec<Vec<u8>> = vec![
            Vec::new(),
            good[..20].to_vec(),
            good[..good.len() - 1].to_vec(),
        ];
        for (at, word) in [
            (0, *b"NOPE"),
            (8, 1u32.to_le_bytes()),
            (12, 0u32.to_le_bytes()),
            (16, 12u32.to_le_bytes()),
            (20, u32::MAX.to_le_bytes()),
            (28, f32::NAN.to_le_bytes()),
            (good.len() - 4, f32::INFINITY.to_le_bytes()),
            (28 + 128 * 16 * 4, (-0.001f32).to_le_bytes()),
        ] {
            let mut bad = good.clone();
            bad[at..at + 4].copy_from_slice(&word);
            cases.push(bad);
        }
        for bad in cases {
            let error = Hrtf::parse(&bad, "ears.hrtf").unwrap_err().to_string();
            assert!(error.starts_with("ears.hrtf: "), "{error}");
        }
    }

    #[test]
    fn left_source_is_earlier_and_louder_at_the_left_ear() {
        let set = set();
        let mut weights = vec![F32x8::ZERO; 2 * set.groups()];
        let delays = set.look_up(Vec3::NEG_X, &mut weights);
        // Woodworth: (r / c)(1 + π / 2) = 0.656 ms for r = 87.5 mm.
        let difference_s = (delays[1] - delays[0]) / 44_100.0;
        assert!((difference_s - 0.656e-3).abs() < 1e-5, "{difference_s}");
        assert!(weights[0].0[0] > weights[set.groups()].0[0]);
    }

    #[test]
    fn look_up_is_continuous_round_the_head_and_over_the_poles() {
        let set = set();
        let mut weights = vec![F32x8::ZERO; 2 * set.groups()];
        let mut last: Option<([f32; 2], Vec<F32x8>)> = None;
        for step in 0..=3600 {
            let angle = step as f32 * std::f32::consts::TAU / 3600.0;
            for direction in [
                Vec3::new(-angle.sin(), 0.3, -angle.cos()),
                Vec3::new(0.02, angle.sin(), -angle.cos()),
            ] {
                set.look_up(direction, &mut weights);
            }
            let delays = set.look_up(Vec3::new(-angle.sin(), 0.3, -angle.cos()), &mut weights);
            if let Some((before, held)) = &last {
                // A tenth of a degree of 0.66 ms over 90 degrees is 0.03 frames; weights change as little.
                assert!((delays[0] - before[0]).abs() < 0.06, "{step}");
                for (a, b) in weights.iter().zip(held) {
                    assert!((a.0[0] - b.0[0]).abs() < 0.01, "{step}");
                }
            }
            last = Some((delays, weights.clone()));
        }
    }

    #[test]
    fn no_direction_and_no_number_are_harmless() {
        let set = set();
        let mut weights = vec![F32x8::ZERO; 2 * set.groups()];
        for direction in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::Y, Vec3::NEG_Y] {
            let delays = set.look_up(direction, &mut weights);
            assert!(delays.iter().all(|d| d.is_finite()), "{direction}");
        }
    }

    #[test]
    fn groups_that_are_not_asked_for_are_zero_and_the_others_as_they_are() {
        let set = set();
        let groups = set.groups();
        let direction = Vec3::new(0.3, 0.2, -0.9);
        let (mut all, mut few) = (
            vec![F32x8::ZERO; 2 * groups],
            vec![F32x8::splat(9.0); 2 * groups],
        );
        let delays = set.look_up(direction, &mut all);
        for wanted in 0..=groups {
            assert_eq!(set.blend(&set.find(direction), wanted, &mut few), delays);
            for (n, (few, all)) in few.iter().zip(&all).enumerate() {
                let is_wanted = n % groups < wanted;
                assert_eq!(*few, if is_wanted { *all } else { F32x8::ZERO });
            }
        }
    }

    #[test]
    fn weights_are_the_grid_points_in_their_shares() {
        let point = |n: usize| -> Vec<F32x8> {
            let lane = |i: usize| ((17 * n + i) as f32 * 0.7).sin();
            (0..2)
                .map(|group| F32x8(std::array::from_fn(|i| lane(8 * group + i))))
                .collect()
        };
        let points: [Vec<F32x8>; 4] = std::array::from_fn(point);
        let grid = points.each_ref().map(Vec::as_slice);
        let shares = [0.1, 0.2, 0.3, 0.4];
        let with = |set: LaneSet| {
            let mut weights = [F32x8::ZERO; 2];
            weigh(set, &grid, &shares, &mut weights);
            weights
        };
        for set in LaneSet::vector_units() {
            assert_eq!(with(set), with(LaneSet::Fused), "{set:?}");
        }
        for found in [with(LaneSet::best()), with(LaneSet::Portable)] {
            for (group, found) in found.iter().enumerate() {
                for lane in 0..8 {
                    let each = grid.iter().zip(shares);
                    let exact: f64 = each
                        .map(|(point, share)| f64::from(point[group].0[lane]) * f64::from(share))
                        .sum();
                    // Seven roundings of sums below one.
                    let bound = 7.0 * f64::from(f32::EPSILON / 2.0);
                    assert!((f64::from(found.0[lane]) - exact).abs() < bound);
                }
            }
        }
    }
}
