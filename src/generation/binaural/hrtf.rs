//! HRTF sets: one delay and a few filter weights per ear and direction, over shared filters.
//!
//! Construction: control side. [`Hrtf::look_up`]: audio side, wait-free. Input: a baked file (layout in
//! assets/hrtf/README.md); output: ear delays and weights for directions in head coordinates.
//!
//! Own form of the usual separation into delays and minimum-phase principal components (\[KISTLER92\]). Both vary
//! smoothly with direction: bilinear interpolation on the grid adds no comb filtering. All paths share one filter bank
//! per ear.

use glam::Vec3;

use crate::error::{Error, Result};
use crate::simd::{F32x8, LaneSet, kernel, prefetch};

const MAGIC: &[u8; 8] = b"FSHRTF1\0";
const HEADER_BYTES: usize = 28;
/// Components per group.
const LANES: usize = 8;
/// Longest valid ear delay in seconds: five times the interaural delay of a human head.
const MAX_DELAY_S: f32 = 0.004;
/// Largest valid magnitude of a weight or tap: 60 dB.
const MAX_VALUE: f32 = 1000.0;
const ADVICE: &str = "bake the file again with assets/hrtf/bake.py";

/// An HRTF set.
///
/// ```
/// use foresound::Hrtf;
///
/// # fn main() -> foresound::Result<()> {
/// let hrtf = Hrtf::omnidirectional(48_000)?;
/// assert_eq!((hrtf.taps(), hrtf.max_delay()), (1, 0.0));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Hrtf {
    set: LaneSet,
    rate_hz: u32,
    taps: usize,
    groups: usize,
    azimuths: usize,
    elevations: usize,
    /// Ordered by group, then by tap; one component per lane.
    basis: Vec<F32x8>,
    /// Left and right delay in frames, ordered by elevation, then by azimuth.
    delays: Vec<[f32; 2]>,
    /// In the same order; per direction the groups of the left ear, then those of the right.
    weights: Vec<F32x8>,
    max_delay: f32,
}

impl Hrtf {
    /// Reads a baked set.
    ///
    /// Errors: [`Error::Format`] with `name` if the size, the header or a value is invalid.
    pub fn parse(bytes: &[u8], name: &str) -> Result<Self> {
        let format_error = |problem: String| Error::format(name, None, problem, ADVICE);
        if bytes.len() < HEADER_BYTES || &bytes[..8] != MAGIC {
            return Err(format_error("this is not a baked HRTF set".into()));
        }
        let mut header = WordReader(&bytes[8..HEADER_BYTES]);
        let rate_hz = header.u32();
        let mut size = |what: &str, low: usize, high: usize| {
            let value = header.u32() as usize;
            if (low..=high).contains(&value) {
                Ok(value)
            } else {
                Err(format_error(format!(
                    "{value} {what}, outside {low} to {high}"
                )))
            }
        };
        let taps = size("taps", 1, 1024)?;
        let components = size("components", LANES, 64)?;
        let azimuths = size("azimuths", 4, 720)?;
        let elevations = size("elevations", 3, 361)?;
        if !(8_000..=192_000).contains(&rate_hz) {
            return Err(format_error(format!(
                "sample rate of {rate_hz} Hz, outside 8000 to 192000"
            )));
        }
        if !components.is_multiple_of(LANES) {
            return Err(format_error(format!(
                "{components} components, not a multiple of {LANES}"
            )));
        }
        let directions = azimuths * elevations;
        let values = components * taps + directions * 2 * (1 + components);
        let expected = HEADER_BYTES + 4 * values;
        if bytes.len() != expected {
            return Err(format_error(format!(
                "length of {} bytes, but the header requires {expected}",
                bytes.len()
            )));
        }
        let body = &bytes[HEADER_BYTES..];
        if let Some(index) = WordReader(body).position(|v| v.is_nan() || v.abs() > MAX_VALUE) {
            return Err(format_error(format!(
                "value {index} after the header is NaN or outside ±{MAX_VALUE}"
            )));
        }

        let groups = components / LANES;
        let mut words = WordReader(body);
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
                    return Err(format_error(format!(
                        "ear delay of {delay_s} s, outside 0 to {MAX_DELAY_S} s"
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

    /// An omnidirectional set: both ears receive every direction without delay or filter. For impulse responses.
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

    /// Number of groups of eight shared filters.
    pub fn groups(&self) -> usize {
        self.groups
    }

    /// The filters of a group below [`Self::groups`], ordered by tap; one filter per lane. Panics for other groups.
    pub fn basis(&self, group: usize) -> &[F32x8] {
        &self.basis[group * self.taps..][..self.taps]
    }

    /// Longest ear delay of the set in frames.
    pub fn max_delay(&self) -> f32 {
        self.max_delay
    }

    /// Returns the delays of the left and right ear in frames for a direction in head coordinates (+x right, +y up,
    /// −z ahead) and writes their weights: [`Self::groups`] entries for the left ear, then as many for the right.
    ///
    /// Interpolates bilinearly in azimuth and elevation. The direction may have any length; the zero vector and NaN
    /// return the response of a grid point. Panics if `weights` is shorter. Real-time: no allocation, four grid points.
    pub fn look_up(&self, direction: Vec3, weights: &mut [F32x8]) -> [f32; 2] {
        self.blend(&self.corners(direction), self.groups, weights)
    }

    /// First part of [`Self::look_up`]; prefetches the input of [`Self::blend`].
    pub(crate) fn find(&self, direction: Vec3) -> Corners {
        let corners = self.corners(direction);
        let width = 2 * self.groups;
        // Neighbours of one elevation are adjacent in memory, except for the last azimuth.
        for (direction, _) in corners {
            let of_corner = &self.weights[direction * width..][..width];
            for group in of_corner.iter().step_by(2) {
                prefetch(group);
            }
            prefetch(&self.delays[direction]);
        }
        corners
    }

    /// Second part of [`Self::look_up`]; groups from `groups` on are zero.
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
            blend_weights(self.set, &grid, &shares, used);
            unused.fill(F32x8::ZERO);
        }
        delays
    }

    /// The four grid points around a direction and their interpolation weights.
    fn corners(&self, direction: Vec3) -> Corners {
        let horizontal = (direction.x * direction.x + direction.z * direction.z).sqrt();
        let turns = (-direction.x).atan2(-direction.z) / std::f32::consts::TAU;
        let rise = direction.y.atan2(horizontal) / std::f32::consts::PI + 0.5;
        // `max` converts NaN to zero.
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

/// Reads little-endian words of four bytes; zero beyond the end, which the size check excludes.
struct WordReader<'a>(&'a [u8]);

impl WordReader<'_> {
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

    fn position(&self, is_invalid: impl Fn(f32) -> bool) -> Option<usize> {
        self.0
            .chunks_exact(4)
            .position(|word| is_invalid(f32::from_le_bytes([word[0], word[1], word[2], word[3]])))
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
    fn damaged_files_are_rejected_with_the_file_name() {
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
    fn look_up_is_continuous_in_azimuth_and_over_the_poles() {
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
                // 0.66 ms over 90 degrees is 0.03 frames per tenth of a degree; the weights change as little.
                assert!((delays[0] - before[0]).abs() < 0.06, "{step}");
                for (a, b) in weights.iter().zip(held) {
                    assert!((a.0[0] - b.0[0]).abs() < 0.01, "{step}");
                }
            }
            last = Some((delays, weights.clone()));
        }
    }

    #[test]
    fn zero_and_non_finite_directions_return_finite_delays() {
        let set = set();
        let mut weights = vec![F32x8::ZERO; 2 * set.groups()];
        for direction in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::Y, Vec3::NEG_Y] {
            let delays = set.look_up(direction, &mut weights);
            assert!(delays.iter().all(|d| d.is_finite()), "{direction}");
        }
    }

    #[test]
    fn unrequested_groups_are_zero_and_the_others_unchanged() {
        let set = set();
        let groups = set.groups();
        let direction = Vec3::new(0.3, 0.2, -0.9);
        let (mut all, mut few) = (
            vec![F32x8::ZERO; 2 * groups],
            vec![F32x8::splat(9.0); 2 * groups],
        );
        let delays = set.look_up(direction, &mut all);
        for requested in 0..=groups {
            assert_eq!(set.blend(&set.find(direction), requested, &mut few), delays);
            for (n, (few, all)) in few.iter().zip(&all).enumerate() {
                let is_requested = n % groups < requested;
                assert_eq!(*few, if is_requested { *all } else { F32x8::ZERO });
            }
        }
    }

    #[test]
    fn weights_are_the_weighted_sum_of_the_grid_points() {
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
            blend_weights(set, &grid, &shares, &mut weights);
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
