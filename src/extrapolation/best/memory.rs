//! Candidates from update to update.
//!
//! An update names the paths that were valid at its poses. What it says of a candidate's visibility counts if it speaks
//! of a later graphics frame than the candidate's own last test; what it says for a pose where the listener never was
//! is a hint. Paths that it names as nearby are kept, closed, until a ray finds them open or it names them no more.
//! Candidates that it does not name are kept for some updates, closed or open.

use super::candidate::{Candidate, Course, Grounds, energy};
use super::groundwork::{Groundwork, continued};
use super::history::Word;
use super::{BestSettings, Now};
use crate::propagation::{Path, PathSet};

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

    /// Takes an update over in a graphics frame, with what has been worked out of it; `word` is what it is worth.
    pub(super) fn take(
        &mut self,
        update: &PathSet,
        groundwork: &Groundwork,
        now: &Now<'_>,
        (frame, word): (u64, Word),
        settings: &BestSettings,
    ) {
        self.updates += 1;
        self.next.clear();
        let mut old = self.candidates.iter().peekable();
        let mut nearby = update.nearby.iter().peekable();
        let named = Named {
            update,
            now,
            frame,
            word,
            updates: self.updates,
            settings,
        };
        let (next, capacity) = (&mut self.next, self.capacity);
        let mut keep = |candidate: Option<Candidate>| {
            next.extend(candidate.filter(|_| next.len() < capacity));
        };
        for (place, path) in continued(update).enumerate() {
            while let Some(beside) = nearby.next_if(|beside| beside.id < path.id) {
                while let Some(absent) = old.next_if(|known| known.path.id < beside.id) {
                    keep(named.absent(absent));
                }
                let known = old.next_if(|known| known.path.id == beside.id);
                keep(Some(named.nearby(beside, known)));
            }
            while let Some(absent) = old.next_if(|known| known.path.id < path.id) {
                keep(named.absent(absent));
            }
            let known = old.next_if(|known| known.path.id == path.id);
            keep(Some(named.valid(path, groundwork.of(place, path), known)));
        }
        for beside in nearby {
            while let Some(absent) = old.next_if(|known| known.path.id < beside.id) {
                keep(named.absent(absent));
            }
            let known = old.next_if(|known| known.path.id == beside.id);
            keep(Some(named.nearby(beside, known)));
        }
        for absent in old {
            keep(named.absent(absent));
        }
        std::mem::swap(&mut self.candidates, &mut self.next);
    }
}

/// An update as it is taken over, and what its word is worth.
struct Named<'a> {
    update: &'a PathSet,
    now: &'a Now<'a>,
    frame: u64,
    word: Word,
    updates: u64,
    settings: &'a BestSettings,
}

impl Named<'_> {
    /// A path that is valid there, and what was known of it.
    fn valid(&self, path: &Path, grounds: Option<Grounds>, known: Option<&Candidate>) -> Candidate {
        let grounds = grounds.unwrap_or_else(|| Grounds::of(path, self.update, self.now.then));
        let mut candidate = Candidate::new(path, self.update, &grounds, self.frame);
        candidate.valid_in = self.updates;
        candidate.tested = self.word.binding.then_some(self.word.frame);
        candidate.trend = known.and_then(|known| known.trend);
        if let Some(known) = known
            && (!self.word.binding || known.tested > candidate.tested)
            && known.tested.is_some()
        {
            (candidate.open, candidate.tested) = (known.open, known.tested);
            candidate.blocked_leg = known.blocked_leg;
        }
        if let Some(known) = known {
            candidate.most_energy = candidate.most_energy.max(known.most_energy);
            if known.open == candidate.open {
                candidate.since = known.since;
            }
            if known.open {
                candidate.energy = known.energy;
            }
        }
        candidate
    }

    /// One that is not, but named: it stays until the next update, and for as long as one that was valid not long ago.
    fn nearby(&self, path: &Path, known: Option<&Candidate>) -> Candidate {
        let mut candidate = match known.and_then(|known| self.absent(known)) {
            Some(known) => known,
            None => Candidate::nearby(path, self.update, self.now.then, self.frame),
        };
        candidate.most_energy = candidate.most_energy.max(energy(&path.amplitude));
        let remembered = u64::from(self.settings.remembered_updates);
        let last = self.updates.saturating_sub(remembered);
        candidate.valid_in = candidate.valid_in.max(last);
        candidate
    }

    /// What becomes of a candidate that is not valid there.
    fn absent(&self, candidate: &Candidate) -> Option<Candidate> {
        let age = self.updates - candidate.valid_in;
        // Of bent paths an update names the loudest, so that the others are not to be heard.
        let remembered = match candidate.course {
            Course::Bends(_) => self.settings.remembered_updates.min(1),
            Course::Mirrors(_) | Course::Unknown => self.settings.remembered_updates,
        };
        if age > u64::from(remembered) || matches!(candidate.course, Course::Unknown) {
            return None;
        }
        let mut kept = *candidate;
        kept.named = false;
        // Where the direct path is seen no update looks for longer bends, so it has not said anything.
        if matches!(kept.course, Course::Bends(_)) && !self.now.is_shadowed(kept.path.source) {
            kept.tested = None;
            return Some(kept);
        }
        if self.word.binding && kept.tested <= Some(self.word.frame) {
            kept.is_found(false, self.word.frame);
        }
        Some(kept)
    }
}
