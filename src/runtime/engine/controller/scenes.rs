//! Scene, propagation settings and schedule.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::Controller;
use crate::error::{Error, Result};
use crate::extrapolation::PredictorKind;
use crate::propagation::{PropagationSettings, Propagator};
use crate::runtime::engine::settings::EngineSchedule;
use crate::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh};

impl Controller {
    /// Replaces the scene; the old one is audible until the first update of the new one. Instances keep their handles
    /// and world poses. Allocates.
    ///
    /// ```
    /// use std::sync::Arc;
    /// use foresound::{MaterialTable, Scene, SceneSettings, glam::Vec3, shoebox};
    ///
    /// # fn main() -> foresound::Result<()> {
    /// # let (mut controller, _renderer) = foresound::Engine::new(Default::default())?;
    /// let mesh = shoebox(Vec3::new(12.0, 4.0, 8.0), "brick");
    /// let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())?;
    /// controller.set_scene(Arc::new(scene))?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`Error::Setting`] for a scene that has instances.
    pub fn set_scene(&mut self, scene: Arc<Scene>) -> Result<()> {
        if scene.has_instances() && !Arc::ptr_eq(&scene, &self.scene) {
            let advice = "give the fixed scene and add instances to the engine";
            return Err(Error::setting("scene", "it has instances", advice));
        }
        self.builder.cancel();
        self.set_propagator(self.with_instances(scene), self.settings.propagation)
    }

    /// Builds a scene on a background thread; the first tick after its end uses it or returns its error. A later call
    /// replaces an earlier one.
    ///
    /// # Errors
    /// [`Error::Engine`] if no thread can be started.
    pub fn build_scene(
        &mut self,
        mesh: TriangleMesh,
        materials: MaterialTable,
        settings: SceneSettings,
    ) -> Result<()> {
        self.builder.start(mesh, materials, settings)
    }

    /// Whether a scene is being built that a later tick will take over.
    pub fn is_building(&self) -> bool {
        self.builder.is_building()
    }

    /// The newest scene, with instances at their poses when one was last added or removed; [`Self::instances`] has
    /// their current poses.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    pub(super) fn install_scene(&mut self) -> Result<()> {
        match self.builder.poll() {
            Some(scene) => {
                self.set_propagator(self.with_instances(scene?), self.settings.propagation)
            }
            None => Ok(()),
        }
    }

    /// Sets rays, reflection orders and caches of propagation; clears its caches. Allocates.
    ///
    /// # Errors
    /// [`Error::Setting`] names a setting outside its range; nothing changes then.
    pub fn set_propagation(&mut self, settings: PropagationSettings) -> Result<()> {
        self.set_propagator(Arc::clone(&self.scene), settings)
    }

    fn set_propagator(&mut self, scene: Arc<Scene>, settings: PropagationSettings) -> Result<()> {
        let propagator = Propagator::new(Arc::clone(&scene), settings)?;
        self.scene = scene;
        self.settings.propagation = settings;
        // Frees a propagator that was not taken.
        drop(
            self.channels
                .pending_propagator
                .swap(Some(Box::new(propagator))),
        );
        Ok(())
    }

    /// Sets how paths continue between updates, from the next update on.
    pub fn set_predictor(&mut self, predictor: PredictorKind) {
        self.settings.predictor = predictor;
    }

    /// Sets when propagation runs. Waits for the current update.
    ///
    /// # Errors
    /// [`Error::Engine`] or [`Error::Setting`] if no thread can be started: the schedule stays.
    pub fn set_schedule(&mut self, schedule: EngineSchedule) -> Result<()> {
        if schedule == self.settings.schedule {
            return Ok(());
        }
        if self
            .channels
            .metrics
            .propagation_failed
            .load(Ordering::Acquire)
        {
            self.set_propagator(Arc::clone(&self.scene), self.settings.propagation)?;
        }
        let before = std::mem::replace(&mut self.settings.schedule, schedule);
        let started = self.propagation.start(&self.settings);
        if started.is_err() {
            self.settings.schedule = before;
            // If this fails as well, the state says so.
            let _ = self.propagation.start(&self.settings);
        }
        started
    }

    /// Restarts propagation after [`super::EngineState::PropagationFailed`]. Waits for the current update.
    ///
    /// # Errors
    /// [`Error::Engine`] or [`Error::Setting`] if no thread can be started: the state stays, and another call tries again.
    pub fn restart(&mut self) -> Result<()> {
        self.set_propagator(Arc::clone(&self.scene), self.settings.propagation)?;
        self.propagation.start(&self.settings)
    }
}
