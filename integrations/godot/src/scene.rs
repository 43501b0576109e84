//! Geometry and instance nodes as scenes of the engine. Meshes are read on the main thread and committed on others.

use std::collections::BTreeMap;
use std::sync::{Arc, mpsc};

use foresound::glam::DAffine3;
use foresound::{
    Controller, InstanceId as PartId, InstancePose, MaterialTable, Scene, SceneSettings,
    TriangleMesh,
};
use godot::classes::{MeshInstance3D, Node3D};
use godot::obj::InstanceId;
use godot::prelude::*;

use crate::coordinates::{Pose, affine, in_body, point};
use crate::engine::Problems;
use crate::material::material;
use crate::mesh;
use crate::nodes::{ForesoundGeometry, ForesoundInstance, ForesoundMaterial};

/// What goes into a commit.
#[derive(Default)]
struct Parts {
    mesh: TriangleMesh,
    table: Option<MaterialTable>,
}

impl Parts {
    /// Adds the meshes at and below a root.
    fn add(
        &mut self,
        root: Gd<Node>,
        material: Option<Gd<ForesoundMaterial>>,
        placement: impl Fn(&Transform3D) -> DAffine3,
    ) -> Result<(), String> {
        let name = self.name_of(material)?;
        let mut stack = vec![root];
        while let Some(node) = stack.pop() {
            if let Ok(body) = node.clone().try_cast::<MeshInstance3D>()
                && let Some(shape) = body.get_mesh()
            {
                let faces = shape.get_faces();
                let corners = faces.as_slice().iter().map(|&corner| point(corner));
                let placement = placement(&body.get_global_transform());
                mesh::append(&mut self.mesh, corners, &name, &placement)
                    .map_err(|error| format!("{}: {error}", node.get_name()))?;
            }
            let children = node.get_children();
            // In the order of the tree.
            stack.extend(
                children
                    .iter_shared()
                    .filter(is_plain)
                    .collect::<Vec<_>>()
                    .into_iter()
                    .rev(),
            );
        }
        Ok(())
    }

    /// The name of a material, which the table has from now on.
    fn name_of(&mut self, resource: Option<Gd<ForesoundMaterial>>) -> Result<String, String> {
        let table = self.table.get_or_insert_with(MaterialTable::built_in);
        let Some(resource) = resource else {
            return Ok("generic".into());
        };
        let own = resource.bind();
        let library_name = own.library_name.to_string();
        if !library_name.is_empty() {
            if table.get(&library_name).is_none() {
                return Err(format!("the library has no material `{library_name}`"));
            }
            return Ok(library_name);
        }
        let name = format!("material {}", resource.instance_id().to_i64());
        let values = material(
            name.clone(),
            own.absorption.as_slice(),
            own.scattering.as_slice(),
            own.transmission.as_slice(),
        )?;
        table.extend(MaterialTable::from_materials(vec![values]));
        Ok(name)
    }

    fn table(&mut self) -> MaterialTable {
        self.table.take().unwrap_or_else(MaterialTable::built_in)
    }
}

/// Whether a node belongs to the root above it, and is no root itself.
fn is_plain(node: &Gd<Node>) -> bool {
    let is_geometry = node.clone().try_cast::<ForesoundGeometry>().is_ok();
    !is_geometry && node.clone().try_cast::<ForesoundInstance>().is_err()
}

/// An instance of the engine.
struct Part {
    building: Option<mpsc::Receiver<foresound::Result<Scene>>>,
    id: Option<PartId>,
    pose: Pose,
}

/// The fixed scene and the instances.
#[derive(Default)]
pub(crate) struct Scenes {
    /// Nodes of the scene that the engine has or is building; `None` asks for a new one.
    fixed: Option<Vec<InstanceId>>,
    parts: BTreeMap<InstanceId, Part>,
}

impl Scenes {
    /// Builds the fixed scene anew with the next frame.
    pub(crate) fn rebuild(&mut self) {
        self.fixed = None;
    }

    /// Builds the fixed scene when its nodes are others than before.
    pub(crate) fn update_fixed(
        &mut self,
        nodes: &[Gd<ForesoundGeometry>],
        controller: &mut Controller,
        problems: &mut Problems,
    ) {
        let ids: Vec<InstanceId> = nodes.iter().map(Gd::instance_id).collect();
        if self.fixed.as_ref() == Some(&ids) {
            return;
        }
        self.fixed = Some(ids);
        let mut parts = Parts::default();
        for node in nodes {
            let material = node.bind().material.clone();
            if let Err(problem) = parts.add(node.clone().upcast(), material, affine) {
                problems.report(&node.get_name().to_string(), &problem);
            }
        }
        let table = parts.table();
        if parts.mesh.triangles.is_empty() {
            // Out of reach: an engine has a scene of at least one triangle.
            let far_m = -5e4;
            let corners = [[0.0, far_m, 0.0], [0.1, far_m, 0.0], [0.0, far_m, 0.1]];
            parts.mesh =
                TriangleMesh::from_slices(&corners, &[0, 1, 2], &[], &[]).unwrap_or_default();
        }
        let built = controller.build_scene(parts.mesh, table, SceneSettings::default());
        if let Err(error) = built {
            problems.report("geometry", &error);
        }
    }

    /// Builds, adds, moves and removes instances.
    pub(crate) fn update_parts(
        &mut self,
        nodes: &[(Gd<ForesoundInstance>, Pose)],
        controller: &mut Controller,
        problems: &mut Problems,
    ) {
        let is_there = |id: &InstanceId| nodes.iter().any(|(node, _)| node.instance_id() == *id);
        self.parts.retain(|id, part| {
            let stays = is_there(id);
            if !stays && let Some(Err(error)) = part.id.map(|id| controller.remove_instance(id)) {
                problems.report("an instance", &error);
            }
            stays
        });
        for (node, pose) in nodes {
            let result = self.update_part(node, pose, controller);
            if let Err(problem) = result {
                problems.report(&node.get_name().to_string(), &problem);
            }
        }
    }

    fn update_part(
        &mut self,
        node: &Gd<ForesoundInstance>,
        pose: &Pose,
        controller: &mut Controller,
    ) -> Result<(), String> {
        let key = node.instance_id();
        let told = |error: foresound::Error| error.to_string();
        let Some(part) = self.parts.get_mut(&key) else {
            let building = commit(node, pose);
            let (building, problem) = match building {
                Ok(building) => (Some(building), Ok(())),
                Err(problem) => (None, Err(problem)),
            };
            let part = Part {
                building,
                id: None,
                pose: *pose,
            };
            self.parts.insert(key, part);
            return problem;
        };
        let mut placed = InstancePose::at(PartId::default(), pose.position.as_dvec3());
        placed.rotation = pose.orientation;
        let built = part
            .building
            .as_ref()
            .and_then(|scene| scene.try_recv().ok());
        if let Some(scene) = built {
            part.building = None;
            let scene = Arc::new(scene.map_err(told)?);
            part.id = Some(controller.add_instance(scene, &placed).map_err(told)?);
            part.pose = *pose;
        } else if let Some(id) = part.id.filter(|_| part.pose != *pose) {
            placed.id = id;
            part.pose = *pose;
            controller.set_instance_pose(&placed).map_err(told)?;
        }
        Ok(())
    }
}

/// Commits a part on a thread of its own.
fn commit(
    node: &Gd<ForesoundInstance>,
    pose: &Pose,
) -> Result<mpsc::Receiver<foresound::Result<Scene>>, String> {
    let mut parts = Parts::default();
    let material = node.bind().material.clone();
    let local = |member: &Transform3D| in_body(pose, member);
    parts.add(node.clone().upcast(), material, local)?;
    let table = parts.table();
    let (sender, receiver) = mpsc::channel();
    std::thread::Builder::new()
        .name("foresound-part".into())
        .spawn(move || {
            let scene = Scene::commit(&parts.mesh, &table, &SceneSettings::default());
            // The node may be gone.
            let _ = sender.send(scene);
        })
        .map_err(|error| format!("no thread: {error}"))?;
    Ok(receiver)
}

/// The poses of nodes that have one; the others are reported.
pub(crate) fn posed<T: Inherits<Node3D> + GodotClass>(
    nodes: Vec<Gd<T>>,
    problems: &mut Problems,
) -> Vec<(Gd<T>, Pose)> {
    let mut posed = Vec::with_capacity(nodes.len());
    for node in nodes {
        let body = node.clone().upcast::<Node3D>();
        match crate::coordinates::pose(&body.get_global_transform()) {
            Some(pose) => posed.push((node, pose)),
            None => problems.report(
                &body.get_name().to_string(),
                &"its transform has no volume, or a NaN",
            ),
        }
    }
    posed
}
