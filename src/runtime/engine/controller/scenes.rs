//! Scenes, and how propagation goes about them.

use std::sync::Arc;

use super::Controller;
use crate::error::{Error, Result};
use crate::extrapolation::PredictorKind;
use crate::propagation::{PropagationSettings, Propagator};
use crate::runtime::engine::propagation_thread::Propagation;
use crate::runtime::engine::settings::EngineSchedule;
use crate::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh};

impl Controller {
    /// Replaces the scene. The old one is heard until the new one's first update is there. Instances stay, at the
    /// same places in world coordinates and under the same handles. Allocates.
    ///
    /// # Errors
    /// [`Error::Setting`] for a scene with instances of its own.
    pub fn set_scene(&mut self, scene: Arc<Scene>) -> Result<()> {
        if scene.has_instances() && !Arc::ptr_eq(&scene, &self.scene) {
            let advice = "give what is fixed and add instances to the engine";
            return Err(Error::setting("scene", "it has instances", advice));
        }
        self.builder.cancel();
        self.set_propagator(self.with_instances(scene), self.settings.propagation)
    }

    /// Builds a scene on a thread of its own; the tick after it is ready uses it, or gives its error. Of several builds
    /// the last counts.
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

    /// Whether a scene is being built.
    pub fn is_building(&self) -> bool {
        self.builder.is_building()
    }

    /// The scene in use, or about to be, with its instances wherever they stood when one was added or removed last;
    /// [`Self::instances`] tells where they stand.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    pub(super) fn install_scene(&mut self) -> Result<()> {
        match self.builder.poll() {
            Some(scene) => self.set_propagator(self.with_instances(scene?), self.settings.propagation),
            None => Ok(()),
        }
    }

    /// Sets rays, depth and memory of propagation; what was remembered of sources is forgotten.
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
        // An order that nobody took is freed here.
        drop(
            self.channels
                .pending_propagator
                .swap(Some(Box::new(propagator))),
        );
        Ok(())
    }

    /// Chooses how paths go on between updates, from the next update on.
    pub fn set_predictor(&mut self, predictor: PredictorKind) {
        self.settings.predictor = predictor;
    }

    /// Chooses when propagation runs. Waits for the update under way.
    ///
    /// # Errors
    /// [`Error::Engine`] if no thread can be started.
    pub fn set_schedule(&mut self, schedule: EngineSchedule) -> Result<()> {
        if schedule == self.settings.schedule {
            return Ok(());
        }
        self.settings.schedule = schedule;
        self.start_propagation()
    }

    /// Starts propagation anew after [`super::EngineState::PropagationFailed`]. Waits for the update under way if there is one.
    ///
    /// # Errors
    /// [`Error::Engine`] if no thread can be started.
    pub fn restart(&mut self) -> Result<()> {
        self.set_propagator(Arc::clone(&self.scene), self.settings.propagation)?;
        self.start_propagation()
    }

    fn start_propagation(&mut self) -> Result<()> {
        let Some(worker) = self.propagation.stop() else {
            let advice = "make another engine";
            return Err(Error::engine("propagation was lost", advice));
        };
        self.propagation = Propagation::start(worker, &self.settings)?;
        Ok(())
    }
}
