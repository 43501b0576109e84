//! What `best` can work out about an update before anybody takes it.
//!
//! On the propagation thread, which has the time: by what each path can be computed anew, and how it differs from that.
//! It is the same whoever works it out and when, so an update that comes without it is no other update.

use super::candidate::Grounds;
use crate::propagation::{Path, PathSet};
use crate::scene::Scene;

/// What [`super::super::PredictorKind::Best`] knows of each path of one update.
#[derive(Debug, Default)]
pub struct Groundwork {
    /// In the order of the update's paths.
    grounds: Vec<Grounds>,
}

impl Groundwork {
    /// Of an update, finished but for its way to the sound thread; `scene` is as it stood for it, `nearest_m` the
    /// distance in metres below which a source gets no louder. Not on the sound thread: allocates.
    pub fn lay(&mut self, update: &PathSet, scene: &Scene, nearest_m: f32) {
        let of = |path: &Path| Grounds::of(path, update, scene, f64::from(nearest_m));
        self.grounds.clear();
        self.grounds.extend(continued(update).map(of));
    }

    /// Forgets the update.
    pub fn clear(&mut self) {
        self.grounds.clear();
    }

    /// What is known of the path that has this place among [`continued`] ones, if it is that path.
    pub(super) fn of(&self, place: usize, path: &Path) -> Option<Grounds> {
        let found = self.grounds.get(place).copied();
        found.filter(|grounds| grounds.id == path.id)
    }
}

/// The paths of an update that are continued from it, not computed anew with the direct field.
pub(super) fn continued(update: &PathSet) -> impl Iterator<Item = &Path> {
    update.paths.iter().filter(|path| !path.is_revalidated())
}
