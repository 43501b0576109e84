//! A block whose sources are rendered apart: each source's voices into a buffer of the caller, the late reverb and the rest
//! into another.
//!
//! Audio side; wait-free. The same delay lines, voices and networks as in [`Generator::render`] in another order: a source's
//! whole block is written and its voices are rendered before the next source's. Voices are sorted by source, so those of one
//! are contiguous, and each source has buses of its own. The delay lines are longer by a block: the reverb reads them
//! afterwards. With several listeners a
//! source's buffer has its sound at all of them. The sum of all buffers is the output of [`Generator::render`] before the limiter, up to rounding.

use super::{Generator, MAX_SAMPLE};
use crate::generation::settings::MAX_BLOCK;
use crate::generation::{Bed, BlockReport};

impl Generator {
    /// Writes a source's input of a block and adds its voices to `output`. Each slot at most once a block, all blocks of the
    /// same length, up to [`MAX_BLOCK`] frames; [`Self::finish_block`] ends the block. Only with
    /// [`GeneratorSettings::source_buses`](crate::GeneratorSettings::source_buses).
    pub(crate) fn render_slot(&mut self, slot: usize, input: &[f32], output: &mut [f32]) {
        let channels = self.channels;
        let frames = (output.len() / channels).min(MAX_BLOCK);
        if slot >= self.lines.len() || self.signals != 1 {
            return;
        }
        for chunk in self.chunks(frames) {
            self.write_sources(slot, &[input], &chunk);
            let part = channels * chunk.start..channels * (chunk.start + chunk.frames);
            for (listener, own) in self.outputs.iter_mut().enumerate() {
                let part = &mut output[part.clone()];
                own.render_slot(slot, &self.lines, chunk.span(listener), part, channels);
            }
        }
        self.silence_non_finite(output);
    }

    /// Ends a block: adds what [`Self::render_slot`] did not render, the late reverb and the bed to `output`. `inputs` holds the
    /// signal of each slot, `is_rendered` whether it was rendered.
    pub(crate) fn finish_block(
        &mut self,
        inputs: &[&[f32]],
        is_rendered: &[bool],
        bed: Bed<'_>,
        output: &mut [f32],
    ) -> BlockReport {
        let channels = self.channels;
        let frames = (output.len() / channels).min(MAX_BLOCK);
        let rendered = is_rendered.iter().chain(std::iter::repeat(&false));
        for (slot, _) in (0..self.lines.len()).zip(rendered).filter(|(_, is)| !**is) {
            let input = inputs.get(slot).copied().unwrap_or_default();
            self.render_slot(slot, input, output);
        }
        for own in &mut self.outputs {
            own.end_slots();
        }
        for chunk in self.chunks(frames) {
            let part = channels * chunk.start..channels * (chunk.start + chunk.frames);
            for (listener, own) in self.outputs.iter_mut().enumerate() {
                let part = &mut output[part.clone()];
                own.render_reverb(&self.lines, chunk.span(listener), part, channels);
            }
            self.advance(&chunk);
        }
        self.silence_non_finite(output);
        if let Some(first) = self.outputs.first_mut() {
            first.add_bed(bed, MAX_SAMPLE, output, channels);
        }
        self.take_report(frames)
    }
}
