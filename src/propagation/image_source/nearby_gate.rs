//! Which nearby paths of a source are worth computing: those about as loud as the loudest ones of the last update. Own.
//!
//! A listener among many surfaces has hundreds of nearby paths a source, and an update keeps the loudest. An estimate from length
//! and surfaces alone leaves most of the others out before their images and amplitudes are computed. It decides about nearby paths
//! only: valid ones are never left out. Estimates are compared with estimates, so a scene at rest has the same paths in every update.

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::path::{Path, PathId};
use crate::scene::Scene;
use crate::simd::F32x8;

/// Most nearby paths of a source.
pub(crate) const MAX_NEARBY: usize = 128;

/// Cosine of the angle of incidence that the estimate takes for every reflection: most materials reflect the most there.
const COSINE: f32 = 1.0;

/// Least estimate that passes, relative to the loudest one beyond [`MAX_NEARBY`]: −0.7 dB, for paths that come nearer.
const MARGIN: f32 = 0.85;

/// Estimated energy below which nearby paths of a source are left out; 0 where an update found no more than are kept.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct NearbyGate {
    least: f32,
}

impl NearbyGate {
    /// Whether a path passes whose reflections leave `reflected` of the energy, by the square of its length.
    #[inline(always)]
    pub(crate) fn passes(&self, reflected: f32, square_m2: f32) -> bool {
        reflected >= self.least * square_m2
    }

    /// The gate of the next update, from the estimates of all paths that passed this one. Changes their order.
    pub(crate) fn after(estimates: &mut [f32]) -> Self {
        if estimates.len() <= MAX_NEARBY {
            return Self::default();
        }
        let louder = |a: &f32, b: &f32| b.total_cmp(a);
        let (_, beyond, _) = estimates.select_nth_unstable_by(MAX_NEARBY, louder);
        Self {
            least: if beyond.is_finite() {
                MARGIN * *beyond
            } else {
                0.0
            },
        }
    }
}

/// Share of the energy that each material reflects, about.
#[derive(Debug, Clone, Default)]
pub(crate) struct MirrorEnergies {
    by_material: Vec<BandArray>,
}

impl MirrorEnergies {
    /// Computes those of a scene's present materials.
    pub(crate) fn renew(&mut self, scene: &Scene) {
        self.by_material.clear();
        self.by_material
            .extend(scene.all_reflectances().map(|reflectance| {
                let factor = reflectance.factor(COSINE);
                factor.map(|factor| factor * factor)
            }));
    }

    /// Energy in all bands that a path of 1 m keeps at the surfaces of a sequence, about.
    #[inline]
    pub(crate) fn reflected(&self, scene: &Scene, sequence: &Sequence) -> f32 {
        let mut energy = F32x8([1.0; BANDS]);
        for surface in sequence.surfaces() {
            let material = scene.surface(*surface).material as usize;
            // An unknown material counts as the first one (`Scene::reflectance_of`).
            let known = self.by_material.get(material);
            if let Some(share) = known.or(self.by_material.first()) {
                energy *= F32x8(*share);
            }
        }
        sum(&energy.0)
    }
}

/// Sum over the bands. A loop: in builds of many code units the standard library's is a call a step.
#[inline(always)]
fn sum(bands: &BandArray) -> f32 {
    let mut sum = 0.0;
    for b in 0..BANDS {
        sum += bands[b];
    }
    sum
}

/// Energy, identity and index of a path.
pub(crate) type RankedPath = (f32, PathId, u32);

/// Keeps the loudest [`MAX_NEARBY`], in any order. Paths are large, so their ranks are sorted instead, in `ranks`,
/// which is scratch memory, and only those are moved that lie beyond the others.
pub(crate) fn keep_loudest(nearby: &mut Vec<Path>, ranks: &mut Vec<RankedPath>) {
    if nearby.len() <= MAX_NEARBY {
        return;
    }
    ranks.clear();
    ranks.extend((0..).zip(&*nearby).map(|(index, path)| {
        let mut energy = path.amplitude;
        for b in 0..BANDS {
            energy[b] *= energy[b];
        }
        (sum(&energy), path.id, index)
    }));
    let louder = |a: &RankedPath, b: &RankedPath| b.0.total_cmp(&a.0).then_with(|| a.1.cmp(&b.1));
    ranks.select_nth_unstable_by(MAX_NEARBY, louder);
    let (kept, left_out) = ranks.split_at(MAX_NEARBY);
    let index = |rank: &RankedPath| rank.2 as usize;
    let holes = left_out.iter().map(index).filter(|n| *n < MAX_NEARBY);
    let beyond = kept.iter().map(index).filter(|n| *n >= MAX_NEARBY);
    for (hole, from) in holes.zip(beyond) {
        nearby[hole] = nearby[from];
    }
    nearby.truncate(MAX_NEARBY);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::path::{MAX_DIFFRACTION_ORDER, MAX_ORDER};
    use crate::propagation::rays::directions::mix;
    use crate::scene::SourceId;
    use glam::Vec3;

    #[test]
    fn what_would_be_kept_passes_and_the_gate_holds_still() {
        let mut estimates: Vec<f32> = (1..=3 * MAX_NEARBY).map(|n| n as f32).collect();
        let gate = NearbyGate::after(&mut estimates);
        let least_kept = (2 * MAX_NEARBY + 1) as f32;
        assert!(gate.passes(least_kept, 1.0) && gate.passes(4.0 * least_kept, 4.0));
        assert!(!gate.passes(0.5 * least_kept, 1.0));
        // The same paths in the next update.
        estimates.retain(|estimate| gate.passes(*estimate, 1.0));
        assert!(estimates.len() < 3 * MAX_NEARBY);
        assert_eq!(NearbyGate::after(&mut estimates), gate);
    }

    #[test]
    fn a_gate_is_open_where_few_are_found_and_after_bad_numbers() {
        assert!(NearbyGate::after(&mut [1.0; MAX_NEARBY]).passes(1e-9, 1e9));
        assert!(NearbyGate::after(&mut [f32::NAN; 2 * MAX_NEARBY]).passes(1e-9, 1e9));
    }

    #[test]
    fn the_loudest_paths_are_kept() {
        let path = |number: u64| Path {
            id: PathId(number),
            source: SourceId::new(0, 0),
            order: 1,
            diffraction_order: 0,
            surfaces: [0; MAX_ORDER],
            edges: [0; MAX_DIFFRACTION_ORDER],
            points: [Vec3::ZERO; MAX_ORDER],
            image: Vec3::ZERO,
            length_m: 1.0,
            // Several are as loud, and of those the lower identities are kept.
            amplitude: [(mix(number) % 40) as f32; BANDS],
        };
        for count in [1, 128, 129, 140, 300, 1000] {
            let mut paths: Vec<Path> = (0..count).map(path).collect();
            let mut expected = paths.clone();
            let louder = |path: &Path| (-path.amplitude[0] as i32, path.id);
            expected.sort_by_key(louder);
            expected.truncate(MAX_NEARBY);
            keep_loudest(&mut paths, &mut Vec::new());
            paths.sort_by_key(louder);
            assert_eq!(paths, expected, "{count}");
        }
    }
}
