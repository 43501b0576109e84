//! Candidates from update to update.
//!
//! An update names the paths that were valid at its poses. What it says of a candidate's visibility counts if it speaks
//! of a later graphics frame than the candidate's own last test; what it says for a pose where the listener never was
//! is a hint. Candidates that it does not name are kept for some updates, closed or open.

use super::candidate::{Candidate, Course, Grounds};
use super::groundwork::{Groundwork, continued};
use super::history::Word;
use super::{BestSettings, Now};
use crate::propagation::PathSet;

/// Candidates kept at most, over all sources: a full memory drops what comes last by identity.
const CAPACITY: usize = 32_768;

/// All candidates, sorted by identity.
#[derive(Debug)]
pub struct Memory {
    /// The candidates.
    pub candidates: Vec<Candidate>,
    next: Vec<Candidate>,
    capacity: usize,
    /// Updates taken so far.
    pub updates: u64,
}

impl Default for Memory {
    fn default() -> Self {
        Self {
            candidates: Vec::new(),
            next: Vec::new(),
            capacity: CAPACITY,
            updates: 0,
        }
    }
}

impl Memory {
    /// Makes room for this many candidates, and keeps to it.
    pub(super) fn bound(&mut self, candidates: usize) {
        self.capacity = candidates.min(CAPACITY);
        self.candidates.reserve_exact(self.capacity);
        self.next.reserve_exact(self.capacity);
    }

    /// Takes an update over, with what has been worked out of it; `word` is what it is worth.
    pub(super) fn take(
        &mut self,
        update: &PathSet,
        groundwork: &Groundwork,
        now: &Now<'_>,
        word: Word,
        settings: &BestSettings,
    ) {
        self.updates += 1;
        self.next.clear();
        let mut old = self.candidates.iter().peekable();
        for (place, path) in continued(update).enumerate() {
            while let Some(absent) = old.next_if(|candidate| candidate.path.id < path.id) {
                let kept = absent_from_update(absent, now, word, self.updates, settings);
                self.next
                    .extend(kept.filter(|_| self.next.len() < self.capacity));
            }
            let known = old.next_if(|candidate| candidate.path.id == path.id);
            let grounds = groundwork.of(place, path);
            let grounds =
                grounds.unwrap_or_else(|| Grounds::of(path, update, now.then, now.nearest_m));
            let mut candidate = Candidate::new(path, update, &grounds);
            candidate.valid_in = self.updates;
            candidate.tested = word.binding.then_some(word.frame);
            if let Some(known) = known
                && (!word.binding || known.tested > candidate.tested)
                && known.tested.is_some()
            {
                (candidate.open, candidate.tested) = (known.open, known.tested);
            }
            if self.next.len() < self.capacity {
                self.next.push(candidate);
            }
        }
        for absent in old {
            let kept = absent_from_update(absent, now, word, self.updates, settings);
            self.next
                .extend(kept.filter(|_| self.next.len() < self.capacity));
        }
        std::mem::swap(&mut self.candidates, &mut self.next);
    }
}

/// What becomes of a candidate that an update does not name.
fn absent_from_update(
    candidate: &Candidate,
    now: &Now<'_>,
    word: Word,
    updates: u64,
    settings: &BestSettings,
) -> Option<Candidate> {
    let age = updates - candidate.valid_in;
    if age > u64::from(settings.remembered_updates) || matches!(candidate.course, Course::Unknown) {
        return None;
    }
    let mut kept = *candidate;
    // Where the direct path is seen no update looks for longer bends, so it has not said anything.
    if matches!(kept.course, Course::Bends(_)) && !now.is_shadowed(kept.path.source) {
        kept.tested = None;
        return Some(kept);
    }
    if word.binding && kept.tested <= Some(word.frame) {
        (kept.open, kept.tested) = (false, Some(word.frame));
    }
    Some(kept)
}
