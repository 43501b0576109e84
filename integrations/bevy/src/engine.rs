//! The engine as a resource.

use std::collections::{BTreeMap, BTreeSet};

use bevy_ecs::prelude::*;
use bevy_platform::cell::SyncCell;
use foresound::diagnostics::SnapshotPath;
use foresound::{Controller, ListenerPose, SourceId, SourcePose};

use crate::coordinates;
use crate::geometry::{FixedScene, Part};
use crate::sources::Voice;

/// The app's half of the engine. Systems of the plugin feed it in `PostUpdate`, after transforms have been propagated.
#[derive(Resource)]
pub struct Foresound {
    controller: SyncCell<Controller>,
    pub(crate) fixed: FixedScene,
    pub(crate) parts: BTreeMap<Entity, Part>,
    pub(crate) voices: BTreeMap<Entity, Voice>,
    pub(crate) problems: Problems,
    /// Of the newest frame.
    pub(crate) listener: ListenerPose,
    pub(crate) poses: Vec<SourcePose>,
    paths: Vec<SnapshotPath>,
}

impl Foresound {
    pub(crate) fn new(controller: Controller) -> Self {
        Self {
            controller: SyncCell::new(controller),
            fixed: FixedScene::default(),
            parts: BTreeMap::new(),
            voices: BTreeMap::new(),
            problems: Problems::default(),
            listener: ListenerPose::default(),
            poses: Vec::new(),
            paths: Vec::new(),
        }
    }

    /// The library's own interface, for what no component has: budget, layout, streams, one-shots, statistics. The plugin calls
    /// `tick`, and adds and removes its own sources and instances.
    pub fn controller(&mut self) -> &mut Controller {
        self.controller.get()
    }

    /// The engine's source of an entity, once the entity was seen.
    pub fn source(&self, entity: Entity) -> Option<SourceId> {
        self.voices.get(&entity).map(|voice| voice.id)
    }

    /// Builds the fixed scene anew with the present transforms. Not needed when meshes or materials change.
    pub fn rebuild(&mut self) {
        self.fixed.is_stale = true;
    }

    /// Whether all geometry and all instances that the app has are in the engine's scene.
    pub fn is_ready(&mut self) -> bool {
        let is_building = self.controller.get().is_building();
        let waits = self.parts.values().any(Part::is_pending);
        !(self.fixed.is_stale || is_building || waits)
    }

    /// What went wrong so far, each message once. The same is in the log.
    pub fn problems(&self) -> impl Iterator<Item = &str> {
        self.problems.0.iter().map(String::as_str)
    }

    /// The loudest paths of the newest update, for drawing; none unless `EngineSettings::max_snapshot_paths` is set.
    pub fn paths(&mut self) -> impl Iterator<Item = DrawnPath<'_>> {
        let newest = self.controller.get().path_snapshot();
        self.paths.clear();
        self.paths.extend_from_slice(newest);
        self.paths.iter().map(|path| DrawnPath { path })
    }
}

/// A path in Bevy's coordinates.
pub struct DrawnPath<'a> {
    path: &'a SnapshotPath,
}

impl DrawnPath<'_> {
    /// Corners from the source to the listener, in metres.
    pub fn corners(&self) -> impl Iterator<Item = [f32; 3]> {
        self.path
            .corners()
            .iter()
            .map(|corner| coordinates::to_bevy(*corner))
    }

    /// The library's path: its source, orders and level.
    pub fn path(&self) -> &SnapshotPath {
        self.path
    }
}

/// Messages, each of which is logged once: a wrong value stays wrong in every frame.
#[derive(Default)]
pub(crate) struct Problems(BTreeSet<String>);

/// Most messages that are kept.
const MOST_PROBLEMS: usize = 256;

impl Problems {
    pub(crate) fn report(
        &mut self,
        about: impl std::fmt::Display,
        problem: impl std::fmt::Display,
    ) {
        let text = format!("{about}: {problem}");
        if self.0.len() < MOST_PROBLEMS && !self.0.contains(&text) {
            log::warn!("Foresound: {text}");
            self.0.insert(text);
        }
    }
}
