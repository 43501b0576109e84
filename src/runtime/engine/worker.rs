//! One step of propagation: newest propagator, newest poses, one update, sent to the renderer.
//!
//! Runs on the propagation thread, or on the app's thread and its helpers in the synchronous schedule. Allocates in a
//! new scene; frees what the renderer returned.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::messages::{ListenerUpdate, UpdateMessage, WorldFrame};
use super::path_snapshot::{PathSnapshot, fill_snapshot};
use super::statistics::{Metrics, add};
use super::virtual_clock::VirtualArrivals;
use crate::extrapolation::{Extrapolator, PredictorKind, PredictorState, ScenePair};
use crate::generation::LongerLine;
use crate::propagation::{Propagator, Workers};
use crate::runtime::budget::{ActiveQuality, Governor, UpdateCost};
use crate::runtime::handover::atomic_box::AtomicBox;
use crate::runtime::handover::newest::{Receiver, Sender};
use crate::runtime::handover::shared_value::SharedValue;
use crate::runtime::phone::DeviceHints;
use crate::runtime::pipeline::expected_listener::ExpectedListener;
use crate::runtime::pipeline::jumps::UpdateKind;
use crate::runtime::pipeline::line_lengths::LineLengths;
use crate::runtime::pipeline::pose_prediction::UseInterval;
use crate::runtime::pipeline::update_pipeline::{UpdatePipeline, UpdateRequest};
use crate::runtime::pipeline::update_timing::UpdateTiming;
use crate::runtime::threads::clock::{nanoseconds, now};
use crate::runtime::threads::interruption::{InterruptibleThreads, Interruption};
use crate::runtime::threads::workers::Threads;
use crate::runtime::trace::system_trace::section;
use crate::runtime::trace::{SpanKind, SpanWriter};
use crate::scene::Scene;

/// A new propagator from the controller, for another scene or with other settings.
pub(super) type PendingPropagator = Arc<AtomicBox<Propagator>>;

/// Greatest number of nearby paths of an update, in all and per source. With 16 sources in the concert hall 256 a source took
/// four times the sound thread's work for an update, and the sound was farther from the synchronous schedule's.
const MAX_NEARBY: usize = 1024;
const MAX_NEARBY_PER_SOURCE: usize = 128;

/// Propagation and its ends of the channels.
pub(super) struct Worker {
    pub(super) propagator: Box<Propagator>,
    pub(super) pipeline: UpdatePipeline,
    /// Further listeners.
    pub(super) others: Vec<OtherListener>,
    pub(super) timing: UpdateTiming,
    pub(super) pending_propagator: PendingPropagator,
    pub(super) world: Receiver<WorldFrame>,
    pub(super) updates: Sender<UpdateMessage>,
    pub(super) metrics: Arc<Metrics>,
    pub(super) max_paths: usize,
    pub(super) max_sources: usize,
    /// Of the renderer, with those under way.
    pub(super) line_lengths: LineLengths,
    /// Of updates that were not sent.
    pub(super) unsent_lines: Vec<LongerLine>,
    pub(super) synchronous: bool,
    /// Threads of an update, and the request of the controller to end it.
    pub(super) threads: Threads,
    pub(super) interruption: Arc<Interruption>,
    /// Where the update under way expects the listener.
    pub(super) expected: Arc<SharedValue<Option<ExpectedListener>>>,
    pub(super) governor: Governor,
    /// Quality in force.
    pub(super) quality: ActiveQuality,
    /// Time of the poses of the last update, in seconds.
    pub(super) last_time_s: Option<f64>,
    /// Time of the last update that searched.
    pub(super) search_time: Duration,
    /// Thermal and performance hints, timed since `epoch`.
    pub(super) device_hints: DeviceHints,
    pub(super) epoch: Instant,
    /// Paths for debug drawing, and how many.
    pub(super) snapshots: Sender<PathSnapshot>,
    pub(super) max_snapshot_paths: usize,
    pub(super) spans: SpanWriter,
    pub(super) before_update: Option<fn(u64)>,
    /// Poses in use.
    pub(super) newest: Option<Box<WorldFrame>>,
    /// Whether no update has begun for those yet.
    pub(super) has_new_poses: bool,
    /// Predictor sent to the renderer last.
    pub(super) predictor: PredictorKind,
    /// Extrapolator for a new scene, sent with its first update.
    pub(super) extrapolator: Option<Box<Extrapolator>>,
    /// Scene set last; the propagator has its own copy once instances move.
    pub(super) base_scene: Arc<Scene>,
    /// The scene with other instances, sent with its first update.
    pub(super) scenes: Option<ScenePair>,
    pub(super) update: u64,
    /// Whether the first update follows one for each ray rotation.
    pub(super) warms_up: bool,
    /// Set if updates arrive by a virtual clock.
    pub(super) virtual_arrivals: Option<VirtualArrivals>,
}

/// A further listener's part.
#[derive(Default)]
pub(super) struct OtherListener {
    pipeline: UpdatePipeline,
    /// See [`Worker::extrapolator`] and [`Worker::scenes`].
    extrapolator: Option<Box<Extrapolator>>,
    scenes: Option<ScenePair>,
}

/// An extrapolator for a propagator's scene, with memory for the greatest number of paths and sources.
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
    /// Computes and sends an update if there are new poses or a new propagator; returns the pause before the next,
    /// `None` if there was nothing to do. An update that a jump or a turn has overtaken is not sent.
    pub(super) fn step(&mut self) -> Option<Duration> {
        let Some(message) = self.compute(None) else {
            // After an interruption there are poses left.
            return self.has_new_poses.then_some(Duration::ZERO);
        };
        if !self.synchronous {
            self.collect_poses();
            if self.is_overtaken(&message) {
                self.drop_overtaken(message);
                return Some(Duration::ZERO);
            }
        }
        self.send(message);
        Some(Duration::from_secs_f64(self.governor.pause_s()))
    }

    /// Computes an update if there are new poses or a new propagator. `virtual_time` replaces the measured time of the
    /// update. An update that a jump overtakes may end early, without a message.
    pub(super) fn compute(&mut self, virtual_time: Option<Duration>) -> Option<Box<UpdateMessage>> {
        let ordered = self.take_propagator();
        // What the last update expected says nothing about this one.
        self.expected.store(None);
        self.interruption.clear();
        self.collect_poses();
        let posed = std::mem::take(&mut self.has_new_poses);
        let world = self.newest.take_if(|_| ordered || posed)?;
        self.take_instances(&world);
        if let Some(before_update) = self.before_update {
            before_update(self.update);
        }
        let mut message = self.updates.take_blank(UpdateMessage::default);
        let started = now();
        let _section = section("foresound update");
        self.propagator.select_listener(0);
        if std::mem::take(&mut self.warms_up) {
            self.propagator.warm_up(&world.listener, &world.sources);
            for (index, (listener, _)) in (1..).zip(&world.others) {
                self.propagator.select_listener(index);
                self.propagator.warm_up(listener, &world.sources);
            }
            self.propagator.select_listener(0);
        }
        let predictor = world.predictor.lowered(self.quality.predictor_steps);
        let kind = match self.synchronous {
            true => UpdateKind::Whole,
            false => self.pipeline.next_kind(&world.sources),
        };
        let request = UpdateRequest {
            listener: &world.listener,
            sources: &world.sources,
            time_s: world.time_s,
            predictor,
            kind,
            in_use: self.in_use(&world, (kind, predictor), virtual_time.is_some()),
            max_paths: self.quality.max_paths,
            max_nearby: MAX_NEARBY.min(MAX_NEARBY_PER_SOURCE * world.sources.len()),
        };
        let UpdateMessage {
            paths, prepared, ..
        } = &mut *message;
        self.expected
            .store(self.pipeline.expected_listener(&request));
        // What travels with an update has to arrive.
        let has_replacements = self.extrapolator.is_some() || self.scenes.is_some();
        let may_end = kind == UpdateKind::Whole && !self.synchronous && virtual_time.is_none();
        let workers = InterruptibleThreads {
            threads: &self.threads,
            interruption: (may_end && !has_replacements).then_some(&self.interruption),
        };
        let propagator = (&mut *self.propagator, &workers);
        let mut trimmed = self
            .pipeline
            .update(propagator, &request, (paths, prepared));
        if workers.is_interrupted() {
            self.updates.keep(message);
            self.newest = Some(world);
            self.has_new_poses = true;
            return None;
        }
        trimmed += self.compute_others(&world, &request, &mut message.others);
        let elapsed = virtual_time.unwrap_or_else(|| started.elapsed());
        message.order_gain = self.quality.order_gain;
        let paths = message.paths.paths.len() as u64;
        if self.max_snapshot_paths > 0 {
            let mut shown = self.snapshots.take_blank(PathSnapshot::default);
            fill_snapshot(&message.paths, self.max_snapshot_paths, &mut shown.paths);
            self.snapshots.send(shown);
        }
        self.metrics
            .rays
            .store(message.paths.rays, Ordering::Relaxed);
        // At rest an update keeps the results of the one before. Its time says nothing about the next one that searches.
        if !self.propagator.is_kept() {
            self.timing.observe(kind, elapsed.as_secs_f64());
            self.search_time = elapsed;
        }
        self.govern(&world, self.search_time);
        let rest = Duration::from_secs_f64(self.governor.pause_s());
        message.interval_s = (self.search_time + rest).as_secs_f64();
        message.synchronous = self.synchronous;
        message.extrapolator = self.extrapolator.take();
        message.scenes = self.scenes.take();
        self.lengthen_lines(&mut message);
        let has_changed = predictor != self.predictor;
        let room = [self.max_paths, self.max_sources];
        let state = || PredictorState::with_room(predictor, room[0], room[1]);
        message.predictor = has_changed.then(state);
        for (update, other) in message.others.iter_mut().zip(&mut self.others) {
            update.extrapolator = other.extrapolator.take();
            update.scenes = other.scenes.take();
            update.predictor = has_changed.then(state);
        }
        self.predictor = predictor;
        self.newest = Some(world);
        self.update += 1;
        self.spans.record(SpanKind::Update, started, elapsed, paths);
        self.metrics.propagation.record(elapsed);
        add(&self.metrics.trimmed_paths, trimmed as u64);
        let latest_ns = nanoseconds(elapsed);
        self.metrics
            .propagation_ns
            .store(latest_ns, Ordering::Relaxed);
        Some(message)
    }

    /// Lengthens delay lines where an update's paths need it.
    fn lengthen_lines(&mut self, message: &mut UpdateMessage) {
        message.lines.clear();
        message.lines.append(&mut self.unsent_lines);
        let speed_m_s = self.propagator.scene().speed_of_sound_m_s();
        let others = message.others.iter().map(|other| &other.paths);
        let updates = others.chain([&message.paths]);
        self.line_lengths
            .grow(updates, speed_m_s, &mut message.lines);
    }

    /// Computes what an update has for further listeners, as that of the first; returns the number of dropped paths.
    fn compute_others(
        &mut self,
        world: &WorldFrame,
        first: &UpdateRequest<'_>,
        updates: &mut Vec<ListenerUpdate>,
    ) -> usize {
        updates.resize_with(self.others.len(), ListenerUpdate::default);
        let mut trimmed = 0;
        // Borrowed, not taken: a panic leaves them in the worker, which a restart uses again.
        let each = self.others.iter_mut().zip(&world.others).zip(updates);
        for (index, ((other, (listener, _)), update)) in (1..).zip(each) {
            let kind = match self.synchronous {
                true => UpdateKind::Whole,
                false => other.pipeline.next_kind(&world.sources),
            };
            let request = UpdateRequest {
                listener,
                kind,
                ..*first
            };
            self.propagator.select_listener(index);
            let propagator = (&mut *self.propagator, &self.threads);
            let results = (&mut update.paths, &mut update.prepared);
            trimmed += other.pipeline.update(propagator, &request, results);
        }
        trimmed
    }

    /// When an update that begins now will be in use; `None` if it is used at once, or before the first.
    fn in_use(
        &self,
        world: &WorldFrame,
        (kind, predictor): (UpdateKind, PredictorKind),
        is_virtual: bool,
    ) -> Option<UseInterval> {
        let frame_s = self.pipeline.history().frame_s().unwrap_or(0.0);
        let pause_s = self.governor.pause_s();
        let times = match is_virtual {
            true => [0.0, 0.0, frame_s, pause_s],
            // A finished update waits half a graphics frame on average.
            false => {
                let age_s = world.sent.elapsed().as_secs_f64();
                [age_s, 0.5 * frame_s, frame_s, pause_s]
            }
        };
        self.timing
            .in_use((kind, predictor, world.sources.len()), times)
            .filter(|_| !self.synchronous)
    }

    /// Applies budget and thermal state after an update.
    fn govern(&mut self, world: &WorldFrame, took: Duration) {
        let before = self.governor.quality_level();
        let elapsed = UpdateCost {
            update_s: took.as_secs_f64(),
            since_last_s: world.time_s - self.last_time_s.unwrap_or(world.time_s),
            sound_share: self.metrics.sound_share(),
            may_pause: !self.synchronous,
        };
        self.last_time_s = Some(world.time_s);
        let now_s = self.epoch.elapsed().as_secs_f64();
        let budget = self.device_hints.limit_budget(world.budget, now_s);
        self.governor.observe(&budget, &elapsed);
        if !self.synchronous {
            self.device_hints.report_update(elapsed.update_s, &budget);
        }
        if self.device_hints.is_sound_report_due(now_s) {
            let load = self.metrics.take_sound_load();
            self.device_hints.report_sound(load, now_s);
        }
        self.metrics.device_hints.store(self.device_hints.report());
        let level = self.governor.quality_level();
        if level != before {
            let number = u32::from(level.0);
            self.metrics.quality_level.store(number, Ordering::Relaxed);
            self.spans
                .record(SpanKind::QualityLevel, now(), Duration::ZERO, number.into());
        }
        self.apply_quality();
    }

    fn apply_quality(&mut self) {
        let settings = self.propagator.settings();
        self.quality = self.governor.active_quality(settings, self.max_paths);
        self.propagator.set_quality(self.quality.propagation);
    }

    fn take_propagator(&mut self) -> bool {
        let Some(ordered) = self.pending_propagator.take() else {
            return false;
        };
        let before = std::mem::replace(&mut self.propagator, ordered);
        self.propagator.set_listener_count(1 + self.others.len());
        let scene = self.propagator.scene();
        let same_scene = before.scene().same_fixed_part(scene)
            && before.settings().min_distance_m == self.propagator.settings().min_distance_m;
        if !same_scene {
            let room = [self.max_paths, self.max_sources];
            let extrapolator = || extrapolator_for(&self.propagator, self.predictor, room);
            self.extrapolator = Some(extrapolator());
            self.scenes = None;
            for other in &mut self.others {
                other.extrapolator = Some(extrapolator());
                other.scenes = None;
            }
            self.governor.reset_costs();
            self.timing = UpdateTiming::default();
        } else if scene.has_instances() || before.scene().has_instances() {
            self.scenes = Some(ScenePair::of(scene));
            for other in &mut self.others {
                other.scenes = Some(ScenePair::of(scene));
            }
        }
        self.base_scene = Arc::clone(scene);
        self.apply_quality();
        true
    }

    /// Takes over added, removed and moved instances.
    fn take_instances(&mut self, world: &WorldFrame) {
        // Poses of another scene are applied with its propagator.
        if !Arc::ptr_eq(&world.scene, &self.base_scene)
            && world.scene.same_fixed_part(&self.base_scene)
        {
            self.base_scene = Arc::clone(&world.scene);
            *self.propagator.scene_mut() = Scene::clone(&world.scene);
            self.scenes = Some(ScenePair::of(&world.scene));
            for other in &mut self.others {
                other.scenes = Some(ScenePair::of(&world.scene));
            }
        }
        if self.propagator.scene().has_instances() {
            let scene = self.propagator.scene_mut();
            scene.set_instance_poses(&world.instances);
        }
    }

    /// Takes the newest poses, for the next update, and records those in between.
    pub(super) fn collect_poses(&mut self) {
        let Some(world) = self.world.take() else {
            return;
        };
        self.pipeline.history_mut().append(&world.recent);
        for (other, (_, recent)) in self.others.iter_mut().zip(&world.others) {
            other.pipeline.history_mut().append(recent);
        }
        self.has_new_poses = true;
        if let Some(old) = self.newest.replace(world) {
            self.world.give_back(old);
        }
    }

    /// Whether a jump or a turn has overtaken the last update, and nothing else travels with it.
    pub(super) fn is_overtaken(&self, last: &UpdateMessage) -> bool {
        let newest = self.newest.as_ref();
        let has_jumped = newest.is_some_and(|world| {
            let others = self.others.iter().map(|other| &other.pipeline);
            let mut all = others.chain([&self.pipeline]);
            all.any(|pipeline| pipeline.is_overtaken(&world.sources))
        });
        has_jumped && !last.has_replacements()
    }

    /// Drops an update that a jump or a turn has overtaken, except for what lengthens delay lines: later updates count on it.
    pub(super) fn drop_overtaken(&mut self, mut message: Box<UpdateMessage>) {
        self.unsent_lines.append(&mut message.lines);
        let others = self.others.iter_mut().map(|other| &mut other.pipeline);
        others
            .chain([&mut self.pipeline])
            .for_each(UpdatePipeline::drop_last);
        self.updates.keep(message);
    }

    /// Time of the next asynchronous update relative to a whole one.
    pub(super) fn next_share(&self) -> f64 {
        let Some(world) = &self.newest else {
            return 1.0;
        };
        let predictor = world.predictor.lowered(self.quality.predictor_steps);
        let others = self.others.iter().map(|other| &other.pipeline);
        let kinds = others.chain([&self.pipeline]);
        let shares = kinds.map(|pipeline| {
            let kind = pipeline.next_kind(&world.sources);
            kind.share(predictor, world.sources.len())
        });
        shares.fold(0.0, f64::max)
    }

    /// Sends an update, together with the replacements of an earlier one that was not taken.
    pub(super) fn send(&mut self, mut message: Box<UpdateMessage>) {
        if let Some(mut missed) = self.updates.recall() {
            if message.extrapolator.is_none() {
                message.extrapolator = missed.extrapolator.take();
                message.scenes = message.scenes.take().or_else(|| missed.scenes.take());
            }
            if message.predictor.is_none() {
                message.predictor = missed.predictor.take();
            }
            // The later message counts on the segments of the missed one.
            missed.lines.append(&mut message.lines);
            std::mem::swap(&mut missed.lines, &mut message.lines);
            for (other, missed) in message.others.iter_mut().zip(&mut missed.others) {
                other.take_missed(missed);
            }
            self.updates.keep(missed);
        }
        self.updates.send(message);
    }
}
