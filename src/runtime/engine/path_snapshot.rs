//! Paths for debug drawing: corners and level.

use glam::Vec3;

use crate::acoustics::BANDS;
use crate::propagation::{MAX_ORDER, Path, PathSet};
use crate::scene::SourceId;

/// Greatest number of corners of a path, including both ends.
pub const MAX_CORNERS: usize = MAX_ORDER + 2;

/// A path as a polyline.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct SnapshotPath {
    /// The source. With shared slots, the handle of the slot.
    pub source: SourceId,
    /// Number of reflections.
    pub order: u8,
    /// Number of diffracting edges.
    pub diffraction_order: u8,
    /// Corners in metres from source to listener; the first `order + diffraction_order + 2` are valid.
    pub corners: [Vec3; MAX_CORNERS],
    /// Level in dB relative to the free field at 1 m: mean energy of all bands.
    pub level_db: f32,
}

impl SnapshotPath {
    /// The corners in use, from the source to the listener, in world coordinates and metres.
    pub fn corners(&self) -> &[Vec3] {
        &self.corners[..usize::from(self.order + self.diffraction_order) + 2]
    }
}

/// Message from propagation to the controller.
#[derive(Debug, Default)]
pub(super) struct PathSnapshot {
    /// Unsorted.
    pub(super) paths: Vec<SnapshotPath>,
}

fn energy(path: &Path) -> f32 {
    path.amplitude.iter().map(|a| a * a).sum::<f32>() / BANDS as f32
}

/// Fills `snapshot` with the `max` loudest paths of an update, unsorted.
pub(super) fn fill_snapshot(update: &PathSet, max: usize, snapshot: &mut Vec<SnapshotPath>) {
    snapshot.clear();
    for path in &update.paths {
        let source = update.sources.iter().find(|s| s.id == path.source);
        let Some(source) = source else { continue };
        let between = path.points();
        let mut corners = [update.listener.position; MAX_CORNERS];
        corners[0] = source.position;
        corners[1..=between.len()].copy_from_slice(between);
        snapshot.push(SnapshotPath {
            source: path.source,
            order: path.order,
            diffraction_order: path.diffraction_order,
            corners,
            level_db: 10.0 * energy(path).max(f32::MIN_POSITIVE).log10(),
        });
    }
    if snapshot.len() > max {
        snapshot.select_nth_unstable_by(max, |a, b| b.level_db.total_cmp(&a.level_db));
        snapshot.truncate(max);
    }
}
