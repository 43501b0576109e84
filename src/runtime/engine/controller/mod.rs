//! The app's half of an engine.
//!
//! Control side: one thread of the app's; allocates now and then, never waits for propagation or audio except in
//! [`Controller::set_schedule`], [`Controller::restart`] and on being dropped (one update at most), and in the synchronous
//! schedule, where [`Controller::tick`] is the propagation.

mod scenes;
mod sources;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use super::feed::Feed;
use super::messages::{AudioFrame, FeedChange, WorldFrame};
use super::propagation_thread::Propagation;
use super::scene_builder::SceneBuilder;
use super::settings::{EngineSettings, FrameTime};
use super::source_table::{SourceTable, check_place};
use super::statistics::{Meters, Statistics};
use super::worker::{Orders, Worker};
use crate::error::{Error, Result};
use crate::extrapolation::PredictorKind;
use crate::runtime::clock::now;
use crate::runtime::handover::Sender;
use crate::scene::{ListenerPose, Scene, SourcePose};

/// Ticks farther apart than this, in seconds, are a pause and not a graphics frame.
const LONGEST_FRAME_S: f64 = 0.5;
/// Share of a new graphics frame in the mean T_g.
const FRAME_WEIGHT: f64 = 0.1;
/// T_g until two ticks have been seen, in seconds.
const FIRST_FRAME_S: f64 = 1.0 / 60.0;

/// How the engine is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EngineState {
    /// Well.
    Running,
    /// Silent until [`Controller::resume`].
    Paused,
    /// Propagation has panicked: sound goes on with its last paths and live direct paths. [`Controller::restart`] helps.
    PropagationFailed,
    /// The renderer was dropped: nobody listens. Make another engine.
    RendererGone,
}

/// The controller's ends of the handovers.
pub(super) struct Links {
    pub(super) frames: Sender<AudioFrame>,
    pub(super) world: Sender<WorldFrame>,
    pub(super) feeds: rtrb::Producer<FeedChange>,
    pub(super) retired: rtrb::Consumer<Feed>,
    pub(super) orders: Orders,
    pub(super) meters: Arc<Meters>,
}

/// The app's half.
pub struct Controller {
    settings: EngineSettings,
    links: Links,
    propagation: Propagation,
    builder: SceneBuilder,
    scene: Arc<Scene>,
    sources: SourceTable,
    /// Feed changes that the ring had no place for, one a slot at most.
    waiting: VecDeque<FeedChange>,
    listener: ListenerPose,
    paused: bool,
    began: Instant,
    last_tick: Option<Instant>,
    frame_s: f64,
}

impl Controller {
    pub(super) fn new(settings: EngineSettings, links: Links, worker: Box<Worker>) -> Result<Self> {
        let frame_s = match settings.frame_time {
            FrameTime::Fixed(seconds) => seconds,
            FrameTime::Measured => FIRST_FRAME_S,
        };
        Ok(Self {
            scene: Arc::clone(worker.propagator.scene()),
            propagation: Propagation::start(worker, &settings)?,
            builder: SceneBuilder::default(),
            sources: SourceTable::new(settings.generation.max_sources),
            waiting: VecDeque::new(),
            listener: ListenerPose::default(),
            paused: false,
            began: now(),
            last_tick: None,
            frame_s,
            links,
            settings,
        })
    }

    /// Hands over one graphics frame: where the listener is, and where sources are that have moved.
    ///
    /// # Errors
    /// The first of: [`Error::Setting`] for a pose with a number that is none or beyond 1,000 km, [`Error::StaleSource`],
    /// [`Error::Mesh`] of a scene that was being built. The frame goes out all the same, with the last good poses.
    pub fn tick(&mut self, listener: ListenerPose, sources: &[SourcePose]) -> Result<()> {
        let mut result = self.install_scene();
        result = result.and(self.take_listener(listener));
        for pose in sources {
            result = result.and(self.sources.pose(pose));
        }
        self.measure_frame();
        let mut world = self.links.world.blank(|| WorldFrame {
            listener,
            sources: Vec::new(),
            predictor: PredictorKind::default(),
            time_s: 0.0,
        });
        world.listener = self.listener;
        world.sources.clear();
        let poses = self.sources.iter().map(|(pose, _)| pose);
        world.sources.extend(poses);
        world.predictor = self.settings.predictor;
        world.time_s = self.began.elapsed().as_secs_f64();
        self.links.world.send(world);
        self.propagation.wake();
        self.send_frame(true);
        result
    }

    fn take_listener(&mut self, listener: ListenerPose) -> Result<()> {
        check_place("listener", listener.position)?;
        let length_squared = listener.orientation.length_squared();
        if !(length_squared.is_finite() && length_squared > 1e-12) {
            let problem = format!("{} is no orientation", listener.orientation);
            let advice = "give a finite quaternion; the last good pose is kept";
            return Err(Error::setting("listener", problem, advice));
        }
        self.listener = ListenerPose {
            orientation: listener.orientation.normalize(),
            ..listener
        };
        Ok(())
    }

    fn measure_frame(&mut self) {
        if let FrameTime::Fixed(_) = self.settings.frame_time {
            return;
        }
        let tick = now();
        if let Some(last) = self.last_tick.replace(tick) {
            let passed_s = tick.duration_since(last).as_secs_f64();
            if passed_s < LONGEST_FRAME_S {
                self.frame_s += FRAME_WEIGHT * (passed_s - self.frame_s);
            }
        }
    }

    fn send_frame(&mut self, is_new: bool) {
        self.send_waiting();
        let mut frame = self
            .links
            .frames
            .blank(|| AudioFrame::with_capacity(self.settings.generation.max_sources));
        // A frame that nobody took is a frame still.
        let missed = self.links.frames.recall();
        frame.is_new = is_new || missed.as_ref().is_some_and(|missed| missed.is_new);
        if let Some(missed) = missed {
            self.links.frames.keep(missed);
        }
        frame.listener = self.listener;
        frame.paused = self.paused;
        frame.frame_s = self.frame_s;
        frame.sources.clear();
        frame.gains.clear();
        for (pose, gain) in self.sources.iter() {
            frame.sources.push(pose);
            frame.gains.push(gain);
        }
        self.links.frames.send(frame);
    }

    /// Fades to silence within milliseconds; sounds stand still.
    pub fn pause(&mut self) {
        self.paused = true;
        self.send_frame(false);
    }

    /// Goes on where [`Self::pause`] stopped.
    pub fn resume(&mut self) {
        self.paused = false;
        self.send_frame(false);
    }

    /// How the engine is.
    pub fn state(&self) -> EngineState {
        let meters = &self.links.meters;
        if self.links.feeds.is_abandoned() {
            EngineState::RendererGone
        } else if meters.propagation_failed.load(Ordering::Acquire) {
            EngineState::PropagationFailed
        } else if self.paused {
            EngineState::Paused
        } else {
            EngineState::Running
        }
    }

    /// What the engine tells about itself.
    pub fn statistics(&self) -> Statistics {
        self.links.meters.read()
    }

    /// The settings in force.
    pub fn settings(&self) -> &EngineSettings {
        &self.settings
    }
}

impl Drop for Controller {
    /// Ends the propagation thread after the update under way. The renderer goes on with what it has.
    fn drop(&mut self) {
        self.propagation.stop();
    }
}
