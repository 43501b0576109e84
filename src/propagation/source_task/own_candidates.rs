//! A source's own candidates: sequences of its rays, and those that were valid before.

use super::listener_walk::WalkKey;
use super::query::SourceQuery;
use super::{ReflectionContext, Scratch, SourceTask, UpdateContext};
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::rays::directions::ROTATIONS;

/// Number of a source's own sequences up to which an update with nearby paths adds those of other rotations.
const MAX_OWN: usize = 2048;

/// Such an update adds those of every fourth rotation, from the present one on: all have been tried after four updates.
const ROTATION_STRIDE: usize = 4;

/// Index of a candidate that is not of the source's rays.
const NOT_OF_RAYS: u32 = u32::MAX;

/// Which sequences of the source's rays are its own candidates. Per-thread scratch.
#[derive(Debug, Default)]
pub(super) struct OwnIndices {
    /// Number of candidates before them.
    first: usize,
    /// Of each own candidate the index among the sequences of all rotations, or [`NOT_OF_RAYS`].
    in_rays: Vec<u32>,
}

impl OwnIndices {
    /// The index of a candidate, by its number among all, among the sequences of all rotations.
    #[inline]
    pub(super) fn in_rays(&self, candidate: u32) -> Option<u32> {
        let own = (candidate as usize).checked_sub(self.first)?;
        let index = self.in_rays.get(own).copied();
        index.filter(|index| *index != NOT_OF_RAYS)
    }
}

impl SourceTask {
    /// Goes on with the listener's walk. Marks of a source's sequences hold for one listener.
    pub(super) fn walk_on(&mut self, query: &SourceQuery<'_>) {
        let update = query.context;
        let [source, listener] = query.ends;
        let key = (update.listeners == 1).then_some(WalkKey {
            source,
            scene_state: update.scene_state,
            margin_m: update.nearby_m.unwrap_or(0.0),
        });
        if self.walk.go_on(key, listener) {
            self.late.packed_mut().clear_marks();
        }
    }

    /// Collects the source's own candidates: those of its rays and those valid before, without those of the guide rays and without
    /// those that have no path here ([`Self::walk_on`]).
    pub(super) fn collect_own(&self, context: &ReflectionContext<'_>, scratch: &mut Scratch) {
        let (scene, depth) = (context.update.scene, context.update.depth);
        let Scratch { rays, own, .. } = scratch;
        let (set, packed) = (&mut rays.sequences, self.late.packed());
        set.clear();
        own.in_rays.clear();
        own.first = context.guide.entries().len();
        let add =
            |set: &mut SequenceSet, in_rays: &mut Vec<u32>, sequence: Sequence, index: u32| {
                let hash = sequence.hash();
                if !context.guide.contains_hashed(&sequence, hash)
                    && set.insert_hashed(sequence, hash)
                {
                    in_rays.push(index);
                }
            };
        let others = || self.other_rotations(&context.update);
        let first = self.rotation.unwrap_or(context.update.round);
        let rotation = |number: u64| (number % ROTATIONS) as usize;
        // Where there are too many, those left out would make room for others.
        let in_turn = self.rotation.into_iter();
        let tried = in_turn.chain(others().map(|other| first + other));
        let most: usize = tried.map(|number| packed.count(rotation(number))).sum();
        let most = most + self.cache.entries().len();
        let reached = match most <= MAX_OWN.min(set.capacity()) {
            true => self.walk.reached(),
            false => u16::MAX,
        };
        if let Some(number) = self.rotation {
            for (index, sequence) in packed.marked(rotation(number), depth, reached) {
                add(set, &mut own.in_rays, sequence, index);
            }
        }
        for sequence in self.cache.entries() {
            if sequence.len() <= depth {
                add(set, &mut own.in_rays, sequence.renewed(scene), NOT_OF_RAYS);
            }
        }
        for other in others() {
            for (index, sequence) in packed.marked(rotation(first + other), depth, reached) {
                if set.entries().len() >= MAX_OWN {
                    return;
                }
                add(set, &mut own.in_rays, sequence.renewed(scene), index);
            }
        }
    }

    /// The rotations whose sequences are tried besides those of the one in turn, from that one on. An update of low orders, of
    /// which each has few, tries all, and one with nearby paths some: it takes longer.
    fn other_rotations(&self, update: &UpdateContext<'_>) -> impl Iterator<Item = u64> + use<> {
        let stride = match (update.scope.max_order, update.nearby_m, self.rotation) {
            (Some(_), ..) => Some(1),
            (None, Some(_), Some(_)) => Some(ROTATION_STRIDE),
            _ => None,
        };
        let others = stride.map(|stride| (0..ROTATIONS).step_by(stride));
        let tried = usize::from(self.rotation.is_some());
        others.into_iter().flatten().skip(tried)
    }
}

#[cfg(test)]
impl SourceTask {
    /// Has the next update try all candidates.
    pub(in crate::propagation) fn forget_marks(&mut self) {
        self.walk = Default::default();
        self.late.packed_mut().clear_marks();
    }

    /// Number of sequences of the source's rays that the next metre brings no path along.
    pub(in crate::propagation) fn marked_for_a_metre(&self) -> usize {
        let (packed, mark) = (self.late.packed(), self.walk.mark(1.0));
        let rotations = 0..ROTATIONS as usize;
        let count = |rotation| {
            let tried = packed.marked(rotation, crate::propagation::MAX_ORDER, mark);
            packed.count(rotation) - tried.count()
        };
        rotations.map(count).sum()
    }
}
