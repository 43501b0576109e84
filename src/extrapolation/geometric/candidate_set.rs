//! The candidates, merged with every update.
//!
//! An update lists the paths that are valid at its poses. Its visibility replaces a candidate's own if it describes a later
//! graphics frame than the candidate's last test; visibility at a position that the listener did not reach is a hint.
//! Nearby paths of an update are kept, silent, until a ray finds them visible or an update omits them. Candidates that an
//! update omits are kept for some updates. An update after a jump ([`crate::propagation::UpdateScope`]) adds what it has found
//! and tests nothing beyond its scope. A long update is merged in parts.

use crate::extrapolation::frame::energy;
use crate::extrapolation::geometric::FrameInputs;
use crate::extrapolation::geometric::candidate::{
    Candidate, PathGeometry, PathRecipe, VisibilityState,
};
use crate::extrapolation::geometric::prepared_update::PreparedUpdate;
use crate::extrapolation::geometric::update_dating::UpdateEpoch;
use crate::extrapolation::line_extrapolation::PathLine;
use crate::extrapolation::work_budget::{WorkBudget, cost};
use crate::propagation::{Path, PathSet};
use crate::scene::SourceId;

/// Most candidates over all sources; a full set drops the last by identity.
const CAPACITY: usize = 32_768;

/// Updates for which a reflected path is kept after it was valid: a ray may find it visible again.
const RETAINED_UPDATES: u64 = 8;

/// Updates for which a diffracted path is kept: an update lists the loudest, and the others must be silent.
const RETAINED_UPDATES_DIFFRACTED: u64 = 1;

/// All candidates, sorted by identity.
#[derive(Debug, Default)]
pub struct CandidateSet {
    /// The candidates.
    pub candidates: Vec<Candidate>,
    /// The visibility of each.
    pub states: Vec<VisibilityState>,
    /// The line through the last evaluations of each; `None` if the next frame evaluates it.
    pub lines: Vec<Option<PathLine>>,
    next: NextSet,
    progress: MergeProgress,
    /// Updates merged so far.
    pub updates: u64,
}

impl CandidateSet {
    /// Limits the number of candidates and reserves capacity for them.
    pub(crate) fn set_capacity(&mut self, candidates: usize) {
        let capacity = candidates.min(CAPACITY);
        self.next.capacity = capacity;
        for list in [&mut self.candidates, &mut self.next.candidates] {
            list.reserve_exact(capacity);
        }
        for list in [&mut self.states, &mut self.next.states] {
            list.reserve_exact(capacity);
        }
        for list in [&mut self.lines, &mut self.next.lines] {
            list.reserve_exact(capacity);
        }
    }

    /// Begins the merge of an update in a graphics frame.
    pub(crate) fn begin_update(&mut self, frame: u64, epoch: UpdateEpoch) {
        self.progress = MergeProgress {
            frame,
            epoch,
            ..MergeProgress::default()
        };
        self.next.candidates.clear();
        self.next.states.clear();
        self.next.lines.clear();
    }

    /// Merges the update until the budget is spent; returns whether it is merged. Until then the candidates are unchanged.
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
            updates: self.updates + u64::from(update.scope.is_whole()),
            old: OldSet {
                candidates: &self.candidates,
                states: &self.states,
                lines: &self.lines,
            },
            next: &mut self.next,
            progress: self.progress,
        };
        let mut steps = 0;
        loop {
            if budget.is_spent() {
                self.progress = merge.progress;
                return false;
            }
            if !merge.step() {
                break;
            }
            steps += 1;
            budget.spend(usize::from(steps % cost::MERGED == 0));
        }
        std::mem::swap(&mut self.candidates, &mut self.next.candidates);
        std::mem::swap(&mut self.states, &mut self.next.states);
        std::mem::swap(&mut self.lines, &mut self.next.lines);
        // Candidates do not age by an update that did not look for them.
        self.updates += u64::from(update.scope.is_whole());
        true
    }

    /// Forgets the past of all candidates whose listener or source was put elsewhere: the next rays test them, and a line
    /// through evaluations at both places leads nowhere.
    pub(crate) fn forget_past(&mut self, frame: u64, has_jumped: impl Fn(SourceId) -> bool) {
        let each = self.candidates.iter().zip(&mut self.states);
        for ((candidate, state), line) in each.zip(&mut self.lines) {
            if has_jumped(candidate.source) {
                *line = None;
                (state.tested, state.changed) = (None, frame);
            }
        }
    }
}

/// The candidates after an update.
#[derive(Debug)]
struct NextSet {
    candidates: Vec<Candidate>,
    states: Vec<VisibilityState>,
    lines: Vec<Option<PathLine>>,
    capacity: usize,
}

impl Default for NextSet {
    fn default() -> Self {
        Self {
            candidates: Vec::new(),
            states: Vec::new(),
            lines: Vec::new(),
            capacity: CAPACITY,
        }
    }
}

impl NextSet {
    /// Adds a candidate if there is capacity.
    fn push(
        &mut self,
        candidate: &Candidate,
        state: &VisibilityState,
        line: Option<&PathLine>,
    ) -> Option<(&mut Candidate, &mut VisibilityState)> {
        if self.candidates.len() >= self.capacity {
            return None;
        }
        self.candidates.push(*candidate);
        self.states.push(*state);
        self.lines.push(line.copied());
        self.candidates.last_mut().zip(self.states.last_mut())
    }
}

/// Progress of a merge.
#[derive(Debug, Clone, Copy, Default)]
struct MergeProgress {
    /// The graphics frame in which the merge began.
    frame: u64,
    epoch: UpdateEpoch,
    /// Index of the next path of the update, and the number of extrapolated ones before it.
    path: usize,
    recipe: usize,
    /// Index of the next nearby path.
    nearby: usize,
    /// Index of the next previous candidate.
    old: usize,
}

/// A merge of an update, its nearby paths and the previous candidates, all sorted by identity.
struct Merge<'a> {
    update: &'a PathSet,
    prepared: &'a PreparedUpdate,
    inputs: &'a FrameInputs<'a>,
    updates: u64,
    old: OldSet<'a>,
    next: &'a mut NextSet,
    progress: MergeProgress,
}

/// The candidates from before the update.
#[derive(Debug, Clone, Copy)]
struct OldSet<'a> {
    candidates: &'a [Candidate],
    states: &'a [VisibilityState],
    lines: &'a [Option<PathLine>],
}

/// A candidate from before the update.
#[derive(Debug, Clone, Copy)]
struct Old<'a> {
    candidate: &'a Candidate,
    state: &'a VisibilityState,
    line: Option<&'a PathLine>,
}

impl<'a> OldSet<'a> {
    fn get(&self, index: usize) -> Option<Old<'a>> {
        Some(Old {
            candidate: self.candidates.get(index)?,
            state: self.states.get(index)?,
            line: self.lines.get(index)?.as_ref(),
        })
    }
}

impl Merge<'_> {
    /// Keeps or drops the next candidate by identity; returns whether there was one.
    fn step(&mut self) -> bool {
        let progress = &mut self.progress;
        let (update, paths) = (self.update, &self.update.paths);
        let scene = self.inputs.update_scene;
        while let Some(path) = paths.get(progress.path) {
            if path.is_frame_validated() {
                progress.path += 1;
            } else if !update.was_searched(scene, path) {
                // As of the update before, which has been merged.
                progress.path += 1;
            } else {
                break;
            }
        }
        let valid = paths.get(progress.path);
        let nearby = self.update.nearby.get(progress.nearby);
        let nearby = nearby.filter(|nearby| valid.is_none_or(|path| nearby.id < path.id));
        let next = nearby.or(valid);
        let old = self.old.get(progress.old);
        let old = old.filter(|old| next.is_none_or(|next| old.candidate.path.id <= next.id));
        progress.old += usize::from(old.is_some());
        match (next, old) {
            (None, None) => return false,
            (None, Some(old)) => {
                self.merge_absent(old);
            }
            (Some(next), Some(old)) if old.candidate.path.id < next.id => {
                self.merge_absent(old);
            }
            (Some(next), old) if nearby.is_some() => {
                let recipe = self.prepared.get_nearby(progress.nearby, next);
                progress.nearby += 1;
                self.merge_nearby(next, recipe, old);
            }
            (Some(next), old) => {
                let recipe = self.prepared.get(progress.recipe, next);
                progress.path += 1;
                progress.recipe += 1;
                self.merge_valid(next, recipe, old);
            }
        }
        true
    }

    /// Merges a path that is valid in the update.
    fn merge_valid(&mut self, path: &Path, recipe: Option<&PathRecipe>, old: Option<Old<'_>>) {
        let own = || PathRecipe::of(path, self.update, self.inputs.update_scene);
        let recipe = recipe.copied().unwrap_or_else(own);
        let new = Candidate::new(path, self.update, &recipe);
        let MergeProgress { frame, epoch, .. } = self.progress;
        let state = VisibilityState::new(path, new.is_reflection(), frame);
        let pushed = self.next.push(&new, &state, old.and_then(|old| old.line));
        let Some((candidate, state)) = pushed else {
            return;
        };
        candidate.valid_in = self.updates;
        state.tested = epoch.is_reached.then_some(epoch.frame);
        let Some(Old { state: old, .. }) = old else {
            return;
        };
        if (!epoch.is_reached || old.tested > state.tested) && old.tested.is_some() {
            (state.is_visible, state.tested) = (old.is_visible, old.tested);
            state.blocked_segment = old.blocked_segment;
        }
        state.peak_energy = state.peak_energy.max(old.peak_energy);
        if old.is_visible == state.is_visible {
            state.changed = old.changed;
        }
        if old.is_visible {
            state.energy = old.energy;
        }
    }

    /// Merges a nearby path: kept until the next update, or as long as a candidate that was valid before.
    fn merge_nearby(&mut self, path: &Path, recipe: Option<&PathRecipe>, old: Option<Old<'_>>) {
        let updates = self.updates;
        // What rays have found since the update's date stays, also of diffracted paths, which no ray retains.
        let is_kept =
            |old: &Old<'_>| old.candidate.is_diffracted() || self.is_retained(old.candidate);
        let pushed = match old.filter(is_kept) {
            Some(old) => self.merge_blocked(old),
            None => {
                let own = || PathRecipe::nearby(path, self.inputs.update_scene);
                let recipe = recipe.copied().unwrap_or_else(own);
                let new = Candidate::new(path, self.update, &recipe);
                let frame = self.progress.frame;
                let state = VisibilityState::nearby(path, new.is_reflection(), frame);
                self.next.push(&new, &state, None)
            }
        };
        let Some((candidate, state)) = pushed else {
            return;
        };
        state.peak_energy = state.peak_energy.max(energy(&path.amplitude));
        let oldest = updates.saturating_sub(RETAINED_UPDATES);
        candidate.valid_in = candidate.valid_in.max(oldest);
    }

    /// Whether a candidate that is not valid in the update is kept.
    fn is_retained(&self, candidate: &Candidate) -> bool {
        let limit = match candidate.geometry {
            PathGeometry::Diffraction(_) => RETAINED_UPDATES_DIFFRACTED,
            PathGeometry::Reflection(_) => RETAINED_UPDATES,
            PathGeometry::Curved(_) | PathGeometry::Unknown => return false,
        };
        self.updates - candidate.valid_in <= limit
    }

    /// Merges a candidate that is not valid in the update.
    fn merge_absent(&mut self, old: Old<'_>) -> Option<(&mut Candidate, &mut VisibilityState)> {
        let Old {
            candidate,
            state,
            line,
        } = old;
        let scene = self.inputs.update_scene;
        if !self.update.was_searched(scene, &candidate.path) {
            return self.next.push(candidate, state, line);
        }
        if !self.is_retained(candidate) {
            return None;
        }
        self.merge_blocked(old)
    }

    /// Merges a candidate that is kept and not valid in the update.
    fn merge_blocked(&mut self, old: Old<'_>) -> Option<(&mut Candidate, &mut VisibilityState)> {
        let Old {
            candidate,
            state,
            line,
        } = old;
        let epoch = self.progress.epoch;
        let (candidate, state) = self.next.push(candidate, state, line)?;
        state.in_update = false;
        // An update does not search for what the direct path masks: absence is no test.
        let is_masked = match candidate.geometry {
            PathGeometry::Diffraction(sequence) => {
                self.inputs.shadow(candidate.source).share(&sequence) == 0.0
            }
            _ => false,
        };
        if is_masked {
            state.tested = None;
        } else if epoch.is_reached && state.tested <= Some(epoch.frame) {
            state.record_visibility(false, epoch.frame);
        }
        Some((candidate, state))
    }
}
