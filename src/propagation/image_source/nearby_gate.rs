//! Which nearby paths of a source are worth computing: those about as loud as the loudest ones of the last update. Own.
//!
//! A listener among many surfaces has hundreds of nearby paths a source, and an update keeps the loudest. An estimate from length
//! and surfaces alone leaves most of the others out before their images and amplitudes are computed. It decides about nearby paths
//! only: valid ones are never left out.

use crate::acoustics::BANDS;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::path::Path;
use crate::scene::Scene;

/// Most nearby paths of a source.
const MAX_NEARBY: usize = 128;

/// Cosine of the angle of incidence that the estimate takes for every reflection.
const COSINE: f32 = 0.5;

/// Estimated energy relative to that of the loudest path dropped below which candidates are left out: −1.5 dB, for paths that come
/// nearer.
const MARGIN: f32 = 0.7;

/// Estimated energy below which nearby paths of a source are left out. 0 until more were found than are kept.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct NearbyGate {
    pub(crate) least: f32,
}

impl NearbyGate {
    /// Whether a path is worth computing whose reflections leave `reflected` of the energy, by the square of its length.
    #[inline(always)]
    pub(crate) fn passes(&self, reflected: f32, square_m2: f32) -> bool {
        reflected >= self.least * square_m2
    }

    /// Keeps the loudest [`MAX_NEARBY`] of an update, and sets the gate for the next one.
    pub(crate) fn keep_loudest(&mut self, nearby: &mut Vec<Path>) {
        if nearby.len() <= MAX_NEARBY {
            // Halved, not opened: the next update may find more again.
            self.least *= 0.5;
            return;
        }
        nearby.select_nth_unstable_by(MAX_NEARBY, |a, b| {
            energy(b)
                .total_cmp(&energy(a))
                .then_with(|| a.id.cmp(&b.id))
        });
        self.least = MARGIN * energy(&nearby[MAX_NEARBY]);
        nearby.truncate(MAX_NEARBY);
    }
}

/// Energy in all bands that a path of 1 m keeps at the surfaces of a sequence, about.
pub(crate) fn reflected_energy(scene: &Scene, sequence: &Sequence) -> f32 {
    let mut energy = [1.0; BANDS];
    for surface in sequence.surfaces() {
        let factor = scene.reflectance(*surface).factor(COSINE);
        for b in 0..BANDS {
            energy[b] *= factor[b] * factor[b];
        }
    }
    energy.iter().sum()
}

fn energy(path: &Path) -> f32 {
    path.amplitude.iter().map(|a| a * a).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::path::{MAX_DIFFRACTION_ORDER, MAX_ORDER, PathId};
    use crate::scene::SourceId;
    use glam::Vec3;

    fn path(number: u64, amplitude: f32) -> Path {
        Path {
            id: PathId(number),
            source: SourceId::default(),
            order: 1,
            diffraction_order: 0,
            edges: [0; MAX_DIFFRACTION_ORDER],
            surfaces: [0; MAX_ORDER],
            points: [Vec3::ZERO; MAX_ORDER],
            image: Vec3::ZERO,
            length_m: 1.0,
            amplitude: [amplitude; BANDS],
        }
    }

    #[test]
    fn what_would_be_kept_passes_and_what_would_be_dropped_by_far_does_not() {
        let mut gate = NearbyGate::default();
        let count = 2 * MAX_NEARBY as u64;
        let mut nearby: Vec<Path> = (1..=count).map(|n| path(n, n as f32)).collect();
        gate.keep_loudest(&mut nearby);
        assert_eq!(nearby.len(), MAX_NEARBY);
        let quietest = nearby.iter().map(energy).fold(f32::INFINITY, f32::min);
        assert_eq!(quietest, energy(&path(0, (MAX_NEARBY + 1) as f32)));
        assert!(nearby.iter().all(|path| gate.passes(energy(path), 1.0)));
        assert!(gate.passes(4.0 * quietest, 4.0));
        assert!(!gate.passes(0.5 * quietest, 1.0));
    }

    #[test]
    fn a_gate_opens_where_few_are_found() {
        let mut gate = NearbyGate { least: 1.0 };
        for _ in 0..200 {
            gate.keep_loudest(&mut vec![path(1, 1.0)]);
        }
        assert!(gate.passes(1e-9, 1e9));
    }
}
