//! The app's half of an engine.
//!
//! Control side, on one thread of the app. May allocate. Waits for propagation (one update at most) only in
//! [`Controller::set_schedule`], [`Controller::restart`] and on drop; in the synchronous schedule [`Controller::tick`]
//! itself propagates.

mod clips;
mod instances;
mod outputs;
mod scenes;
mod sources;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use glam::Vec3;

use super::clip_player::Kernel;
use super::frame_numbers::{FrameNumbers, FrameReceiver};
use super::messages::{AudioFrame, BED, OutputChange, SampleSourceChange, SourceRoute, WorldFrame};
use super::path_snapshot::{PathSnapshot, SnapshotPath};
use super::propagation_thread::Propagation;
use super::scene_builder::SceneBuilder;
use super::settings::{EngineSettings, FrameTime};
use super::source_table::{SourceTable, check_position};
use super::statistics::{Metrics, Statistics};
use super::worker::{PendingPropagator, Worker};
use crate::error::{Error, Result};
use crate::extrapolation::PredictorKind;
use crate::runtime::budget::Budget;
use crate::runtime::engine::sample_source::SampleSource;
use crate::runtime::engine::slot_release::{PlaybackProgress, release_s};
use crate::runtime::engine::source_virtualization::{SourceVirtualizer, VirtualSource};
use crate::runtime::handover::newest::{Receiver, Sender};
use crate::runtime::handover::shared_value::SharedValue;
use crate::runtime::pipeline::expected_listener::{ExpectedListener, TurnWatch};
use crate::runtime::pipeline::jump_watch::JumpWatch;
use crate::runtime::pipeline::pose_history::PoseHistory;
use crate::runtime::threads::clock::now;
use crate::runtime::threads::interruption::Interruption;
use crate::runtime::trace::{SpanKind, SpanReader, SpanWriter, TraceLog};
use crate::scene::{InstancePose, ListenerPose, Scene, SourceId, SourcePose};

/// State of an engine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum EngineState {
    /// Normal operation.
    Running,
    /// Silent until [`Controller::resume`].
    Paused,
    /// Propagation panicked, or its threads could not be started: sound continues with its last paths and live direct paths until
    /// [`Controller::restart`].
    PropagationFailed,
    /// The renderer was dropped. Make another engine.
    RendererGone,
}

/// The controller's ends of all channels.
pub(super) struct Channels {
    pub(super) frames: Sender<AudioFrame>,
    pub(super) world: Sender<WorldFrame>,
    pub(super) outputs: Sender<OutputChange>,
    pub(super) source_changes: rtrb::Producer<SampleSourceChange>,
    pub(super) retired: rtrb::Consumer<SampleSource>,
    pub(super) pending_propagator: PendingPropagator,
    pub(super) metrics: Arc<Metrics>,
    pub(super) snapshots: Receiver<PathSnapshot>,
    pub(super) numbers: FrameReceiver,
    pub(super) spans: SpanWriter,
    pub(super) span_readers: [SpanReader; 3],
}

/// The app's half of an engine: scene, sources, instances, poses, budget. Belongs to one thread of the app.
pub struct Controller {
    settings: EngineSettings,
    channels: Channels,
    propagation: Propagation,
    builder: SceneBuilder,
    scene: Arc<Scene>,
    /// Poses of its instances, by slot.
    instances: Vec<InstancePose>,
    sources: SourceTable,
    /// Only with more sources than slots.
    virtualizer: Option<SourceVirtualizer>,
    /// Release time of a slot, in seconds of audio.
    release_s: f64,
    /// Poses of used slots, and routes of all sources, of the newest tick.
    slot_poses: Vec<SourcePose>,
    routes: Vec<SourceRoute>,
    /// Changes that did not fit into the ring, one per source at most.
    waiting_changes: VecDeque<SampleSourceChange>,
    /// One-shots that have ended; scratch.
    ended: Vec<SourceId>,
    kernel: Arc<Kernel>,
    jump_watch: JumpWatch,
    /// Of the worker.
    interruption: Arc<Interruption>,
    expected: Arc<SharedValue<Option<ExpectedListener>>>,
    turn_watch: TurnWatch,
    listener: ListenerPose,
    /// Further listeners.
    others: Vec<ListenerPose>,
    /// Positions of all listeners; scratch.
    ears: Vec<Vec3>,
    paused: bool,
    snapshot: Box<PathSnapshot>,
    began: Instant,
    ticks: u64,
}

impl Controller {
    pub(super) fn new(
        settings: EngineSettings,
        channels: Channels,
        worker: Box<Worker>,
    ) -> Result<Self> {
        let (sources, slots) = (settings.source_limit(), settings.generation.max_sources);
        let release_s = release_s(settings.block_frames, settings.generation.rate_hz);
        let interruption = Arc::clone(&worker.interruption);
        let expected = Arc::clone(&worker.expected);
        let scene = Arc::clone(worker.propagator.scene());
        let mut propagation = Propagation::Idle(worker);
        propagation.start(&settings)?;
        Ok(Self {
            jump_watch: JumpWatch::default(),
            interruption,
            expected,
            turn_watch: TurnWatch::default(),
            scene,
            propagation,
            builder: SceneBuilder::default(),
            instances: Vec::new(),
            sources: SourceTable::new(sources),
            virtualizer: (sources > slots)
                .then(|| SourceVirtualizer::new(sources, slots, release_s)),
            release_s,
            slot_poses: Vec::with_capacity(slots),
            routes: Vec::with_capacity(sources),
            waiting_changes: VecDeque::new(),
            ended: Vec::new(),
            kernel: Arc::new(Kernel::new()),
            listener: ListenerPose::default(),
            others: vec![ListenerPose::default(); settings.generation.listeners - 1],
            ears: Vec::new(),
            paused: false,
            snapshot: Box::default(),
            began: now(),
            ticks: 0,
            channels,
            settings,
        })
    }

    /// Sends one graphics frame: the listener's pose and whole poses of sources, for those that turned. Call once per frame.
    ///
    /// ```
    /// # use foresound::{Controller, ListenerPose, Result, SourceId};
    /// # fn frame(controller: &mut Controller, source: SourceId) -> Result<()> {
    /// controller.move_source(source, [1.0, 1.5, 0.0])?;
    /// let listener = ListenerPose::facing([0.0, 1.7, 0.0], 0.0);
    /// controller.tick(listener, &[])
    /// # }
    /// ```
    ///
    /// A [`SourcePose`] carries the source's orientation and settings too: [`SourcePose::at`] has the defaults and replaces
    /// those of [`Self::configure_source`]. Move a configured source by [`Self::move_source`], or keep one `SourcePose` a
    /// source with its settings and change its position and orientation. In C and Kotlin a pose leaves the options as they
    /// are.
    ///
    /// ```
    /// # use foresound::{Controller, ListenerPose, Result, SourcePose, glam::Quat};
    /// # fn frame(controller: &mut Controller, listener: ListenerPose, voice: &mut SourcePose) -> Result<()> {
    /// // Kept beside the source: `voice.settings` are set once.
    /// voice.position.x += 0.02;
    /// voice.orientation = Quat::from_rotation_y(0.4);
    /// controller.tick(listener, &[*voice])
    /// # }
    /// ```
    ///
    /// # Errors
    /// The first of: [`Error::Setting`] for a pose that is not finite or beyond 1,000 km, or whose orientation cannot be
    /// normalised (four zeros are a source's identity, and no listener's), [`Error::StaleSource`],
    /// [`Error::Mesh`] of a scene built in the background. The frame is sent nevertheless, with the last good poses.
    pub fn tick(&mut self, listener: ListenerPose, sources: &[SourcePose]) -> Result<()> {
        let began = now();
        let mut result = self.install_scene();
        match checked_listener(listener) {
            Ok(listener) => self.listener = listener,
            Err(error) => result = result.and(Err(error)),
        }
        for pose in sources {
            result = result.and(self.sources.pose(pose));
        }
        let time_s = self.time_s();
        self.ticks += 1;
        self.free_outputs();
        self.end_clips(time_s);
        self.assign_slots(time_s);
        let mut world = self.channels.world.take_blank(|| WorldFrame {
            listener,
            others: Vec::new(),
            sources: Vec::new(),
            scene: Arc::clone(&self.scene),
            instances: Vec::new(),
            predictor: PredictorKind::default(),
            budget: Budget::default(),
            time_s: 0.0,
            sent: began,
            recent: PoseHistory::default(),
        });
        // Positions of graphics frames that propagation has not taken go with the next one.
        world.recent.clear();
        world
            .others
            .resize_with(self.others.len(), Default::default);
        world
            .others
            .iter_mut()
            .for_each(|(_, recent)| recent.clear());
        if let Some(mut missed) = self.channels.world.recall() {
            std::mem::swap(&mut world.recent, &mut missed.recent);
            for ((_, recent), (_, missed)) in world.others.iter_mut().zip(&mut missed.others) {
                std::mem::swap(recent, missed);
            }
            self.channels.world.keep(missed);
        }
        world.listener = self.listener;
        for ((pose, recent), other) in world.others.iter_mut().zip(&self.others) {
            *pose = *other;
            recent.push(time_s, other, &self.slot_poses);
        }
        world.sources.clear();
        world.sources.extend_from_slice(&self.slot_poses);
        if !Arc::ptr_eq(&world.scene, &self.scene) {
            world.scene = Arc::clone(&self.scene);
        }
        world.instances.clone_from(&self.instances);
        world.predictor = self.settings.predictor;
        world.budget = self.settings.budget;
        world.time_s = time_s;
        world.sent = began;
        world.recent.push(time_s, &self.listener, &self.slot_poses);
        let ears = std::iter::once(&self.listener).chain(&self.others);
        let ears = ears.map(|listener| listener.position);
        let has_jumped = self.jump_watch.observe(time_s, ears, &self.slot_poses);
        let expected = self.expected.load();
        let has_turned = self.turn_watch.observe(time_s, &self.listener, expected);
        if has_jumped || has_turned {
            self.interruption.request();
        }
        self.channels.world.send(world);
        self.propagation.wake();
        self.send_frame(true);
        let sources = self.sources.count() as u64;
        self.channels
            .spans
            .record(SpanKind::Tick, began, began.elapsed(), sources);
        result
    }

    /// Seconds since the engine was made: by fixed frame times or by the clock.
    pub(super) fn time_s(&self) -> f64 {
        match self.settings.frame_time {
            FrameTime::Fixed(frame_s) => self.ticks as f64 * frame_s,
            FrameTime::Measured => self.began.elapsed().as_secs_f64(),
        }
    }

    /// Progress of the renderer.
    fn progress(&self) -> PlaybackProgress {
        let metrics = &self.channels.metrics;
        // In this order: audio mixed before the frame was applied is counted when the frame is seen.
        let placed = metrics.applied_tick.load(Ordering::Acquire);
        let frames = metrics.mixed_frames.load(Ordering::Relaxed);
        PlaybackProgress {
            tick: self.ticks,
            applied_tick: placed,
            time_s: frames as f64 / f64::from(self.settings.generation.rate_hz),
        }
    }

    /// Assigns slots: own ones, unless there are more sources than slots.
    fn assign_slots(&mut self, time_s: f64) {
        let progress = self.progress();
        if let Some(virtualizer) = &mut self.virtualizer {
            // The app's blocks count as sound: nobody knows yet how loud they are.
            let has_buses = self.settings.generation.source_buses;
            let sources = self.sources.iter().map(move |source| VirtualSource {
                plays: source.plays || has_buses,
                ..source
            });
            self.ears.clear();
            let all = std::iter::once(&self.listener).chain(&self.others);
            self.ears.extend(all.map(|listener| listener.position));
            let times = (time_s, progress);
            virtualizer.assign(
                sources,
                &self.ears,
                times,
                &mut self.slot_poses,
                &mut self.routes,
            );
            let unheard = &self.channels.metrics.unheard_sources;
            unheard.store(virtualizer.masked, Ordering::Relaxed);
            return;
        }
        self.slot_poses.clear();
        self.routes.clear();
        self.sources.advance_releases(&progress, self.release_s);
        for source in self.sources.iter_released() {
            let VirtualSource {
                pose,
                gain,
                ramp_s,
                play,
                ..
            } = source;
            let id = pose.id;
            let slot = match source.is_2d() {
                true => BED,
                false => id.slot() as u16,
            };
            if slot != BED {
                self.slot_poses.push(pose);
            }
            self.routes.push(SourceRoute {
                id,
                slot,
                gain,
                ramp_s,
                play,
            });
        }
    }

    /// Sets the pose of one of several listeners from the next tick on; of the first one [`Self::tick`] has it. Listeners are
    /// numbered from 0 to below [`GeneratorSettings::listeners`](crate::GeneratorSettings::listeners).
    ///
    /// ```
    /// # fn main() -> foresound::Result<()> {
    /// # use foresound::{Engine, EngineSettings, ListenerPose};
    /// let mut settings = EngineSettings::default();
    /// settings.generation.listeners = 2;
    /// let (mut controller, mut renderer) = Engine::new(settings)?;
    /// controller.set_listener(1, ListenerPose::facing([3.0, 1.7, 0.0], 0.0))?;
    /// controller.tick(ListenerPose::default(), &[])?;
    /// // Both listeners, one after the other, each of two channels.
    /// renderer.render_listeners(&mut [0.0; 2 * 2 * 256]);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`Error::Setting`] for a listener that the engine does not have, and for a pose that is not finite or beyond 1,000 km: the last good
    /// one stays.
    pub fn set_listener(&mut self, index: usize, listener: ListenerPose) -> Result<()> {
        let listener = checked_listener(listener)?;
        let own = match index.checked_sub(1) {
            None => Some(&mut self.listener),
            Some(other) => self.others.get_mut(other),
        };
        let own = own.ok_or_else(|| {
            let count = self.settings.generation.listeners;
            let problem = format!("there is no listener {index}, but {count}");
            let advice = "make the engine with more listeners";
            Error::setting("listener", problem, advice)
        })?;
        *own = listener;
        Ok(())
    }

    fn send_frame(&mut self, is_new: bool) {
        self.send_waiting_changes();
        let settings = &self.settings;
        let mut frame = self.channels.frames.take_blank(|| {
            let generation = &settings.generation;
            let slots = generation.max_sources;
            AudioFrame::with_capacity(settings.source_limit(), slots, generation.listeners)
        });
        // A new frame that was not taken stays new.
        let missed = self.channels.frames.recall();
        frame.is_new = is_new || missed.as_ref().is_some_and(|missed| missed.is_new);
        if let Some(missed) = missed {
            self.channels.frames.keep(missed);
        }
        frame.listener = self.listener;
        frame.others.clone_from(&self.others);
        frame.paused = self.paused;
        frame.ticks = self.ticks;
        frame.instances.clone_from(&self.instances);
        frame.sources.clone_from(&self.slot_poses);
        frame.routes.clone_from(&self.routes);
        self.channels.frames.send(frame);
    }

    /// Pauses: fades to silence within 5 ms and stops all samples.
    pub fn pause(&mut self) {
        self.paused = true;
        self.send_frame(false);
    }

    /// Continues after [`Self::pause`].
    pub fn resume(&mut self) {
        self.paused = false;
        self.send_frame(false);
    }

    /// The state of the engine.
    pub fn state(&self) -> EngineState {
        let metrics = &self.channels.metrics;
        if self.channels.source_changes.is_abandoned() {
            EngineState::RendererGone
        } else if metrics.propagation_failed.load(Ordering::Acquire) || self.propagation.has_ended()
        {
            EngineState::PropagationFailed
        } else if self.paused {
            EngineState::Paused
        } else {
            EngineState::Running
        }
    }

    /// Sets the limits of computing time from the next update on.
    ///
    /// ```
    /// # fn limit(controller: &mut foresound::Controller) -> foresound::Result<()> {
    /// let mut budget = foresound::Budget::default();
    /// budget.update_s = Some(0.01);
    /// controller.set_budget(budget)
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`Error::Setting`] names a limit outside its range; nothing changes then.
    pub fn set_budget(&mut self, budget: Budget) -> Result<()> {
        budget.check()?;
        self.settings.budget = budget;
        Ok(())
    }

    /// Moves recorded spans to a log; see [`EngineSettings::trace_spans`].
    pub fn collect_spans(&mut self, log: &mut TraceLog) {
        for reader in &mut self.channels.span_readers {
            log.collect(reader);
        }
    }

    /// The loudest paths of the newest update, unsorted, up to [`EngineSettings::max_snapshot_paths`].
    pub fn path_snapshot(&mut self) -> &[SnapshotPath] {
        if let Some(newest) = self.channels.snapshots.take() {
            let old = std::mem::replace(&mut self.snapshot, newest);
            self.channels.snapshots.give_back(old);
        }
        &self.snapshot.paths
    }

    /// The numbers of the newest graphics frame that the renderer has taken, for a mixer of the app's own: each source's paths,
    /// what blocks it, its late reverb. The first call makes memory for them and returns none; from then on the renderer copies
    /// each frame, without waiting. Paths beyond [`EngineSettings::max_paths`] are not in it.
    pub fn frame_numbers(&mut self) -> &FrameNumbers {
        let settings = &self.settings;
        let (paths, slots) = (settings.max_frame_paths(), settings.generation.max_sources);
        let numbers = &mut self.channels.numbers;
        numbers.take(paths, slots, settings.source_limit())
    }

    /// What [`Self::frame_numbers`] returned last.
    pub(crate) fn last_frame_numbers(&self) -> &FrameNumbers {
        self.channels.numbers.last()
    }

    /// Statistics since the engine was made. Allocates.
    pub fn statistics(&self) -> Statistics {
        self.channels.metrics.read()
    }

    /// The settings in force.
    pub fn settings(&self) -> &EngineSettings {
        &self.settings
    }
}

/// A listener's pose with a normalised orientation.
fn checked_listener(listener: ListenerPose) -> Result<ListenerPose> {
    check_position("listener", listener.position)?;
    listener.normalized().ok_or_else(|| {
        let problem = format!("{} is no orientation", listener.orientation);
        let advice = "give a finite quaternion; the last good pose is kept";
        Error::setting("listener", problem, advice)
    })
}

impl Drop for Controller {
    /// Stops propagation after the current update. The renderer continues with the last poses.
    fn drop(&mut self) {
        self.propagation.stop();
    }
}
