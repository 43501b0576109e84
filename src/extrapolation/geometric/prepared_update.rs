//! What `best` can work out about an update before anybody takes it.
//!
//! On the propagation thread, which has the time: by what each path can be computed anew.
//! It is the same whoever works it out and when, so an update that comes without it is no other update.

use crate::extrapolation::geometric::candidate::Grounds;
use crate::propagation::{Path, PathSet};
use crate::scene::Scene;

/// What [`crate::extrapolation::PredictorKind::Geometric`] knows of each path of one update.
#[derive(Debug, Default)]
pub struct PreparedUpdate {
    /// In the order of the update's paths.
    grounds: Vec<Grounds>,
    /// In the order of those nearby.
    nearby: Vec<Grounds>,
}

impl PreparedUpdate {
    /// Of an update, finished but for its way to the sound thread; `scene` is as it stood for it. Not on the sound thread:
    /// allocates.
    pub fn lay(&mut self, update: &PathSet, scene: &Scene) {
        let of = |path: &Path| Grounds::of(path, update, scene);
        self.grounds.clear();
        self.grounds.extend(continued(update).map(of));
        let nearby = update.nearby.iter();
        self.nearby.clear();
        self.nearby
            .extend(nearby.map(|path| Grounds::nearby(path, scene)));
    }

    /// Forgets the update.
    pub fn clear(&mut self) {
        self.grounds.clear();
        self.nearby.clear();
    }

    /// What is known of the path that has this place among [`continued`] ones, if it is that path.
    pub(crate) fn of(&self, place: usize, path: &Path) -> Option<&Grounds> {
        let found = self.grounds.get(place);
        found.filter(|grounds| grounds.id == path.id)
    }

    /// The same of a path nearby, by its place among those.
    pub(crate) fn of_nearby(&self, place: usize, path: &Path) -> Option<&Grounds> {
        let found = self.nearby.get(place);
        found.filter(|grounds| grounds.id == path.id)
    }
}

/// The paths of an update that are continued from it, not computed anew with the direct field.
pub(crate) fn continued(update: &PathSet) -> impl Iterator<Item = &Path> {
    update
        .paths
        .iter()
        .filter(|path| !path.is_frame_validated())
}
