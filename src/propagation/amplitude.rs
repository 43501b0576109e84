//! Amplitudes of paths in eight bands, relative to the free field at 1 m.

use glam::Vec3;

use crate::acoustics::bands::exp_neg;
use crate::acoustics::{BANDS, BandArray};
use crate::propagation::image_source::finite_panel;
use crate::propagation::image_source::image_path::ImagePath;
use crate::scene::{Scene, SourcePose};
use crate::simd::{LaneSet, kernel};

/// Spherical spreading and air absorption over `distance_m` metres. Below `min_distance_m` (above 0) the spreading is
/// constant: a real source is not a point.
pub fn free_field(scene: &Scene, distance_m: f64, min_distance_m: f64) -> BandArray {
    let spreading = (1.0 / distance_m.max(min_distance_m)) as f32;
    let mut amplitude = [0.0; BANDS];
    spread(
        LaneSet::best(),
        scene.air_np_per_m(),
        distance_m as f32,
        spreading,
        &mut amplitude,
    );
    amplitude
}

kernel! {
    /// Absorption of the air over a distance, times a factor. No fused products: all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn spread<L>(np_per_m: &BandArray, distance_m: f32, factor: f32, amplitude: &mut BandArray) {
        let mut nepers = *np_per_m;
        for value in &mut nepers {
            *value *= distance_m;
        }
        *amplitude = exp_neg(&nepers);
        for value in amplitude {
            *value *= factor;
        }
    }
}

/// Amplitude of a reflected path: free field over its length, times each surface's reflection factor at the angle of
/// incidence, times the factor of finite panels.
pub fn reflected(scene: &Scene, path: &ImagePath, min_distance_m: f64) -> BandArray {
    let mut amplitude = reflected_unbounded(scene, path, min_distance_m);
    if let Some(factor) = finite_panel::factor(scene, path) {
        for b in 0..BANDS {
            amplitude[b] *= factor[b];
        }
    }
    amplitude
}

/// [`reflected`] without the factor of finite panels.
pub fn reflected_unbounded(scene: &Scene, path: &ImagePath, min_distance_m: f64) -> BandArray {
    let mut amplitude = free_field(scene, path.length_m, min_distance_m);
    reflect(LaneSet::best(), scene, path, &mut amplitude);
    amplitude
}

kernel! {
    /// Multiplies by the reflection factors of a path's surfaces. No fused products: all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn reflect<L>(scene: &Scene, path: &ImagePath, amplitude: &mut BandArray) {
        for step in 0..path.order {
            let reflectance = scene.reflectance(path.surfaces[step]);
            let factor = reflectance.factor(path.cosines[step] as f32);
            for b in 0..BANDS {
                amplitude[b] *= factor[b];
            }
        }
    }
}

/// Multiplies by the source's directivity towards a world direction of any length.
pub fn apply_directivity(amplitude: &mut BandArray, source: &SourcePose, departure: Vec3) {
    if source.settings.directivity.is_omni() {
        return;
    }
    for (value, factor) in amplitude.iter_mut().zip(source.factor_towards(departure)) {
        *value *= factor;
    }
}
