//! The engine: one controller for the app's thread, one renderer for audio, propagation on a separate thread.
//!
//! ```text
//! app      Controller ──poses──► propagation thread ──updates──► Renderer      audio
//!              └───────────────poses, gains, sounds─────────────────┘
//! ```
//!
//! Poses and updates go through newest-value channels, sample sources through a ring; the audio side returns memory to
//! be freed elsewhere. The app calls [`Controller::tick`] once a graphics frame; the device, or a
//! [`crate::runtime::SoundThread`], calls [`Renderer::render`]. Either half may be dropped first: the controller then
//! reports the missing renderer; the renderer continues with the last poses.
//!
//! The extrapolation level L is set when an update is taken, by Eq. 1 of the update's time and the time between
//! graphics frames, and holds until the next update (the paper's Figure 2).

mod audibility;
mod block_pacing;
mod clip_player;
mod controller;
mod frame_clock;
mod frame_numbers;
mod histogram;
mod messages;
mod mixer;
mod path_snapshot;
mod playback;
mod propagation_thread;
mod release_tails;
mod renderer;
mod sample_source;
mod scene_builder;
mod settings;
mod slot_release;
mod smooth_gain;
mod source_bus;
mod source_table;
mod source_virtualization;
mod statistics;
mod stream;
mod virtual_clock;
mod virtual_engine;
mod virtual_propagation;
mod worker;

use std::sync::Arc;

pub use controller::{Controller, EngineState};

pub use crate::runtime::engine::block_pacing::ramp_frames;
pub use clip_player::Clip;
pub use frame_numbers::{FrameNumbers, SourceNumbers};
pub use histogram::Percentiles;
pub use path_snapshot::{MAX_CORNERS, SnapshotPath};
pub use playback::{PlaySettings, Playback, PlaybackState};
pub use renderer::{RenderReport, Renderer};
pub use settings::{EngineSchedule, EngineSettings, FrameTime, MAX_SOURCES};
pub use source_bus::BusStatus;
pub use statistics::Statistics;
pub use stream::StreamWriter;
pub use virtual_clock::VirtualClock;
pub use virtual_engine::VirtualEngine;

use crate::error::Result;
use crate::generation::Generator;
use crate::propagation::Propagator;
use crate::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh};

use super::budget::Governor;
use super::phone::DeviceHints;
use super::trace::{Track, spans};
use crate::runtime::handover::newest::newest;
use crate::runtime::pipeline::line_lengths::LineLengths;
use crate::runtime::pipeline::update_pipeline::UpdatePipeline;
use crate::runtime::pipeline::update_timing::UpdateTiming;
use crate::runtime::threads::clock::now;
use crate::runtime::threads::workers::Threads;
use controller::Channels;
use messages::AudioFrame;
use renderer::RendererParts;
use statistics::Metrics;
use virtual_clock::VirtualArrivals;
use worker::{OtherListener, PendingPropagator, Worker, extrapolator_for};

/// Capacity of the ring of sample sources; beyond it the controller keeps the newest per source.
const CHANGES_AHEAD: usize = 64;

/// Constructor of an engine's two halves.
pub struct Engine;

impl Engine {
    /// An engine in open air without sources: both halves, and a propagation thread in the asynchronous schedule.
    /// Control side; allocates.
    ///
    /// ```
    /// use foresound::{Engine, EngineSettings, ListenerPose};
    ///
    /// # fn main() -> foresound::Result<()> {
    /// let mut settings = EngineSettings::default();
    /// settings.generation.max_sources = 8;
    /// let (mut controller, mut renderer) = Engine::new(settings)?;
    /// let source = controller.add_source([0.0, 1.5, -2.0])?;
    /// let mut click = vec![0.0; 22_050]; // half a second at the engine's 44,100 Hz
    /// click[..64].fill(0.5);
    /// controller.play(source, click.into(), true)?;
    /// controller.tick(ListenerPose::default(), &[])?;
    /// renderer.render(&mut [0.0; 512]);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) names a setting outside its range;
    /// [`Error::Engine`](crate::Error::Engine) if no thread can be started.
    #[expect(clippy::new_ret_no_self, reason = "an engine is its two halves")]
    pub fn new(settings: EngineSettings) -> Result<(Controller, Renderer)> {
        Self::with_clock(settings, None)
    }

    /// [`Self::new`], or on a virtual clock.
    fn with_clock(
        settings: EngineSettings,
        clock: Option<VirtualClock>,
    ) -> Result<(Controller, Renderer)> {
        settings.check()?;
        let hrtf = settings.hrtf_of(settings.generation.layout)?;
        let (sources, slots) = (settings.source_limit(), settings.generation.max_sources);
        let epoch = now();
        let [app, propagation, sound] = [Track::App, Track::Propagation, Track::Sound]
            .map(|track| spans(track, settings.trace_spans, epoch));
        let scene = Arc::new(open_air()?);
        let listeners = settings.generation.listeners;
        let mut propagator = Box::new(Propagator::new(scene, settings.propagation)?);
        propagator.set_listener_count(listeners);
        let room = [settings.max_paths, slots];
        let extrapolator = |_| extrapolator_for(&propagator, settings.predictor, room);
        let extrapolators = (0..listeners).map(extrapolator).collect();
        let generator = Generator::with_short_lines(settings.generation.clone(), hrtf)?;
        let metrics = Arc::new(Metrics::default());
        let (frame_sender, frames) = newest();
        let (world_sender, world) = newest();
        let (output_sender, outputs) = newest();
        let (delivery_sender, deliveries) = newest();
        let (shown_sender, shown) = newest();
        let (numbers, numbers_receiver) = frame_numbers::frame_numbers();
        let (feed_sender, feeds) = rtrb::RingBuffer::new(CHANGES_AHEAD);
        let (retired, retired_receiver) = rtrb::RingBuffer::new(CHANGES_AHEAD);
        let pending_propagator = PendingPropagator::default();
        let worker = Worker {
            pending_propagator: Arc::clone(&pending_propagator),
            world,
            updates: delivery_sender,
            metrics: Arc::clone(&metrics),
            max_paths: settings.max_paths,
            max_sources: slots,
            line_lengths: LineLengths::new(&settings.generation),
            unsent_lines: Vec::new(),
            synchronous: false,
            threads: Threads::start(1)?,
            interruption: Arc::default(),
            expected: Arc::default(),
            governor: Governor::default(),
            quality: Governor::default().active_quality(&settings.propagation, settings.max_paths),
            last_time_s: None,
            search_time: std::time::Duration::ZERO,
            device_hints: DeviceHints::new(settings.device_hints),
            epoch,
            snapshots: shown_sender,
            max_snapshot_paths: settings.max_snapshot_paths,
            spans: propagation.0,
            before_update: settings.before_update,
            newest: None,
            has_new_poses: false,
            predictor: settings.predictor,
            extrapolator: None,
            base_scene: Arc::clone(propagator.scene()),
            scenes: None,
            update: 0,
            warms_up: clock.is_some(),
            virtual_arrivals: clock.map(VirtualArrivals::new),
            propagator,
            pipeline: UpdatePipeline::default(),
            others: (1..listeners).map(|_| OtherListener::default()).collect(),
            timing: UpdateTiming::default(),
        };
        let parts = RendererParts {
            frames,
            updates: deliveries,
            outputs,
            source_changes: feeds,
            retired,
            frame: Box::new(AudioFrame::with_capacity(sources, slots, listeners)),
            generator,
            numbers,
            spans: sound.0,
            metrics: Arc::clone(&metrics),
            settings: settings.clone(),
        };
        let renderer = Renderer::new(parts, extrapolators);
        let channels = Channels {
            frames: frame_sender,
            world: world_sender,
            outputs: output_sender,
            source_changes: feed_sender,
            retired: retired_receiver,
            pending_propagator,
            metrics,
            snapshots: shown,
            numbers: numbers_receiver,
            spans: app.0,
            span_readers: [app.1, propagation.1, sound.1],
        };
        let controller = Controller::new(settings, channels, Box::new(worker))?;
        Ok((controller, renderer))
    }
}

/// A scene with direct paths only: one triangle of 50 cm² out of reach.
fn open_air() -> Result<Scene> {
    let far_m = -5e4;
    let positions = [[0.0, far_m, 0.0], [0.1, far_m, 0.0], [0.0, far_m, 0.1]];
    let mesh = TriangleMesh::from_slices(&positions, &[0, 1, 2], &[], &[])?;
    Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())
}
