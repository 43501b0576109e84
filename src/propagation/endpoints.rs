//! The two ends of every path: source and listener.

use glam::Vec3;

use crate::scene::SourcePose;

/// Source and listener of a propagation query, in world coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Endpoints {
    /// The source's pose and settings.
    pub source: SourcePose,
    /// Position of the source.
    pub from: Vec3,
    /// Position of the listener.
    pub to: Vec3,
    /// Distance in metres below which the level is constant.
    pub min_distance_m: f64,
}

impl Endpoints {
    /// A source and a listener position. `default_m` is the minimum distance of sources without a setting of their own.
    pub fn of(source: &SourcePose, to: Vec3, default_m: f64) -> Self {
        Self {
            source: *source,
            from: source.position,
            to,
            min_distance_m: source.settings.min_distance_m(default_m),
        }
    }
}
