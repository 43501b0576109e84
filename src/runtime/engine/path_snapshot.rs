//! Paths as a picture shows them: corners, and how loud.

use glam::Vec3;

use crate::acoustics::BANDS;
use crate::propagation::{MAX_ORDER, Path, PathSet};
use crate::scene::SourceId;

/// Most corners of a path, both ends among them.
pub const MAX_CORNERS: usize = MAX_ORDER + 2;

/// A path as a line with corners.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SnapshotPath {
    /// The source it starts at. Where sources share slots, the one whose place the slot has.
    pub source: SourceId,
    /// Number of reflections.
    pub order: u8,
    /// Number of edges that it bends around.
    pub diffraction_order: u8,
    /// Corners in metres, from source to listener; the first `order + diffraction_order + 2` count.
    pub corners: [Vec3; MAX_CORNERS],
    /// Level in dB relative to the free field at 1 m, the mean of all bands' energies.
    pub level_db: f32,
}

impl SnapshotPath {
    /// The corners that count.
    pub fn corners(&self) -> &[Vec3] {
        &self.corners[..usize::from(self.order + self.diffraction_order) + 2]
    }
}

/// What travels from propagation to the controller and back.
#[derive(Debug, Default)]
pub(super) struct PathSnapshot {
    /// In no order.
    pub(super) paths: Vec<SnapshotPath>,
}

fn energy(path: &Path) -> f32 {
    path.amplitude.iter().map(|a| a * a).sum::<f32>() / BANDS as f32
}

/// Fills `shown` with the loudest paths of an update, `most` at most, in no order.
pub(super) fn fill_snapshot(update: &PathSet, most: usize, shown: &mut Vec<SnapshotPath>) {
    shown.clear();
    for path in &update.paths {
        let source = update.sources.iter().find(|s| s.id == path.source);
        let Some(source) = source else { continue };
        let between = path.points();
        let mut corners = [update.listener.position; MAX_CORNERS];
        corners[0] = source.position;
        corners[1..=between.len()].copy_from_slice(between);
        shown.push(SnapshotPath {
            source: path.source,
            order: path.order,
            diffraction_order: path.diffraction_order,
            corners,
            level_db: 10.0 * energy(path).max(f32::MIN_POSITIVE).log10(),
        });
    }
    if shown.len() > most {
        shown.select_nth_unstable_by(most, |a, b| b.level_db.total_cmp(&a.level_db));
        shown.truncate(most);
    }
}
