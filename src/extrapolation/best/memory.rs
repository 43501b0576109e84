//! Candidates from update to update.
//!
//! An update names the paths that were valid at its poses. What it says of a candidate's visibility counts if it speaks
//! of a later graphics frame than the candidate's own last test; what it says for a pose where the listener never was
//! is a hint. Paths that it names as nearby are kept, closed, until a ray finds them open or it names them no more.
//! Candidates that it does not name are kept for some updates, closed or open. A long update is taken over in parts.

use super::candidate::{Candidate, Course, Grounds, energy};
use super::groundwork::Groundwork;
use super::history::Word;
use super::{BestSettings, Now};
use crate::extrapolation::effort::{Effort, cost};
use crate::propagation::{Path, PathSet};

/// Candidates kept at most, over all sources: a full memory drops what comes last by identity.
const CAPACITY: usize = 32_768;

/// All candidates, sorted by identity.
#[derive(Debug)]
pub struct Memory {
    /// The candidates.
    pub candidates: Vec<Candidate>,
    next: Vec<Candidate>,
    /// How far an update has been taken over, into `next`.
    taken: Taken,
    capacity: usize,
    /// Updates taken so far.
    pub updates: u64,
}

impl Default for Memory {
    fn default() -> Self {
        Self {
            candidates: Vec::new(),
            next: Vec::new(),
            taken: Taken::default(),
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

    /// An update is to be taken over in a graphics frame, from its first path on; `word` is what it is worth.
    pub(super) fn begin_update(&mut self, frame: u64, word: Word) {
        self.taken = Taken {
            frame,
            word,
            ..Taken::default()
        };
        self.next.clear();
    }

    /// Goes on taking that update over, with what has been worked out of it, until the effort is spent; gives whether it
    /// has been. Until then the candidates are those from before it.
    pub(super) fn take_part(
        &mut self,
        (update, groundwork): (&PathSet, &Groundwork),
        now: &Now<'_>,
        settings: &BestSettings,
        effort: &mut Effort,
    ) -> bool {
        let mut taken = self.taken;
        let named = Named {
            update,
            now,
            frame: taken.frame,
            word: taken.word,
            updates: self.updates + 1,
            settings,
        };
        loop {
            if effort.is_spent() {
                self.taken = taken;
                return false;
            }
            let kept = match named.following(&mut taken, groundwork, &self.candidates) {
                Following::Kept(candidate) => Some(candidate),
                Following::Forgotten => None,
                Following::Nothing => break,
            };
            effort.spend(cost::CONTINUED);
            if self.next.len() < self.capacity {
                self.next.extend(kept);
            }
        }
        std::mem::swap(&mut self.candidates, &mut self.next);
        self.updates += 1;
        true
    }
}

/// How far an update has been taken over.
#[derive(Debug, Clone, Copy)]
struct Taken {
    /// The graphics frame in which that began.
    frame: u64,
    word: Word,
    /// The next of its paths, and how many before it are continued.
    path: usize,
    place: usize,
    /// The next of those nearby.
    nearby: usize,
    /// The next candidate from before.
    old: usize,
}

impl Default for Taken {
    fn default() -> Self {
        Self {
            frame: 0,
            word: Word {
                frame: 0,
                binding: false,
            },
            path: 0,
            place: 0,
            nearby: 0,
            old: 0,
        }
    }
}

/// What comes next by identity.
#[expect(
    clippy::large_enum_variant,
    reason = "it lives for one step, and what is kept is the rule"
)]
enum Following {
    Kept(Candidate),
    Forgotten,
    Nothing,
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
    /// The next candidate of the update and of those from before, all by identity; moves on by one.
    fn following(
        &self,
        taken: &mut Taken,
        groundwork: &Groundwork,
        old: &[Candidate],
    ) -> Following {
        let paths = &self.update.paths;
        while paths.get(taken.path).is_some_and(Path::is_revalidated) {
            taken.path += 1;
        }
        let valid = paths.get(taken.path);
        let beside = self.update.nearby.get(taken.nearby);
        let beside = beside.filter(|beside| valid.is_none_or(|path| beside.id < path.id));
        let next = beside.or(valid);
        let known = old.get(taken.old);
        let known = known.filter(|known| next.is_none_or(|next| known.path.id <= next.id));
        taken.old += usize::from(known.is_some());
        match (next, known) {
            (None, None) => Following::Nothing,
            (None, Some(known)) => self
                .absent(known)
                .map_or(Following::Forgotten, Following::Kept),
            (Some(next), Some(known)) if known.path.id < next.id => self
                .absent(known)
                .map_or(Following::Forgotten, Following::Kept),
            (Some(next), known) if beside.is_some() => {
                taken.nearby += 1;
                Following::Kept(self.nearby(next, known))
            }
            (Some(next), known) => {
                let grounds = groundwork.of(taken.place, next);
                taken.path += 1;
                taken.place += 1;
                Following::Kept(self.valid(next, grounds, known))
            }
        }
    }

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
            kept.note_visibility(false, self.word.frame);
        }
        Some(kept)
    }
}
