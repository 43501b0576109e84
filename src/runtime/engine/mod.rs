//! The engine: one controller for the app's thread, one renderer for audio, propagation on a thread of its own.
//!
//! ```text
//! app      Controller ──poses──► propagation thread ──updates──► Renderer      audio
//!              └───────────────poses, gains, sounds─────────────────┘
//! ```
//!
//! Newest values go through slots that are overwritten, sounds through a ring; what the audio side has done with travels
//! back to be freed elsewhere. Every graphics frame the app calls [`Controller::tick`]; the device, or a
//! [`crate::runtime::SoundThread`], calls [`Renderer::render`]. Either half may be dropped first: without a renderer the
//! controller goes on and says so, without a controller the renderer goes on with the last poses.
//!
//! The level L is decided when an update is taken: Eq. 1 of its own time and of the time between graphics frames, fixed
//! until the next one (the paper's Figure 2).

mod audibility;
mod block_pacing;
mod controller;
mod frame_clock;
mod histogram;
mod messages;
mod mixer;
mod propagation_thread;
mod release_tails;
mod renderer;
mod sample_source;
mod scene_builder;
mod settings;
mod shown_paths;
mod slot_release;
mod smooth_gain;
mod source_table;
mod source_virtualization;
mod statistics;
mod stream;
mod worker;

use std::sync::Arc;

pub use controller::{Controller, EngineState};

pub use crate::runtime::engine::block_pacing::ramp_frames;
pub use histogram::Percentiles;
pub use renderer::{RenderReport, Renderer};
pub use settings::{EngineSchedule, EngineSettings, FrameTime, MOST_SOURCES};
pub use shown_paths::{MOST_CORNERS, ShownPath};
pub use statistics::Statistics;
pub use stream::StreamWriter;

use crate::error::Result;
use crate::generation::Generator;
use crate::propagation::Propagator;
use crate::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh};

use super::budget::Governor;
use super::phone::DeviceHints;
use super::trace::{Track, spans};
use crate::runtime::handover::newest::newest;
use crate::runtime::threads::clock::now;
use crate::runtime::threads::workers::Threads;
use controller::Links;
use messages::AudioFrame;
use renderer::Parts;
use statistics::Meters;
use worker::{Orders, Worker, extrapolator_for};

/// Feed changes that may wait for the renderer; beyond them the controller keeps the newest one a source.
const FEEDS_AHEAD: usize = 64;

/// Makes engines.
pub struct Engine;

impl Engine {
    /// An engine in open air, without sources: both halves, with propagation waiting for the first tick.
    ///
    /// # Errors
    /// [`crate::Error::Setting`] names a setting outside its range; [`crate::Error::Engine`] if no thread can be
    /// started.
    #[expect(clippy::new_ret_no_self, reason = "an engine is its two halves")]
    pub fn new(settings: EngineSettings) -> Result<(Controller, Renderer)> {
        settings.check()?;
        let head = settings.head()?;
        let (sources, slots) = (settings.most_sources(), settings.generation.max_sources);
        let epoch = now();
        let [app, propagation, sound] = [Track::App, Track::Propagation, Track::Sound]
            .map(|track| spans(track, settings.trace_spans, epoch));
        let scene = Arc::new(open_air()?);
        let propagator = Box::new(Propagator::new(scene, settings.propagation)?);
        let predictor = match settings.even_blocks {
            true => settings.predictor.reduced(),
            false => settings.predictor,
        };
        let extrapolator = extrapolator_for(&propagator, predictor, [settings.max_paths, slots]);
        let generator = Generator::new(settings.generation.clone(), head)?;
        let meters = Arc::new(Meters::default());
        let (frame_sender, frames) = newest();
        let (world_sender, world) = newest();
        let (delivery_sender, deliveries) = newest();
        let (shown_sender, shown) = newest();
        let (feed_sender, feeds) = rtrb::RingBuffer::new(FEEDS_AHEAD);
        let (retired, retired_receiver) = rtrb::RingBuffer::new(FEEDS_AHEAD);
        let orders = Orders::default();
        let worker = Worker {
            orders: Arc::clone(&orders),
            world,
            deliveries: delivery_sender,
            meters: Arc::clone(&meters),
            max_paths: settings.max_paths,
            max_sources: slots,
            synchronous: false,
            even_blocks: settings.even_blocks,
            tracers: Threads::start(1)?,
            governor: Governor::default(),
            detail: Governor::default().detail(&settings.propagation, settings.max_paths),
            last_time_s: None,
            manners: DeviceHints::begin(settings.manners),
            epoch,
            shown: shown_sender,
            most_shown: settings.shown_paths,
            spans: propagation.0,
            before_update: settings.before_update,
            newest: None,
            predictor: settings.predictor,
            extrapolator: None,
            given: Arc::clone(propagator.scene()),
            scenes: None,
            update: 0,
            propagator,
        };
        let renderer = Renderer::new(Parts {
            frames,
            deliveries,
            feeds,
            retired,
            frame: Box::new(AudioFrame::with_capacity(sources, slots)),
            extrapolator,
            generator,
            spans: sound.0,
            meters: Arc::clone(&meters),
            settings: settings.clone(),
        });
        let links = Links {
            frames: frame_sender,
            world: world_sender,
            feeds: feed_sender,
            retired: retired_receiver,
            orders,
            meters,
            shown,
            spans: app.0,
            span_readers: [app.1, propagation.1, sound.1],
        };
        let controller = Controller::new(settings, links, Box::new(worker))?;
        Ok((controller, renderer))
    }
}

/// A scene with nothing to hear but the way from source to listener: one triangle of a square centimetre, out of reach.
fn open_air() -> Result<Scene> {
    let far_m = -5e4;
    let positions = [[0.0, far_m, 0.0], [0.1, far_m, 0.0], [0.0, far_m, 0.1]];
    let mesh = TriangleMesh::from_slices(&positions, &[0, 1, 2], &[], &[])?;
    Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())
}
