//! The candidates, merged with every update.
//!
//! An update lists the paths that are valid at its poses. Its visibility replaces a candidate's own if it describes a later
//! graphics frame than the candidate's last test; visibility for a position that the listener never reached is a hint.
//! Paths that an update lists as nearby are kept, silent, until a ray finds them visible or an update omits them.
//! Candidates that an update omits are kept for some updates. A long update is merged in parts.

use crate::extrapolation::frame::energy;
use crate::extrapolation::geometric::FrameInputs;
use crate::extrapolation::geometric::candidate::{
    Candidate, PathGeometry, PathRecipe, VisibilityState,
};
use crate::extrapolation::geometric::prepared_update::PreparedUpdate;
use crate::extrapolation::geometric::update_dating::UpdateEpoch;
use crate::extrapolation::work_budget::{WorkBudget, cost};
use crate::propagation::{Path, PathSet};

/// Most candidates over all sources; a full set drops the last by identity.
const CAPACITY: usize = 32_768;

/// Updates for which a reflected path is kept that was valid before, so that a ray can find it visible again.
const REMEMBERED_UPDATES: u64 = 8;

/// The same of a diffracted path: an update lists the loudest, and the others are not to be heard.
const REMEMBERED_UPDATES_DIFFRACTED: u64 = 1;

/// All candidates, sorted by identity.
#[derive(Debug, Default)]
pub struct CandidateSet {
    /// The candidates.
    pub candidates: Vec<Candidate>,
    /// The visibility of each.
    pub states: Vec<VisibilityState>,
    next: NextSet,
    progress: MergeProgress,
    /// Updates merged so far.
    pub updates: u64,
}

impl CandidateSet {
    /// Reserves room for this many candidates and drops what exceeds it.
    pub(crate) fn set_capacity(&mut self, candidates: usize) {
        let capacity = candidates.min(CAPACITY);
        self.next.capacity = capacity;
        for list in [&mut self.candidates, &mut self.next.candidates] {
            list.reserve_exact(capacity);
        }
        for list in [&mut self.states, &mut self.next.states] {
            list.reserve_exact(capacity);
        }
    }

    /// Begins to merge an update, in a graphics frame.
    pub(crate) fn begin_update(&mut self, frame: u64, epoch: UpdateEpoch) {
        self.progress = MergeProgress {
            frame,
            epoch,
            ..MergeProgress::default()
        };
        self.next.candidates.clear();
        self.next.states.clear();
    }

    /// Merges that update until the budget is spent; returns whether it is merged. Until then the candidates are those from
    /// before it.
    pub(crate) fn merge_part(
        &mut self,
        (update, prepared): (&PathSet, &PreparedUpdate),
        inputs: &FrameInputs<'_>,
        budget: &mut WorkBudget,
    ) -> bool {
        let mut merge = Merge {
            update,
            prepared,
            inputs,
            updates: self.updates + 1,
            old: (&self.candidates, &self.states),
            next: &mut self.next,
            progress: self.progress,
        };
        loop {
            if budget.is_spent() {
                self.progress = merge.progress;
                return false;
            }
            if !merge.step() {
                break;
            }
            budget.spend(cost::CONTINUED);
        }
        std::mem::swap(&mut self.candidates, &mut self.next.candidates);
        std::mem::swap(&mut self.states, &mut self.next.states);
        self.updates += 1;
        true
    }
}

/// The candidates after an update.
#[derive(Debug)]
struct NextSet {
    candidates: Vec<Candidate>,
    states: Vec<VisibilityState>,
    capacity: usize,
}

impl Default for NextSet {
    fn default() -> Self {
        Self {
            candidates: Vec::new(),
            states: Vec::new(),
            capacity: CAPACITY,
        }
    }
}

impl NextSet {
    /// Adds one if there is room.
    fn push(
        &mut self,
        candidate: &Candidate,
        state: &VisibilityState,
    ) -> Option<(&mut Candidate, &mut VisibilityState)> {
        if self.candidates.len() >= self.capacity {
            return None;
        }
        self.candidates.push(*candidate);
        self.states.push(*state);
        self.candidates.last_mut().zip(self.states.last_mut())
    }
}

/// Progress of a merge.
#[derive(Debug, Clone, Copy, Default)]
struct MergeProgress {
    /// The graphics frame in which it began.
    frame: u64,
    epoch: UpdateEpoch,
    /// The next path of the update, and the number of extrapolated ones before it.
    path: usize,
    recipe: usize,
    /// The next nearby path.
    nearby: usize,
    /// The next candidate from before.
    old: usize,
}

/// A merge of an update, its nearby paths and the candidates from before, all sorted by identity.
struct Merge<'a> {
    update: &'a PathSet,
    prepared: &'a PreparedUpdate,
    inputs: &'a FrameInputs<'a>,
    updates: u64,
    old: (&'a [Candidate], &'a [VisibilityState]),
    next: &'a mut NextSet,
    progress: MergeProgress,
}

/// A candidate from before the update.
type Known<'a> = (&'a Candidate, &'a VisibilityState);

impl Merge<'_> {
    /// Keeps or drops the next candidate by identity; returns whether there was one.
    fn step(&mut self) -> bool {
        let progress = &mut self.progress;
        let paths = &self.update.paths;
        while paths
            .get(progress.path)
            .is_some_and(Path::is_frame_validated)
        {
            progress.path += 1;
        }
        let valid = paths.get(progress.path);
        let nearby = self.update.nearby.get(progress.nearby);
        let nearby = nearby.filter(|nearby| valid.is_none_or(|path| nearby.id < path.id));
        let next = nearby.or(valid);
        let known = self.old.0.get(progress.old);
        let known = known.zip(self.old.1.get(progress.old));
        let known = known.filter(|(known, _)| next.is_none_or(|next| known.path.id <= next.id));
        progress.old += usize::from(known.is_some());
        match (next, known) {
            (None, None) => return false,
            (None, Some(known)) => {
                self.merge_absent(known);
            }
            (Some(next), Some(known)) if known.0.path.id < next.id => {
                self.merge_absent(known);
            }
            (Some(next), known) if nearby.is_some() => {
                let recipe = self.prepared.get_nearby(progress.nearby, next);
                progress.nearby += 1;
                self.merge_nearby(next, recipe, known);
            }
            (Some(next), known) => {
                let recipe = self.prepared.get(progress.recipe, next);
                progress.path += 1;
                progress.recipe += 1;
                self.merge_valid(next, recipe, known);
            }
        }
        true
    }

    /// A path that is valid in the update.
    fn merge_valid(&mut self, path: &Path, recipe: Option<&PathRecipe>, known: Option<Known<'_>>) {
        let own = || PathRecipe::of(path, self.update, self.inputs.update_scene);
        let recipe = recipe.copied().unwrap_or_else(own);
        let new = Candidate::new(path, self.update, &recipe);
        let MergeProgress { frame, epoch, .. } = self.progress;
        let pushed = self.next.push(&new, &VisibilityState::new(path, frame));
        let Some((candidate, state)) = pushed else {
            return;
        };
        candidate.valid_in = self.updates;
        state.tested = epoch.is_reached.then_some(epoch.frame);
        let Some((before, known)) = known else {
            return;
        };
        candidate.line = before.line;
        if (!epoch.is_reached || known.tested > state.tested) && known.tested.is_some() {
            (state.is_visible, state.tested) = (known.is_visible, known.tested);
            state.blocked_segment = known.blocked_segment;
        }
        state.peak_energy = state.peak_energy.max(known.peak_energy);
        if known.is_visible == state.is_visible {
            state.changed = known.changed;
        }
        if known.is_visible {
            state.energy = known.energy;
        }
    }

    /// A nearby path: kept until the next update, and as long as a candidate that was valid before.
    fn merge_nearby(&mut self, path: &Path, recipe: Option<&PathRecipe>, known: Option<Known<'_>>) {
        let updates = self.updates;
        let pushed = match known.filter(|(known, _)| self.is_remembered(known)) {
            Some(known) => self.merge_absent(known),
            None => {
                let own = || PathRecipe::nearby(path, self.inputs.update_scene);
                let recipe = recipe.copied().unwrap_or_else(own);
                let new = Candidate::new(path, self.update, &recipe);
                let state = VisibilityState::nearby(path, self.progress.frame);
                self.next.push(&new, &state)
            }
        };
        let Some((candidate, state)) = pushed else {
            return;
        };
        state.peak_energy = state.peak_energy.max(energy(&path.amplitude));
        let oldest = updates.saturating_sub(REMEMBERED_UPDATES);
        candidate.valid_in = candidate.valid_in.max(oldest);
    }

    /// Whether a candidate is kept that is not valid in the update.
    fn is_remembered(&self, candidate: &Candidate) -> bool {
        let remembered = match candidate.geometry {
            PathGeometry::Diffraction(_) => REMEMBERED_UPDATES_DIFFRACTED,
            PathGeometry::Reflection(_) => REMEMBERED_UPDATES,
            PathGeometry::Unknown => return false,
        };
        self.updates - candidate.valid_in <= remembered
    }

    /// A candidate that is not valid in the update.
    fn merge_absent(
        &mut self,
        (candidate, state): Known<'_>,
    ) -> Option<(&mut Candidate, &mut VisibilityState)> {
        if !self.is_remembered(candidate) {
            return None;
        }
        let epoch = self.progress.epoch;
        let (candidate, state) = self.next.push(candidate, state)?;
        state.in_update = false;
        // Where the direct path is visible no update searches for diffracted ones: their absence means nothing.
        let is_diffracted = matches!(candidate.geometry, PathGeometry::Diffraction(_));
        if is_diffracted && !self.inputs.is_occluded(candidate.path.source) {
            state.tested = None;
        } else if epoch.is_reached && state.tested <= Some(epoch.frame) {
            state.record_visibility(false, epoch.frame);
        }
        Some((candidate, state))
    }
}
