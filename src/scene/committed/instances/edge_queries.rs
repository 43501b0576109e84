//! Queries of the edges of a scene with instances. Without instances each is a query of the fixed part after one comparison.
//!
//! Any thread; all take `&self`, neither allocate nor block.

use glam::DVec3;

use crate::geometry::bvh::NO_GROUP;
use crate::scene::Scene;
use crate::scene::committed::instances::numbering;
use crate::scene::committed::instances::placed::PlacedInstance;
use crate::scene::edges::{
    DiffractingEdge, DiffractingEdges, Edge, EdgeMirrors, NO_EDGE, OwnEdges, choose,
};

impl Scene {
    /// An edge by its index, in local coordinates; an edge that no path crosses for a stale index.
    #[inline]
    pub fn edge(&self, index: u32) -> Edge {
        if numbering::is_instance(index) {
            return self.instance_edge(index);
        }
        if let Some(fixed) = &self.instances.fixed {
            return fixed.edge_at(index).unwrap_or(NO_EDGE);
        }
        let found = self.edges().as_slice().get(index as usize);
        *found.unwrap_or(&NO_EDGE)
    }

    /// Surfaces of an edge's faces ([`Edge::faces`]), without its geometry.
    pub(crate) fn edge_faces(&self, index: u32) -> [u32; 2] {
        self.part_of_edge(index, |edge| edge.faces)
    }

    /// A point of an edge's line and its direction ([`Edge::origin`], [`Edge::direction`]), without the rest of its geometry.
    #[inline]
    pub(crate) fn edge_line(&self, index: u32) -> [DVec3; 2] {
        self.part_of_edge(index, |edge| [edge.origin, edge.direction])
    }

    /// A part of an edge, without a copy of the rest.
    #[inline]
    pub(crate) fn part_of_edge<T>(&self, index: u32, part: impl Fn(&Edge) -> T) -> T {
        let has_instances = numbering::is_instance(index) || self.instances.fixed.is_some();
        match self.edges().as_slice().get(index as usize) {
            Some(edge) if !has_instances => part(edge),
            _ => part(&self.edge(index)),
        }
    }

    /// All edges in local coordinates: those of the fixed part, and of each instance as joining has left them.
    pub fn all_edges(&self) -> impl Iterator<Item = Edge> + '_ {
        let joined = self.instances.fixed.as_ref();
        let fixed = match joined {
            Some(_) => &[],
            None => self.edges().as_slice(),
        };
        let placed = joined.into_iter().chain(self.instances.placed());
        fixed.iter().copied().chain(placed.flat_map(|placed| {
            let own = 0..placed.part.edges().len() as u32;
            let further = placed.further_numbers();
            own.chain(further)
                .filter_map(|number| placed.edge_at(number))
                .filter(|edge| edge.length_m > 0.0)
        }))
    }

    #[inline(never)]
    fn instance_edge(&self, index: u32) -> Edge {
        let found = self.instances.of(index);
        let edge = found.and_then(|(placed, local)| placed.edge_at(local));
        edge.unwrap_or(NO_EDGE)
    }

    /// Edges of the same rigid body that are visible from an edge. Visibility between bodies changes as instances move.
    pub fn edge_neighbours(&self, index: u32) -> impl Iterator<Item = u32> + '_ {
        let (placed, local) = match numbering::is_instance(index) {
            true => match self.instances.of(index) {
                Some((placed, local)) => (Some(placed), local),
                None => (None, NO_GROUP),
            },
            false => (self.instances.fixed.as_ref(), index),
        };
        let set = placed.map_or(self.edges(), |placed| placed.part.edges());
        let neighbours = match (local as usize) < set.len() {
            true => set.neighbours(local),
            false => &[],
        };
        let is_covered = move |other: &u32| {
            let joint = placed.and_then(|placed| placed.joint.as_ref());
            joint.is_some_and(|joint| joint.edges.is_covered(*other))
        };
        neighbours
            .iter()
            .filter(move |other| !is_covered(other))
            .map(move |&other| placed.map_or(other, |placed| placed.scene_index(other)))
    }

    /// The `MAX_DIFFRACTING_EDGES` shortest paths between two points over
    /// one edge, of the fixed part and of instances, up to `longest_m`: both points in the exterior wedge, the crossing
    /// within the edge's ends. Occlusion is not tested. The result for nearby points as `known` saves time without
    /// changing the result.
    pub fn diffracting_edges(
        &self,
        known: &DiffractingEdges,
        from: DVec3,
        to: DVec3,
        longest_m: f64,
    ) -> DiffractingEdges {
        let (edges, mut near) = (self.edges(), DiffractingEdges::default());
        match &self.instances.fixed {
            None => {
                edges.add_known(&mut near, known, (from, to), longest_m, &OwnEdges);
                edges.add_crossings(&mut near, from, to, longest_m, &OwnEdges);
            }
            Some(fixed) => {
                let names = fixed.part_edges();
                edges.add_known(&mut near, known, (from, to), longest_m, &names);
                edges.add_crossings(&mut near, from, to, longest_m, &names);
                if let Some((set, names)) = fixed.further_edges() {
                    set.add_crossings(&mut near, from, to, longest_m, &names);
                }
            }
        }
        for placed in self.instances.placed() {
            if placed.min_path_length_m(from, to) <= near.bound_m(longest_m) {
                let (from, to) = (placed.point(from), placed.point(to));
                let set = placed.part.edges();
                set.add_crossings(&mut near, from, to, longest_m, &placed.part_edges());
                if let Some((set, names)) = placed.further_edges() {
                    set.add_crossings(&mut near, from, to, longest_m, &names);
                }
            }
        }
        near
    }

    /// The same for a list of edges, which may have duplicates and stale indices.
    pub fn diffracting_edges_over(
        &self,
        edges: impl Iterator<Item = u32>,
        from: DVec3,
        to: DVec3,
    ) -> DiffractingEdges {
        let mut near = DiffractingEdges::default();
        for edge in edges {
            if near.as_slice().iter().any(|found| found.edge == edge) {
                continue;
            }
            let rank_m = self.edge(edge).crossing_rank_m(from, to, f64::INFINITY);
            if let Some(length_m) = rank_m {
                near.insert(DiffractingEdge { edge, length_m });
            }
        }
        near
    }

    /// The same for edges of paths with several interactions: one end at least lies in the exterior wedge, and a crossing
    /// beyond an edge's end counts as one at its end.
    pub fn outer_crossings(&self, from: DVec3, to: DVec3, longest_m: f64) -> DiffractingEdges {
        let mut near = DiffractingEdges::default();
        let edges = self.edges();
        match &self.instances.fixed {
            None => edges.add_outer_crossings(&mut near, (from, to), longest_m, &OwnEdges),
            Some(fixed) => {
                let names = fixed.part_edges();
                edges.add_outer_crossings(&mut near, (from, to), longest_m, &names);
                if let Some((edges, names)) = fixed.further_edges() {
                    edges.add_outer_crossings(&mut near, (from, to), longest_m, &names);
                }
            }
        }
        for placed in self.instances.placed() {
            if placed.min_path_length_m(from, to) <= near.bound_m(longest_m) {
                let ends = (placed.point(from), placed.point(to));
                let edges = placed.part.edges();
                edges.add_outer_crossings(&mut near, ends, longest_m, &placed.part_edges());
                if let Some((edges, names)) = placed.further_edges() {
                    edges.add_outer_crossings(&mut near, ends, longest_m, &names);
                }
            }
        }
        near
    }

    /// The same over edges of instances only; `from` lies in the exterior wedge.
    pub fn first_crossings_of_instances(
        &self,
        from: DVec3,
        to: DVec3,
        longest_m: f64,
    ) -> DiffractingEdges {
        let mut near = DiffractingEdges::default();
        for placed in self.instances.placed() {
            if placed.min_path_length_m(from, to) <= near.bound_m(longest_m) {
                let ends = (placed.point(from), placed.point(to));
                let edges = placed.part.edges();
                edges.add_first_crossings(&mut near, ends, longest_m, &placed.part_edges());
                if let Some((edges, names)) = placed.further_edges() {
                    edges.add_first_crossings(&mut near, ends, longest_m, &names);
                }
            }
        }
        near
    }

    /// The same over edges of the fixed part only.
    pub fn first_crossings_of_fixed(
        &self,
        from: DVec3,
        to: DVec3,
        longest_m: f64,
    ) -> DiffractingEdges {
        let Some(fixed) = &self.instances.fixed else {
            return self.edges().first_crossings(from, to, longest_m);
        };
        let (mut near, ends) = (DiffractingEdges::default(), (from, to));
        let names = fixed.part_edges();
        self.edges()
            .add_first_crossings(&mut near, ends, longest_m, &names);
        if let Some((edges, names)) = fixed.further_edges() {
            edges.add_first_crossings(&mut near, ends, longest_m, &names);
        }
        near
    }

    /// Whether a commit has searched for a line of sight between two edges: both are of the fixed part, or of one part and
    /// neither a further piece that joining has added.
    pub fn is_committed_pair(&self, a: u32, b: u32) -> bool {
        let is_further = |edge: u32| {
            let fixed = self.instances.fixed.as_ref().map(|fixed| (fixed, edge));
            let found = match numbering::is_instance(edge) {
                true => self.instances.of(edge),
                false => fixed,
            };
            let joint = found.and_then(|(placed, local)| Some((placed.joint.as_ref()?, local)));
            joint.is_some_and(|(joint, local)| joint.edges.is_further(local))
        };
        a == b || numbering::is_same_rigid_body(a, b) && !is_further(a) && !is_further(b)
    }

    /// Candidates for a reflection before or after the diffraction at an edge: surfaces of the fixed part and of
    /// instances with a large solid angle from it.
    pub fn edge_mirrors(&self, index: u32) -> EdgeMirrors {
        if !self.has_instances() {
            return self.edges().mirrors(index);
        }
        if let Some(merged) = self.instances.continued.merged() {
            let edge = self.edge(index);
            let is_face = |surface: u32| {
                edge.faces.contains(&surface)
                    || self
                        .continued_by(surface)
                        .is_some_and(|other| edge.faces.contains(&other))
            };
            let mirrors = merged.iter().filter(|(surface, _)| !is_face(*surface));
            return choose(&edge, mirrors.map(|(surface, merged)| (*surface, merged)));
        }
        let large = self.instances.large_surfaces().iter();
        let named = large.map(|&surface| (surface, self.surface(surface)));
        choose(&self.edge(index), named)
    }

    /// Distance in metres from a point of a surface to the nearest edge that it ends at, if that is below `within_m`. Edges
    /// at which another surface continues it on the normal's side (`in_front`) or on the other do not count there.
    #[inline]
    pub fn edge_distance_m(
        &self,
        surface: u32,
        point: DVec3,
        in_front: bool,
        within_m: f64,
    ) -> Option<f64> {
        if numbering::is_instance(surface) {
            return self.instance_edge_distance_m(surface, point, in_front, within_m);
        }
        let fixed = self.instances.fixed.as_ref();
        let joint = fixed.and_then(|fixed| fixed.joint.as_ref());
        joint
            .and_then(|joint| joint.rims.distance_m(surface, point, in_front, within_m))
            .unwrap_or_else(|| self.edges().distance_m(surface, point, in_front, within_m))
    }

    /// Whether the scene has edges.
    #[inline]
    pub fn has_edges(&self) -> bool {
        let has = |scene: &Self| !scene.edges().is_empty();
        has(self) || self.instances.placed().any(|placed| has(&placed.part))
    }

    #[inline(never)]
    fn instance_edge_distance_m(
        &self,
        surface: u32,
        point: DVec3,
        in_front: bool,
        within_m: f64,
    ) -> Option<f64> {
        let of_part = |placed: &PlacedInstance, local: u32, in_front: bool| {
            let at = placed.point(point);
            let joint = placed.joint.as_ref();
            let joined = joint.and_then(|j| j.rims.distance_m(local, at, in_front, within_m));
            let edges = placed.part.edges();
            joined.unwrap_or_else(|| edges.distance_m(local, at, in_front, within_m))
        };
        if let Some((placed, local)) = self.instances.of(surface) {
            return of_part(placed, local, in_front);
        }
        let members = self.instances.members_at(surface, point, within_m);
        let distances = members.filter_map(|(placed, member)| {
            of_part(placed, member.local, in_front != member.is_turned)
        });
        distances.min_by(f64::total_cmp)
    }
}
