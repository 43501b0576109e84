//! HRTF sets: one delay and a few filter weights per ear and direction, over shared filters.
//!
//! Construction: control side. [`Hrtf::look_up`]: audio side, wait-free. Input: a baked file (layout in
//! assets/hrtf/README.md); output: ear delays and weights for directions in head coordinates.
//!
//! Own form of the usual separation into delays and minimum-phase principal components (\[KISTLER92\]). Both vary
//! smoothly with direction: bilinear interpolation on the grid adds no comb filtering. All paths share one filter bank
//! per ear.

use std::sync::Arc;

use glam::Vec3;

use crate::error::{Error, Result};
use crate::generation::binaural::baked_set::{BakedSet, Directions, MAGIC};
use crate::generation::panning::direction_table::{DirectionTable, LANES, TableSize};
use crate::simd::F32x8;

const HEADER_BYTES: usize = 28;
/// Longest valid ear delay in seconds: five times the interaural delay of a human head.
const MAX_DELAY_S: f32 = 0.004;
/// Largest valid magnitude of a weight or tap: 60 dB.
const MAX_VALUE: f32 = 1000.0;
/// Corner of the noise whose energy a wide image keeps, in Hz, and frames until its filter is silent.
const EVEN_TO_HZ: f32 = 2000.0;
const TAIL: usize = 64;
const ADVICE: &str = "write the file again with `foresound hrtf`";

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
    rate_hz: u32,
    taps: usize,
    /// Ordered by group, then by tap; one component per lane.
    basis: Vec<F32x8>,
    /// Delays and weights of both ears.
    table: Arc<DirectionTable>,
}

impl Hrtf {
    /// Reads a set from the content of a baked file, or of a SOFA file, which is converted to a sample rate
    /// (`Hrtf::from_sofa`; some seconds).
    ///
    /// Errors: [`Error::Format`] with `name` for a file that is neither or invalid, or a SOFA file without the feature `sofa`;
    /// [`Error::Setting`] for a sample rate out of range. The sample rate of a baked set is checked where the set is used.
    pub fn read(bytes: &[u8], name: &str, rate_hz: u32) -> Result<Self> {
        if !bytes.starts_with(b"\x89HDF") {
            return Self::parse(bytes, name);
        }
        #[cfg(feature = "sofa")]
        {
            Self::from_sofa(bytes, name, rate_hz)
        }
        #[cfg(not(feature = "sofa"))]
        {
            let problem = format!("a SOFA file for {rate_hz} Hz, which this build does not read");
            let advice = "build with the feature sofa, or give a baked set of `foresound hrtf`";
            Err(Error::format(name, None, problem, advice))
        }
    }

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
                for group in of_ear {
                    for lane in &mut group.0 {
                        *lane = words.f32();
                    }
                }
            }
            delays.push(ears);
        }
        let size = TableSize {
            ears: 2,
            groups,
            coarse_groups: 1,
            azimuths,
            elevations,
        };
        let table = DirectionTable::new(size, delays, weights);
        Ok(Self {
            rate_hz,
            taps,
            table: Arc::new(table.with_filter_products(filter_products(&basis, taps, rate_hz))),
            basis,
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
        let size = TableSize {
            ears: 2,
            groups: 1,
            coarse_groups: 1,
            azimuths: 4,
            elevations: 3,
        };
        let directions = size.azimuths * size.elevations;
        let unit = F32x8([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let (delays, weights) = (vec![[0.0; 2]; directions], vec![unit; 2 * directions]);
        Ok(Self {
            rate_hz,
            taps: 1,
            basis: vec![unit],
            table: Arc::new(DirectionTable::new(size, delays, weights)),
        })
    }

    /// The content of a baked file, to be read again within a millisecond.
    pub fn to_bytes(&self) -> Vec<u8> {
        let groups = self.groups();
        let (directions, delays, weights) = self.table.grid();
        let mut basis = Vec::with_capacity(groups * LANES * self.taps);
        for group in 0..groups {
            for lane in 0..LANES {
                basis.extend(self.basis(group).iter().map(|tap| tap.0[lane]));
            }
        }
        let mut ears = Vec::with_capacity(delays.len() * 2 * (1 + groups * LANES));
        let each = delays.iter().zip(weights.chunks_exact(2 * groups));
        for (delays, weights) in each {
            for (delay, weights) in delays.iter().zip(weights.chunks_exact(groups)) {
                ears.push(delay / self.rate_hz as f32);
                ears.extend(weights.iter().flat_map(|group| group.0));
            }
        }
        let set = BakedSet {
            rate_hz: self.rate_hz,
            taps: self.taps,
            components: groups * LANES,
            directions: Directions {
                azimuths: directions[0],
                elevations: directions[1],
            },
            basis,
            ears,
        };
        set.to_bytes()
    }

    /// Checks that the set is for a sample rate.
    ///
    /// Errors: [`Error::Setting`] if it is not.
    pub(crate) fn check_rate(&self, rate_hz: u32) -> Result<()> {
        if self.rate_hz == rate_hz {
            return Ok(());
        }
        let problem = format!("{rate_hz} Hz, but the HRTF set is for {} Hz", self.rate_hz);
        Err(Error::setting(
            "rate_hz",
            problem,
            "load the set that is baked for this rate",
        ))
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
        self.table.groups()
    }

    /// The filters of a group below [`Self::groups`], ordered by tap; one filter per lane. Panics for other groups.
    pub fn basis(&self, group: usize) -> &[F32x8] {
        &self.basis[group * self.taps..][..self.taps]
    }

    /// Longest ear delay of the set in frames.
    pub fn max_delay(&self) -> f32 {
        self.table.max_delay()
    }

    /// Returns the delays of the left and right ear in frames for a direction in head coordinates (+x right, +y up,
    /// −z ahead) and writes their weights: [`Self::groups`] entries for the left ear, then as many for the right.
    ///
    /// Interpolates bilinearly in azimuth and elevation. The direction may have any length; the zero vector and NaN
    /// return the response of a grid point. Panics if `weights` is shorter. Real-time: no allocation, four grid points.
    pub fn look_up(&self, direction: Vec3, weights: &mut [F32x8]) -> [f32; 2] {
        self.table.look_up(direction, weights)
    }

    /// Delays and weights of both ears.
    pub(crate) fn table(&self) -> &Arc<DirectionTable> {
        &self.table
    }
}

/// Products of all shared filters with each other, by filter, for noise that is flat to [`EVEN_TO_HZ`] and falls by 6 dB an octave
/// above, as much of speech and music does.
fn filter_products(basis: &[F32x8], taps: usize, rate_hz: u32) -> Vec<F32x8> {
    let pole = (-std::f32::consts::TAU * EVEN_TO_HZ / rate_hz as f32).exp();
    let tail = std::iter::repeat_n(&F32x8::ZERO, TAIL);
    let mut heard = Vec::with_capacity(basis.len() / taps * (taps + TAIL));
    for filter in basis.chunks_exact(taps) {
        let mut low = [0.0; LANES];
        heard.extend(filter.iter().chain(tail.clone()).map(|tap| {
            for (low, tap) in low.iter_mut().zip(tap.0) {
                *low += (1.0 - pole) * (tap - *low);
            }
            F32x8(low)
        }));
    }
    let (groups, length) = (basis.len() / taps, taps + TAIL);
    let mut products = Vec::with_capacity(LANES * groups * groups);
    for filter in 0..LANES * groups {
        let own = &heard[filter / LANES * length..][..length];
        for other in heard.chunks_exact(length) {
            let mut sum = [0.0; LANES];
            for (own, other) in own.iter().zip(other) {
                for (sum, other) in sum.iter_mut().zip(other.0) {
                    *sum += own.0[filter % LANES] * other;
                }
            }
            products.push(F32x8(sum));
        }
    }
    products
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
    fn a_set_survives_its_file() {
        let set = set();
        let again = Hrtf::read(&set.to_bytes(), "again", 44_100).unwrap();
        assert_eq!((again.taps(), again.groups()), (set.taps(), set.groups()));
        let mut found = [
            vec![F32x8::ZERO; 2 * set.groups()],
            vec![F32x8::ZERO; 2 * set.groups()],
        ];
        for direction in [Vec3::X, Vec3::new(0.3, 0.2, -0.9), Vec3::NEG_Y] {
            let [first, second] = &mut found;
            let delays = [
                set.look_up(direction, first),
                again.look_up(direction, second),
            ];
            assert_eq!(first, second);
            for (a, b) in delays[0].iter().zip(delays[1]) {
                // Seconds and frames, rounded to single precision.
                assert!((a - b).abs() < 1e-5, "{a} {b}");
            }
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
}
