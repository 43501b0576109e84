//! How loud a path is, in eight bands.

use glam::Vec3;

use crate::acoustics::bands::exp_neg;
use crate::acoustics::{BANDS, BandArray};
use crate::propagation::image_source::finite_panel;
use crate::propagation::image_source::image_path::ImagePath;
use crate::scene::{Scene, SourcePose};

/// Spherical spreading and air: the pressure ratio of the free field at a distance, relative to 1 m without air.
///
/// Nearer than `min_distance_m` the level stays what it is there, since a real source is not a point.
pub fn free_field(scene: &Scene, distance_m: f64, min_distance_m: f64) -> BandArray {
    let spreading = (1.0 / distance_m.max(min_distance_m)) as f32;
    let mut amplitude = *scene.air_np_per_m();
    for value in &mut amplitude {
        *value *= distance_m as f32;
    }
    amplitude = exp_neg(&amplitude);
    for value in &mut amplitude {
        *value *= spreading;
    }
    amplitude
}

/// Amplitude of a reflected path: free field over its length, times each surface's reflection factor at its angle, and
/// what small panels leave of it.
pub fn reflected(scene: &Scene, path: &ImagePath, min_distance_m: f64) -> BandArray {
    let mut amplitude = unbounded(scene, path, min_distance_m);
    if let Some(factor) = finite_panel::factor(scene, path) {
        for b in 0..BANDS {
            amplitude[b] *= factor[b];
        }
    }
    amplitude
}

/// The same as if no surface had an end.
pub fn unbounded(scene: &Scene, path: &ImagePath, min_distance_m: f64) -> BandArray {
    let mut amplitude = free_field(scene, path.length_m, min_distance_m);
    for step in 0..path.order {
        let reflectance = scene.reflectance(path.surfaces[step]);
        let factor = reflectance.factor(path.cosines[step] as f32);
        for b in 0..BANDS {
            amplitude[b] *= factor[b];
        }
    }
    amplitude
}

/// Takes in what the source's directivity does to a path that leaves it towards a world direction.
pub fn direct_by_source(amplitude: &mut BandArray, source: &SourcePose, departure: Vec3) {
    if source.settings.directivity.is_omni() {
        return;
    }
    for (value, factor) in amplitude.iter_mut().zip(source.factor_towards(departure)) {
        *value *= factor;
    }
}
