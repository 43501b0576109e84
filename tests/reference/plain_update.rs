//! Oracle: an unoptimised update. Every candidate of every source is unfolded and cast in full, with linear searches of
//! lists; canonical forms are the least of all orders reachable by swaps of neighbours. Shared with the library: rays,
//! the late estimator, diffraction, and the amplitude of a path, which have oracles of their own.

use std::sync::Arc;

use foresound::geometry::Ray;
use foresound::geometry::bvh::NO_GROUP;
use foresound::propagation::curved_reflection;
use foresound::propagation::diffraction::{self, LastSearch, reflection_gain};
use foresound::propagation::diffuse::late_directions::set_directions;
use foresound::propagation::diffuse::{
    LateEstimate, LateEstimator, ListenerField, RayScratch, SceneField, SourceRays,
    VisibilityCells, stable_viewpoint,
};
use foresound::propagation::endpoints::Endpoints;
use foresound::propagation::image_source::image_path::ImagePath;
use foresound::propagation::image_source::sequence::Sequence;
use foresound::propagation::rays::directions::{
    ROTATIONS, fibonacci_direction, interleaved_lattices, lattice_of, rotation,
};
use foresound::propagation::{
    MAX_DIFFRACTION_ORDER, MAX_ORDER, Path, PathSet, PropagationSettings, amplitude,
};
use glam::{DVec3, Vec3};

use foresound::scene::{InstancePose, ListenerPose, Scene, SourceId, SourcePose};

struct SourceState {
    id: SourceId,
    late: LateEstimator,
    cache: Vec<(Sequence, u64)>,
    position: Option<DVec3>,
    origins: [Option<DVec3>; ROTATIONS as usize],
}

/// A propagator without optimisation.
pub struct PlainPropagator {
    scene: Arc<Scene>,
    settings: PropagationSettings,
    update: u64,
    field: SceneField,
    /// Poses of the instances, the update since which they hold, and those of the field.
    instances: (Vec<InstancePose>, u64, Option<Vec<InstancePose>>),
    states: Vec<SourceState>,
    /// Origin of the last guide rays of each rotation, and the update since which the scene had been as it was.
    casts: [Option<(DVec3, u64)>; ROTATIONS as usize],
    /// Sequences hit by guide rays, the newest first.
    history: Vec<Known>,
}

/// A sequence hit by guide rays.
struct Known {
    sequence: Sequence,
    /// One bit for each rotation whose last rays hit it.
    rotations: u16,
    /// Update and listener when rays last hit it or a rotation lost it.
    update: u64,
    ear: Vec3,
}

/// Most sequences that are kept.
const KEPT: usize = 4096;

/// Candidates up to which an update adds sequences that its rays did not hit.
const CANDIDATES: usize = 1024;

impl PlainPropagator {
    pub fn new(scene: Arc<Scene>, settings: PropagationSettings) -> Self {
        Self {
            field: SceneField::default(),
            instances: Default::default(),
            scene,
            settings,
            update: 0,
            states: Vec::new(),
            casts: Default::default(),
            history: Vec::new(),
        }
    }

    pub fn scene_mut(&mut self) -> &mut Scene {
        Arc::make_mut(&mut self.scene)
    }

    pub fn update(&mut self, listener: &ListenerPose, sources: &[SourcePose]) -> PathSet {
        self.update_field(listener, sources);
        let guide = self.guide(listener);
        self.states
            .retain(|state| sources.iter().any(|pose| pose.id == state.id));
        let mut result = PathSet {
            update: self.update,
            listener: *listener,
            sources: sources.to_vec(),
            instances: self.scene.instance_poses().collect(),
            ..PathSet::default()
        };
        let mut directions = Vec::new();
        for pose in sources {
            let late = self.source(listener, pose, &guide, &mut result);
            result.late.push(late.energy);
            directions.push(late.directions);
        }
        set_directions(&mut result.late_groups, directions.iter());
        result.paths.sort_by_key(|path| path.id);
        self.update += 1;
        result
    }

    /// The late field is traced at first, and anew when instances have rested for four updates.
    fn update_field(&mut self, listener: &ListenerPose, sources: &[SourcePose]) {
        let poses: Vec<InstancePose> = self.scene.instance_poses().collect();
        let (last, since, traced) = &mut self.instances;
        if *last != poses {
            (*last, *since) = (poses.clone(), self.update);
        }
        let is_due = self.update - *since >= 4 && traced.as_ref() != Some(&poses);
        if traced.is_none() || is_due {
            *traced = Some(poses);
            let samples = 4 * self.settings.source_rays.min(128) as usize;
            let positions = sources.iter().map(|source| source.position);
            let local = |position| self.scene.to_local(position).as_vec3();
            let occupants: Vec<_> = positions.chain([listener.position]).map(local).collect();
            self.field = SceneField::new(&self.scene, samples, &occupants, &mut 0);
        }
    }

    fn guide(&mut self, listener: &ListenerPose) -> Vec<Sequence> {
        let scene = &*Arc::clone(&self.scene);
        let ear = scene.to_local(listener.position);
        let since = self.instances.1;
        let mut met_now = Vec::new();
        let most = match self.update {
            0 => 4,
            _ => 2,
        };
        let mut casts = 0;
        for turn in self.update..self.update + ROTATIONS {
            let number = (turn % ROTATIONS) as usize;
            let origin = stable_viewpoint(scene, ear, turn, &mut 0);
            let is_in_turn = turn == self.update;
            let is_valid =
                |(at, state): (DVec3, u64)| at == origin && (state == since || !is_in_turn);
            if casts == most || self.casts[number].is_some_and(is_valid) {
                continue;
            }
            casts += 1;
            self.casts[number] = Some((origin, since));
            let bit = 1 << number;
            for known in self
                .history
                .iter_mut()
                .filter(|known| known.rotations & bit != 0)
            {
                known.rotations &= !bit;
                (known.update, known.ear) = (self.update, ear.as_vec3());
            }
            for sequence in self.hit(origin, turn) {
                let old = self
                    .history
                    .iter()
                    .position(|known| known.sequence == sequence);
                let rotations = old.map_or(0, |old| self.history.remove(old).rotations);
                add(&mut met_now, sequence);
                self.history.push(Known {
                    sequence,
                    rotations: rotations | bit,
                    update: self.update,
                    ear: ear.as_vec3(),
                });
            }
        }
        let is_new = |known: &Known| met_now.contains(&known.sequence);
        let order = |known: &Known| met_now.iter().position(|met| *met == known.sequence);
        let (mut new, old): (Vec<_>, Vec<_>) = self.history.drain(..).partition(is_new);
        new.sort_by_key(order);
        let mut found = Vec::new();
        for known in new.iter().chain(&old) {
            if found.len() < new.len().max(KEPT) {
                add(&mut found, least_order(scene, known.sequence.surfaces()));
            }
        }
        let hit = old.iter().filter(|known| known.rotations != 0).count();
        let mut left = KEPT.saturating_sub(new.len() + hit);
        self.history = new;
        for known in old {
            let is_young = known.update >= since || self.update - known.update < 4 * ROTATIONS;
            let is_near = known.ear.distance(ear.as_vec3()) <= 4.0;
            if known.rotations != 0 || is_young && is_near && left > 0 {
                left -= usize::from(known.rotations == 0);
                self.history.push(known);
            }
        }
        self.history.truncate(KEPT);
        self.expand(&mut found);
        found
    }

    /// The sequences that the guide rays of a rotation hit, each once.
    fn hit(&self, origin: DVec3, rotation_number: u64) -> Vec<Sequence> {
        let scene = &*self.scene;
        let turn = rotation(rotation_number, self.settings.seed);
        let mut found = Vec::new();
        for index in 0..self.settings.guide_rays {
            let direction = turn * fibonacci_direction(index, self.settings.guide_rays);
            let mut ray = Ray::new(origin.as_vec3(), direction);
            let mut met = Vec::new();
            while met.len() < self.settings.depth {
                let last = met.first().copied().unwrap_or(NO_GROUP);
                let Some(hit) = scene.closest_hit(&ray, [last, NO_GROUP]) else {
                    break;
                };
                if !scene.is_panel(hit.triangle) {
                    break;
                }
                met.insert(0, hit.group);
                add(&mut found, least_order(scene, &met));
                let normal = scene.surface(hit.group).normal.as_vec3();
                let onward = ray.direction - 2.0 * normal.dot(ray.direction) * normal;
                ray = Ray::new(ray.at(hit.t), onward);
            }
        }
        found
    }

    /// Adds candidates: each is one of the 32 largest surfaces of single reflections prepended to a sequence, pairs first, then
    /// longer ones from this update's start index.
    fn expand(&self, candidates: &mut Vec<Sequence>) {
        let scene = &*self.scene;
        let singles = candidates.iter().filter(|sequence| sequence.len() == 1);
        let mut largest: Vec<u32> = singles.map(|single| single.surfaces()[0]).collect();
        let area = |surface: u32| scene.surface(surface).area_m2;
        largest.sort_by(|a, b| area(*b).total_cmp(&area(*a)));
        largest.truncate(32);
        let prepend = |candidates: &mut Vec<Sequence>, index: usize| {
            let rest = candidates[index];
            for &surface in &largest {
                if candidates.len() < CANDIDATES && surface != rest.surfaces()[0] {
                    let longer = [&[surface], rest.surfaces()].concat();
                    add(candidates, least_order(scene, &longer));
                }
            }
        };
        for index in 0..candidates.len() {
            if candidates[index].len() == 1 && self.settings.depth > 1 {
                prepend(candidates, index);
            }
        }
        let count = candidates.len();
        let start = count * (self.update % ROTATIONS) as usize / ROTATIONS as usize;
        for index in (start..count).chain(0..start) {
            if (2..self.settings.depth).contains(&candidates[index].len()) {
                prepend(candidates, index);
            }
        }
    }

    fn source(
        &mut self,
        listener: &ListenerPose,
        pose: &SourcePose,
        guide: &[Sequence],
        result: &mut PathSet,
    ) -> LateEstimate {
        let scene = Arc::clone(&self.scene);
        let (settings, update) = (self.settings, self.update);
        let (ear, origin) = (
            scene.to_local(listener.position),
            scene.to_local(pose.position),
        );
        if !self.states.iter().any(|state| state.id == pose.id) {
            self.states.push(SourceState {
                id: pose.id,
                late: LateEstimator::default(),
                cache: Vec::new(),
                position: None,
                origins: [None; ROTATIONS as usize],
            });
        }
        let state = self.states.iter_mut().find(|state| state.id == pose.id);
        let state = state.expect("just made");
        let mut viewpoints = VisibilityCells::default();
        viewpoints.renew(&scene, ear.as_vec3(), 0);
        let moves = state
            .position
            .replace(origin)
            .is_some_and(|last| last != origin);
        let directions = interleaved_lattices(settings.source_rays);
        let mut scratch = RayScratch::with_capacity(1 << 16);
        for turn in update..update + ROTATIONS {
            let rays = SourceRays {
                origin: match moves {
                    true => stable_viewpoint(&scene, origin, turn, &mut 0),
                    false => origin,
                },
                offset: DVec3::ZERO,
                field: &self.field,
                pose: *pose,
                directions: lattice_of(&directions, turn),
                turn: rotation(0, settings.seed),
                rotation: turn % ROTATIONS,
                depth: settings.depth,
                scene_state: 0,
                poses_since: 0,
                fixed_since: 0,
            };
            let before = state.origins[rays.rotation as usize].replace(rays.origin);
            let is_new = before != Some(rays.origin);
            state.late.invalidate_rays();
            state.late.cast_rays(&scene, &rays, &mut scratch, &mut 0);
            if is_new || !moves {
                break;
            }
        }
        state
            .late
            .test_visibility(&scene, [origin, ear], &viewpoints, &mut 0);
        let mut field = ListenerField::default();
        field.renew(&scene, &self.field, ear.as_vec3(), &viewpoints, 0);
        result.late_groups = field.groups;
        let late = state.late.estimate(&scene, &self.field, &field, pose.id);
        let mut own = Vec::new();
        for sequence in state.late.sequences(update) {
            if !guide.contains(&sequence) {
                add(&mut own, sequence);
            }
        }
        for (sequence, _) in &state.cache {
            // Commutation depends on the current poses of instances.
            let sequence = least_order(&scene, sequence.surfaces());
            if !guide.contains(&sequence) {
                add(&mut own, sequence);
            }
        }
        let mut candidates = guide.to_vec();
        candidates.append(&mut own);
        let min_distance_m = pose
            .settings
            .min_distance_m(f64::from(settings.min_distance_m));
        // Diffracted paths use the library's function; the law `edge` tests its accuracy.
        let spot = Endpoints::of(pose, listener.position, f64::from(settings.min_distance_m));
        let paths = &mut result.paths;
        let mut emit = |path| paths.push(path);
        let mut last = LastSearch::default();
        let near_edges = diffraction::update(
            &scene,
            &spot,
            settings.diffraction_order,
            &mut last,
            &mut 0,
            &mut emit,
        );
        // So do paths over curved surfaces; the law `mesh/curved` tests them.
        let mut emit = |path| result.paths.push(path);
        curved_reflection::find(&scene, &spot, settings.depth, &mut 0, &mut emit);
        let edges = near_edges.direct.as_slice().iter();
        result
            .direct_edges
            .extend(edges.map(|edge| (pose.id, *edge)));
        let limits = (pose.id, near_edges.limits);
        result.edge_limits.push(limits);
        let edges = || near_edges.reflections.edges();
        let of_source = edges().map(|edge| (pose.id, edge));
        result.reflection_edges.extend(of_source);
        let mut valid = Vec::new();
        let mut single = Vec::new();
        for sequence in &candidates {
            if sequence.len() > settings.depth {
                continue;
            }
            let mirror = |point, &index: &u32| scene.surface(index).mirror(point);
            let image = sequence.surfaces().iter().rev().fold(ear, mirror);
            let found = unfold(&scene, sequence, origin, image)
                .filter(|path| is_clear(&scene, path, [origin, ear]));
            let Some(path) = found else { continue };
            valid.push((*sequence, update));
            let mut amplitude = amplitude::reflected(&scene, &path, min_distance_m);
            if path.order == 1 {
                single.push(path.surfaces[0]);
                if let Some(gain) = reflection_gain(&scene, &spot, path.surfaces[0], edges()) {
                    amplitude = std::array::from_fn(|band| amplitude[band] * gain[band]);
                }
            }
            result.paths.push(Path {
                id: sequence.path_id(&scene, pose.id),
                source: pose.id,
                order: path.order as u8,
                diffraction_order: 0,
                surfaces: path.surfaces,
                edges: [0; MAX_DIFFRACTION_ORDER],
                points: path.points.map(|p| scene.to_world(p)),
                image: scene.to_world(path.image),
                length_m: path.length_m as f32,
                amplitude,
            });
        }
        for near in near_edges.reflections.iter() {
            let is_continued = |surface: &u32| near.0.surface() == Some(*surface);
            if !single.iter().any(is_continued) {
                let path = diffraction::path_in_shadow(&scene, &spot, near);
                result.paths.extend(path);
            }
        }
        for (sequence, seen) in &state.cache {
            let renewed = valid.iter().any(|(s, _)| s == sequence);
            if !renewed && update - seen < settings.cache_updates {
                valid.push((*sequence, *seen));
            }
        }
        assert!(
            valid.len() <= settings.cache_capacity,
            "the oracle has no bound"
        );
        state.cache = valid;
        late
    }
}

fn add(list: &mut Vec<Sequence>, sequence: Sequence) {
    if !list.contains(&sequence) {
        list.push(sequence);
    }
}

/// The lexicographically least of all orders that swaps of perpendicular neighbours reach.
pub fn least_order(scene: &Scene, surfaces: &[u32]) -> Sequence {
    let mut orders = vec![surfaces.to_vec()];
    let mut next = 0;
    while next < orders.len() {
        for i in 1..surfaces.len() {
            let mut swapped = orders[next].clone();
            let commutes = commute(scene, swapped[i - 1], swapped[i]);
            swapped.swap(i - 1, i);
            if commutes && !orders.contains(&swapped) {
                orders.push(swapped);
            }
        }
        next += 1;
    }
    let least = orders.iter().min().expect("at least its own order");
    // Already canonical, so this only changes the type.
    Sequence::canonical(scene, least)
}

/// The path along a sequence, every order of its class tried in turn.
fn unfold(
    scene: &Scene,
    sequence: &Sequence,
    source: DVec3,
    listener_image: DVec3,
) -> Option<ImagePath> {
    let mut path = ImagePath {
        surfaces: [0; MAX_ORDER],
        points: [DVec3::ZERO; MAX_ORDER],
        cosines: [0.0; MAX_ORDER],
        order: 0,
        length_m: source.distance(listener_image),
        image: source,
    };
    descend(
        scene,
        sequence.surfaces(),
        source,
        listener_image,
        &mut path,
    )
    .then_some(())?;
    for step in 0..path.order {
        path.image = scene.surface(path.surfaces[step]).mirror(path.image);
    }
    Some(path)
}

fn descend(scene: &Scene, rest: &[u32], from: DVec3, image: DVec3, path: &mut ImagePath) -> bool {
    if rest.is_empty() {
        return true;
    }
    let line = image - from;
    let step = path.order;
    for (position, &index) in rest.iter().enumerate() {
        let surface = scene.surface(index);
        let commutes = |&other: &u32| commute(scene, index, other);
        if !rest[..position].iter().all(commutes) {
            continue;
        }
        let here = surface.distance_m(from);
        let there = surface.distance_m(image);
        if here * there >= 0.0 || here.abs() < 1e-6 || there.abs() < 1e-6 {
            continue;
        }
        let point = from + line * (here / (here - there));
        if !scene.reflects_at(index, point) {
            continue;
        }
        path.surfaces[step] = index;
        path.points[step] = point;
        path.cosines[step] = (surface.normal.dot(line) / line.length()).abs();
        path.order = step + 1;
        let next = surface.mirror(image);
        let others = [&rest[..position], &rest[position + 1..]].concat();
        if descend(scene, &others, point, next, path) {
            return true;
        }
        path.order = step;
    }
    false
}

/// Whether two planes are perpendicular within 0.006°.
fn commute(scene: &Scene, a: u32, b: u32) -> bool {
    let [a, b] = [a, b].map(|index| scene.surface(index).normal);
    a.dot(b).abs() < 1e-4
}

/// Whether nothing blocks the legs of a path; a leg ignores the surfaces of its ends. Legs meet a thousandth of the longer one
/// before a reflection point.
fn is_clear(scene: &Scene, path: &ImagePath, [source, listener]: [DVec3; 2]) -> bool {
    let mut stops = vec![(source, NO_GROUP)];
    let reflections = path.points.into_iter().zip(path.surfaces);
    stops.extend(reflections.take(path.order));
    stops.push((listener, NO_GROUP));
    let points: Vec<DVec3> = stops.iter().map(|stop| stop.0).collect();
    for (stop, near) in stops[1..].iter_mut().zip(points.windows(3)) {
        let legs = [near[0] - near[1], near[2] - near[1]];
        let longer = usize::from(legs[1].length_squared() > legs[0].length_squared());
        stop.0 = near[1] + legs[longer] * 1e-3;
    }
    stops.windows(2).all(|leg| {
        let ray = Ray::between(leg[0].0.as_vec3(), leg[1].0.as_vec3());
        !scene.any_hit(&ray, [leg[0].1, leg[1].1])
    })
}
