//! Scenes built off the app's thread: a mesh goes in, a committed scene comes out some frames later.
//!
//! Control side. At most one build runs and one mesh waits for it to end, however often an app changes its mind: of several
//! builds only the last one asked for counts. What nobody wants any more is freed as soon as its build ends.

use std::sync::Arc;
use std::thread::{self, JoinHandle};

use crate::error::{Error, Result};
use crate::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh};

/// What a scene is made of.
struct Request {
    mesh: TriangleMesh,
    materials: MaterialTable,
    settings: SceneSettings,
}

/// A build on its thread.
struct Build {
    thread: JoinHandle<Result<Scene>>,
    is_wanted: bool,
}

/// The build under way, if there is one, and the one after it.
#[derive(Default)]
pub(super) struct SceneBuilder {
    build: Option<Build>,
    waiting: Option<Request>,
}

impl SceneBuilder {
    /// Starts a build, or has it wait for the one under way, whose result will not be looked at.
    pub(super) fn start(
        &mut self,
        mesh: TriangleMesh,
        materials: MaterialTable,
        settings: SceneSettings,
    ) -> Result<()> {
        self.cancel();
        let request = Request {
            mesh,
            materials,
            settings,
        };
        if self.build.is_some() {
            self.waiting = Some(request);
            return Ok(());
        }
        self.spawn(request)
    }

    fn spawn(&mut self, request: Request) -> Result<()> {
        let thread = thread::Builder::new()
            .name("foresound-scene".into())
            .spawn(move || Scene::commit(&request.mesh, &request.materials, &request.settings))
            .map_err(|error| {
                let advice = "commit the scene yourself and hand it over";
                Error::engine(format!("no thread for the scene: {error}"), advice)
            })?;
        self.build = Some(Build {
            thread,
            is_wanted: true,
        });
        Ok(())
    }

    pub(super) fn is_building(&self) -> bool {
        self.waiting.is_some() || self.build.as_ref().is_some_and(|build| build.is_wanted)
    }

    /// Forgets what is being built.
    pub(super) fn cancel(&mut self) {
        self.waiting = None;
        if let Some(build) = &mut self.build {
            build.is_wanted = false;
        }
    }

    /// The result, once it is there.
    pub(super) fn poll(&mut self) -> Option<Result<Arc<Scene>>> {
        let build = self.build.take_if(|build| build.thread.is_finished())?;
        let result = build.thread.join();
        if let Some(request) = self.waiting.take() {
            return self.spawn(request).err().map(Err);
        }
        if !build.is_wanted {
            return None;
        }
        Some(match result {
            Ok(result) => result.map(Arc::new),
            Err(_) => Err(Error::engine(
                "building the scene panicked",
                "the scene before is kept; report the mesh",
            )),
        })
    }
}
