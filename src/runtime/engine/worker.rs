//! One step of propagation at run time: newest orders, newest poses, one update, off to the renderer.
//!
//! Runs on whichever thread calls [`Worker::step`]: the propagation thread alone, or the app's and its helpers in the
//! synchronous schedule. Allocates while a scene is new; frees what the renderer has retired.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::messages::{Delivery, WorldFrame};
use super::shown_paths::{PathSnapshot, show};
use super::statistics::{Meters, add};
use crate::extrapolation::{Extrapolator, PredictorKind, PredictorState, ScenePair};
use crate::propagation::{Path, Propagator};
use crate::runtime::budget::{ActiveQuality, Governor, Spent};
use crate::runtime::handover::newest::{Receiver, Sender};
use crate::runtime::handover::slot::Slot;
use crate::runtime::phone::DeviceHints;
use crate::runtime::threads::clock::{nanoseconds, now};
use crate::runtime::threads::workers::Threads;
use crate::runtime::trace::system_trace::section;
use crate::runtime::trace::{SpanKind, SpanWriter};
use crate::scene::Scene;

/// The newest propagator that the controller wants used: for another scene, or with other settings.
pub(super) type Orders = Arc<Slot<Propagator>>;

/// Propagation with its ends of the handovers.
pub(super) struct Worker {
    pub(super) propagator: Box<Propagator>,
    pub(super) orders: Orders,
    pub(super) world: Receiver<WorldFrame>,
    pub(super) deliveries: Sender<Delivery>,
    pub(super) meters: Arc<Meters>,
    pub(super) max_paths: usize,
    pub(super) max_sources: usize,
    pub(super) synchronous: bool,
    /// Whether the sound thread's blocks are to take alike time.
    pub(super) even_blocks: bool,
    /// Who traces, besides the thread that steps.
    pub(super) tracers: Threads,
    pub(super) governor: Governor,
    /// What the budget leaves.
    pub(super) detail: ActiveQuality,
    /// Time of the last update's poses.
    pub(super) last_time_s: Option<f64>,
    /// Heat and hints, by the time since the engine began.
    pub(super) manners: DeviceHints,
    pub(super) epoch: Instant,
    /// Paths for pictures, and how many.
    pub(super) shown: Sender<PathSnapshot>,
    pub(super) most_shown: usize,
    pub(super) spans: SpanWriter,
    pub(super) before_update: Option<fn(u64)>,
    /// The poses in use.
    pub(super) newest: Option<Box<WorldFrame>>,
    /// The predictor that the renderer has or will have got.
    pub(super) predictor: PredictorKind,
    /// Extrapolation for a new scene, waiting for its first update.
    pub(super) extrapolator: Option<Box<Extrapolator>>,
    /// The scene that the propagator was given last; it has its own copy as soon as instances move.
    pub(super) given: Arc<Scene>,
    /// The same with other instances, waiting for its first update.
    pub(super) scenes: Option<ScenePair>,
    pub(super) update: u64,
}

/// Extrapolation for a propagator's scene, with room for as many paths and sources as there may be.
pub(super) fn extrapolator_for(
    propagator: &Propagator,
    kind: PredictorKind,
    [max_paths, max_sources]: [usize; 2],
) -> Box<Extrapolator> {
    let min_distance_m = propagator.settings().min_distance_m;
    let mut extrapolator = Extrapolator::new(Arc::clone(propagator.scene()), kind, min_distance_m);
    extrapolator.reserve(max_paths, max_sources);
    Box::new(extrapolator)
}

impl Worker {
    /// Computes an update if there are new poses or a new order; gives the time to rest until the next, or `None` if
    /// there was nothing to do.
    pub(super) fn step(&mut self) -> Option<Duration> {
        let ordered = self.take_order();
        let posed = self.take_poses();
        let world = self.newest.take_if(|_| ordered || posed)?;
        self.take_instances(&world);
        if let Some(before_update) = self.before_update {
            before_update(self.update);
        }
        let mut delivery = self.deliveries.blank(Delivery::default);
        let started = now();
        let _section = section("foresound update");
        self.propagator.update_with(
            &self.tracers,
            &world.listener,
            &world.sources,
            world.time_s,
            &mut delivery.paths,
        );
        let trimmed = keep_loudest(&mut delivery.paths.paths, self.detail.max_paths);
        self.lay_groundwork(world.predictor, &mut delivery);
        let spent = started.elapsed();
        delivery.order_gain = self.detail.order_gain;
        let paths = delivery.paths.paths.len() as u64;
        if self.most_shown > 0 {
            let mut shown = self.shown.blank(PathSnapshot::default);
            show(&delivery.paths, self.most_shown, &mut shown.paths);
            self.shown.send(shown);
        }
        self.meters
            .rays
            .store(delivery.paths.rays, Ordering::Relaxed);
        self.govern(&world, spent);
        let rest = Duration::from_secs_f64(self.governor.rest_s());
        delivery.interval_s = (spent + rest).as_secs_f64();
        delivery.synchronous = self.synchronous;
        delivery.extrapolator = self.extrapolator.take();
        delivery.scenes = self.scenes.take();
        delivery.predictor = (world.predictor != self.predictor).then(|| {
            let kind = self.paced(world.predictor);
            PredictorState::with_room(kind, self.max_paths, self.max_sources)
        });
        self.predictor = world.predictor;
        self.newest = Some(world);
        self.update += 1;
        self.spans.record(SpanKind::Update, started, spent, paths);
        self.meters.propagation.record(spent);
        add(&self.meters.trimmed_paths, trimmed as u64);
        let latest_ns = nanoseconds(spent);
        self.meters
            .propagation_ns
            .store(latest_ns, Ordering::Relaxed);
        self.send(delivery);
        Some(rest)
    }

    /// The predictor as the sound thread is to have it.
    fn paced(&self, kind: PredictorKind) -> PredictorKind {
        match self.even_blocks {
            true => kind.reduced(),
            false => kind,
        }
    }

    /// Works out here what the sound thread would have to when it takes the update.
    fn lay_groundwork(&self, predictor: PredictorKind, delivery: &mut Delivery) {
        let Delivery {
            paths, groundwork, ..
        } = delivery;
        match predictor {
            PredictorKind::Geometric(_) => {
                groundwork.prepare(paths, self.propagator.scene());
            }
            PredictorKind::Hold | PredictorKind::Linear => groundwork.clear(),
        }
    }

    /// What the budget makes of an update.
    fn govern(&mut self, world: &WorldFrame, took: Duration) {
        let before = self.governor.tier();
        let spent = Spent {
            update_s: took.as_secs_f64(),
            since_last_s: world.time_s - self.last_time_s.unwrap_or(world.time_s),
            sound_share: self.meters.sound_share(),
            can_rest: !self.synchronous,
        };
        self.last_time_s = Some(world.time_s);
        let now_s = self.epoch.elapsed().as_secs_f64();
        let budget = self.manners.temper(world.budget, now_s);
        self.governor.observe(&budget, &spent);
        if !self.synchronous {
            self.manners.tell_update(spent.update_s, &budget);
        }
        if self.manners.wants_sound(now_s) {
            let load = self.meters.take_sound_load();
            self.manners.tell_sound(load, now_s);
        }
        self.meters.manners.store(self.manners.report());
        let tier = self.governor.tier();
        if tier != before {
            let number = u32::from(tier.0);
            self.meters.tier.store(number, Ordering::Relaxed);
            self.spans
                .record(SpanKind::QualityLevel, now(), Duration::ZERO, number.into());
        }
        self.take_detail();
    }

    fn take_detail(&mut self) {
        let settings = self.propagator.settings();
        self.detail = self.governor.detail(settings, self.max_paths);
        self.propagator.set_quality(self.detail.effort);
    }

    fn take_order(&mut self) -> bool {
        let Some(ordered) = self.orders.take() else {
            return false;
        };
        let before = std::mem::replace(&mut self.propagator, ordered);
        let scene = self.propagator.scene();
        let same_scene = before.scene().same_fixed_part(scene)
            && before.settings().min_distance_m == self.propagator.settings().min_distance_m;
        if !same_scene {
            let kind = self.paced(self.predictor);
            let room = [self.max_paths, self.max_sources];
            self.extrapolator = Some(extrapolator_for(&self.propagator, kind, room));
            self.scenes = None;
            self.governor.begin_scene();
        } else if scene.has_instances() || before.scene().has_instances() {
            self.scenes = Some(ScenePair::of(scene));
        }
        self.given = Arc::clone(scene);
        self.take_detail();
        true
    }

    /// Instances that were added, removed or moved.
    fn take_instances(&mut self, world: &WorldFrame) {
        // Poses of another scene wait for its propagator.
        if !Arc::ptr_eq(&world.scene, &self.given) && world.scene.same_fixed_part(&self.given) {
            self.given = Arc::clone(&world.scene);
            *self.propagator.scene_mut() = Scene::clone(&world.scene);
            self.scenes = Some(ScenePair::of(&world.scene));
        }
        if self.propagator.scene().has_instances() {
            let scene = self.propagator.scene_mut();
            scene.set_instance_poses(&world.instances);
        }
    }

    fn take_poses(&mut self) -> bool {
        let Some(world) = self.world.take() else {
            return false;
        };
        if let Some(old) = self.newest.replace(world) {
            self.world.give_back(old);
        }
        true
    }

    /// Sends an update, with what an earlier one that nobody took had brought along.
    fn send(&mut self, mut delivery: Box<Delivery>) {
        if let Some(mut missed) = self.deliveries.recall() {
            if delivery.extrapolator.is_none() {
                delivery.extrapolator = missed.extrapolator.take();
                delivery.scenes = delivery.scenes.take().or_else(|| missed.scenes.take());
            }
            if delivery.predictor.is_none() {
                delivery.predictor = missed.predictor.take();
            }
            self.deliveries.keep(missed);
        }
        self.deliveries.send(delivery);
    }
}

/// Energy over that of the loudest path dropped up to which paths are faded, so that one whose rank changes neither
/// comes nor goes with a step: 6 dB.
const KNEE: f32 = 4.0;

/// Drops the quietest paths beyond a limit, keeps the order, and gives the number dropped.
fn keep_loudest(paths: &mut Vec<Path>, most: usize) -> usize {
    let dropped = paths.len().saturating_sub(most);
    if dropped > 0 {
        let energy = |path: &Path| path.amplitude.iter().map(|a| a * a).sum::<f32>();
        paths.select_nth_unstable_by(most, |a, b| {
            energy(b)
                .total_cmp(&energy(a))
                .then_with(|| a.id.cmp(&b.id))
        });
        let silent = energy(&paths[most]).max(f32::MIN_POSITIVE);
        paths.truncate(most);
        for path in paths.iter_mut() {
            let over = energy(path) / silent;
            if over < KNEE {
                let gain = (over - 1.0) / (KNEE - 1.0);
                path.amplitude = path.amplitude.map(|a| a * gain.max(0.0));
            }
        }
        paths.sort_unstable_by_key(|path| path.id);
    }
    dropped
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::{MAX_DIFFRACTION_ORDER, MAX_ORDER, PathId};
    use crate::scene::SourceId;
    use glam::Vec3;

    fn path(number: u64, amplitude: f32) -> Path {
        Path {
            id: PathId(number),
            source: SourceId::default(),
            order: 1,
            diffraction_order: 0,
            edges: [0; MAX_DIFFRACTION_ORDER],
            surfaces: [0; MAX_ORDER],
            points: [Vec3::ZERO; MAX_ORDER],
            image: Vec3::ZERO,
            length_m: 1.0,
            amplitude: [amplitude; 8],
        }
    }

    #[test]
    fn a_path_that_loses_its_rank_has_faded_before() {
        let heard = |amplitude: f32| {
            let others = (1..6).map(|n| path(n, 0.1 + 0.2 * n as f32));
            let mut paths: Vec<Path> = others.chain([path(9, amplitude)]).collect();
            assert_eq!(keep_loudest(&mut paths, 4), 2);
            assert!(paths.is_sorted_by_key(|path| path.id));
            let found = paths.iter().find(|path| path.id == PathId(9));
            found.map_or(0.0, |path| path.amplitude[0])
        };
        let mut last = heard(0.3);
        assert_eq!(last, 0.0);
        for step in 1..=1000 {
            let next = heard(0.3 + 0.001 * step as f32);
            // 6 dB about the limit: at most some three times as fast as the path itself.
            assert!((next - last).abs() < 0.005, "{last} to {next}");
            last = next;
        }
        assert_eq!(last, 1.3);
    }

    #[test]
    fn within_the_limit_nothing_is_touched() {
        let mut paths: Vec<Path> = (0..4).map(|n| path(n, 0.5)).collect();
        let before = paths.clone();
        assert_eq!(keep_loudest(&mut paths, 4), 0);
        assert_eq!(paths, before);
    }
}
