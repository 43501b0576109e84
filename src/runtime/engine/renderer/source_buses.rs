//! Sources rendered apart, for an app that mixes them itself: [`Renderer::begin_block`], [`Renderer::render_source`] for each,
//! [`Renderer::render_reverb`].
//!
//! Audio side, as [`Renderer::render`]: wait-free. Own.

use super::{MAX_SLOTS, RenderReport, Renderer};
use crate::runtime::engine::source_bus::BusStatus;
use crate::runtime::engine::statistics::add;
use crate::runtime::threads::clock::now;
use crate::runtime::threads::flush_to_zero::FlushToZero;
use crate::runtime::trace::SpanKind;
use crate::scene::SourceId;

impl Renderer {
    /// Begins a block of `frames` audio frames, 1 to [`Self::block_frames`], whose sources are rendered apart: takes the newest
    /// graphics frame and the newest update. For a game that mixes sources itself; in place of [`Self::render`]. Needs
    /// [`GeneratorSettings::source_buses`](crate::GeneratorSettings::source_buses). Wait-free; audio thread. Returns [`BusStatus::Own`] unless
    /// the block could not begin.
    ///
    /// Then call [`Self::render_source`] for each source and [`Self::render_reverb`] once. The sum of all their outputs is the
    /// output of [`Self::render`] up to rounding, without its limiter: the game's mix needs one of its own. A block that the
    /// next one finds without its [`Self::render_reverb`] is completed unheard.
    ///
    /// ```
    /// # fn main() -> foresound::Result<()> {
    /// use foresound::{BusStatus, Engine, EngineSettings};
    ///
    /// let mut settings = EngineSettings::default();
    /// settings.generation.source_buses = true;
    /// let (mut controller, mut renderer) = Engine::new(settings)?;
    /// let source = controller.add_source([0.0, 1.5, -2.0])?;
    /// controller.tick(Default::default(), &[])?;
    /// // In the game's audio callback:
    /// let dry = [0.1; 256];
    /// let (mut bus, mut reverb) = ([0.0; 2 * 256], [0.0; 2 * 256]);
    /// renderer.begin_block(256);
    /// // Silent, and `BusStatus::UnknownSource`, until a graphics frame with the source is heard.
    /// renderer.render_source(source, &dry, &mut bus);
    /// assert_eq!(renderer.render_reverb(&mut reverb).0, BusStatus::Own);
    /// # Ok(())
    /// # }
    /// ```
    pub fn begin_block(&mut self, frames: usize) -> BusStatus {
        let _flush = FlushToZero::begin();
        if !self.parts.settings.generation.source_buses {
            return BusStatus::Off;
        }
        self.end_open_block();
        if !(1..=self.parts.settings.block_frames).contains(&frames) {
            return BusStatus::WrongSize;
        }
        let started = now();
        let mut report = RenderReport::default();
        self.take_source_changes();
        self.advance_frame(frames, &mut report);
        if !self.is_silent() {
            self.mixer.begin(frames);
        }
        report.frames = frames as u32;
        self.apart.report = report;
        self.apart.frames = frames;
        self.apart.is_rendered.fill(false);
        self.apart.elapsed = started.elapsed();
        BusStatus::Own
    }

    /// Renders one source of the block into `output`, interleaved frames of [`Self::channels`], overwriting it: its paths, without
    /// the late reverb. `dry` holds the block's mono samples, 1 being the pressure at 1 m; they take the place of what the
    /// source plays in the engine. Without samples (an empty slice) the source's clip or stream is rendered. Once a source
    /// and block; the source's gain, mute and mix apply. Wait-free; audio thread.
    ///
    /// A source that is not rendered is in [`Self::render_reverb`]'s output: no sound is lost. Its clip or stream goes on, and its
    /// reflections fade away.
    pub fn render_source(
        &mut self,
        source: SourceId,
        dry: &[f32],
        output: &mut [f32],
    ) -> BusStatus {
        let _flush = FlushToZero::begin();
        let started = now();
        output.fill(0.0);
        let status = self.render_apart(source, dry, output);
        self.apart.elapsed += started.elapsed();
        status
    }

    fn render_apart(&mut self, source: SourceId, dry: &[f32], output: &mut [f32]) -> BusStatus {
        let frames = self.apart.frames;
        if !self.parts.settings.generation.source_buses {
            return BusStatus::Off;
        }
        if frames == 0 {
            return BusStatus::WrongOrder;
        }
        if output.len() != frames * self.channels() || ![0, frames].contains(&dry.len()) {
            return BusStatus::WrongSize;
        }
        if self.is_silent() {
            return BusStatus::Silent;
        }
        let dry = (!dry.is_empty()).then_some(dry);
        let (mixed, underrun) = self.mixer.mix_apart(source, dry);
        self.apart.report.underrun_samples += underrun;
        let mut is_heard = false;
        for slot in mixed.slots.into_iter().flatten() {
            if let Some(is_rendered) = self.apart.is_rendered.get_mut(slot)
                && !std::mem::replace(is_rendered, true)
            {
                let input = self.mixer.input(slot, frames);
                self.parts.generator.render_slot(slot, input, output);
                is_heard = true;
            }
        }
        if is_heard {
            // Every output of the block has the same fade.
            let gain = self.pause_gain;
            self.apply_pause_gain(output, self.target_pause_gain());
            self.pause_gain = gain;
        }
        mixed.status
    }

    /// Ends the block: renders the late reverb of all sources into `output`, interleaved frames of [`Self::channels`],
    /// overwriting it, and with it everything that has no bus of its own in this block: sources that were not rendered, that
    /// share slots or have no position, and the fading paths of removed ones. With another length than the block's the output is silent and
    /// sound goes on. Wait-free; audio thread. The report covers the whole block.
    pub fn render_reverb(&mut self, output: &mut [f32]) -> (BusStatus, RenderReport) {
        let _flush = FlushToZero::begin();
        output.fill(0.0);
        let frames = self.apart.frames;
        if !self.parts.settings.generation.source_buses {
            return (BusStatus::Off, RenderReport::default());
        }
        if frames == 0 {
            return (BusStatus::WrongOrder, RenderReport::default());
        }
        if output.len() == frames * self.channels() {
            return (BusStatus::Own, self.finish_block(output));
        }
        (BusStatus::WrongSize, self.end_open_block())
    }

    /// Completes a block without an output for it.
    pub(super) fn end_open_block(&mut self) -> RenderReport {
        let samples = self.apart.frames * self.channels();
        if samples == 0 {
            return RenderReport::default();
        }
        let mut spare = std::mem::take(&mut self.apart.spare);
        let output = &mut spare[..samples];
        output.fill(0.0);
        let report = self.finish_block(output);
        self.apart.spare = spare;
        report
    }

    /// Adds the rest of the block to `output`, and counts the block.
    fn finish_block(&mut self, output: &mut [f32]) -> RenderReport {
        let started = now();
        let frames = std::mem::take(&mut self.apart.frames);
        let mut report = self.apart.report;
        if !self.is_silent() {
            report.underrun_samples += self.mixer.mix_rest();
            add(&self.parts.metrics.mixed_frames, frames as u64);
            let mut inputs: [&[f32]; MAX_SLOTS] = [&[]; MAX_SLOTS];
            let slots = self.mixer.inputs(frames, &mut inputs);
            let (bed, is_rendered) = (self.mixer.bed(frames), &self.apart.is_rendered);
            let generator = &mut self.parts.generator;
            let made = generator.finish_block(&inputs[..slots], is_rendered, bed, output);
            report.voices = made.voices;
            self.voices = made.voices;
            report.dropped_paths += made.dropped_paths + made.dropped_delays;
            self.apply_pause_gain(output, self.target_pause_gain());
        }
        self.return_output();
        let elapsed = self.apart.elapsed + started.elapsed();
        self.parts.metrics.generation.record(elapsed);
        let voices = u64::from(report.voices);
        let spans = &mut self.parts.spans;
        spans.record(SpanKind::Generation, started, elapsed, voices);
        self.complete(&mut report, started, elapsed);
        report
    }
}
