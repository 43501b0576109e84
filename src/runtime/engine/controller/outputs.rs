//! Layout and HRTF set of the output, changed while sound runs.

use std::sync::Arc;

use super::Controller;
use crate::error::Result;
use crate::generation::{GeneratorSettings, Hrtf, Layout, OutputStage};
use crate::runtime::engine::messages::OutputChange;

impl Controller {
    /// The layout of the output.
    pub fn layout(&self) -> Layout {
        self.settings.generation.layout
    }

    /// Changes the layout, such as when headphones are plugged in: sound cross-fades within the next graphics frame. The
    /// number of channels stays that of the engine; channels that the layout does not have fall silent. Allocates some
    /// megabytes and computes for some milliseconds on this thread.
    ///
    /// ```
    /// # fn main() -> foresound::Result<()> {
    /// use foresound::Layout;
    ///
    /// # let (mut controller, _renderer) = foresound::Engine::new(Default::default())?;
    /// controller.set_layout(Layout::Stereo)?;
    /// assert!(controller.set_layout(Layout::Surround51).is_err()); // The engine has two channels.
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for a layout with more channels than the output, and for binaural sound
    /// without an HRTF set; nothing changes then.
    pub fn set_layout(&mut self, layout: Layout) -> Result<()> {
        let generation = GeneratorSettings {
            layout,
            channels: Some(self.settings.generation.output_channels()),
            ..self.settings.generation.clone()
        };
        let hrtf = self.settings.hrtf_of(layout)?;
        self.send_output(&generation, &hrtf)?;
        self.settings.generation = generation;
        Ok(())
    }

    /// Changes the HRTF set; binaural sound cross-fades within the next graphics frame. `None` is the built-in set for the
    /// sample rate. Allocates.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for a set of another sample rate, or without a built-in set; nothing changes
    /// then.
    pub fn set_hrtf(&mut self, hrtf: Option<Arc<Hrtf>>) -> Result<()> {
        let mut settings = self.settings.clone();
        settings.hrtf = hrtf;
        let hrtf = settings.load_hrtf()?;
        hrtf.check_rate(settings.generation.rate_hz)?;
        if self.layout() == Layout::Binaural {
            self.send_output(&settings.generation, &hrtf)?;
        }
        self.settings = settings;
        Ok(())
    }

    fn send_output(&mut self, generation: &GeneratorSettings, hrtf: &Hrtf) -> Result<()> {
        let stage = |_| OutputStage::new(generation, hrtf).map(Box::new);
        let stages: Result<Vec<_>> = (0..generation.listeners).map(stage).collect();
        let stages = stages?;
        let outputs = &mut self.channels.outputs;
        let mut change = outputs.take_blank(OutputChange::default);
        change.stages = stages;
        outputs.send(change);
        Ok(())
    }

    /// Frees outputs that have faded out.
    pub(super) fn free_outputs(&mut self) {
        while let Some(mut change) = self.channels.outputs.returned() {
            change.stages.clear();
            self.channels.outputs.keep(change);
        }
    }
}
