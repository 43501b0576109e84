//! The part of the geometric predictor's work that depends only on an update.
//!
//! Runs on the propagation thread. Computes a recipe for each path, from which later frames compute the path. The result is
//! a function of update and scene: an update without preparation produces the same frames at a higher cost.

use crate::extrapolation::geometric::candidate::PathRecipe;
use crate::propagation::{Path, PathSet};
use crate::scene::Scene;

/// Recipes of one update's paths for [`crate::extrapolation::PredictorKind::Geometric`].
#[derive(Debug, Default)]
pub struct PreparedUpdate {
    /// In the order of the update's paths, without those of the direct field and of sources outside of its scope.
    recipes: Vec<PathRecipe>,
    /// In the order of the update's nearby paths.
    nearby: Vec<PathRecipe>,
}

impl PreparedUpdate {
    /// Computes the recipes of a finished update; `scene` has the instance poses of that update. Propagation thread;
    /// allocates.
    pub fn prepare(&mut self, update: &PathSet, scene: &Scene) {
        let paths = update.paths.iter();
        let extrapolated =
            paths.filter(|path| !path.is_frame_validated() && update.was_searched(scene, path));
        self.recipes.clear();
        self.recipes
            .extend(extrapolated.map(|path| PathRecipe::of(path, update, scene)));
        self.nearby.clear();
        let nearby = update.nearby.iter();
        self.nearby
            .extend(nearby.map(|path| PathRecipe::nearby(path, scene)));
    }

    /// Removes all recipes.
    pub fn clear(&mut self) {
        self.recipes.clear();
        self.nearby.clear();
    }

    /// The recipe at `index` among the extrapolated paths, if it belongs to this path.
    pub(crate) fn get(&self, index: usize, path: &Path) -> Option<&PathRecipe> {
        let found = self.recipes.get(index);
        found.filter(|recipe| recipe.id == path.id)
    }

    /// The recipe at `index` among the nearby paths, if it belongs to this path.
    pub(crate) fn get_nearby(&self, index: usize, path: &Path) -> Option<&PathRecipe> {
        let found = self.nearby.get(index);
        found.filter(|recipe| recipe.id == path.id)
    }
}
