//! What guide rays have met in the last updates: sixteen rotations see more than one.
//!
//! A path through a small window is met by one ray in some rotations only. Since a sequence that was met stays one as long
//! as the listener is near, what the last updates have met is tried again where there is room for it: what is found
//! depends less on which rotation the turn has come to, so that few updates find nearly what many do. Own.

use super::cache::SequenceCache;
use super::neighbours::CANDIDATES;
use super::sampling::ROTATIONS;
use super::sequence::Sequence;
use super::sequence_set::SequenceSet;
use crate::scene::Scene;

/// Updates for which a sequence is tried again that rays have met: as many as there are rotations at least.
const AGE_UPDATES: u64 = 4 * ROTATIONS;

/// Sequences that guide rays have met, with the update in which they last did.
#[derive(Debug)]
pub struct GuideMemory {
    cache: SequenceCache,
}

impl Default for GuideMemory {
    fn default() -> Self {
        Self {
            cache: SequenceCache::with_capacity(Self::MOST),
        }
    }
}

impl GuideMemory {
    /// Sequences that an update tries at most where it is asked for more than its own poses need
    /// ([`super::Propagator::set_reach`]); others try [`CANDIDATES`].
    pub const MOST: usize = 4096;

    /// Adds what is remembered to `guide`, which holds what rays have met now, and remembers that.
    pub fn turn(&mut self, scene: &Scene, update: u64, is_wide: bool, guide: &mut SequenceSet) {
        let moves = scene.has_instances();
        let most = match is_wide {
            true => Self::MOST,
            false => CANDIDATES,
        };
        let met = guide.entries().len();
        for sequence in self.cache.entries() {
            if guide.entries().len() >= most {
                break;
            }
            guide.insert(match moves {
                // What commutes depends on how instances stand.
                true => Sequence::canonical(scene, sequence.surfaces()),
                false => *sequence,
            });
        }
        for sequence in &guide.entries()[..met] {
            self.cache.renew(*sequence, update);
        }
        self.cache.turn(update, AGE_UPDATES);
    }
}
