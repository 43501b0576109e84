//! Paths for pictures, as plain numbers.

use crate::runtime::engine;

/// Corners of a path, both ends among them.
pub const CORNERS: usize = 6;
/// How many floats a path is as a list: source, corners, reflections, bends, level, then three coordinates a corner.
pub const PATH_FLOATS: usize = 5 + 3 * CORNERS;

// The header says six.
const _: () = assert!(CORNERS == engine::MAX_CORNERS);

/// A path of sound as a line with corners, from source to listener.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ShownPath {
    /// The source's number.
    pub source: u32,
    /// How many of the corners count, both ends among them.
    pub corner_count: u32,
    /// Reflections.
    pub reflections: u32,
    /// Edges that it bends around.
    pub diffraction_order: u32,
    /// Level in dB relative to the free field at 1 m.
    pub level_db: f32,
    /// Corners in metres.
    pub corners_m: [[f32; 3]; 6],
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

impl ShownPath {
    /// All fields in their order, as floats: how Java gets them. Of the source it is the slot, the number's lower half,
    /// which a float can hold.
    pub fn floats(&self) -> [f32; PATH_FLOATS] {
        let mut floats = [0.0; PATH_FLOATS];
        floats[0] = (self.source & 0xffff) as f32;
        floats[1] = self.corner_count as f32;
        floats[2] = self.reflections as f32;
        floats[3] = self.diffraction_order as f32;
        floats[4] = self.level_db;
        floats[5..].copy_from_slice(self.corners_m.as_flattened());
        floats
    }
}
