//! What an update searches for, if not everything: after a jump the cheapest comes first.

use crate::scene::SourceId;

/// The scope of the next update. The default is a whole search.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct UpdateScope {
    /// Sources to search for; the others keep the paths of the update before. `None` for all.
    pub sources: Option<Vec<SourceId>>,
    /// Highest reflection order to search for, if it is lower than that of the settings.
    pub max_order: Option<usize>,
    /// Number of guide rays, if it is lower than that of the settings; with 0 only remembered sequences are tried.
    pub guide_rays: Option<u32>,
    /// Number of sequences up to which those of guide rays are filled with remembered and expanded ones, if not the usual.
    pub max_candidates: Option<usize>,
    /// Whether late energy is left out: that of the result is of the update before.
    pub skips_late: bool,
    /// Number of sources put elsewhere that share the casts of all ray rotations, for their late energy, in an update without
    /// nearby paths; with 0 one is cast for each.
    pub late_sources: usize,
    /// Whether only reflections at planes are searched for: the other paths are of the update before.
    pub only_planes: bool,
    /// Sources that were put elsewhere since the last update: what was found out at their old positions is dropped.
    pub jumped: Vec<SourceId>,
}

impl UpdateScope {
    /// Whether a source is searched for.
    pub fn has_source(&self, source: SourceId) -> bool {
        let sources = self.sources.as_ref();
        sources.is_none_or(|sources| sources.contains(&source))
    }

    /// Whether reflections of an order are searched for.
    pub(crate) fn has_order(&self, order: u8) -> bool {
        self.max_order.is_none_or(|most| usize::from(order) <= most)
    }

    /// Whether everything is searched for.
    pub fn is_whole(&self) -> bool {
        self.sources.is_none() && self.max_order.is_none() && !self.only_planes
    }

    /// Reflection order of the search under the settings' `depth`.
    pub(crate) fn depth(&self, depth: usize) -> usize {
        self.max_order.map_or(depth, |most| most.min(depth))
    }
}
