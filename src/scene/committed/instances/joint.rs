//! What joining adds to a part: its numbers in the scene, and how its edges and boundaries differ from its commit. Data alone;
//! [`super::joined`] makes it.

use std::sync::Arc;

use glam::DVec3;

use crate::scene::committed::instances::numbering;
use crate::scene::edges::{Contact, Edge, EdgeSet, FreeBoundary, NO_EDGE, nearest_m};

/// What joining adds to a part.
#[derive(Debug, Clone, Default)]
pub(super) struct Joint {
    /// The scene's numbers of the part's surfaces.
    pub(super) surfaces: Arc<[u32]>,
    /// Border pieces of the part that are panels together with those of others, ascending.
    pub(super) raised: Vec<u32>,
    /// Edges of these, ascending.
    pub(super) raised_edges: Vec<u32>,
    pub(super) edges: JoinedEdges,
    pub(super) rims: JoinedRims,
}

impl Joint {
    pub(super) fn memory_bytes(&self) -> usize {
        let raised =
            size_of_val(self.raised.as_slice()) + size_of_val(self.raised_edges.as_slice());
        size_of_val(&*self.surfaces) + raised + self.edges.memory_bytes() + self.rims.memory_bytes()
    }
}

/// What joining has changed about a part's edges, in the part's coordinates; faces have the scene's numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct JoinedEdges {
    /// Edge, slot of the other part, and contact; sorted by edge and slot.
    contacts: Vec<(u32, u16, Contact)>,
    /// Edges that are not as committed, by index.
    changed: Vec<(u32, Edge)>,
    /// Further pieces: number in the part, edge that it is a piece of, piece; by number.
    further: Vec<(u32, u32, Edge)>,
    /// Numbers that have been given to further pieces.
    given: u32,
    /// The further pieces, for queries.
    set: Arc<EdgeSet>,
}

impl JoinedEdges {
    /// An edge by its number in the part, if it is not as committed.
    #[inline]
    pub(super) fn get(&self, edge: u32) -> Option<&Edge> {
        let found = self.changed.binary_search_by_key(&edge, |entry| entry.0);
        if let Ok(index) = found {
            return Some(&self.changed[index].1);
        }
        let found = self.further.binary_search_by_key(&edge, |entry| entry.0);
        found.ok().map(|index| &self.further[index].2)
    }

    /// Whether other parts cover an edge whole.
    #[inline]
    pub(super) fn is_covered(&self, edge: u32) -> bool {
        self.get(edge).is_some_and(|edge| edge.length_m <= 0.0)
    }

    /// Whether an edge is a further piece.
    pub(super) fn is_further(&self, edge: u32) -> bool {
        let found = self.further.binary_search_by_key(&edge, |entry| entry.0);
        found.is_ok()
    }

    /// The further pieces.
    pub(super) fn further(&self) -> &EdgeSet {
        &self.set
    }

    /// The number in the part of a further piece by its index.
    pub(super) fn number_of(&self, index: u32) -> u32 {
        self.further
            .get(index as usize)
            .map_or(u32::MAX, |entry| entry.0)
    }

    /// Adds contacts of edges with another part.
    pub(super) fn add_contacts(&mut self, slot: usize, found: Vec<(u32, Contact)>) {
        if found.is_empty() {
            return;
        }
        let found = found.into_iter();
        self.contacts
            .extend(found.map(|(edge, contact)| (edge, slot as u16, contact)));
        self.contacts.sort_by_key(|entry| (entry.0, entry.1));
    }

    /// Drops all contacts with another part.
    pub(super) fn drop_contacts(&mut self, slot: usize) {
        self.contacts.retain(|entry| usize::from(entry.1) != slot);
    }

    pub(super) fn contacts_of(&self, edge: u32) -> impl Iterator<Item = Contact> + '_ {
        let first = self.contacts.partition_point(|entry| entry.0 < edge);
        let own = self.contacts[first..].iter();
        own.take_while(move |entry| entry.0 == edge)
            .map(|entry| entry.2)
    }

    /// Drops all contacts of some edges, which are sorted.
    pub(super) fn drop_contacts_of(&mut self, edges: &[u32]) {
        self.contacts
            .retain(|entry| edges.binary_search(&entry.0).is_err());
    }

    /// Replaces what is left of some edges, sorted by edge, of a part with `count` edges and `border` edges of border pieces.
    /// All that is left of the latter are further pieces.
    pub(super) fn replace(&mut self, [count, border]: [u32; 2], edges: Vec<(u32, Outcome)>) {
        let is_renewed = |edge: u32| edges.binary_search_by_key(&edge, |entry| entry.0).is_ok();
        let mut old = Vec::new();
        self.further.retain(|entry| {
            let is_kept = !is_renewed(entry.1);
            if !is_kept {
                old.push(*entry);
            }
            is_kept
        });
        self.changed.retain(|entry| !is_renewed(entry.0));
        for (edge, outcome) in edges {
            let Outcome::Changed(pieces) = outcome else {
                continue;
            };
            let first = pieces.first().copied().unwrap_or(NO_EDGE);
            match edge < count {
                true => self.changed.push((edge, first)),
                false if pieces.is_empty() => continue,
                false => self.further.push((edge, edge, first)),
            }
            for piece in pieces.into_iter().skip(1) {
                let is_same =
                    |entry: &&(u32, u32, Edge)| entry.0 != entry.1 && entry.2.key == piece.key;
                let known = old.iter().find(is_same);
                let number = known.map_or_else(
                    || {
                        self.given += 1;
                        count + border + self.given - 1
                    },
                    |entry| entry.0,
                );
                if (number as usize) < numbering::MOST_IN_A_PART {
                    self.further.push((number, edge, piece));
                }
            }
        }
        self.changed.sort_by_key(|entry| entry.0);
        self.further.sort_by_key(|entry| entry.0);
        self.further.dedup_by_key(|entry| entry.0);
        let list = self.further.iter().map(|entry| entry.2).collect();
        self.set = Arc::new(EdgeSet::of_edges(list));
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.contacts.as_slice())
            + size_of_val(self.changed.as_slice())
            + size_of_val(self.further.as_slice())
            + self.set.memory_bytes()
    }
}

/// What is left of an edge.
#[derive(Debug)]
pub(super) enum Outcome {
    Unchanged,
    Changed(Vec<Edge>),
}

/// What joining has changed about the boundaries of a part's surfaces, in the part's coordinates.
#[derive(Debug, Clone, Default)]
pub(super) struct JoinedRims {
    /// Surfaces whose boundaries are not as committed, with what is still free.
    pub(super) boundaries: Vec<(u32, Vec<FreeBoundary>)>,
    /// Finite panels that go on in another part: they count as large.
    pub(super) continued: Vec<u32>,
}

impl JoinedRims {
    /// As `EdgeSet::distance_m`; `None` for a surface whose boundaries are as committed.
    #[inline]
    pub(super) fn distance_m(
        &self,
        surface: u32,
        point: DVec3,
        in_front: bool,
        within_m: f64,
    ) -> Option<Option<f64>> {
        let found = self.boundaries.binary_search_by_key(&surface, |e| e.0);
        let (_, own) = &self.boundaries[found.ok()?];
        Some(nearest_m(own, point, in_front, within_m))
    }

    /// Finite panels that go on in another part, sorted.
    #[inline]
    pub(super) fn continued(&self) -> &[u32] {
        &self.continued
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let lists = self
            .boundaries
            .iter()
            .map(|(_, list)| size_of_val(list.as_slice()));
        lists.sum::<usize>()
            + size_of_val(self.boundaries.as_slice())
            + size_of_val(self.continued.as_slice())
    }
}
