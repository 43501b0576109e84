//! Sums of series of energies that are delayed by a part of a time step. Own.

use crate::acoustics::BandArray;
use crate::propagation::diffuse::packed_energy::Energies;
use crate::simd::Lanes;

/// Steps that are added in one round of the loop.
const UNROLLED: usize = 4;

/// Adds a series from index `skipped` on, times an energy, `rest` of a time step later.
#[inline(always)]
pub(crate) fn add_delayed<L: Lanes>(
    series: &[impl Energies],
    skipped: usize,
    energy: &BandArray,
    rest: f32,
    sums: &mut [BandArray],
) {
    let energy = L::load(energy);
    let (now, later) = (energy.mul(L::splat(1.0 - rest)), energy.mul(L::splat(rest)));
    let before = skipped.checked_sub(1).and_then(|last| series.get(last));
    let mut before = before.map_or(L::splat(0.0), Energies::lanes);
    let series = series.get(skipped..).unwrap_or_default();
    // Several steps a round, or counting them takes a quarter of the instructions.
    let count = sums.len().min(series.len());
    let (of_rounds, last) = sums[..count].as_chunks_mut::<UNROLLED>();
    let (series, of_last) = series[..count].as_chunks::<UNROLLED>();
    for (sums, series) in of_rounds.iter_mut().zip(series) {
        for step in 0..UNROLLED {
            before = add_arriving([now, later], before, &series[step], &mut sums[step]);
        }
    }
    for (sum, value) in last.iter_mut().zip(of_last) {
        before = add_arriving([now, later], before, value, sum);
    }
}

/// Adds what arrives of an energy and of the one before it, and returns the energy.
#[inline(always)]
fn add_arriving<L: Lanes>(
    [now, later]: [L; 2],
    before: L,
    value: &impl Energies,
    sum: &mut BandArray,
) -> L {
    let value: L = value.lanes();
    let arriving = now.mul(value).add(later.mul(before));
    L::load(sum).add(arriving).store(sum);
    value
}
