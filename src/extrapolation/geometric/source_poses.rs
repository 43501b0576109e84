//! The sources in one graphics frame, transformed once per frame instead of once per path.

use glam::{DVec3, Vec3};

use crate::extrapolation::frame::{FramePath, PathKind, allows};
use crate::extrapolation::geometric::FrameInputs;
use crate::extrapolation::line_extrapolation::ExtrapolationReach;
use crate::propagation::diffraction::{DiffractionSequence, DirectField};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::{EdgeLimits, ReflectionEdge};
use crate::scene::{SourceId, SourcePose};

/// Whether other paths than the direct one are masked by it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SourceShadow {
    /// Whether the direct path is blocked.
    pub(crate) is_occluded: bool,
    /// [`DirectField::two_edge_share`].
    two_edge_share: f32,
    /// Of the last updates.
    pub(crate) limits: EdgeLimits,
}

impl SourceShadow {
    /// That of a source's direct field, and of the last updates.
    pub(crate) fn of(field: &DirectField, limits: EdgeLimits) -> Self {
        Self {
            is_occluded: !field.visible,
            two_edge_share: field.two_edge_share,
            limits,
        }
    }

    /// Amplitude factor of a diffracted path: 0 where the direct path masks it and an update does not search for it.
    pub(crate) fn share(&self, sequence: &DiffractionSequence) -> f32 {
        if sequence.has_two_edges() {
            return self.two_edge_share;
        }
        let is_found = self.is_occluded || sequence.continued_reflection().is_some();
        f32::from(u8::from(is_found))
    }
}

/// One source in the present graphics frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FrameSource {
    /// Source and listener in world coordinates.
    pub(crate) endpoints: Endpoints,
    /// Positions of source and listener in the scene's local coordinates.
    pub(crate) local: [DVec3; 2],
    /// Whether both positions are finite.
    pub(crate) is_finite: bool,
    /// What this frame's direct field tells of it.
    pub(crate) shadow: SourceShadow,
    /// Whether it was put elsewhere since the last graphics frame.
    pub(crate) has_jumped: bool,
    /// Graphics frames over which its paths may be extrapolated linearly.
    pub(crate) reach: u64,
    /// Range of its edges in [`FrameInputs::reflection_edges`].
    reflection_edges: (usize, usize),
}

impl FrameSource {
    /// The edges near its single reflections.
    pub(crate) fn reflection_edges<'a>(
        &self,
        inputs: &FrameInputs<'a>,
    ) -> impl Iterator<Item = ReflectionEdge> + 'a {
        let (first, end) = self.reflection_edges;
        let edges = inputs.reflection_edges[first..end].iter();
        edges.map(|(_, edge)| *edge)
    }

    /// Whether the source's effects allow a path.
    pub(crate) fn allows(&self, path: &FramePath) -> bool {
        let is_diffracted = path.kind == PathKind::Diffracted;
        allows(&self.endpoints.source, path.order, is_diffracted)
    }
}

/// All sources, in the order of their poses.
#[derive(Debug, Default)]
pub(crate) struct FrameSources {
    sources: Vec<FrameSource>,
    /// Those of the graphics frame before.
    last: Vec<FrameSource>,
}

impl FrameSources {
    /// Reserves capacity for this many sources.
    pub(crate) fn reserve(&mut self, sources: usize) {
        self.sources.reserve(sources);
        self.last.reserve(sources);
    }

    /// Sets the poses of a graphics frame, whose paths are extrapolated within `reach`; returns whether a source has jumped: its last
    /// position is far.
    pub(crate) fn update(
        &mut self,
        inputs: &FrameInputs<'_>,
        reach: ExtrapolationReach,
        is_far: impl Fn(Vec3, Vec3) -> bool,
    ) -> bool {
        let to = inputs.listener.position;
        let poses = inputs.sources.iter().enumerate();
        std::mem::swap(&mut self.sources, &mut self.last);
        self.sources.clear();
        let last = &self.last;
        let last_of = |index: usize, pose: &SourcePose| {
            let own = |last: &&FrameSource| last.endpoints.source.id == pose.id;
            let likely = last.get(index).filter(own);
            let last = likely.or_else(|| last.iter().find(own));
            last.map(|last| &last.endpoints)
        };
        self.sources.extend(poses.map(|(index, pose)| {
            let endpoints = Endpoints::of(pose, to, inputs.min_distance_m);
            let last = last_of(index, pose);
            FrameSource {
                endpoints,
                local: [pose.position, to].map(|position| inputs.scene.to_local(position)),
                is_finite: pose.position.is_finite() && to.is_finite(),
                shadow: inputs.shadows.get(index).copied().unwrap_or_default(),
                has_jumped: last.is_some_and(|last| is_far(last.from, pose.position)),
                reach: last.map_or(1, |last| reach.frames(last, &endpoints)),
                reflection_edges: range_of(inputs.reflection_edges, pose.id),
            }
        }));
        self.sources.iter().any(|source| source.has_jumped)
    }

    /// A source of this frame. Poses are mostly in the order of their slots: the slot is tested first.
    #[inline]
    pub(crate) fn get(&self, id: SourceId) -> Option<&FrameSource> {
        let is_own = |source: &&FrameSource| source.endpoints.source.id == id;
        let likely = self.sources.get(id.slot()).filter(is_own);
        likely.or_else(|| self.sources.iter().find(is_own))
    }
}

/// The range of a source's edges in a list by source.
fn range_of(edges: &[(SourceId, ReflectionEdge)], id: SourceId) -> (usize, usize) {
    let first = edges.iter().position(|(source, _)| *source == id);
    let first = first.unwrap_or(edges.len());
    let others = edges[first..].iter().position(|(source, _)| *source != id);
    (first, others.map_or(edges.len(), |count| first + count))
}
