//! Rigid parts that move: doors, lifts, vehicles. Each is a separately committed [`Scene`] at a pose.
//!
//! Adding and removing is control side and allocates; moving ([`Scene::set_instance_poses`]) allocates nothing and is
//! allowed on the audio side. A query traverses a tree over the instances' boxes, rebuilt after a move, and then the
//! part's BVH with the ray in the part's coordinates. The keys of surfaces do not depend on the pose: a path at a moving
//! door keeps its identity. Own.
//!
//! A part is not joined with the scene: a door that touches its frame shares no edge or surface with it. Free edges of its
//! panels, free ends of edges and visibility among its edges were found at its commit, without the scene; diffraction over
//! edges of two bodies is searched at their current poses.

mod changes;
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
use crate::geometry::{Aabb, AabbTree, Hit, Ray};
use crate::scene::edges::MOST_MIRRORS;
use crate::scene::surface::Surface;
use materials::InstanceMaterials;
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
    /// Materials that the fixed scene does not have.
    materials: InstanceMaterials,
    tree: AabbTree,
    /// One per slot.
    boxes: Vec<Aabb>,
    /// The largest surfaces of fixed scene and instances, largest first.
    large: Vec<u32>,
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
        self.slots.get(slot)?.placed.as_ref()
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
        let (placed, local) = self.of(global)?;
        placed.surfaces.get(local as usize)
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
        let mut best = found;
        // A hit at the same parameter counts if its index is lower.
        let up_to = |best: Option<Hit>| best.map_or(ray.t_max, |hit| hit.t.next_up());
        let short = Ray {
            t_max: up_to(best),
            ..*ray
        };
        self.tree.traverse(&short, |slot, t_max| {
            let Some(placed) = self.at(slot as usize) else {
                return t_max;
            };
            let local = Ray {
                t_max,
                ..placed.ray(ray)
            };
            if let Some(hit) = placed
                .part
                .bvh()
                .closest_hit(&local, placed.part_groups(ignored))
            {
                let hit = Hit {
                    t: hit.t,
                    triangle: placed.scene_index(hit.triangle),
                    group: placed.scene_index(hit.group),
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
        let mut met = None;
        self.tree.traverse(ray, |slot, t_max| {
            met = self.at(slot as usize).and_then(|placed| {
                let part_groups = placed.part_groups(ignored);
                let found = placed.part.bvh().occluder(&placed.ray(ray), part_groups)?;
                Some(placed.scene_index(found))
            });
            if met.is_some() { -1.0 } else { t_max }
        });
        met
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let placed: usize = self.placed().map(PlacedInstance::memory_bytes).sum();
        placed
            + self.tree.memory_bytes()
            + size_of_val(self.boxes.as_slice())
            + size_of_val(self.large.as_slice())
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
        instances.rebuild_tree();
        self.rank_surfaces();
        Ok(id)
    }

    /// Removes an instance; its handle is stale from now on. Control side.
    ///
    /// # Errors
    /// [`Error::StaleInstance`].
    pub fn remove_instance(&mut self, id: InstanceId) -> Result<()> {
        let slot = self.instances.slot_of(id)?;
        slot.placed = None;
        slot.generation = slot.generation.checked_add(1).unwrap_or(1);
        self.instances.count -= 1;
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

    /// Checks that a pose is rigid and its handle valid.
    ///
    /// # Errors
    /// [`Error::StaleInstance`], [`Error::Setting`].
    pub fn check_instance_pose(&self, pose: &InstancePose) -> Result<()> {
        self.instance_part(pose.id)?;
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
            if let Some(placed) = placed.filter(|p| p.pose.id == pose.id && p.pose != *pose)
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
        for placed in self.instances.placed() {
            let own = placed.part.edges().large_surfaces().iter();
            large.extend(own.map(|&surface| placed.scene_index(surface)));
        }
        let area_m2 = |surface: &u32| self.surface(*surface).area_m2;
        large.sort_by(|a, b| area_m2(b).total_cmp(&area_m2(a)).then(a.cmp(b)));
        large.truncate(MOST_MIRRORS);
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
                None => (first + self.instances.materials.index(material)) as u32,
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
    let most = part.bvh().triangle_count().max(part.edges().len());
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
