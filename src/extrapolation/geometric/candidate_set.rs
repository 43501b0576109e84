//! Candidates from update to update.
//!
//! An update names the paths that were valid at its poses. What it says of a candidate's visibility counts if it speaks
//! of a later graphics frame than the candidate's own last test; what it says for a pose where the listener never was
//! is a hint. Paths that it names as nearby are kept, closed, until a ray finds them open or it names them no more.
//! Candidates that it does not name are kept for some updates, closed or open. A long update is taken over in parts.

use crate::extrapolation::geometric::candidate::{Candidate, Course, Grounds, Mark, energy};
use crate::extrapolation::geometric::prepared_update::PreparedUpdate;
use crate::extrapolation::geometric::update_dating::Word;
use crate::extrapolation::geometric::{GeometricSettings, Now};
use crate::extrapolation::work_budget::{WorkBudget, cost};
use crate::propagation::{Path, PathSet};

/// Candidates kept at most, over all sources: a full memory drops what comes last by identity.
const CAPACITY: usize = 32_768;

/// All candidates, sorted by identity.
#[derive(Debug, Default)]
pub struct Memory {
    /// The candidates.
    pub candidates: Vec<Candidate>,
    /// What is known of each.
    pub marks: Vec<Mark>,
    next: Next,
    /// How far an update has been taken over, into `next`.
    taken: Taken,
    /// Updates taken so far.
    pub updates: u64,
}

impl Memory {
    /// Makes room for this many candidates, and keeps to it.
    pub(crate) fn bound(&mut self, candidates: usize) {
        let capacity = candidates.min(CAPACITY);
        self.next.capacity = capacity;
        for list in [&mut self.candidates, &mut self.next.candidates] {
            list.reserve_exact(capacity);
        }
        for list in [&mut self.marks, &mut self.next.marks] {
            list.reserve_exact(capacity);
        }
    }

    /// An update is to be taken over in a graphics frame, from its first path on; `word` is what it is worth.
    pub(crate) fn begin_update(&mut self, frame: u64, word: Word) {
        self.taken = Taken {
            frame,
            word,
            ..Taken::default()
        };
        self.next.candidates.clear();
        self.next.marks.clear();
    }

    /// Goes on taking that update over, with what has been worked out of it, until the effort is spent; gives whether it
    /// has been. Until then the candidates are those from before it.
    pub(crate) fn take_part(
        &mut self,
        (update, groundwork): (&PathSet, &PreparedUpdate),
        now: &Now<'_>,
        settings: &GeometricSettings,
        effort: &mut WorkBudget,
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
            let old = (&self.candidates[..], &self.marks[..]);
            if !named.following(&mut taken, groundwork, old, &mut self.next) {
                break;
            }
            effort.spend(cost::CONTINUED);
        }
        std::mem::swap(&mut self.candidates, &mut self.next.candidates);
        std::mem::swap(&mut self.marks, &mut self.next.marks);
        self.updates += 1;
        true
    }
}

/// The candidates that an update leaves.
#[derive(Debug)]
struct Next {
    candidates: Vec<Candidate>,
    marks: Vec<Mark>,
    capacity: usize,
}

impl Default for Next {
    fn default() -> Self {
        Self {
            candidates: Vec::new(),
            marks: Vec::new(),
            capacity: CAPACITY,
        }
    }
}

impl Next {
    /// Keeps one more, if there is room.
    fn keep(&mut self, candidate: &Candidate, mark: &Mark) -> Option<(&mut Candidate, &mut Mark)> {
        if self.candidates.len() >= self.capacity {
            return None;
        }
        self.candidates.push(*candidate);
        self.marks.push(*mark);
        self.candidates.last_mut().zip(self.marks.last_mut())
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

/// An update as it is taken over, and what its word is worth.
struct Named<'a> {
    update: &'a PathSet,
    now: &'a Now<'a>,
    frame: u64,
    word: Word,
    updates: u64,
    settings: &'a GeometricSettings,
}

/// What was known of a candidate.
type Known<'a> = (&'a Candidate, &'a Mark);

impl Named<'_> {
    /// Keeps the next candidate of the update and of those from before, all by identity, or forgets it; moves on by one.
    /// Gives whether there was one.
    fn following(
        &self,
        taken: &mut Taken,
        groundwork: &PreparedUpdate,
        (old, marks): (&[Candidate], &[Mark]),
        kept: &mut Next,
    ) -> bool {
        let paths = &self.update.paths;
        while paths.get(taken.path).is_some_and(Path::is_frame_validated) {
            taken.path += 1;
        }
        let valid = paths.get(taken.path);
        let beside = self.update.nearby.get(taken.nearby);
        let beside = beside.filter(|beside| valid.is_none_or(|path| beside.id < path.id));
        let next = beside.or(valid);
        let known = old.get(taken.old).zip(marks.get(taken.old));
        let known = known.filter(|(known, _)| next.is_none_or(|next| known.path.id <= next.id));
        taken.old += usize::from(known.is_some());
        match (next, known) {
            (None, None) => return false,
            (None, Some(known)) => {
                self.absent(known, kept);
            }
            (Some(next), Some(known)) if known.0.path.id < next.id => {
                self.absent(known, kept);
            }
            (Some(next), known) if beside.is_some() => {
                let grounds = groundwork.of_nearby(taken.nearby, next);
                taken.nearby += 1;
                self.nearby(next, grounds, known, kept);
            }
            (Some(next), known) => {
                let grounds = groundwork.of(taken.place, next);
                taken.path += 1;
                taken.place += 1;
                self.valid(next, grounds, known, kept);
            }
        }
        true
    }

    /// A path that is valid there, and what was known of it.
    fn valid(
        &self,
        path: &Path,
        grounds: Option<&Grounds>,
        known: Option<Known<'_>>,
        kept: &mut Next,
    ) {
        let own;
        let grounds = match grounds {
            Some(grounds) => grounds,
            None => {
                own = Grounds::of(path, self.update, self.now.then);
                &own
            }
        };
        let new = Candidate::new(path, self.update, grounds);
        let Some((candidate, mark)) = kept.keep(&new, &Mark::new(path, self.frame)) else {
            return;
        };
        candidate.valid_in = self.updates;
        mark.tested = self.word.binding.then_some(self.word.frame);
        let Some((before, known)) = known else {
            return;
        };
        candidate.trend = before.trend;
        if (!self.word.binding || known.tested > mark.tested) && known.tested.is_some() {
            (mark.open, mark.tested) = (known.open, known.tested);
            mark.blocked_leg = known.blocked_leg;
        }
        mark.most_energy = mark.most_energy.max(known.most_energy);
        if known.open == mark.open {
            mark.since = known.since;
        }
        if known.open {
            mark.energy = known.energy;
        }
    }

    /// One that is not, but named: it stays until the next update, and for as long as one that was valid not long ago.
    fn nearby(
        &self,
        path: &Path,
        grounds: Option<&Grounds>,
        known: Option<Known<'_>>,
        kept: &mut Next,
    ) {
        let found = match known.filter(|(known, _)| self.is_remembered(known)) {
            Some(known) => self.absent(known, kept),
            None => {
                let own;
                let grounds = match grounds {
                    Some(grounds) => grounds,
                    None => {
                        own = Grounds::nearby(path, self.now.then);
                        &own
                    }
                };
                let new = Candidate::new(path, self.update, grounds);
                kept.keep(&new, &Mark::nearby(path, self.frame))
            }
        };
        let Some((candidate, mark)) = found else {
            return;
        };
        mark.most_energy = mark.most_energy.max(energy(&path.amplitude));
        let remembered = u64::from(self.settings.remembered_updates);
        let last = self.updates.saturating_sub(remembered);
        candidate.valid_in = candidate.valid_in.max(last);
    }

    /// Whether a candidate is kept that is not valid there.
    fn is_remembered(&self, candidate: &Candidate) -> bool {
        let age = self.updates - candidate.valid_in;
        // Of bent paths an update names the loudest, so that the others are not to be heard.
        let remembered = match candidate.course {
            Course::Bends(_) => self.settings.remembered_updates.min(1),
            Course::Mirrors(_) => self.settings.remembered_updates,
            Course::Unknown => return false,
        };
        age <= u64::from(remembered)
    }

    /// What becomes of a candidate that is not valid there.
    fn absent<'a>(
        &self,
        (candidate, mark): Known<'_>,
        kept: &'a mut Next,
    ) -> Option<(&'a mut Candidate, &'a mut Mark)> {
        if !self.is_remembered(candidate) {
            return None;
        }
        let (candidate, mark) = kept.keep(candidate, mark)?;
        mark.named = false;
        // Where the direct path is seen no update looks for longer bends, so it has not said anything.
        let diffraction_order = matches!(candidate.course, Course::Bends(_));
        if diffraction_order && !self.now.is_shadowed(candidate.path.source) {
            mark.tested = None;
        } else if self.word.binding && mark.tested <= Some(self.word.frame) {
            mark.note_visibility(false, self.word.frame);
        }
        Some((candidate, mark))
    }
}
