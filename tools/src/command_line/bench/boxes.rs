//! Instances that all move: a door, or boxes, in a scene's open space.
//!
//! Every instance turns and slides to and fro about its position in every update.

use std::sync::Arc;

use foresound::propagation::Propagator;
use foresound::scene::{
    InstanceId, InstancePose, MaterialTable, Scene, SceneSettings, SourcePose, procedural,
};
use foresound::{Error, Result};
use glam::{DVec3, Quat, Vec3};

use super::sources::sources;
use super::walk::Walk;

/// Seconds between two updates.
const UPDATE_S: f32 = 0.05;

/// Size of a door, and of the boxes that more than one instance are, in metres.
const DOOR_M: Vec3 = Vec3::new(0.9, 2.1, 0.05);
const BOX_M: Vec3 = Vec3::new(0.8, 0.9, 0.6);

/// Nearest that an instance comes to a source at first, in metres.
const CLEARANCE_M: f32 = 1.5;

/// The instances of one propagator.
pub(super) struct Boxes {
    instances: Vec<(InstanceId, Vec3)>,
    poses: Vec<InstancePose>,
}

impl Boxes {
    /// Adds `count` instances to a propagator's scene, away from the sources.
    pub(super) fn add(
        to: &mut Propagator,
        walk: &Walk,
        sources: &[SourcePose],
        count: usize,
    ) -> Result<Self> {
        let mut result = Self {
            instances: Vec::with_capacity(count),
            poses: Vec::with_capacity(count),
        };
        if count == 0 {
            return Ok(result);
        }
        let size = if count == 1 { DOOR_M } else { BOX_M };
        let mesh = procedural::shoebox(size, "wood");
        let part = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())?;
        let part = Arc::new(part);
        for position in positions(walk, sources, count)? {
            let at = InstancePose::at(InstanceId::default(), position.as_dvec3());
            let id = to.scene_mut().add_instance(Arc::clone(&part), &at)?;
            result.instances.push((id, position));
        }
        Ok(result)
    }

    /// Sets all poses of an update.
    pub(super) fn move_on(&mut self, of: &mut Propagator, step: usize) {
        if self.instances.is_empty() {
            return;
        }
        self.poses.clear();
        let time_s = step as f32 * UPDATE_S;
        let instances = self.instances.iter().zip(0..);
        self.poses
            .extend(instances.map(|((id, position), number)| pose(*id, *position, number, time_s)));
        of.scene_mut().set_instance_poses(&self.poses);
    }
}

/// Open positions away from the sources.
fn positions(walk: &Walk, poses: &[SourcePose], count: usize) -> Result<Vec<Vec3>> {
    let own: Vec<_> = walk.benchmark.sources.iter().map(|(_, at)| *at).collect();
    let open = sources(&walk.scene, &own, 2 * own.len() + 4 * count);
    let clear = |position: &Vec3| {
        let mut away = poses.iter().map(|pose| pose.position.distance(*position));
        away.all(|m| m > CLEARANCE_M)
    };
    let found: Vec<Vec3> = open
        .iter()
        .map(|pose| pose.position)
        .filter(clear)
        .take(count)
        .collect();
    if found.len() < count {
        let problem = format!("{count} do not fit into the scene's open space");
        return Err(Error::setting("--instances", problem, "choose fewer"));
    }
    Ok(found)
}

/// An instance at a time: it turns about the vertical through its corner and slides half a metre to and fro.
fn pose(id: InstanceId, position: Vec3, number: usize, time_s: f32) -> InstancePose {
    let phase = time_s + number as f32;
    InstancePose {
        id,
        position: position.as_dvec3() + DVec3::X * f64::from(0.5 * phase.sin()),
        rotation: Quat::from_rotation_y(0.7 * phase),
    }
}
