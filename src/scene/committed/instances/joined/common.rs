//! Surfaces that joined parts have in common: the floors of two chunks in one plane and of one material are one surface, as
//! if both were committed in one piece.
//!
//! Every surface that may go on beyond its part is one of a common surface, also the only one: its key, made of plane and
//! material, and its number stay when neighbours come and go. Adding and removing is control side; queries are wait-free.

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::scene::committed::instances::numbering;
use crate::scene::surface::key::{instance_key, key};
use crate::scene::surface::{
    SAME_PLANE_ANGLE_DEG, SAME_PLANE_DISTANCE_M, Surface, canonical, is_parallel,
};

/// Edge of a search cell for components of normals and for offsets in metres: several tolerances.
const NORMAL_CELL: f64 = 0.03;
const OFFSET_CELL_M: f64 = 8e-3;

/// Numbers of removed surfaces that stay vacant, so that a stale one meets no other surface.
const RESTING: usize = 1024;

/// End of a chain.
const NONE: u32 = u32::MAX;

type Cell = [i64; 4];

/// A surface of one part.
#[derive(Debug, Clone, Copy)]
pub(in crate::scene::committed::instances) struct Member {
    pub(super) slot: u16,
    /// Its index in the part.
    pub(in crate::scene::committed::instances) local: u32,
    /// Whether its normal is opposite to the common one.
    pub(in crate::scene::committed::instances) is_turned: bool,
    low: Vec3,
    high: Vec3,
    area_m2: f64,
    /// Whether any piece of it is a panel.
    has_panel: bool,
}

impl Member {
    /// Whether a point is within a distance of its bounds.
    #[inline]
    pub(super) fn is_near(&self, point: DVec3, within_m: f64) -> bool {
        let (low, high) = (self.low.as_dvec3(), self.high.as_dvec3());
        point.cmpge(low - within_m).all() && point.cmple(high + within_m).all()
    }
}

/// A common surface with its members by slot, at most one a part.
#[derive(Debug, Clone)]
pub(super) struct CommonSurface {
    pub(super) surface: Surface,
    pub(super) members: Vec<Member>,
    cell: Cell,
}

impl CommonSurface {
    /// The member of a slot.
    #[inline]
    pub(super) fn member(&self, slot: usize) -> Option<&Member> {
        let found = self
            .members
            .binary_search_by_key(&slot, |member| usize::from(member.slot));
        found.ok().map(|index| &self.members[index])
    }

    fn sum_up(&mut self) {
        let (mut low, mut high, mut area_m2) = (Vec3::INFINITY, Vec3::NEG_INFINITY, 0.0);
        for member in &self.members {
            (low, high) = (low.min(member.low), high.max(member.high));
            area_m2 += member.area_m2;
        }
        let count = self.members.len() as u32;
        let with_panel = self.members.iter().filter(|member| member.has_panel);
        let panels = with_panel.count() as u32;
        self.surface = Surface {
            area_m2,
            bounds_min: low,
            bounds_max: high,
            triangle_count: count,
            panel_triangle_count: panels,
            ..self.surface
        };
    }
}

/// All common surfaces of a scene.
#[derive(Debug, Clone, Default)]
pub(in crate::scene::committed::instances) struct CommonSurfaces {
    list: Vec<Option<Arc<CommonSurface>>>,
    vacant: VecDeque<u32>,
    /// The first surface of each cell of planes, and the next one of the same cell.
    cells: HashMap<Cell, u32>,
    next: Vec<u32>,
}

impl CommonSurfaces {
    #[inline]
    pub(super) fn get(&self, index: u32) -> Option<&CommonSurface> {
        self.list.get(index as usize)?.as_deref()
    }

    /// The surface of a number, if it is a common one's.
    #[inline]
    pub(in crate::scene::committed::instances) fn surface(&self, number: u32) -> Option<&Surface> {
        Some(&self.get(numbering::as_common(number)?)?.surface)
    }

    /// Adds a part's surface, in the scene's coordinates, and returns its common number; none if all are in use. `name` is
    /// its material's, `centre` the origin of the scene's coordinates.
    pub(super) fn join(
        &mut self,
        (slot, local): (usize, u32),
        own: &Surface,
        corners: &[DVec3],
        name: &str,
        centre: DVec3,
    ) -> Option<u32> {
        let normal = canonical(own.normal);
        let offset_m = own.offset_m * 1f64.copysign(normal.dot(own.normal)) + normal.dot(centre);
        let mut taken = Vec::new();
        let found = self.find(normal, offset_m, |index, common| {
            taken.push(common.surface.key);
            let fits = common.surface.material == own.material
                && is_parallel(common.surface.normal, normal)
                && common.member(slot).is_none()
                && corners
                    .iter()
                    .all(|&p| common.surface.distance_m(p).abs() <= SAME_PLANE_DISTANCE_M);
            fits.then_some(index)
        });
        let index = match found {
            Some(index) => index,
            None => {
                let mut unique = key(normal, offset_m, DVec3::ZERO, name);
                while taken.contains(&unique) {
                    unique = instance_key(unique, 1);
                }
                let cell = cell(normal, offset_m);
                let surface = Surface {
                    key: unique,
                    normal,
                    offset_m: offset_m - normal.dot(centre),
                    first_triangle: 0,
                    ..*own
                };
                self.insert(CommonSurface {
                    surface,
                    members: Vec::new(),
                    cell,
                })?
            }
        };
        let common = Arc::make_mut(self.list[index as usize].as_mut()?);
        let member = Member {
            slot: slot as u16,
            local,
            is_turned: own.normal.dot(common.surface.normal) < 0.0,
            low: own.bounds_min,
            high: own.bounds_max,
            area_m2: own.area_m2,
            has_panel: own.panel_triangle_count > 0,
        };
        let rank = common
            .members
            .partition_point(|other| usize::from(other.slot) < slot);
        common.members.insert(rank, member);
        common.sum_up();
        Some(numbering::common(index))
    }

    /// Notes whether any piece of a member is a panel.
    pub(super) fn set_panel(&mut self, number: u32, slot: usize, has_panel: bool) {
        let index = numbering::as_common(number).map(|index| index as usize);
        let common = index.and_then(|index| self.list.get_mut(index)?.as_mut());
        if let Some(common) = common.map(Arc::make_mut) {
            let members = common.members.iter_mut();
            for member in members.filter(|member| usize::from(member.slot) == slot) {
                member.has_panel = has_panel;
            }
            common.sum_up();
        }
    }

    /// Removes the member of a slot; the surface ends with its last member.
    pub(super) fn leave(&mut self, number: u32, slot: usize) {
        let Some(index) = numbering::as_common(number) else {
            return;
        };
        let Some(common) = self.list.get_mut(index as usize).and_then(Option::as_mut) else {
            return;
        };
        let common = Arc::make_mut(common);
        common
            .members
            .retain(|member| usize::from(member.slot) != slot);
        common.sum_up();
        if common.members.is_empty() {
            let cell = common.cell;
            self.list[index as usize] = None;
            self.vacant.push_back(index);
            self.unlink(cell, index);
        }
    }

    /// The first result of `choose` among the surfaces in planes near to this one.
    fn find(
        &self,
        normal: DVec3,
        offset_m: f64,
        mut choose: impl FnMut(u32, &CommonSurface) -> Option<u32>,
    ) -> Option<u32> {
        let reach = SAME_PLANE_ANGLE_DEG.to_radians();
        // A plane near the threshold of signs may have the opposite normal.
        for sign in [1.0, -1.0] {
            let at = |shift: f64| {
                let shifted = sign * normal + DVec3::splat(shift * reach);
                cell(shifted, sign * offset_m + shift * SAME_PLANE_DISTANCE_M)
            };
            let (low, high) = (at(-1.0), at(1.0));
            for number in 0..16u32 {
                let mut cell = low;
                let mut is_new = true;
                for axis in 0..4 {
                    if number & 1 << axis != 0 {
                        is_new &= high[axis] != low[axis];
                        cell[axis] = high[axis];
                    }
                }
                let mut index = match self.cells.get(&cell) {
                    Some(first) if is_new => *first,
                    _ => NONE,
                };
                while let Some(common) = self.get(index) {
                    let found = choose(index, common);
                    if found.is_some() {
                        return found;
                    }
                    index = self.next[index as usize];
                }
            }
        }
        None
    }

    fn insert(&mut self, common: CommonSurface) -> Option<u32> {
        let is_full = self.list.len() == numbering::MOST_COMMON;
        let vacant = match is_full || self.vacant.len() > RESTING {
            true => self.vacant.pop_front(),
            false => None,
        };
        let index = match vacant {
            Some(index) => index,
            None if is_full => return None,
            None => {
                self.list.push(None);
                self.next.push(NONE);
                (self.list.len() - 1) as u32
            }
        };
        let first = self.cells.insert(common.cell, index);
        self.next[index as usize] = first.unwrap_or(NONE);
        self.list[index as usize] = Some(Arc::new(common));
        Some(index)
    }

    fn unlink(&mut self, cell: Cell, index: u32) {
        let after = std::mem::replace(&mut self.next[index as usize], NONE);
        let Some(first) = self.cells.get_mut(&cell) else {
            return;
        };
        if *first == index {
            *first = after;
            if after == NONE {
                self.cells.remove(&cell);
            }
            return;
        }
        let mut at = *first;
        while at != NONE {
            let next = self.next[at as usize];
            if next == index {
                self.next[at as usize] = after;
                return;
            }
            at = next;
        }
    }

    pub(in crate::scene::committed::instances) fn memory_bytes(&self) -> usize {
        let members = |common: &Arc<CommonSurface>| {
            size_of::<CommonSurface>() + size_of_val(common.members.as_slice())
        };
        let list: usize = self.list.iter().flatten().map(members).sum();
        let cells = self.cells.capacity() * size_of::<(Cell, u32)>();
        list + cells + self.list.len() * (size_of::<usize>() + size_of::<u32>())
    }
}

fn cell(normal: DVec3, offset_m: f64) -> Cell {
    let step = |value: f64, size: f64| (value / size).floor() as i64;
    let [x, y, z] = normal.to_array().map(|value| step(value, NORMAL_CELL));
    [x, y, z, step(offset_m, OFFSET_CELL_M)]
}
