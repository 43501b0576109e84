//! Scenes from slices, with sources and a listener at arbitrary positions: every result is finite, and no path is louder
//! than a source can be.

use std::sync::Arc;

use foresound::propagation::diffraction::MAX_DIRECT_EDGES;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, TriangleMesh,
};
use glam::Vec3;

use super::bytes::Bytes;

/// Few rays: degenerate positions matter here.
pub(crate) const SETTINGS: PropagationSettings = PropagationSettings {
    guide_rays: 32,
    source_rays: 16,
    depth: 4,
    seed: 1,
    cache_updates: 16,
    cache_capacity: 64,
    min_distance_m: 0.3,
    diffraction_order: 2,
};

/// A mesh with moving instances.
pub(crate) fn commit(data: &[u8]) {
    let mut bytes = Bytes(data);
    let scale = [1.0, 1e-3, 300.0, 1.0][bytes.below(4)];
    let vertices = 3 + bytes.below(30);
    let count = 3 * bytes.below(40) + bytes.below(8) / 7;
    let points: [Vec3; 3] = std::array::from_fn(|_| Vec3::from_array(bytes.numbers()) * scale);
    let positions: Vec<[f32; 3]> = (0..vertices)
        .map(|_| bytes.numbers::<3>().map(|n| n * scale))
        .collect();
    let indices: Vec<u32> = (0..count)
        .map(|_| match bytes.byte() {
            255 => bytes.word(),
            tame => u32::from(tame) % vertices as u32,
        })
        .collect();
    let mesh = match TriangleMesh::from_slices(&positions, &indices, &[], &[]) {
        Ok(mesh) => mesh,
        Err(error) => return assert_eq!(error.to_string().lines().count(), 1),
    };
    let table = MaterialTable::built_in();
    let scene = match Scene::commit(&mesh, &table, &SceneSettings::default()) {
        Ok(scene) => scene,
        Err(error) => return assert_eq!(error.to_string().lines().count(), 1),
    };
    let mut propagator = Propagator::new(Arc::new(scene), SETTINGS).expect("settings");
    let [ear, a, b] = points;
    // One of the sources may lie at a corner.
    let corner = Vec3::from_array(positions[0]);
    let sources: Vec<SourcePose> = (0..)
        .zip([a, b, corner])
        .map(|(slot, position)| SourcePose::at(SourceId::new(slot, 0), position))
        .collect();
    let mut set = PathSet::default();
    for position in [ear, corner] {
        propagator.update(
            &ListenerPose::facing(position, 0.0),
            &sources,
            0.0,
            &mut set,
        );
        check(&set);
    }
}

/// Invariants of every update.
pub(crate) fn check(set: &PathSet) {
    for path in &set.paths {
        // The direct path carries up to half a free field for each edge near it.
        let share = match path.is_direct() {
            true => 1.0 + 0.5 * MAX_DIRECT_EDGES as f32,
            false => 1.0001,
        };
        let loudest = share / SETTINGS.min_distance_m;
        assert!(
            path.amplitude.iter().all(|a| a.abs() <= loudest),
            "{path:?}"
        );
        assert!(path.points().iter().all(|p| p.is_finite()), "{path:?}");
        assert!(
            path.image.is_finite() && path.length_m.is_finite(),
            "{path:?}"
        );
    }
    assert!(set.paths.windows(2).all(|pair| pair[0].id <= pair[1].id));
    for late in &set.late {
        let mut energies = late.energy.as_flattened().as_flattened().iter();
        assert!(energies.all(|e| e.is_finite() && *e >= 0.0), "{late:?}");
        assert!(
            late.start_s.is_finite() && late.mean_free_time_s.is_finite(),
            "{late:?}"
        );
    }
}
