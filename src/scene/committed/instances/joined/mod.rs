//! Joined parts: static parts that are one scene with those that they touch, such as the chunks of a streamed world.
//!
//! A part is committed alone, on any thread, and never changes. What joining adds is kept beside it, a part: the common
//! surfaces that its surfaces belong to ([`common`]), the edges that other parts cover or turn into wedges ([`edges`]), and
//! the boundaries at which its surfaces go on ([`rims`]). Adding or removing a part renews only what lies in its bounds:
//! the numbers and keys of everything else stay. Control side; all queries are wait-free. Own.
//!
//! Small pieces of a part at its bounds are panels together with those that they touch ([`pieces`]).
//!
//! The fixed part is one of them: its edges and boundaries change as those of a part, under numbers and keys of its own. Its
//! surfaces are no common ones, so a path's identity changes where its reflection point crosses the border.
//!
//! Not joined: curved surfaces, which only scatter in a part; rough regions, which each part flattens on its own planes; and
//! small pieces of the fixed part with what continues them.

pub(super) mod common;
mod edges;
mod pieces;
mod rims;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::geometry::Aabb;
use crate::scene::Scene;
use crate::scene::committed::instances::Instances;
use crate::scene::committed::instances::joint::{JoinedEdges, JoinedRims, Joint};
use crate::scene::committed::instances::numbering::FIXED;
use crate::scene::committed::instances::placed::PlacedInstance;
use common::Member;
use edges::{contacts_with, edges_near, resolve};
use rims::REACH_M;

/// Wedge index of an edge above which it is a rim: its surface may go on there.
const RIM: f64 = 1.999;

/// Distance in metres from a part's bounds at which a surface may go on.
const AT_BOUNDS_M: f32 = 5e-3;

/// What has to be found out again.
#[derive(Default)]
struct Renewal {
    /// Edges, by slot.
    edges: BTreeMap<usize, BTreeSet<u32>>,
    /// Slots of parts whose boundaries have to be renewed, and of those beside which.
    beside: BTreeSet<(usize, usize)>,
}

/// The joined parts around one, with their bounds.
pub(super) struct Neighbours {
    list: Vec<(usize, Aabb)>,
}

impl Neighbours {
    /// Of the part of a slot, without it.
    fn of(instances: &Instances, slot: usize, bounds: &Aabb) -> Self {
        let is_near = |other: &Aabb| {
            let reach_m = REACH_M as f32;
            other.min.cmple(bounds.max + reach_m).all()
                && other.max.cmpge(bounds.min - reach_m).all()
        };
        let placed = instances.slots.iter().enumerate().filter_map(|(at, slot)| {
            let placed = slot.placed.as_ref().filter(|p| p.joint.is_some())?;
            Some((at, placed.bounds))
        });
        let fixed = instances.fixed.iter().map(|fixed| (FIXED, fixed.bounds));
        Self {
            list: placed
                .chain(fixed)
                .filter(|(at, other)| *at != slot && is_near(other))
                .collect(),
        }
    }

    /// Slots of those within a distance of a point.
    pub(super) fn at(&self, point: DVec3, within_m: f64) -> impl Iterator<Item = usize> + '_ {
        self.within(point, point, within_m)
    }

    /// Slots of those within a distance of a box.
    pub(super) fn within(
        &self,
        low: DVec3,
        high: DVec3,
        within_m: f64,
    ) -> impl Iterator<Item = usize> + '_ {
        let (low, high) = (low - within_m, high + within_m);
        let near = self.list.iter().filter(move |(_, bounds)| {
            bounds.min.as_dvec3().cmple(high).all() && bounds.max.as_dvec3().cmpge(low).all()
        });
        near.map(|(slot, _)| *slot)
    }
}

impl Instances {
    /// The surface of a part among those of a common one.
    #[inline]
    pub(super) fn member(&self, number: u32, slot: usize) -> Option<&Member> {
        let index = super::numbering::as_common(number)?;
        self.common.get(index)?.member(slot)
    }

    /// Members of a common surface near a point, each with its part.
    #[inline]
    pub(super) fn members_at(
        &self,
        number: u32,
        point: DVec3,
        within_m: f64,
    ) -> impl Iterator<Item = (&PlacedInstance, &Member)> {
        let index = super::numbering::as_common(number);
        let common = index.and_then(|index| self.common.get(index));
        let members = common.into_iter().flat_map(|common| &common.members);
        let near = members.filter(move |member| member.is_near(point, within_m));
        near.filter_map(|member| Some((self.at(usize::from(member.slot))?, member)))
    }

    /// Joins a placed part with those that it touches.
    pub(super) fn join(&mut self, slot: usize, names: &[String], centre: DVec3) {
        let Some(placed) = self.at(slot).cloned() else {
            return;
        };
        let common = Arc::make_mut(&mut self.common);
        let mut surfaces: Vec<u32> = (0..placed.surfaces.len() as u32)
            .map(|local| placed.scene_index(local))
            .collect();
        for local in may_go_on(&placed.part) {
            let own = &placed.surfaces[local as usize];
            let corners: Vec<DVec3> = placed
                .outline_of(local)
                .map(|corner| corner - own.distance_m(corner) * own.normal)
                .collect();
            let name = &names[placed.part.surfaces()[local as usize].material as usize];
            let number = common.join((slot, local), own, &corners, name, centre);
            surfaces[local as usize] = number.unwrap_or(surfaces[local as usize]);
        }
        if let Some(placed) = self.slots[slot].placed.as_mut() {
            placed.joint = Some(Arc::new(Joint {
                surfaces: surfaces.into(),
                raised: Vec::new(),
                raised_edges: Vec::new(),
                edges: JoinedEdges::default(),
                rims: JoinedRims::default(),
            }));
        }
        let raised = self.pieces_to_raise(slot);
        for (&at, pieces) in &raised {
            self.mark_pieces(at, pieces, true);
        }
        let mut renewal = Renewal::default();
        self.renew_beside(slot, &placed, true, &mut renewal);
        for (&at, pieces) in &raised {
            self.renew_edges_of(at, pieces, &mut renewal);
        }
        self.resolve_all(&renewal, None, centre);
    }

    /// Undoes what joining with a part that has been removed had changed.
    pub(super) fn part_from(&mut self, slot: usize, removed: &PlacedInstance, centre: DVec3) {
        let Some(joint) = &removed.joint else {
            return;
        };
        let common = Arc::make_mut(&mut self.common);
        for &number in joint.surfaces.iter() {
            common.leave(number, slot);
        }
        let lowered = self.pieces_to_lower(slot, removed);
        let mut renewal = Renewal::default();
        self.renew_beside(slot, removed, false, &mut renewal);
        for (&at, pieces) in &lowered {
            self.mark_pieces(at, pieces, false);
            self.renew_edges_of(at, pieces, &mut renewal);
        }
        self.resolve_all(&renewal, Some((slot, removed)), centre);
    }

    /// Renews contacts of a part that has come or gone and of its neighbours in its bounds.
    fn renew_beside(
        &mut self,
        slot: usize,
        part: &PlacedInstance,
        is_new: bool,
        renewal: &mut Renewal,
    ) {
        let near = Neighbours::of(self, slot, &part.bounds);
        if is_new {
            renewal.edges.entry(slot).or_default();
        }
        for &(other, _) in &near.list {
            let Some(neighbour) = self.at(other) else {
                continue;
            };
            let theirs = edges_near(neighbour, part);
            let mut contacts = [Vec::new(), Vec::new()];
            if let Some(present) = self.at(slot).filter(|_| is_new) {
                let ours = edges_near(present, neighbour);
                contacts = [
                    contacts_with(present, &ours, neighbour),
                    contacts_with(neighbour, &theirs, present),
                ];
                renewal.edges.entry(slot).or_default().extend(ours);
                renewal.beside.insert((slot, other));
            }
            let [ours, of_neighbour] = contacts;
            self.change_joint(slot, |joint| joint.edges.add_contacts(other, ours));
            self.change_joint(other, |joint| match is_new {
                true => joint.edges.add_contacts(slot, of_neighbour),
                false => joint.edges.drop_contacts(slot),
            });
            renewal.edges.entry(other).or_default().extend(theirs);
            renewal.beside.insert((other, slot));
        }
    }

    /// Renews the edges of border pieces of a part that are panels now, or no longer: their contacts, and what they change about
    /// the neighbours' edges.
    fn renew_edges_of(&mut self, slot: usize, pieces: &[u32], renewal: &mut Renewal) {
        let Some(placed) = self.at(slot).cloned() else {
            return;
        };
        let mut edges = placed.edges_of_pieces(|piece| pieces.contains(&piece));
        renewal.edges.entry(slot).or_default().extend(&edges);
        self.change_joint(slot, |joint| joint.edges.drop_contacts_of(&edges));
        edges.retain(|edge| placed.is_edge(*edge));
        let bounds: Vec<[DVec3; 2]> = pieces.iter().map(|&p| placed.bounds_of_piece(p)).collect();
        for (other, around) in Neighbours::of(self, slot, &placed.bounds).list {
            let [least, greatest] = [around.min, around.max].map(Vec3::as_dvec3);
            let is_near = |[low, high]: &[DVec3; 2]| {
                low.cmple(greatest + REACH_M).all() && high.cmpge(least - REACH_M).all()
            };
            if !bounds.iter().any(is_near) {
                continue;
            }
            let Some(neighbour) = self.at(other).cloned() else {
                continue;
            };
            let theirs = edges_near(&neighbour, &placed);
            renewal.edges.entry(other).or_default().extend(theirs);
            renewal.beside.extend([(slot, other), (other, slot)]);
            let found = contacts_with(&placed, &edges, &neighbour);
            self.change_joint(slot, |joint| joint.edges.add_contacts(other, found));
        }
    }

    /// Finds out what is left of edges and boundaries.
    fn resolve_all(
        &mut self,
        renewal: &Renewal,
        removed: Option<(usize, &PlacedInstance)>,
        centre: DVec3,
    ) {
        for (&at, edges) in &renewal.edges {
            let Some(placed) = self.at(at) else {
                continue;
            };
            let Some(mut joint) = placed.joint.as_deref().cloned() else {
                continue;
            };
            let around = Neighbours::of(self, at, &placed.bounds);
            let resolved = edges
                .iter()
                .map(|&edge| (edge, resolve(self, at, edge, &around, centre)));
            let resolved = resolved.collect();
            joint.edges.replace(placed.edge_counts(), resolved);
            // A new part's boundaries are renewed beside each neighbour.
            let beside = renewal.beside.range((at, 0)..=(at, usize::MAX));
            for &(_, other) in beside {
                let gone = removed.filter(|(slot, _)| *slot == other);
                if let Some(other) = gone.map(|(_, part)| part).or_else(|| self.at(other)) {
                    rims::renew(&mut joint.rims, self, placed, other, &around);
                }
            }
            if let Some(placed) = self.at_mut(at) {
                placed.joint = Some(Arc::new(joint));
            }
        }
    }

    fn change_joint(&mut self, slot: usize, change: impl FnOnce(&mut Joint)) {
        if let Some(joint) = self.at_mut(slot).and_then(|placed| placed.joint.as_mut()) {
            change(Arc::make_mut(joint));
        }
    }
}

/// Surfaces of a part that may go on beyond it: those with a rim, and those that reach its bounds.
fn may_go_on(part: &Scene) -> Vec<u32> {
    let surfaces = part.surfaces();
    let mut may = vec![false; surfaces.len()];
    for edge in part.edges().as_slice().iter().filter(|edge| edge.n > RIM) {
        for face in edge.faces {
            may[face as usize] = true;
        }
    }
    let mut bounds = Aabb::EMPTY;
    for surface in surfaces {
        bounds = bounds.union(&Aabb {
            min: surface.bounds_min,
            max: surface.bounds_max,
        });
    }
    for (may, surface) in may.iter_mut().zip(surfaces) {
        let low = surface.bounds_min.cmplt(bounds.min + AT_BOUNDS_M);
        let high = surface.bounds_max.cmpgt(bounds.max - AT_BOUNDS_M);
        *may |= low.any() || high.any();
        *may &= surface.panel_triangle_count > 0;
    }
    for piece in part.surface_set().border().as_slice() {
        may[piece.surface as usize] = true;
    }
    let indices = 0..surfaces.len() as u32;
    indices.filter(|&s| may[s as usize]).collect()
}
