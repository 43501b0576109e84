//! Several listeners in turn: what each has of its own, and what all share.

use super::{ListenerState, MAX_LISTENERS, Propagator};
use crate::propagation::diffuse::ListenerField;
use crate::propagation::source_task::PredictedPosition;

impl Propagator {
    /// Computes for several listeners in turn, 1 to 16: [`Self::select_listener`] before each one's update. All share the
    /// sources' rays and the scene's exchange of scattered energy. Initially one. Allocates.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use foresound::paths::{PathSet, Propagator};
    /// # use foresound::{ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, glam::Vec3, shoebox};
    /// # fn main() -> foresound::Result<()> {
    /// # let room = shoebox(Vec3::new(6.0, 3.0, 4.0), "concrete");
    /// # let scene = Scene::commit(&room, &MaterialTable::built_in(), &SceneSettings::default())?;
    /// let mut propagator = Propagator::new(Arc::new(scene), Default::default())?;
    /// let source = SourcePose::at(SourceId::new(0, 0), Vec3::new(1.0, 1.5, 2.0));
    /// let mut sets = [PathSet::default(), PathSet::default()];
    /// propagator.set_listener_count(2);
    /// for (index, set) in sets.iter_mut().enumerate() {
    ///     propagator.select_listener(index);
    ///     let listener = ListenerPose::facing([4.0, 1.5, 1.0 + index as f32], 0.0);
    ///     propagator.update(&listener, &[source], 0.0, set);
    /// }
    /// assert!(sets.iter().all(|set| set.paths.iter().any(|path| path.is_direct())));
    /// # Ok(())
    /// # }
    /// ```
    pub fn set_listener_count(&mut self, count: usize) {
        let count = count.clamp(1, MAX_LISTENERS);
        self.select_listener(0);
        self.last_inputs = None;
        self.listeners.clear();
        if count > 1 {
            self.listeners.resize_with(count, ListenerState::default);
        }
    }

    /// Takes up the state of a listener for its update, below the number of listeners (others are ignored). The first
    /// listener's turn begins a round; the others follow in order, with the same source poses.
    pub fn select_listener(&mut self, index: usize) {
        if index >= self.listeners.len() {
            return;
        }
        if index == 0 {
            self.round += u64::from(std::mem::take(&mut self.is_round_begun));
        }
        if index == self.listener {
            return;
        }
        for part in [self.listener, index] {
            let state = &mut self.listeners[part];
            std::mem::swap(&mut self.cells, &mut state.cells);
            std::mem::swap(&mut self.listener_field, &mut state.field);
            std::mem::swap(&mut self.predicted, &mut state.predicted);
            std::mem::swap(&mut self.history, &mut state.history);
            std::mem::swap(&mut self.guide_origins, &mut state.guide_origins);
        }
        self.listener = index;
    }
}

/// Marks what every listener knows of the late field, at its position and at predicted ones, as out of date: of the listener
/// whose turn it is and of the others.
pub(super) fn invalidate_fields(
    field: &mut ListenerField,
    predicted: &mut [PredictedPosition],
    others: &mut [ListenerState],
) {
    field.invalidate();
    for other in &mut *others {
        other.field.invalidate();
    }
    let elsewhere = others.iter_mut().flat_map(|other| &mut other.predicted);
    for there in predicted.iter_mut().chain(elsewhere) {
        there.field.invalidate();
    }
}
