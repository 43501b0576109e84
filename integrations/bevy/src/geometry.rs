//! Meshes below [`ForesoundGeometry`] and [`ForesoundInstance`]: which they are, when they changed, and how they get into the
//! engine's scene.

use std::sync::Arc;

use bevy_asset::{AssetEvent, AssetId, Assets};
use bevy_ecs::prelude::*;
use bevy_ecs::system::SystemParam;
use bevy_mesh::{Mesh, Mesh3d};
use bevy_tasks::futures::check_ready;
use bevy_tasks::{AsyncComputeTaskPool, Task, TaskPool};
use bevy_transform::components::GlobalTransform;
use foresound::glam::DAffine3;
use foresound::{InstanceId, InstancePose, MaterialTable, Scene, SceneSettings, TriangleMesh};

use crate::assets::MaterialFile;
use crate::components::{ForesoundGeometry, ForesoundInstance, ForesoundMaterial};
use crate::coordinates;
use crate::engine::{Foresound, Problems};
use crate::mesh::triangles;

/// Settings of every commit.
#[derive(Resource, Clone, Copy)]
pub(crate) struct Commit(pub(crate) SceneSettings);

/// A mesh of a body.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Piece {
    entity: Entity,
    mesh: AssetId<Mesh>,
    material: Option<ForesoundMaterial>,
}

/// The fixed scene.
#[derive(Default)]
pub(crate) struct FixedScene {
    /// What the engine has, or is building.
    pieces: Vec<Piece>,
    /// Whether it is to be built anew, as soon as all meshes are loaded.
    pub(crate) is_stale: bool,
    is_building: bool,
}

/// An instance.
pub(crate) struct Part {
    pieces: Vec<Piece>,
    is_stale: bool,
    task: Option<Task<foresound::Result<Scene>>>,
    id: Option<InstanceId>,
}

impl Part {
    fn new() -> Self {
        Self {
            pieces: Vec::new(),
            is_stale: true,
            task: None,
            id: None,
        }
    }

    pub(crate) fn is_pending(&self) -> bool {
        self.is_stale || self.task.is_some()
    }
}

type Body<'a> = (
    Option<&'a Mesh3d>,
    Option<&'a ForesoundMaterial>,
    Option<&'a Children>,
    Option<&'a GlobalTransform>,
);
type IsRoot = Or<(With<ForesoundGeometry>, With<ForesoundInstance>)>;
type IsNew = Or<(
    Changed<Mesh3d>,
    Changed<ForesoundMaterial>,
    Changed<Children>,
    Added<ForesoundGeometry>,
    Added<ForesoundInstance>,
)>;

/// The world's meshes.
#[derive(SystemParam)]
pub(crate) struct WorldMeshes<'w, 's> {
    bodies: Query<'w, 's, Body<'static>>,
    roots: Query<'w, 's, (), IsRoot>,
    meshes: Res<'w, Assets<Mesh>>,
    files: Res<'w, Assets<MaterialFile>>,
}

impl WorldMeshes<'_, '_> {
    /// The meshes at and below a root that belong to no root further down, in the order of the hierarchy.
    fn add_pieces(&self, root: Entity, pieces: &mut Vec<Piece>) {
        let mut stack = vec![(root, None)];
        while let Some((entity, material)) = stack.pop() {
            let Ok((mesh, own, children, _)) = self.bodies.get(entity) else {
                continue;
            };
            let material = own.or(material);
            if let Some(mesh) = mesh {
                pieces.push(Piece {
                    entity,
                    mesh: mesh.id(),
                    material: material.cloned(),
                });
            }
            let children = children.into_iter().flatten().copied();
            let own = children.filter(|child| !self.roots.contains(*child));
            stack.extend(
                own.map(|child| (child, material))
                    .collect::<Vec<_>>()
                    .into_iter()
                    .rev(),
            );
        }
    }

    fn are_loaded(&self, pieces: &[Piece]) -> bool {
        pieces.iter().all(|piece| {
            let file = piece.material.as_ref().and_then(|own| own.file.as_ref());
            self.meshes.contains(piece.mesh) && file.is_none_or(|file| self.files.contains(file))
        })
    }

    fn transform(&self, entity: Entity) -> GlobalTransform {
        let body = self.bodies.get(entity).ok();
        body.and_then(|body| body.3).copied().unwrap_or_default()
    }

    /// One mesh of all pieces, and the materials that they name.
    fn joined(
        &self,
        pieces: &[Piece],
        placement: impl Fn(&GlobalTransform) -> DAffine3,
        problems: &mut Problems,
    ) -> (TriangleMesh, MaterialTable) {
        let mut joined = TriangleMesh::default();
        let mut table = MaterialTable::built_in();
        for piece in pieces {
            let material = piece.material.as_ref();
            let file = material.and_then(|own| own.file.as_ref());
            if let Some(file) = file.and_then(|file| self.files.get(file)) {
                table.extend(file.0.clone());
            }
            let name = material.map_or("generic", |own| own.name.as_str());
            let Some(mesh) = self.meshes.get(piece.mesh) else {
                continue;
            };
            let placement = placement(&self.transform(piece.entity));
            let added = triangles(mesh, name)
                .map_err(|error| error.to_string())
                .and_then(|mesh| {
                    let added = joined.append(&mesh, &placement);
                    added.map_err(|error| error.to_string())
                });
            if let Err(problem) = added {
                problems.report(format_args!("entity {}", piece.entity), problem);
            }
        }
        (joined, table)
    }
}

/// Whether any of the world's roots may have other meshes than before.
#[derive(SystemParam)]
pub(crate) struct Changes<'w, 's> {
    new: Query<'w, 's, Entity, IsNew>,
    meshes_gone: RemovedComponents<'w, 's, Mesh3d>,
    materials_gone: RemovedComponents<'w, 's, ForesoundMaterial>,
    children_gone: RemovedComponents<'w, 's, Children>,
    geometry_gone: RemovedComponents<'w, 's, ForesoundGeometry>,
    instances_gone: RemovedComponents<'w, 's, ForesoundInstance>,
}

impl Changes<'_, '_> {
    fn any(&mut self) -> bool {
        let gone = self.meshes_gone.read().count()
            + self.materials_gone.read().count()
            + self.children_gone.read().count()
            + self.geometry_gone.read().count()
            + self.instances_gone.read().count();
        gone > 0 || !self.new.is_empty()
    }

    /// Whether a mesh itself changed, such as when its asset was reloaded.
    fn touch(&self, pieces: &[Piece]) -> bool {
        pieces.iter().any(|piece| self.new.contains(piece.entity))
    }
}

/// Finds out what changed.
pub(crate) fn watch(
    mut engine: ResMut<Foresound>,
    world: WorldMeshes,
    mut changes: Changes,
    fixed: Query<Entity, (With<ForesoundGeometry>, Without<ForesoundInstance>)>,
    moving: Query<Entity, With<ForesoundInstance>>,
) {
    if !changes.any() {
        return;
    }
    let Foresound {
        fixed: scene,
        parts,
        ..
    } = &mut *engine;
    let mut pieces = Vec::new();
    // Entities are not stored in the order in which they were made.
    let mut roots: Vec<Entity> = fixed.iter().collect();
    roots.sort_unstable();
    for root in roots {
        world.add_pieces(root, &mut pieces);
    }
    if pieces != scene.pieces || changes.touch(&pieces) {
        scene.pieces = pieces;
        scene.is_stale = true;
    }
    for root in &moving {
        let part = parts.entry(root).or_insert_with(Part::new);
        let mut pieces = Vec::new();
        world.add_pieces(root, &mut pieces);
        if pieces != part.pieces || changes.touch(&pieces) {
            part.pieces = pieces;
            part.is_stale = true;
        }
    }
}

/// Builds the fixed scene on a thread of the library once all its meshes are there.
pub(crate) fn build(mut engine: ResMut<Foresound>, world: WorldMeshes, commit: Res<Commit>) {
    let engine = &mut *engine;
    if engine.fixed.is_stale && world.are_loaded(&engine.fixed.pieces) {
        engine.fixed.is_stale = false;
        let pieces = std::mem::take(&mut engine.fixed.pieces);
        let (mesh, table) = world.joined(&pieces, coordinates::affine, &mut engine.problems);
        engine.fixed.pieces = pieces;
        let built = match mesh.triangles.is_empty() {
            true => {
                let empty = open_air(&commit.0);
                empty.and_then(|scene| engine.controller().set_scene(Arc::new(scene)))
            }
            false => engine.controller().build_scene(mesh, table, commit.0),
        };
        engine.fixed.is_building = built.is_ok();
        if let Err(error) = built {
            engine.problems.report("geometry", error);
        }
    }
    if engine.fixed.is_building && !engine.controller().is_building() {
        engine.fixed.is_building = false;
        let unknown = engine.controller().scene().defaulted_materials().to_vec();
        for name in unknown {
            let problem = "no such material: it is `generic` now; give a MaterialFile that has it";
            engine
                .problems
                .report(format_args!("material `{name}`"), problem);
        }
    }
}

/// A scene without walls, as an engine begins with: one triangle of 50 cm² out of reach.
fn open_air(settings: &SceneSettings) -> foresound::Result<Scene> {
    let far_m = -5e4;
    let corners = [[0.0, far_m, 0.0], [0.1, far_m, 0.0], [0.0, far_m, 0.1]];
    let mesh = TriangleMesh::from_slices(&corners, &[0, 1, 2], &["generic"], &[0])?;
    Scene::commit(&mesh, &MaterialTable::built_in(), settings)
}

/// Builds, adds, moves and removes instances.
pub(crate) fn move_parts(
    mut engine: ResMut<Foresound>,
    world: WorldMeshes,
    commit: Res<Commit>,
    moving: Query<(Entity, Ref<GlobalTransform>), With<ForesoundInstance>>,
) {
    let engine = &mut *engine;
    let gone: Vec<Entity> = engine
        .parts
        .keys()
        .filter(|root| !moving.contains(**root))
        .copied()
        .collect();
    for root in gone {
        let id = engine.parts.remove(&root).and_then(|part| part.id);
        if let Some(Err(error)) = id.map(|id| engine.controller().remove_instance(id)) {
            engine.problems.report(format_args!("entity {root}"), error);
        }
    }
    for (root, transform) in &moving {
        let Some(mut part) = engine.parts.remove(&root) else {
            continue;
        };
        if part.is_stale && world.are_loaded(&part.pieces) {
            part.is_stale = false;
            let placement = |member: &GlobalTransform| coordinates::in_body(&transform, member);
            let (mesh, table) = world.joined(&part.pieces, placement, &mut engine.problems);
            let settings = commit.0;
            let pool = AsyncComputeTaskPool::get_or_init(TaskPool::default);
            part.task = Some(pool.spawn(async move { Scene::commit(&mesh, &table, &settings) }));
        }
        let placed = place(engine, &mut part, &transform);
        if let Err(error) = placed {
            engine.problems.report(format_args!("entity {root}"), error);
        }
        engine.parts.insert(root, part);
    }
}

fn place(
    engine: &mut Foresound,
    part: &mut Part,
    transform: &Ref<GlobalTransform>,
) -> foresound::Result<()> {
    let at = coordinates::pose(transform);
    let mut pose = InstancePose::at(InstanceId::default(), at.position.as_dvec3());
    pose.rotation = at.orientation;
    if let Some(scene) = part.task.as_mut().and_then(check_ready) {
        part.task = None;
        if let Some(old) = part.id.take() {
            engine.controller().remove_instance(old)?;
        }
        part.id = Some(engine.controller().add_instance(Arc::new(scene?), &pose)?);
    } else if let Some(id) = part.id.filter(|_| transform.is_changed()) {
        pose.id = id;
        engine.controller().set_instance_pose(&pose)?;
    }
    Ok(())
}

/// Materials whose file was reloaded change while sound runs.
pub(crate) fn reload_materials(
    mut engine: ResMut<Foresound>,
    mut events: MessageReader<AssetEvent<MaterialFile>>,
    files: Res<Assets<MaterialFile>>,
) {
    for event in events.read() {
        let AssetEvent::Modified { id } = event else {
            continue;
        };
        let Some(file) = files.get(*id) else { continue };
        for entry in file.0.entries() {
            // A name that no surface has is refused, and changes nothing.
            let _ = engine.controller().set_material(&entry.material);
        }
    }
}
