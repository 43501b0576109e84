//! Border pieces that are panels because of what they touch in other parts.
//!
//! In one mesh a connected plane piece is a panel from a least area on. A piece of a part below it is one as well where it touches a
//! panel of another part, or pieces that have the area together with it. Own.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::Neighbours;
use super::rims::triangle_in_plane;
use crate::geometry::Aabb;
use crate::scene::committed::instances::Instances;
use crate::scene::committed::instances::numbering::FIXED;
use crate::scene::committed::instances::placed::PlacedInstance;
use crate::scene::surface::{SAME_PLANE_DISTANCE_M, is_parallel};

/// Distance in metres from the outline of a piece at which another one begins.
const ASIDE_M: f64 = 0.01;

/// Distance in metres of the points of an outline that are tested, and their least and greatest number a side.
const STEP_M: f64 = 0.1;
const STEPS: [f64; 2] = [3.0, 64.0];

/// Slot and border piece.
type Piece = (usize, u32);

/// The search for pieces that touch each other.
struct Search<'a> {
    instances: &'a Instances,
    neighbours: BTreeMap<usize, Neighbours>,
}

impl Instances {
    /// Border pieces that a new part makes panels, its own among them, by slot.
    pub(super) fn pieces_to_raise(&self, slot: usize) -> BTreeMap<usize, Vec<u32>> {
        let Some(part) = self.at(slot) else {
            return BTreeMap::new();
        };
        let mut search = Search::new(self);
        let mut left = search.pieces_beside(slot, part, false);
        left.extend(part.border().map(|piece| (slot, piece)));
        search.by_slot(left, false)
    }

    /// Border pieces that are no panels without a part that has gone, by slot.
    pub(super) fn pieces_to_lower(
        &self,
        slot: usize,
        removed: &PlacedInstance,
    ) -> BTreeMap<usize, Vec<u32>> {
        let mut search = Search::new(self);
        let left = search.pieces_beside(slot, removed, true);
        search.by_slot(left, true)
    }

    /// Notes that border pieces of a part are panels, or no longer.
    pub(super) fn mark_pieces(&mut self, slot: usize, pieces: &[u32], are_panels: bool) {
        self.change_joint(slot, |joint| {
            let raised = &mut joint.raised;
            raised.retain(|piece| !pieces.contains(piece));
            if are_panels {
                raised.extend_from_slice(pieces);
                raised.sort_unstable();
            }
        });
        let Some(placed) = self.at(slot) else {
            return;
        };
        let edges = placed.edges_of_pieces(|piece| placed.is_raised(piece));
        let placed = placed.clone();
        self.change_joint(slot, |joint| joint.raised_edges = edges);
        let set = placed.part.surface_set();
        let surface = |piece: &u32| set.border().as_slice()[*piece as usize].surface;
        let surfaces: BTreeSet<u32> = pieces.iter().map(surface).collect();
        let common = Arc::make_mut(&mut self.common);
        for surface in surfaces {
            let mut own = set.border().of_surface(surface);
            let has_panel = set.surfaces[surface as usize].panel_triangle_count > 0
                || own.any(|piece| placed.is_raised(piece));
            common.set_panel(placed.surface_number(surface), slot, has_panel);
        }
    }
}

impl PlacedInstance {
    /// Numbers of the part's border pieces.
    fn border(&self) -> std::ops::Range<u32> {
        0..self.part.surface_set().border().as_slice().len() as u32
    }

    /// Bounds of a border piece in the scene's coordinates.
    pub(super) fn bounds_of_piece(&self, piece: u32) -> [DVec3; 2] {
        let piece = &self.part.surface_set().border().as_slice()[piece as usize];
        let corner = |n: u32| {
            let pick = |axis: usize| [piece.low, piece.high][(n >> axis & 1) as usize][axis];
            self.to_scene(Vec3::new(pick(0), pick(1), pick(2)))
        };
        let corners = (0..8).map(corner);
        corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], at| {
            [low.min(at), high.max(at)]
        })
    }

    /// Points beside the outline of a border piece, in the scene's coordinates and on both sides of it.
    fn points_beside(&self, piece: u32) -> impl Iterator<Item = DVec3> + '_ {
        let set = self.part.surface_set();
        let border = set.border();
        let surface = border.as_slice()[piece as usize].surface;
        let normal = set.surfaces[surface as usize].normal;
        border.outline_of(piece).iter().flat_map(move |ends| {
            let [from, to] = ends.map(|end| end.as_dvec3());
            let across = normal.cross(to - from).normalize_or_zero();
            let count = (from.distance(to) / STEP_M)
                .ceil()
                .clamp(STEPS[0], STEPS[1]);
            (0..count as u32).flat_map(move |n| {
                let at = from.lerp(to, (f64::from(n) + 0.5) / count);
                let points = [at + ASIDE_M * across, at - ASIDE_M * across];
                points.map(|point| self.to_scene(point.as_vec3()))
            })
        })
    }
}

impl<'a> Search<'a> {
    fn new(instances: &'a Instances) -> Self {
        Self {
            instances,
            neighbours: BTreeMap::new(),
        }
    }

    /// Slots of the parts around one.
    fn around(&mut self, slot: usize) -> Vec<usize> {
        let instances = self.instances;
        let near = self.neighbours.entry(slot).or_insert_with(|| {
            let bounds = instances
                .at(slot)
                .map_or(Aabb::EMPTY, |placed| placed.bounds);
            Neighbours::of(instances, slot, &bounds)
        });
        near.list.iter().map(|(at, _)| *at).collect()
    }

    /// Border pieces, raised or not, that may touch a part that has come or gone.
    fn pieces_beside(&self, slot: usize, part: &PlacedInstance, raised: bool) -> BTreeSet<Piece> {
        let numbers: HashSet<u32> = match &part.joint {
            Some(joint) => joint.surfaces.iter().copied().collect(),
            None => HashSet::new(),
        };
        let [least, greatest] = [part.bounds.min, part.bounds.max].map(Vec3::as_dvec3);
        let mut found = BTreeSet::new();
        for (at, _) in Neighbours::of(self.instances, slot, &part.bounds).list {
            let Some(placed) = self.instances.at(at) else {
                continue;
            };
            let pieces = placed.part.surface_set().border().as_slice();
            // Surfaces of the fixed part have no common numbers.
            let with_fixed = at == FIXED || part.is_fixed();
            let is_common = |piece: &u32| {
                if with_fixed {
                    return true;
                }
                let number = placed.surface_number(pieces[*piece as usize].surface);
                numbers.contains(&number)
            };
            let is_near = |piece: &u32| {
                let [low, high] = placed.bounds_of_piece(*piece);
                low.cmple(greatest + ASIDE_M).all() && high.cmpge(least - ASIDE_M).all()
            };
            let own = placed
                .border()
                .filter(|piece| placed.is_raised(*piece) == raised);
            let own = own.filter(|piece| is_common(piece) && is_near(piece));
            found.extend(own.map(|piece| (at, piece)));
        }
        found
    }

    /// Of some pieces and those that they touch, the ones that are to be raised, or lowered if they are `raised`.
    fn by_slot(&mut self, mut left: BTreeSet<Piece>, raised: bool) -> BTreeMap<usize, Vec<u32>> {
        let mut changed: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        while let Some(first) = left.pop_first() {
            let (found, are_panels) = self.spread(first, raised);
            for (at, piece) in found {
                left.remove(&(at, piece));
                if are_panels != raised {
                    changed.entry(at).or_default().push(piece);
                }
            }
        }
        changed
    }

    /// All pieces that touch each other and the first, raised ones or others, and whether they are panels together. There may be
    /// more raised ones if they are.
    fn spread(&mut self, first: Piece, raised: bool) -> (Vec<Piece>, bool) {
        let mut found = vec![first];
        let mut is_panel = false;
        let (mut area_m2, mut at) = (0.0, 0);
        while let Some(&(slot, piece)) = found.get(at) {
            at += 1;
            let Some(placed) = self.instances.at(slot) else {
                continue;
            };
            let border = placed.part.surface_set().border();
            area_m2 += border.as_slice()[piece as usize].area_m2;
            is_panel |= area_m2 >= border.least_m2();
            if raised && is_panel {
                break;
            }
            for other in self.around(slot) {
                let (touches_panel, touched) = self.touched(placed, piece, other);
                is_panel |= touches_panel;
                for next in touched {
                    match next.1 {
                        true if !raised => is_panel = true,
                        _ if found.contains(&(other, next.0)) => (),
                        _ => found.push((other, next.0)),
                    }
                }
            }
        }
        (found, is_panel)
    }

    /// Whether a piece touches a panel of another part's commit, and the border pieces there that it touches, each with whether it
    /// is a panel.
    fn touched(
        &self,
        placed: &PlacedInstance,
        piece: u32,
        other: usize,
    ) -> (bool, Vec<(u32, bool)>) {
        let none = (false, Vec::new());
        let surface = placed.part.surface_set().border().as_slice()[piece as usize].surface;
        let Some(part) = self.instances.at(other) else {
            return none;
        };
        let [low, high] = placed.bounds_of_piece(piece);
        let is_near = |[from, to]: [DVec3; 2]| {
            from.cmple(high + ASIDE_M).all() && to.cmpge(low - ASIDE_M).all()
        };
        if !is_near([part.bounds.min, part.bounds.max].map(|corner| corner.as_dvec3())) {
            return none;
        }
        let set = part.part.surface_set();
        let pieces = set.border().as_slice();
        let mut points = placed.points_beside(piece);
        // Surfaces of the fixed part have no common numbers: planes and materials are compared.
        let (touches_panel, candidates) = if other == FIXED || placed.is_fixed() {
            let own = &placed.surfaces[surface as usize];
            let is_on_panel = |at: DVec3| {
                let triangle = triangle_in_plane(part, own, at, own.normal.as_vec3());
                triangle.is_some_and(|triangle| part.part.is_panel(triangle))
            };
            let is_same = |next: &u32| {
                let surface = &part.surfaces[pieces[*next as usize].surface as usize];
                let [low, high] = part.bounds_of_piece(*next);
                surface.material == own.material
                    && is_parallel(surface.normal, own.normal)
                    && own.distance_m(0.5 * (low + high)).abs() <= SAME_PLANE_DISTANCE_M
            };
            let same: Vec<u32> = part.border().filter(is_same).collect();
            (points.any(is_on_panel), same)
        } else {
            let number = placed.surface_number(surface);
            let Some(member) = self.instances.member(number, other) else {
                return none;
            };
            let touches_panel = set.surfaces[member.local as usize].panel_triangle_count > 0
                && points.any(|point| part.part.reflects_at(member.local, part.point(point)));
            (
                touches_panel,
                set.border().of_surface(member.local).collect(),
            )
        };
        let mut touched = Vec::new();
        for next in candidates {
            if !is_near(part.bounds_of_piece(next)) {
                continue;
            }
            let own = placed.part.surface_set();
            let mut to = placed.points_beside(piece);
            let mut from = part.points_beside(next);
            if to.any(|point| set.border_piece_holds(next, part.point(point)))
                || from.any(|point| own.border_piece_holds(piece, placed.point(point)))
            {
                touched.push((next, part.is_raised(next)));
            }
        }
        (touches_panel, touched)
    }
}
