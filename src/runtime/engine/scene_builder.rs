//! Builds scenes on a background thread. Control side.
//!
//! One build runs at a time; of further requests only the last is kept and starts when the running build ends.

use std::sync::Arc;
use std::thread::{self, JoinHandle};

use crate::error::{Error, Result};
use crate::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh};

/// Input of a build.
struct Request {
    mesh: TriangleMesh,
    materials: MaterialTable,
    settings: SceneSettings,
}

/// A running build.
struct Build {
    thread: JoinHandle<Result<Scene>>,
    is_current: bool,
}

/// The running build and the next request.
#[derive(Default)]
pub(super) struct SceneBuilder {
    build: Option<Build>,
    waiting: Option<Request>,
}

impl SceneBuilder {
    /// Starts a build, or queues it behind the running one and discards the running one's result.
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
            is_current: true,
        });
        Ok(())
    }

    pub(super) fn is_building(&self) -> bool {
        self.waiting.is_some() || self.build.as_ref().is_some_and(|build| build.is_current)
    }

    /// Discards the running build's result and the next request.
    pub(super) fn cancel(&mut self) {
        self.waiting = None;
        if let Some(build) = &mut self.build {
            build.is_current = false;
        }
    }

    /// The result, once available.
    pub(super) fn poll(&mut self) -> Option<Result<Arc<Scene>>> {
        let build = self.build.take_if(|build| build.thread.is_finished())?;
        let result = build.thread.join();
        if let Some(request) = self.waiting.take() {
            return self.spawn(request).err().map(Err);
        }
        if !build.is_current {
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
