//! Rigid parts that move: doors, lifts, vehicles. Each is a separately committed [`Scene`] at a pose.
//!
//! Adding and removing is control side and allocates; moving ([`Scene::set_instance_poses`]) allocates nothing and is
//! allowed on the audio side. A query traverses a tree over the instances' boxes, rebuilt after a move, and then the
//! part's BVH with the ray in the part's coordinates. The keys of surfaces do not depend on the pose: a path at a moving
//! door keeps its identity. Own.
//!
//! A part that moves is not joined with the scene: a door that touches its frame shares no edge or surface with it. Free
//! edges of its panels, free ends of edges and visibility among its edges were found at its commit, without the scene;
//! diffraction over edges of two bodies is searched at their current poses. Parts that do not move may be joined with each
//! other and with the fixed part (`joined`).

mod changes;
mod continued;
mod continued_queries;
mod edge_queries;
mod joined;
mod joint;
mod materials;
mod numbering;
mod placed;
mod pose;
mod queries;

use std::sync::Arc;

use glam::DVec3;

use super::Scene;
use crate::acoustics::Material;
use crate::error::{Error, Result};
use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Aabb, AabbTree, Hit, Ray};
use crate::scene::edges::MOST_MIRRORS;
use crate::scene::surface::Surface;
use continued::ContinuedSurfaces;
use joined::common::CommonSurfaces;
use materials::InstanceMaterials;
use numbering::FIXED;
use placed::PlacedInstance;

pub use crate::scene::committed::instances::changes::{SceneChange, SceneSnapshot};
pub use crate::scene::committed::instances::numbering::{MOST_IN_A_PART, MOST_INSTANCES};
pub use pose::{InstanceId, InstancePose};

#[derive(Debug, Clone, Default)]
struct Slot {
    generation: u16,
    placed: Option<PlacedInstance>,
}

/// All instances of a scene.
#[derive(Debug, Clone, Default)]
pub(super) struct Instances {
    slots: Vec<Slot>,
    count: usize,
    /// Those of them that are joined.
    joined: usize,
    /// Materials that the fixed scene does not have.
    materials: InstanceMaterials,
    tree: AabbTree,
    /// One per slot.
    boxes: Vec<Aabb>,
    /// The largest surfaces of fixed scene and instances, largest first.
    large: Vec<u32>,
    /// Surfaces of joined parts.
    common: Arc<CommonSurfaces>,
    /// The fixed part, while others are joined with it.
    fixed: Option<PlacedInstance>,
    /// Of the largest surfaces those that go on in each other: the fixed part's and the joined parts'.
    continued: ContinuedSurfaces,
}

impl Instances {
    /// Whether an instance has a material of its own of this name.
    pub(super) fn has_material(&self, name: &str) -> bool {
        self.materials.has(name)
    }

    /// Replaces the instances' own materials of a name.
    pub(super) fn replace_material(&mut self, material: &Material) {
        self.materials.replace(material);
    }

    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        self.count == 0
    }

    fn large_surfaces(&self) -> &[u32] {
        &self.large
    }

    fn placed(&self) -> impl Iterator<Item = &PlacedInstance> {
        self.slots.iter().filter_map(|slot| slot.placed.as_ref())
    }

    #[inline]
    fn at(&self, slot: usize) -> Option<&PlacedInstance> {
        match self.slots.get(slot) {
            Some(slot) => slot.placed.as_ref(),
            None if slot == FIXED => self.fixed.as_ref(),
            None => None,
        }
    }

    fn at_mut(&mut self, slot: usize) -> Option<&mut PlacedInstance> {
        match self.slots.get_mut(slot) {
            Some(slot) => slot.placed.as_mut(),
            None if slot == FIXED => self.fixed.as_mut(),
            None => None,
        }
    }

    /// The instance that a number belongs to, and its index there.
    #[inline]
    fn of(&self, global: u32) -> Option<(&PlacedInstance, u32)> {
        let (slot, local) = numbering::split(global);
        let placed = self.at(slot).filter(|_| numbering::is_instance(global));
        Some((placed?, local))
    }

    #[inline]
    fn surface(&self, global: u32) -> Option<&Surface> {
        match self.of(global) {
            Some((placed, local)) => placed.surfaces.get(local as usize),
            None if numbering::is_instance(global) => self.common.surface(global),
            None => self.fixed.as_ref()?.surfaces.get(global as usize),
        }
    }

    /// The groups that a ray ignores, by a part's numbers.
    #[inline]
    fn part_groups(&self, placed: &PlacedInstance, ignored: [u32; 2]) -> [u32; 2] {
        ignored.map(|group| match numbering::as_common(group) {
            None => placed.part_group(group),
            Some(_) => {
                let member = self.member(group, placed.pose.id.slot());
                member.map_or(NO_GROUP, |member| member.local)
            }
        })
    }

    fn slot_of(&mut self, id: InstanceId) -> Result<&mut Slot> {
        let slot = self.slots.get_mut(id.slot());
        slot.filter(|slot| slot.generation == id.generation() && slot.placed.is_some())
            .ok_or(Error::StaleInstance {
                slot: id.slot(),
                generation: id.generation(),
            })
    }

    /// Rebuilds the tree.
    fn rebuild_tree(&mut self) {
        self.boxes.clear();
        let bounds = |slot: &Slot| slot.placed.as_ref().map_or(Aabb::EMPTY, |p| p.bounds);
        self.boxes.extend(self.slots.iter().map(bounds));
        self.tree.build(&self.boxes);
    }

    #[inline(never)]
    fn closest_hit(&self, ray: &Ray, ignored: [u32; 2], found: Option<Hit>) -> Option<Hit> {
        self.closest_hit_of(ray, ignored, found, |_| true)
    }

    #[inline(never)]
    fn closest_joined_hit(&self, ray: &Ray, ignored: [u32; 2], found: Option<Hit>) -> Option<Hit> {
        self.closest_hit_of(ray, ignored, found, |placed| placed.joint.is_some())
    }

    #[inline(always)]
    fn closest_hit_of(
        &self,
        ray: &Ray,
        ignored: [u32; 2],
        found: Option<Hit>,
        counts: impl Fn(&PlacedInstance) -> bool,
    ) -> Option<Hit> {
        let mut best = found;
        // A hit at the same parameter counts if its index is lower.
        let up_to = |best: Option<Hit>| best.map_or(ray.t_max, |hit| hit.t.next_up());
        let short = Ray {
            t_max: up_to(best),
            ..*ray
        };
        self.tree.traverse(&short, |slot, t_max| {
            let Some(placed) = self.at(slot as usize).filter(|placed| counts(placed)) else {
                return t_max;
            };
            let local = Ray {
                t_max,
                ..placed.ray(ray)
            };
            if let Some(hit) = placed
                .part
                .bvh()
                .closest_hit(&local, self.part_groups(placed, ignored))
            {
                let hit = Hit {
                    t: hit.t,
                    triangle: placed.scene_index(hit.triangle),
                    group: placed.surface_number(hit.group),
                };
                if best.is_none_or(|b| (hit.t, hit.triangle) < (b.t, b.triangle)) {
                    best = Some(hit);
                }
            }
            up_to(best)
        });
        best
    }

    #[inline(never)]
    fn blocker(&self, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
        self.blocker_of(ray, ignored, |_| true)
    }

    #[inline(never)]
    fn joined_blocker(&self, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
        self.blocker_of(ray, ignored, |placed| placed.joint.is_some())
    }

    #[inline(always)]
    fn blocker_of(
        &self,
        ray: &Ray,
        ignored: [u32; 2],
        counts: impl Fn(&PlacedInstance) -> bool,
    ) -> Option<u32> {
        let mut met = None;
        self.tree.traverse(ray, |slot, t_max| {
            let placed = self.at(slot as usize).filter(|placed| counts(placed));
            met = placed.and_then(|placed| {
                let part_groups = self.part_groups(placed, ignored);
                let found = placed.part.bvh().occluder(&placed.ray(ray), part_groups)?;
                Some(placed.scene_index(found))
            });
            if met.is_some() { -1.0 } else { t_max }
        });
        met
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let placed: usize = self.placed().map(PlacedInstance::memory_bytes).sum();
        let fixed = self.fixed.as_ref().map_or(0, PlacedInstance::memory_bytes);
        placed
            + fixed
            + self.tree.memory_bytes()
            + size_of_val(self.boxes.as_slice())
            + size_of_val(self.large.as_slice())
            + self.common.memory_bytes()
            + self.continued.memory_bytes()
    }
}

impl Scene {
    /// Adds an instance of a part: a separately committed scene in local coordinates. The pose's handle is
    /// ignored; the instance's is returned. Parts may be shared by any number of instances. Control side; allocates.
    ///
    /// # Errors
    /// [`Error::Setting`] for a pose that is not rigid, a part with instances of its own or of more than
    /// `MOST_IN_A_PART` triangles or edges, and beyond `MOST_INSTANCES`.
    pub fn add_instance(&mut self, part: Arc<Scene>, pose: &InstancePose) -> Result<InstanceId> {
        let id = self.insert(part, pose)?;
        self.instances.rebuild_tree();
        self.rank_surfaces();
        Ok(id)
    }

    /// Adds an instance that stays where it is and is joined with the fixed scene and with all such instances that it touches, as
    /// if they had been committed in one piece: surfaces of instances in one plane and of one material are one surface, a rim at
    /// which another part goes on is no edge, and a wall on another part's floor is a wedge. For chunks of a streamed world, tiles and prefabs. Numbers and keys of
    /// everything beyond the part's bounds stay. Control side; allocates, in proportion to the part and its borders.
    ///
    /// The fixed scene's surfaces keep numbers and keys of their own. Instances that move are not
    /// joined. The instance is removed by [`Self::remove_instance`]; its pose cannot be changed.
    ///
    /// # Errors
    /// As [`Self::add_instance`].
    ///
    /// # Examples
    /// ```
    /// use std::sync::Arc;
    /// use foresound::{InstanceId, InstancePose, MaterialTable, Scene, SceneSettings, TriangleMesh, shoebox};
    ///
    /// let commit = |mesh: &TriangleMesh| Scene::commit(mesh, &MaterialTable::built_in(), &SceneSettings::default());
    /// let corners = [[0.0, 0.0, 0.0], [0.0, 0.0, 8.0], [8.0, 0.0, 8.0], [8.0, 0.0, 0.0]];
    /// let tile = TriangleMesh::from_slices(&corners, &[0, 1, 2, 0, 2, 3], &[], &[])?;
    /// let tile = Arc::new(commit(&tile)?);
    /// let mut world = commit(&shoebox([0.1, 0.1, 0.1], "wood"))?;
    /// for column in 0..4 {
    ///     let pose = InstancePose::at(InstanceId::default(), [8.0 * f64::from(column), 0.0, 0.0]);
    ///     world.add_joined_instance(Arc::clone(&tile), &pose)?;
    /// }
    /// # Ok::<(), foresound::Error>(())
    /// ```
    pub fn add_joined_instance(
        &mut self,
        part: Arc<Scene>,
        pose: &InstancePose,
    ) -> Result<InstanceId> {
        let id = self.insert(part, pose)?;
        self.join(id.slot());
        self.instances.rebuild_tree();
        self.rank_surfaces();
        Ok(id)
    }

    fn join(&mut self, slot: usize) {
        let centre = self.centre();
        let Some(placed) = self.instances.slots[slot].placed.take() else {
            return;
        };
        let placed = placed.at_rest();
        let names = placed.part.materials().iter();
        let names: Vec<String> = names.map(|material| material.name.clone()).collect();
        self.instances.slots[slot].placed = Some(placed);
        self.instances.joined += 1;
        if self.instances.fixed.is_none() {
            let fixed = Self {
                instances: Instances::default(),
                ..self.clone()
            };
            self.instances.fixed = Some(PlacedInstance::of_fixed(Arc::new(fixed)));
        }
        self.instances.join(slot, &names, centre);
    }

    /// Places a part in a vacant slot; tree and ranking are left to the caller.
    fn insert(&mut self, part: Arc<Scene>, pose: &InstancePose) -> Result<InstanceId> {
        pose.check()?;
        check_part(&part)?;
        let slots = &mut self.instances.slots;
        // The vacant slot of the lowest generation: generations repeat as late as possible.
        let vacant = slots.iter().enumerate().filter(|(_, s)| s.placed.is_none());
        let slot = match vacant.min_by_key(|(_, slot)| slot.generation) {
            Some((slot, _)) => slot,
            None if slots.len() < MOST_INSTANCES => {
                slots.push(Slot {
                    generation: 1,
                    placed: None,
                });
                slots.len() - 1
            }
            None => {
                let problem = format!("all {MOST_INSTANCES} instances are in use");
                return Err(Error::setting("instance", problem, "remove one first"));
            }
        };
        let id = InstanceId::new(slot as u16, slots[slot].generation);
        let placed = self.place(part, InstancePose { id, ..*pose });
        let instances = &mut self.instances;
        instances.slots[slot].placed = Some(placed);
        instances.count += 1;
        instances.tree.reserve(instances.slots.len());
        Ok(id)
    }

    /// Removes an instance; its handle is stale from now on. Control side.
    ///
    /// # Errors
    /// [`Error::StaleInstance`].
    pub fn remove_instance(&mut self, id: InstanceId) -> Result<()> {
        let centre = self.centre();
        let slot = self.instances.slot_of(id)?;
        let removed = slot.placed.take();
        slot.generation = slot.generation.checked_add(1).unwrap_or(1);
        self.instances.count -= 1;
        if let Some(removed) = removed {
            self.instances.joined -= usize::from(removed.joint.is_some());
            self.instances.part_from(id.slot(), &removed, centre);
            if self.instances.joined == 0 {
                self.instances.fixed = None;
            }
        }
        self.instances.rebuild_tree();
        self.rank_surfaces();
        Ok(())
    }

    /// Moves one instance; [`Self::set_instance_poses`] is faster for several.
    ///
    /// # Errors
    /// [`Error::StaleInstance`]; [`Error::Setting`] for a pose that is not rigid, and the last good one stays.
    pub fn set_instance_pose(&mut self, pose: &InstancePose) -> Result<()> {
        self.check_instance_pose(pose)?;
        self.set_instance_poses(std::slice::from_ref(pose));
        Ok(())
    }

    /// Checks that a pose is rigid and its handle valid, and that a joined instance stays where it is.
    ///
    /// # Errors
    /// [`Error::StaleInstance`], [`Error::Setting`].
    pub fn check_instance_pose(&self, pose: &InstancePose) -> Result<()> {
        self.instance_part(pose.id)?;
        let placed = self.instances.at(pose.id.slot());
        if placed.is_some_and(|placed| placed.joint.is_some() && placed.pose != *pose) {
            let advice = "remove it and add it elsewhere, or add it as one that moves";
            return Err(Error::setting(
                "pose",
                "a joined instance does not move",
                advice,
            ));
        }
        pose.check()
    }

    /// Moves instances; returns how many changed their pose. Stale handles and poses that are not rigid
    /// ([`InstancePose::check`]) are ignored.
    ///
    /// # Real-time
    /// Allocates nothing, neither blocks nor fails; time is proportional to the number of poses.
    pub fn set_instance_poses(&mut self, poses: &[InstancePose]) -> usize {
        let centre = self.centre();
        let instances = &mut self.instances;
        let mut moved = 0;
        for pose in poses {
            let slot = instances.slots.get_mut(pose.id.slot());
            let placed = slot.and_then(|slot| slot.placed.as_mut());
            let may_move = |p: &PlacedInstance| p.joint.is_none() && p.pose != *pose;
            if let Some(placed) = placed.filter(|p| p.pose.id == pose.id && may_move(p))
                && pose.check().is_ok()
            {
                placed.place(*pose, centre);
                moved += 1;
            }
        }
        if moved > 0 {
            instances.rebuild_tree();
        }
        moved
    }

    /// The same fixed scene with the instances of another, under the same handles and at the same poses. Control side;
    /// allocates.
    pub fn with_instances_of(&self, other: &Self) -> Self {
        let mut result = self.clone();
        result.instances = Instances {
            count: other.instances.count,
            ..Instances::default()
        };
        for slot in &other.instances.slots {
            let placed = slot.placed.as_ref();
            let placed = placed.map(|p| result.place(Arc::clone(&p.part), p.pose));
            result.instances.slots.push(Slot {
                generation: slot.generation,
                placed,
            });
        }
        for (slot, before) in other.instances.slots.iter().enumerate() {
            if before.placed.as_ref().is_some_and(|p| p.joint.is_some()) {
                result.join(slot);
            }
        }
        result.instances.tree.reserve(result.instances.slots.len());
        result.instances.rebuild_tree();
        result.rank_surfaces();
        result
    }

    /// Ranks the surfaces by area, which does not depend on poses.
    fn rank_surfaces(&mut self) {
        let mut large = std::mem::take(&mut self.instances.large);
        large.clear();
        large.extend_from_slice(self.edges().large_surfaces());
        large.extend(
            self.instances
                .fixed
                .iter()
                .flat_map(PlacedInstance::raised_surfaces),
        );
        for placed in self.instances.placed() {
            let own = placed.part.edges().large_surfaces().iter().copied();
            let own = own.chain(placed.raised_surfaces());
            large.extend(own.map(|surface| placed.surface_number(surface)));
        }
        large.sort_unstable();
        large.dedup();
        // Bits of positive numbers sort as the numbers do; inverted, the largest comes first.
        let rank = |&surface: &u32| (!self.surface(surface).area_m2.to_bits(), surface);
        let mut ranked: Vec<(u64, u32)> = large.iter().map(rank).collect();
        if ranked.len() > MOST_MIRRORS {
            ranked.select_nth_unstable(MOST_MIRRORS);
            ranked.truncate(MOST_MIRRORS);
        }
        ranked.sort_unstable();
        large.clear();
        large.extend(ranked.iter().map(|(_, surface)| *surface));
        self.instances.continued = match &self.instances.fixed {
            Some(_) => ContinuedSurfaces::among(&large, |surface| self.surface(surface)),
            None => ContinuedSurfaces::default(),
        };
        self.instances.large = large;
    }

    /// A part at a pose, with materials of this scene.
    fn place(&mut self, part: Arc<Scene>, pose: InstancePose) -> PlacedInstance {
        let fixed = self.materials();
        let numbers = part.materials().iter();
        // Two statements, since the fixed materials are the scene's too.
        let known: Vec<Option<usize>> = numbers
            .map(|material| fixed.iter().position(|m| m == material))
            .collect();
        let first = fixed.len();
        let materials: Vec<u32> = known
            .into_iter()
            .zip(part.materials())
            .map(|(known, material)| match known {
                Some(index) => index as u32,
                None => (first + self.instances.materials.index(material, part.materials())) as u32,
            })
            .collect();
        let like = self
            .instances
            .placed()
            .find(|p| Arc::ptr_eq(&p.part, &part));
        let centre = self.centre();
        PlacedInstance::new(part, pose, &materials, centre, like)
    }

    /// Number of instances.
    pub fn instance_count(&self) -> usize {
        self.instances.count
    }

    /// Handles and poses of all instances, by slot.
    pub fn instance_poses(&self) -> impl Iterator<Item = InstancePose> + '_ {
        self.instances.placed().map(|placed| placed.pose)
    }

    /// The part of an instance.
    ///
    /// # Errors
    /// [`Error::StaleInstance`].
    pub fn instance_part(&self, id: InstanceId) -> Result<&Arc<Scene>> {
        let placed = self.instances.at(id.slot());
        let placed = placed.filter(|placed| placed.pose.id == id);
        placed.map(|p| &p.part).ok_or(Error::StaleInstance {
            slot: id.slot(),
            generation: id.generation(),
        })
    }
}

fn check_part(part: &Scene) -> Result<()> {
    let advice = "commit the part alone, as coarse as it is heard";
    if !part.instances.is_empty() {
        let problem = "the part has instances of its own";
        return Err(Error::setting("part", problem, advice));
    }
    let edges = part.edges().len() + part.edges().border().as_slice().len();
    let most = part.bvh().triangle_count().max(edges);
    let surfaces = part.surfaces().len();
    if most.max(surfaces) > MOST_IN_A_PART {
        let problem = format!("{most} triangles or edges are more than {MOST_IN_A_PART}");
        return Err(Error::setting("part", problem, advice));
    }
    Ok(())
}

/// The origin of a scene's local coordinates in double precision.
impl Scene {
    pub(super) fn centre(&self) -> DVec3 {
        self.mesh.centre
    }
}
