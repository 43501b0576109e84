//! Steps of one graphics frame, computed at once or in parts.
//!
//! Audio side. Order: the direct field by source, the other paths, sorting and late energy. A part ends when its budget is
//! spent, and the next part resumes there. The parts do not affect the result.

use super::extrapolator::{Extrapolator, Rule, Step};
use super::frame::{FramePath, FramePaths, LateSend, Obstruction, PathKind, WideArrival, allows};
use super::frame_mix::{FrameMix, find as find_mix};
use super::predictor::{FrameContext, TrackedPath};
use super::wide_reflections::WideSource;
use crate::acoustics::BANDS;
use crate::extrapolation::geometric::{FrameInputs, SourceShadow, extrapolate_late};
use crate::extrapolation::work_budget::{Progress, WorkBudget, cost};
use crate::propagation::diffraction::{
    DirectField, WideField, direct_field, edges_with_shares, wide_field,
};
use crate::propagation::diffuse::late_segments;
use crate::propagation::endpoints::Endpoints;
use crate::propagation::transmission::unoccluded_path;
use crate::propagation::{EdgeLimits, LateEnergy, Path, PathSet};
use crate::scene::edges::DiffractingEdges;
use crate::scene::{ListenerPose, Scene, SourceId, SourcePose};

const DONE: Progress = Progress {
    rays: 0,
    is_done: true,
};

/// Time in seconds between graphics frames of which nobody tells it.
const UNTIMED_FRAME_S: f64 = 1.0 / 60.0;

impl Extrapolator {
    /// Computes the graphics frame of these poses; the next call computes the next frame. Returns the number of rays cast.
    /// Before the first update the frame has only the direct field.
    pub fn frame(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        result: &mut FramePaths,
    ) -> u64 {
        let budget = &mut WorkBudget::boundless();
        let direct = self.direct_part(listener, sources, budget, result);
        direct.rays + self.other_part(listener, sources, budget, result).rays
    }

    /// Resumes the direct field of a graphics frame until the budget is spent. Poses and result must stay the same until
    /// [`Self::other_part`] is done; a new update, scene or predictor restarts the frame.
    pub fn direct_part(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        budget: &mut WorkBudget,
        result: &mut FramePaths,
    ) -> Progress {
        let mut progress = DONE;
        let Step::Direct(first) = self.step else {
            return progress;
        };
        if first == 0 {
            result.paths.clear();
            result.wide.clear();
            result.obstructions.clear();
            self.edge_rays = 0;
            self.shadows.clear();
            self.mixes.clear();
            self.images.clear();
            self.direct_lines
                .begin(sources.len(), self.direct_reach(), self.time_s);
        }
        for (index, pose) in sources.iter().enumerate().skip(first) {
            if budget.is_spent() {
                self.step = Step::Direct(index);
                progress.is_done = false;
                return progress;
            }
            let (before, mut rays) = (result.paths.len(), 0);
            let endpoints = Endpoints::of(pose, listener.position, self.min_distance_m);
            let (ear, min_distance_m) = (listener.position, endpoints.min_distance_m);
            let limits = self.edge_limits(index, &endpoints);
            let mix = self.smoother.frame_mix(pose, ear, min_distance_m);
            let scene = self.scenes.current();
            let is_wide = pose.settings.extent.is_wide();
            let at = (scene, listener);
            let listed_edges = self.direct_edges(&endpoints);
            let straight_m = straight_m(scene, &endpoints);
            let edges = || edges_with_shares(&listed_edges, straight_m, &limits);
            let lines = &mut self.direct_lines;
            let paths = &mut result.paths;
            let extrapolated = match is_wide {
                true => None,
                false => lines.extrapolate(index, &endpoints, at, edges, &mut rays, paths),
            };
            self.edge_rays += rays.saturating_sub(1);
            let is_extrapolated = extrapolated.is_some();
            let (field, wide) = match extrapolated {
                Some(field) => (field, None),
                None => {
                    let paths = &mut result.paths;
                    let edges = (edges(), &limits);
                    self.computed_field(&endpoints, edges, listener, &mix, &mut rays, paths)
                }
            };
            if !is_extrapolated && !is_wide {
                let paths = &result.paths[before..];
                self.direct_lines
                    .store((index, scene), &endpoints, &field, paths);
            }
            self.shadows.push(SourceShadow::of(&field, limits));
            let hidden_share = match &wide {
                Some(wide) => 1.0 - wide.visible_share,
                None => f32::from(u8::from(field.through != [1.0; BANDS])),
            };
            let is_blocked = hidden_share >= 1.0;
            if is_blocked {
                let straight = result.paths[before..].iter_mut();
                straight
                    .filter(|path| path.kind.is_straight())
                    .for_each(|path| path.kind = PathKind::Transmitted);
            }
            result.obstructions.push(Obstruction {
                source: pose.id,
                is_blocked,
                occlusion: hidden_share * mix.mix.occlusion,
                transmission: field.through,
            });
            let paths = &mut result.paths;
            // What comes through walls from a wide source has its gain.
            let line = match &wide {
                Some(wide) => (false, Some(&wide.free)),
                None => (is_blocked, None),
            };
            mix.apply_to_direct(scene, &endpoints, listener, line, paths, before);
            let straight = paths[before..].iter().find(|path| path.kind.is_straight());
            if let (Some(wide), Some(path)) = (&wide, straight) {
                let arrival = WideArrival::of(path.id, wide.image.points(), ear);
                result.wide.extend(arrival);
            }
            self.images.extend(wide.map(|wide| (pose.id, wide.image)));
            self.mixes.push(mix);
            let waves = cost::WAVE * field.waves + cost::SIDES * field.edges.as_slice().len();
            budget.spend(cost::DIRECT + cost::RAY * rays as usize + waves);
            progress.rays += rays;
        }
        self.step = Step::Continued(0);
        progress
    }

    /// Computes a source's direct field; a wide source has a field of its points too.
    fn computed_field(
        &self,
        endpoints: &Endpoints,
        (edges, limits): (impl Iterator<Item = (u32, f64)> + Clone, &EdgeLimits),
        listener: &ListenerPose,
        mix: &FrameMix,
        rays: &mut u64,
        paths: &mut Vec<FramePath>,
    ) -> (DirectField, Option<WideField>) {
        let scene = self.scenes.current();
        let source = &endpoints.source;
        let mut emit = |path: Path| {
            paths.push(FramePath::of(&path, source.position, listener, scene));
        };
        if source.settings.extent.is_wide() {
            let through = mix.mix.transmission;
            let wide = wide_field(scene, endpoints, edges, through, rays, &mut emit);
            return (wide.direct, Some(wide));
        }
        let limits = |_: &DirectField, _: &mut u64, _: &mut dyn FnMut(Path)| *limits;
        let field = direct_field(scene, endpoints, edges, limits, rays, &mut emit);
        (field, None)
    }

    /// Resumes the rest of the frame until the budget is spent, after the direct field and for the same poses.
    pub fn other_part(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        budget: &mut WorkBudget,
        result: &mut FramePaths,
    ) -> Progress {
        let mut progress = match self.step {
            Step::Direct(_) => Progress::default(),
            Step::Continued(first) => {
                self.continued_part(listener, sources, first, budget, &mut result.paths)
            }
            Step::Emission(_) | Step::Finish => DONE,
        };
        if !progress.is_done {
            return progress;
        }
        if let Step::Continued(_) = self.step {
            self.step = Step::Emission(0);
            self.widen_reflections(listener, sources, budget, result);
        }
        if !self.emission_part(sources, budget, &mut result.paths) {
            progress.is_done = false;
            return progress;
        }
        if budget.is_spent() {
            self.step = Step::Finish;
            progress.is_done = false;
            return progress;
        }
        self.apply_mixes(listener, sources, &mut result.paths);
        budget.spend(result.paths.len() / cost::SORTED + cost::LATE * self.current.late.len());
        result.paths.sort_unstable_by_key(|path| path.id);
        result.wide.sort_unstable_by_key(|wide| wide.id);
        result.orientation = listener.orientation;
        result.high_air_np_per_s = self.scenes.current().high_air_np_per_s();
        progress.rays += self.update_late(listener, sources);
        result.late_groups = self.late_groups;
        result.late.clear();
        let has_late = |late: &LateEnergy| {
            let own = sources.iter().find(|pose| pose.id == late.source);
            own.is_some_and(|pose| pose.settings.effects.late)
        };
        for late in self.late.iter().filter(|late| has_late(late)) {
            let segments = late_segments(late, &result.late_groups);
            result.late.extend(segments.map(|segment| LateSend {
                source: late.source,
                group: segment.group,
                energy_per_s: segment.energy_per_s,
                start_s: segment.start_s,
            }));
        }
        for send in &mut result.late {
            if let Some(mix) = find_mix(&self.mixes, send.source) {
                mix.apply_to_late(send, &result.late_groups);
            }
        }
        self.frames_since_update = self.frames_since_update.saturating_add(1);
        self.direct_lines.end();
        if !std::mem::take(&mut self.is_timed) {
            self.time_s += UNTIMED_FRAME_S;
        }
        self.step = Step::default();
        progress
    }

    /// Gives the reflections of wide sources their level and width.
    fn widen_reflections(
        &self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        budget: &mut WorkBudget,
        result: &mut FramePaths,
    ) {
        for (id, points) in &self.images {
            let Some(pose) = sources.iter().find(|pose| pose.id == *id) else {
                continue;
            };
            let min_distance_m = pose.settings.min_distance_m(self.min_distance_m);
            let speed_m_s = self.scenes.current().speed_of_sound_m_s();
            let at = listener.position;
            let source = WideSource::new(pose, points, at, [min_distance_m, speed_m_s]);
            let widened = source.widen(&mut result.paths, &mut result.wide);
            budget.spend(cost::WIDENED * widened + result.paths.len() / cost::SORTED);
        }
    }

    /// Applies the mixes of all sources to the paths of the frame.
    fn apply_mixes(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        paths: &mut [FramePath],
    ) {
        if self.mixes.iter().all(|mix| mix.is_physical) {
            return;
        }
        let scene = self.scenes.current();
        for (mix, pose) in self.mixes.iter_mut().zip(sources) {
            if mix.mix.doppler != 1.0 {
                let (from, to) = (pose.position, listener.position);
                let min_distance_m = pose.settings.min_distance_m(self.min_distance_m);
                let line = unoccluded_path(scene, pose.id, from, to, min_distance_m);
                let mut line = FramePath::of(&line, from, listener, scene);
                self.motion.apply(&mut line, scene, min_distance_m);
                mix.flight_s = line.delay_s;
            }
        }
        for path in paths {
            if let Some(mix) = find_mix(&self.mixes, path.source).filter(|mix| !mix.is_physical) {
                mix.apply(path, scene);
            }
        }
    }

    /// Limits of a source at an index, between those of the last two updates.
    fn edge_limits(&self, index: usize, endpoints: &Endpoints) -> EdgeLimits {
        let [Some(newest), before] =
            [&self.current, &self.previous].map(|update| limits_of(update, index, endpoints))
        else {
            return EdgeLimits::default();
        };
        before.map_or(newest.0, |before| between(before, newest))
    }

    /// The edges of a source's direct field in the newest update and in that one of the others whose positions are nearest,
    /// shortest detour first: the updates may be for positions before and after the present one, and a listener that has turned
    /// comes back to those of an earlier one.
    fn direct_edges(&self, endpoints: &Endpoints) -> DiffractingEdges {
        let others = std::iter::once(&self.previous).chain(&self.older);
        let far_m = |update: &&PathSet| update_distance_m(update, endpoints);
        let nearest = others.reduce(|a, b| if far_m(&b) < far_m(&a) { b } else { a });
        let edges = self.current.direct_edges.iter();
        let edges = edges
            .chain(nearest.into_iter().flat_map(|update| &update.direct_edges))
            .filter(|(id, _)| *id == endpoints.source.id)
            .map(|(_, edge)| *edge);
        let scene = self.scenes.current();
        let [from, to] = [endpoints.from, endpoints.to].map(|position| scene.to_local(position));
        scene.diffracting_edges_over(edges, from, to)
    }

    /// Appends the reflected and diffracted paths that are not part of the direct field.
    fn continued_part(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        first: usize,
        budget: &mut WorkBudget,
        paths: &mut Vec<FramePath>,
    ) -> Progress {
        let predictor = match &mut self.predictor.0 {
            Rule::PathByPath(predictor) => predictor,
            Rule::Geometric(predictor) => {
                let inputs = FrameInputs {
                    scene: self.scenes.current(),
                    update_scene: self.scenes.at_update(),
                    listener,
                    sources,
                    time_s: self.time_s,
                    shadows: &self.shadows,
                    min_distance_m: self.min_distance_m,
                    reflection_edges: &self.current.reflection_edges,
                    edge_rays: self.edge_rays,
                };
                let is_new = self.updates > 0 && self.frames_since_update == 0;
                let arrived = is_new.then_some((&self.current, &self.prepared));
                let progress = predictor.resume(arrived, &inputs, budget, paths);
                // The candidates may include paths of effects that are now off.
                if progress.is_done && !sources.iter().all(|pose| pose.settings.effects.reflections)
                {
                    paths.retain(|path| path.order == 0 || reflects(sources, path.source));
                }
                return progress;
            }
        };
        let at = FrameContext {
            scene: self.scenes.current(),
            listener,
            frames_since_update: self.frames_since_update,
            level: self.level,
        };
        let each = self.current.paths.iter().zip(&self.matches);
        for (index, (current, matched)) in each.enumerate().skip(first) {
            if budget.is_spent() {
                self.step = Step::Continued(index);
                return Progress::default();
            }
            budget.spend(cost::CONTINUED);
            let exists = |surface: &u32| at.scene.has_surface(*surface);
            let is_gone = !current.surfaces().iter().all(exists);
            let is_diffracted = current.diffraction_order > 0;
            let is_allowed = |pose: &SourcePose| {
                pose.id == current.source && allows(pose, current.order, is_diffracted)
            };
            let Some(source) = sources.iter().find(|pose| is_allowed(pose)) else {
                continue;
            };
            if current.is_frame_validated() || is_gone {
                continue;
            }
            let tracked = TrackedPath {
                current,
                source: source.position,
                previous: matched.map(|i| &self.previous.paths[i as usize]),
                listener: &self.current.listener,
            };
            paths.push(predictor.predict(&tracked, &at));
        }
        DONE
    }

    /// Moves the starts of paths of moving sources to the positions at emission; returns whether it is done.
    fn emission_part(
        &mut self,
        sources: &[SourcePose],
        budget: &mut WorkBudget,
        paths: &mut [FramePath],
    ) -> bool {
        let Step::Emission(first) = self.step else {
            return true;
        };
        if self.motion.is_at_rest() {
            return true;
        }
        let scene = self.scenes.current();
        for (index, path) in paths.iter_mut().enumerate().skip(first) {
            if budget.is_spent() {
                self.step = Step::Emission(index);
                return false;
            }
            budget.spend(cost::EMISSION);
            let pose = sources.iter().find(|pose| pose.id == path.source);
            let min_distance_m = pose.map_or(self.min_distance_m, |pose| {
                pose.settings.min_distance_m(self.min_distance_m)
            });
            self.motion.apply(path, scene, min_distance_m);
        }
        true
    }

    /// Computes the late energy of every source of the newest update; returns the number of rays cast.
    fn update_late(&mut self, listener: &ListenerPose, sources: &[SourcePose]) -> u64 {
        self.late.clear();
        if let Rule::PathByPath(_) = self.predictor.0 {
            self.late.extend_from_slice(&self.current.late);
            self.late_groups = self.current.late_groups;
            return 0;
        }
        let inputs = FrameInputs {
            scene: self.scenes.current(),
            update_scene: self.scenes.at_update(),
            listener,
            sources,
            time_s: self.time_s,
            shadows: &self.shadows,
            min_distance_m: self.min_distance_m,
            reflection_edges: &self.current.reflection_edges,
            edge_rays: self.edge_rays,
        };
        let (late, groups) = (&mut self.late, &mut self.late_groups);
        let updates = [&self.current, &self.previous].into_iter();
        extrapolate_late(updates.chain(&self.older), &inputs, groups, |source| {
            late.push(source);
        })
    }
}

/// An update's limits of a source, mostly at this index, and how far in metres its positions are from these.
fn limits_of(update: &PathSet, index: usize, endpoints: &Endpoints) -> Option<(EdgeLimits, f64)> {
    let id = endpoints.source.id;
    let own = |limits: &&(SourceId, EdgeLimits)| limits.0 == id;
    let likely = update.edge_limits.get(index).filter(own);
    let (_, limits) = likely.or_else(|| update.edge_limits.iter().find(own))?;
    let off_m = update_distance_m(update, endpoints);
    off_m.is_finite().then_some((*limits, f64::from(off_m)))
}

/// Limits between those of two updates, by the distances from their positions.
fn between(
    (before, before_m): (EdgeLimits, f64),
    (newest, newest_m): (EdgeLimits, f64),
) -> EdgeLimits {
    let share = match before_m + newest_m > 0.0 {
        true => before_m / (before_m + newest_m),
        false => 1.0,
    };
    let mix = |before: f64, newest: f64| match before.is_finite() && newest.is_finite() {
        true => before + (newest - before) * share,
        false => newest,
    };
    EdgeLimits {
        two_edge_floor: mix(before.two_edge_floor, newest.two_edge_floor),
        two_edge_detour_m: match (before.two_edge_detour_m, newest.two_edge_detour_m) {
            (Some(before), Some(newest)) => Some(mix(before, newest)),
            (before, newest) => newest.or(before),
        },
        left_out_energy: mix(before.left_out_energy, newest.left_out_energy),
        direct_detour_m: mix(before.direct_detour_m, newest.direct_detour_m),
        near_detours_m: match (before.near_detours_m, newest.near_detours_m) {
            (Some(before), Some(newest)) => Some([0, 1].map(|i| mix(before[i], newest[i]))),
            (before, newest) => newest.or(before),
        },
    }
}

/// How far in metres an update's positions of a source and its listener are from these; infinite without the source.
fn update_distance_m(update: &PathSet, endpoints: &Endpoints) -> f32 {
    let own = |pose: &&SourcePose| pose.id == endpoints.source.id;
    let source = update.sources.iter().find(own);
    source.map_or(f32::INFINITY, |source| {
        source.position.distance(endpoints.from) + update.listener.position.distance(endpoints.to)
    })
}

/// Length in metres of the straight line, between local positions as in an update.
fn straight_m(scene: &Scene, endpoints: &Endpoints) -> f64 {
    scene
        .to_local(endpoints.from)
        .distance(scene.to_local(endpoints.to))
}

/// Whether a source exists and its reflections are on.
fn reflects(sources: &[SourcePose], id: SourceId) -> bool {
    sources
        .iter()
        .any(|pose| pose.id == id && pose.settings.effects.reflections)
}
