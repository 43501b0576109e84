//! HRTF sets from measured responses: SOFA files become delays and weights of shared filters.
//!
//! Control side, on any thread but the sound's: takes some seconds and some ten megabytes. Input: a SOFA file of the
//! convention SimpleFreeFieldHRIR \[AES69\]; output: an [`Hrtf`].
//!
//! 1. `sofa_file` reads directions and responses and checks them.
//! 2. `sphere_grid` gives weights that interpolate between measured directions to the grid of the set.
//! 3. `spectrum` computes levels at the frequencies of the wanted sample rate, and minimum-phase responses of levels.
//! 4. `shared_filters` finds the filters whose sums come closest to all responses.
//! 5. `interaural` measures interaural delays. Each direction gets the delay with which the set, filters included, has the
//!    measured one.
//!
//! Separation into delay and minimum phase as in \[KISTLER92\]; filters by principal components of responses, not of
//! logarithmic levels, because components add in the signal path.

pub mod accuracy;
mod interaural;
mod shared_filters;
mod sofa_file;
mod spectrum;
mod sphere_grid;

use glam::DVec3;

use crate::error::{Error, Result};
use crate::generation::Hrtf;
use crate::generation::binaural::baked_set::{BakedSet, Directions};

use interaural::BandPhase;
use shared_filters::SharedFilters;
use sofa_file::Measurement;
use spectrum::Spectra;
use sphere_grid::SphereGrid;

/// Grid of baked sets: 5 degrees.
const DIRECTIONS: Directions = Directions {
    azimuths: 72,
    elevations: 37,
};
/// Shared filters.
const COMPONENTS: usize = 16;
/// Length of the shared filters at 48 kHz and below: 2.7 ms.
const TAPS: usize = 128;
/// Standard deviation of the kernel that smooths interaural delays over the sphere, in radians: 3 degrees, within the
/// spacing of measurements.
const DELAY_SMOOTHING: f64 = 0.052;

impl Hrtf {
    /// Converts a SOFA file's content to a set for a sample rate, which need not be the file's. Needs the feature `sofa`.
    ///
    /// Takes some seconds: call it on a thread of its own, then pass the set to [`Controller::set_hrtf`]. The set's licence
    /// is the user's concern.
    ///
    /// Range: the convention SimpleFreeFieldHRIR, 8 to 65,536 directions around the head, up to 16 million samples; sample
    /// rates from 16,000 to 96,000 Hz.
    ///
    /// Errors: [`Error::Format`] with `name` for a damaged file, another convention, or directions that leave a gap;
    /// [`Error::Setting`] for a sample rate.
    ///
    /// [`Controller::set_hrtf`]: crate::Controller::set_hrtf
    pub fn from_sofa(bytes: &[u8], name: &str, rate_hz: u32) -> Result<Self> {
        if !(16_000..=96_000).contains(&rate_hz) {
            let problem = format!("{rate_hz} Hz is outside 16000 to 96000");
            let advice = "choose the engine's sample rate in that range";
            return Err(Error::setting("rate_hz", problem, advice));
        }
        let measured = Measurement::read(bytes, name)?.thinned();
        bake(&measured, name, rate_hz)
    }
}

/// Reads and checks a SOFA file without converting it; returns the number of its directions.
///
/// Errors: those of [`Hrtf::from_sofa`] that the file's content has by itself.
pub fn check_sofa(bytes: &[u8], name: &str) -> Result<usize> {
    Ok(Measurement::read(bytes, name)?.directions.len())
}

fn bake(measured: &Measurement, name: &str, rate_hz: u32) -> Result<Hrtf> {
    let grid = SphereGrid::new(&measured.directions, DIRECTIONS, name)?;
    let spectra = Spectra::new(measured, rate_hz, name)?;
    // The level of each grid point and ear.
    let levels: [Vec<Vec<f64>>; 2] = std::array::from_fn(|ear| {
        let of_ear = spectra.levels(ear);
        grid.interpolate_rows(of_ear)
    });
    let levels = spectrum::equalise(levels, &grid.areas, &spectra);
    let taps = (TAPS * rate_hz.max(48_000) as usize).div_ceil(48_000);
    let responses = levels.map(|ear| spectra.minimum_phase(&ear, taps));
    let filters = SharedFilters::new(&responses, &grid.areas, COMPONENTS, rate_hz);

    // Interaural delays: what was measured, less what the filters have.
    let head = interaural::head_time_s(&measured.directions, spectra.interaural_delays_s());
    let beyond_sphere: Vec<f64> = measured
        .directions
        .iter()
        .zip(spectra.interaural_delays_s())
        .map(|(direction, delay_s)| delay_s - head * interaural::sphere_difference(*direction))
        .collect();
    let beyond_sphere = grid.smooth(&grid.interpolate(&beyond_sphere), DELAY_SMOOTHING);
    let band = BandPhase::new(f64::from(rate_hz), filters.basis());
    let mut delays_s: Vec<[f64; 2]> = Vec::with_capacity(grid.points.len());
    for (point, &direction) in grid.points.iter().enumerate() {
        let wanted_s = head * interaural::sphere_difference(direction) + beyond_sphere[point];
        let of_filters_s = band.delay_s(filters.weights(point, 0), filters.weights(point, 1));
        delays_s.push(ear_delays_s(direction, head, wanted_s - of_filters_s));
    }
    let least_s = delays_s.iter().flatten().copied().fold(f64::MAX, f64::min);
    for delay_s in delays_s.iter_mut().flatten() {
        *delay_s -= least_s;
    }
    let mut ears = Vec::with_capacity(2 * delays_s.len() * (1 + COMPONENTS));
    for (point, delays_s) in delays_s.iter().enumerate() {
        for (ear, delay_s) in delays_s.iter().enumerate() {
            ears.push(*delay_s as f32);
            ears.extend(
                filters
                    .weights(point, ear)
                    .iter()
                    .map(|weight| *weight as f32),
            );
        }
    }
    let set = BakedSet {
        rate_hz,
        taps,
        components: COMPONENTS,
        directions: DIRECTIONS,
        basis: filters
            .basis()
            .iter()
            .flatten()
            .map(|tap| *tap as f32)
            .collect(),
        ears,
    };
    Hrtf::parse(&set.to_bytes(), name)
}

/// Delays of the left and right ear with a difference, right less left. Their mean is a sphere's: what measurements have
/// beyond it is mostly the distance of their loudspeakers.
fn ear_delays_s(direction: DVec3, head_s: f64, difference_s: f64) -> [f64; 2] {
    let mean_s = head_s * interaural::sphere_mean(direction);
    [mean_s - 0.5 * difference_s, mean_s + 0.5 * difference_s]
}
