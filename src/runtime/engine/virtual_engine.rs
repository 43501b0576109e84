//! An engine on a virtual clock: both halves and propagation on the caller's thread, deterministic to the bit.
//!
//! For measurements and tests. Runs the same controller, worker and renderer as [`super::Engine`]; only the time at which an
//! update arrives is given instead of measured.

use super::settings::{EngineSettings, FrameTime};
use super::{Controller, Engine, Renderer, VirtualClock};
use crate::error::{Error, Result};
use crate::scene::{ListenerPose, SourcePose};

/// Both halves of an engine, driven by one thread.
///
/// Sources and scene are those of [`Self::controller`]; set them before the first graphics frame, whose update follows
/// sixteen others at the same poses, as after a loading screen, and is used at once. In
/// [`super::EngineSchedule::Asynchronous`] an update begins in the graphics frame in which the last one arrived, with the
/// poses of that frame, and arrives by the clock's delays. In [`super::EngineSchedule::Synchronous`] every graphics frame
/// has its own update: the reference. The sound device takes whole blocks, and a graphics frame is heard from the first
/// block that begins after it.
///
/// ```
/// use foresound::runtime::{EngineSettings, VirtualClock, VirtualEngine};
/// use foresound::{ListenerPose, glam::Vec3};
///
/// # fn main() -> foresound::Result<()> {
/// let mut engine = VirtualEngine::new(EngineSettings::default(), VirtualClock::at_level(74.6, 12))?;
/// let source = engine.controller().add_source([0.0, 1.5, -2.0])?;
/// engine.controller().play(source, vec![0.1; 44_100].into(), true)?;
/// let mut sound = Vec::new();
/// while engine.time_s() < 0.1 {
///     let listener = ListenerPose::facing(Vec3::X * (1.4 * engine.time_s()) as f32, 0.0);
///     engine.next_frame(listener, &[], |block| sound.extend_from_slice(block))?;
/// }
/// assert!(sound.len() > 2 * 4_410);
/// # Ok(())
/// # }
/// ```
pub struct VirtualEngine {
    controller: Controller,
    renderer: Renderer,
    graphics_rate_hz: f64,
    frames: u64,
    /// Audio frames rendered.
    rendered: u64,
    block: Vec<f32>,
}

impl VirtualEngine {
    /// For these settings; [`EngineSettings::frame_time`] is replaced by the clock's. Control side; allocates.
    ///
    /// # Errors
    /// As [`Engine::new`]; [`Error::Setting`] for a graphics rate outside 1 to 1,000 Hz.
    pub fn new(mut settings: EngineSettings, clock: VirtualClock) -> Result<Self> {
        let graphics_rate_hz = clock.graphics_rate_hz;
        if !(1.0..=1000.0).contains(&graphics_rate_hz) {
            let problem = format!("{graphics_rate_hz} Hz is outside 1 to 1000");
            let advice = "choose a rate in that range";
            return Err(Error::setting("graphics_rate_hz", problem, advice));
        }
        settings.frame_time = FrameTime::Fixed(graphics_rate_hz.recip());
        let channels = settings.generation.output_channels();
        let block = vec![0.0; channels * settings.block_frames];
        let (controller, renderer) = Engine::with_clock(settings, Some(clock))?;
        Ok(Self {
            controller,
            renderer,
            graphics_rate_hz,
            frames: 0,
            rendered: 0,
            block,
        })
    }

    /// The app's half: scene, sources, settings. Its `tick` is called by [`Self::next_frame`].
    pub fn controller(&mut self) -> &mut Controller {
        &mut self.controller
    }

    /// The audio half.
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// Time of the next graphics frame in seconds.
    pub fn time_s(&self) -> f64 {
        self.frames as f64 / self.graphics_rate_hz
    }

    /// One graphics frame: [`Self::tick`], then the blocks of interleaved channels that begin before the next one.
    ///
    /// # Errors
    /// As [`Controller::tick`]; the sound is rendered nevertheless.
    pub fn next_frame(
        &mut self,
        listener: ListenerPose,
        sources: &[SourcePose],
        mut sink: impl FnMut(&[f32]),
    ) -> Result<()> {
        let result = self.tick(listener, sources);
        while let Some(block) = self.next_block() {
            sink(block);
        }
        result
    }

    /// The app's half of [`Self::next_frame`]: propagation as the clock has it, and the next graphics frame's poses.
    ///
    /// # Errors
    /// As [`Controller::tick`].
    pub fn tick(&mut self, listener: ListenerPose, sources: &[SourcePose]) -> Result<()> {
        let result = self.controller.tick(listener, sources);
        self.frames += 1;
        result
    }

    /// The audio half of [`Self::next_frame`]: renders a block, or none if the next one begins after the graphics frame.
    pub fn next_block(&mut self) -> Option<&[f32]> {
        let end = self.time_s() * f64::from(self.renderer.rate_hz());
        if self.rendered as f64 >= end {
            return None;
        }
        self.renderer.render(&mut self.block);
        self.rendered += self.renderer.block_frames() as u64;
        Some(&self.block)
    }
}
