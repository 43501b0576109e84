//! Scenes built off the app's thread: a mesh goes in, a committed scene comes out some frames later.
//!
//! Control side. One thread a build; of several builds only the last one asked for counts.

use std::sync::Arc;
use std::thread::{self, JoinHandle};

use crate::error::{Error, Result};
use crate::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh};

type Build = JoinHandle<Result<Scene>>;

/// The build under way, if there is one.
#[derive(Default)]
pub(super) struct SceneBuilder {
    build: Option<Build>,
}

impl SceneBuilder {
    /// Starts a build; an earlier one's result will not be looked at.
    pub(super) fn start(
        &mut self,
        mesh: TriangleMesh,
        materials: MaterialTable,
        settings: SceneSettings,
    ) -> Result<()> {
        let build = thread::Builder::new()
            .name("foresound-scene".into())
            .spawn(move || Scene::commit(&mesh, &materials, &settings))
            .map_err(|error| {
                let advice = "commit the scene yourself and hand it over";
                Error::engine(format!("no thread for the scene: {error}"), advice)
            })?;
        self.build = Some(build);
        Ok(())
    }

    pub(super) fn is_building(&self) -> bool {
        self.build.is_some()
    }

    /// Forgets the build under way.
    pub(super) fn cancel(&mut self) {
        self.build = None;
    }

    /// The result, once it is there.
    pub(super) fn poll(&mut self) -> Option<Result<Arc<Scene>>> {
        let build = self.build.take_if(|build| build.is_finished())?;
        Some(match build.join() {
            Ok(result) => result.map(Arc::new),
            Err(_) => Err(Error::engine(
                "building the scene panicked",
                "the scene before is kept; report the mesh",
            )),
        })
    }
}
