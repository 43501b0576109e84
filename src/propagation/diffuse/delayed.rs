//! Sums of series of energies that are delayed by a part of a time step. Own.

use crate::acoustics::BandArray;
use crate::propagation::diffuse::packed_energy::Energies;
use crate::simd::Lanes;

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
    for (sum, value) in sums.iter_mut().zip(series) {
        let value: L = value.lanes();
        let arriving = now.mul(value).add(later.mul(before));
        L::load(sum).add(arriving).store(sum);
        before = value;
    }
}
