//! Where the sources are in one graphics frame, worked out once a frame and not once a path.

use glam::DVec3;

use crate::extrapolation::geometric::Now;
use crate::propagation::Path;
use crate::propagation::diffraction::Endpoints;
use crate::scene::SourceId;

/// A source as it is in the present graphics frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// The source and the listener in world coordinates.
    pub(crate) spot: Endpoints,
    /// Both in local coordinates.
    pub(crate) ends: [DVec3; 2],
    /// Whether both are somewhere.
    pub(crate) is_somewhere: bool,
    /// Whether the listener does not see it.
    pub(crate) is_shadowed: bool,
}

impl Place {
    /// Whether this source may be heard along a path.
    pub(crate) fn wants(&self, path: &Path) -> bool {
        let effects = self.spot.source.settings.effects;
        (path.order == 0 || effects.reflections)
            && (path.diffraction_order == 0 || effects.diffraction)
    }
}

/// All sources, in the order of their poses.
#[derive(Debug, Default)]
pub(crate) struct Places {
    each: Vec<Place>,
}

impl Places {
    /// Makes room for this many sources.
    pub(crate) fn reserve(&mut self, sources: usize) {
        self.each.reserve(sources);
    }

    /// Takes the poses of a graphics frame.
    pub(crate) fn look(&mut self, now: &Now<'_>) {
        let to = now.listener.position;
        self.each.clear();
        self.each
            .extend(now.sources.iter().enumerate().map(|(number, pose)| Place {
                spot: Endpoints::of(pose, to, now.min_distance_m),
                ends: [pose.position, to].map(|place| now.scene.to_local(place)),
                is_somewhere: pose.position.is_finite() && to.is_finite(),
                is_shadowed: now.shadowed.get(number).is_some_and(|shadowed| *shadowed),
            }));
    }

    /// A source, if it is still there. Poses mostly come in the order of their slots, which says where to look first.
    #[inline]
    pub(crate) fn of(&self, source: SourceId) -> Option<&Place> {
        let likely = self.each.get(source.slot());
        let is_own = |place: &&Place| place.spot.source.id == source;
        likely
            .filter(is_own)
            .or_else(|| self.each.iter().find(is_own))
    }
}
