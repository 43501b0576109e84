//! Paths for display, as polylines.

use super::record::record;
use crate::runtime::engine;

// The array below has a literal length, which cbindgen reads.
const _: () = assert!(engine::MAX_CORNERS == 6);

record! {
    /// A path as a polyline from source to listener. An element of an array, whose element size foresound_engine_paths takes.
    pub struct ShownPath {
        /// Id of the source.
        pub source: u32,
        /// Corners in use, both ends included.
        pub corner_count: u32,
        /// Number of reflections.
        pub reflections: u32,
        /// Number of diffractions.
        pub diffraction_order: u32,
        /// Level in dB re the free field at 1 m.
        pub level_db: f32,
        /// Corners in metres.
        pub corners_m: [[f32; 3]; 6],
    }
}

impl From<&engine::SnapshotPath> for ShownPath {
    fn from(from: &engine::SnapshotPath) -> Self {
        Self {
            source: from.source.bits(),
            corner_count: from.corners().len() as u32,
            reflections: from.order.into(),
            diffraction_order: from.diffraction_order.into(),
            level_db: from.level_db,
            corners_m: from.corners.map(|corner| corner.to_array()),
        }
    }
}
