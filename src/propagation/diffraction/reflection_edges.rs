//! The edges near a source's single reflections. Plain data.

use crate::propagation::path::{Path, ReflectionEdge};

/// Most paths of one source over one edge with reflections.
pub const MAX_REFLECTED_EDGE_PATHS: usize = 12;

/// The edges near a source's single reflections, loudest first, each with its path in the shadow of the reflection if the
/// direct path is occluded.
#[derive(Debug, Clone, Copy, Default)]
pub struct ReflectionEdges {
    list: [Option<(ReflectionEdge, Option<Path>)>; MAX_REFLECTED_EDGE_PATHS],
    count: usize,
}

impl ReflectionEdges {
    pub(super) fn push(&mut self, edge: ReflectionEdge, path: Option<Path>) {
        self.list[self.count] = Some((edge, path));
        self.count += 1;
    }

    /// The edges with their paths.
    pub fn iter(&self) -> impl Iterator<Item = &(ReflectionEdge, Option<Path>)> {
        self.list.iter().flatten()
    }

    /// The edges.
    pub fn edges(&self) -> impl Iterator<Item = ReflectionEdge> + '_ {
        self.iter().map(|(edge, _)| *edge)
    }
}
