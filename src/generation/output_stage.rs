//! The part of generation that depends on the layout or the HRTF set: voices, plane waves and buses.
//!
//! Construction: control side; allocates. The rest: audio side, wait-free. A generator changes its output by another stage:
//! in the frame of the change all paths start in the new stage and fade out in the old one, which is returned when it is
//! silent.

use std::f32::consts::SQRT_2;
use std::sync::Arc;

use glam::Quat;

use crate::error::Result;
use crate::generation::binaural::far_field::FarField;
use crate::generation::binaural::filter_bank::OutputBuses;
use crate::generation::delay::delay_line::DelayLine;
use crate::generation::panning::direction_table::DirectionTable;
use crate::generation::panning::layout::Layout;
use crate::generation::ramp::ChunkSpan;
use crate::generation::render_context::{RenderContext, SlotOwner};
use crate::generation::reverb::mixing::Rows;
use crate::generation::sound_field::FieldDecoder;
use crate::generation::voices::voice_set::VoiceSet;
use crate::generation::{GeneratorSettings, Hrtf};
use crate::simd::F32x8;

/// Voices, waves and buses of one output. Made on the control side, used on the audio side.
#[derive(Debug)]
pub(crate) struct OutputStage {
    pub(crate) table: Arc<DirectionTable>,
    pub(crate) voices: VoiceSet,
    far_field: Option<FarField>,
    buses: OutputBuses,
    /// Those of each source's voices, if sources have buses.
    slot_buses: Vec<OutputBuses>,
    field: FieldDecoder,
    /// Gains of a signal without position in the first two channels, of its middle and its side: of the energy of two ears.
    bed_gains: [[f32; 2]; 2],
    /// Whether the stage fades out, and frames until it is silent.
    is_fading: bool,
    fade_left: u32,
}

impl OutputStage {
    /// A silent stage for generators of these settings, in their layout.
    ///
    /// Errors: [`Error::Setting`](crate::Error::Setting) for a layout with more channels than the output, or an HRTF set of binaural sound with a
    /// different sample rate.
    pub(crate) fn new(settings: &GeneratorSettings, hrtf: &Hrtf) -> Result<Self> {
        let (layout, channels) = (settings.layout, settings.output_channels());
        layout.check_channels(channels)?;
        if layout == Layout::Binaural {
            hrtf.check_rate(settings.rate_hz)?;
            let buses = OutputBuses::binaural(hrtf);
            let table = Arc::clone(hrtf.table());
            let field = FieldDecoder::new(layout, &table, channels, hrtf);
            return Ok(Self::with(settings, table, buses, field));
        }
        let table = DirectionTable::of_layout(layout, channels);
        let used = match layout {
            Layout::Mono => channels.min(2),
            _ => layout.channels(),
        };
        let buses = OutputBuses::of_channels(used);
        let field = FieldDecoder::new(layout, &table, used, hrtf);
        Ok(Self::with(settings, Arc::new(table), buses, field))
    }

    fn with(
        settings: &GeneratorSettings,
        table: Arc<DirectionTable>,
        buses: OutputBuses,
        field: FieldDecoder,
    ) -> Self {
        let fine_voices = settings.fine_voices.min(settings.max_voices);
        Self {
            voices: VoiceSet::new(settings.max_voices, fine_voices, &table),
            far_field: settings.late.then(|| FarField::new(&table)),
            table,
            slot_buses: match settings.source_buses {
                true => vec![buses.clone(); settings.max_sources],
                false => Vec::new(),
            },
            buses,
            field,
            bed_gains: match (
                settings.layout.ambisonics_order(),
                settings.output_channels(),
            ) {
                // Left and right at 90 degrees.
                (Some(_), _) => [[SQRT_2, 0.0], [0.0, SQRT_2]],
                (None, 1) => [[SQRT_2, 0.0], [0.0; 2]],
                _ if settings.layout == Layout::Mono => [[1.0; 2], [0.0; 2]],
                _ => [[1.0; 2], [1.0, -1.0]],
            },
            is_fading: false,
            fade_left: 0,
        }
    }

    /// Gains of a signal without position in the first two channels, of its middle and its side.
    pub(crate) fn bed_gains(&self) -> [[f32; 2]; 2] {
        self.bed_gains
    }

    /// Begins at the next frame in place of another stage that fades out.
    pub(crate) fn start_silent(&mut self) {
        self.field.start_silent();
        if let Some(far_field) = &mut self.far_field {
            far_field.start_silent();
        }
    }

    /// Raises the sound field after [`Self::start_silent`], within so many frames.
    pub(crate) fn raise_field(&mut self, ramp: u32) {
        self.field.ramp_to(1.0, ramp);
    }

    /// Adds a chunk of the sound field to interleaved frames; `None` is silence.
    pub(crate) fn add_field(
        &mut self,
        field: Option<&[F32x8]>,
        output: &mut [f32],
        channels: usize,
    ) {
        self.field.add(field, output, channels);
    }

    /// Ramps the plane waves to a listener orientation.
    pub(crate) fn set_orientation(&mut self, to_head: Quat, left: u32, ramp: u32) {
        if let Some(far_field) = &mut self.far_field {
            far_field.set_orientation(&self.table, to_head, left, ramp);
        }
    }

    /// Fades all voices and waves out within the context's ramp.
    pub(crate) fn fade(&mut self, owners: &[SlotOwner], context: &RenderContext) {
        self.voices.discard_paths();
        self.voices.set_paths(&[], owners, context);
        if let Some(far_field) = &mut self.far_field {
            far_field.fade(context.left, context.ramp);
        }
        self.field.ramp_to(0.0, context.ramp);
        let tail = self.voices.tail_frames() + self.buses.tail_frames();
        let tail = tail.max(self.field.tail_frames());
        self.is_fading = true;
        self.fade_left = context.ramp + tail as u32;
    }

    /// Whether the stage has faded out and is silent.
    pub(crate) fn is_over(&self) -> bool {
        self.fade_left == 0
    }

    /// Adds a chunk of the voices to the buses. Calls `after_slot` for every slot in order, after the voices of its source.
    pub(crate) fn add_voices(
        &mut self,
        lines: &[DelayLine],
        chunk: ChunkSpan,
        after_slot: &mut impl FnMut(usize),
    ) {
        if self.slot_buses.is_empty() {
            let buses = &mut self.buses;
            self.voices.render(lines, chunk, buses, after_slot);
            return;
        }
        for (slot, buses) in self.slot_buses.iter_mut().enumerate() {
            self.voices.render_slot(slot, lines, chunk, buses);
            after_slot(slot);
        }
        self.voices.remove_faded();
    }

    /// Adds a chunk of one source's voices to interleaved frames of `channels` channels. After the chunks of all sources call
    /// [`Self::end_slots`].
    pub(crate) fn render_slot(
        &mut self,
        slot: usize,
        lines: &[DelayLine],
        chunk: ChunkSpan,
        (output, channels): (&mut [f32], usize),
    ) {
        if let Some(buses) = self.slot_buses.get_mut(slot) {
            self.voices.render_slot(slot, lines, chunk, buses);
            buses.finish(output, channels);
        }
    }

    /// Ends a block whose sources were rendered apart.
    pub(crate) fn end_slots(&mut self) {
        self.voices.remove_faded();
    }

    /// Adds a chunk of the plane waves to the buses; `None` is silence.
    pub(crate) fn add_waves(&mut self, chunk: ChunkSpan, waves: Option<&Rows>) {
        if let Some(far_field) = &mut self.far_field {
            far_field.render(chunk.left, chunk.frames, &mut self.buses, waves);
        }
    }

    /// Adds the chunk's sound to interleaved frames of `channels` channels.
    pub(crate) fn finish(&mut self, output: &mut [f32], channels: usize) {
        for buses in &mut self.slot_buses {
            buses.finish(output, channels);
        }
        self.finish_waves(output, channels);
    }

    /// [`Self::finish`] without the sources, which were rendered apart.
    pub(crate) fn finish_waves(&mut self, output: &mut [f32], channels: usize) {
        self.buses.finish(output, channels);
        let frames = (output.len() / channels) as u32;
        self.fade_left = self.fade_left.saturating_sub(frames);
        // Voices that began to fade before the change may take longer.
        if self.is_fading && self.voices.count() > 0 {
            self.fade_left = self.fade_left.max(self.buses.tail_frames() as u32 + 1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extrapolation::{FramePath, FramePaths, PathKind};
    use crate::generation::{Generator, synthetic_hrtf};
    use crate::propagation::PathId;
    use crate::scene::SourceId;
    use glam::Vec3;

    /// A path that ends within 8,000 frames goes on to do so in the old stage when the change comes with a short ramp.
    #[test]
    fn a_fade_before_the_change_is_not_cut() {
        let settings = GeneratorSettings {
            max_sources: 1,
            max_voices: 8,
            limiter: false,
            late: false,
            ..GeneratorSettings::default()
        };
        let set = synthetic_hrtf::bytes(settings.rate_hz);
        let hrtf = Arc::new(Hrtf::parse(&set, "synthetic").unwrap());
        let mut generator = Generator::new(settings.clone(), Arc::clone(&hrtf)).unwrap();
        let mut sounding = FramePaths::default();
        sounding.paths.push(FramePath {
            id: PathId(1),
            source: SourceId::new(0, 0),
            kind: PathKind::Direct,
            order: 0,
            amplitude: [1.0; 8],
            delay_s: 0.01,
            air_delay_s: 0.01,
            arrival: Vec3::NEG_Z,
            departure: Vec3::ZERO,
        });
        let silent = FramePaths::default();
        let (mut now, mut sound) = (0usize, Vec::new());
        let mut block = |generator: &mut Generator| {
            let input: Vec<f32> = (now..now + 256).map(|n| (0.02 * n as f32).sin()).collect();
            let mut output = [0.0; 2 * 256];
            generator.render(&[&input], &mut output);
            sound.extend(output.iter().step_by(2));
            now += 256;
        };
        generator.set_frame(&sounding, 256);
        (0..20).for_each(|_| block(&mut generator));
        generator.set_frame(&silent, 8000);
        block(&mut generator);
        let changed = GeneratorSettings {
            layout: Layout::Stereo,
            ..settings
        };
        let stage = OutputStage::new(&changed, &hrtf).unwrap();
        generator.change_stages(&mut vec![Box::new(stage)]);
        generator.set_frame(&silent, 256);
        let mut retired = 0;
        for number in 0..60 {
            block(&mut generator);
            if generator.take_retired_stages(&mut Vec::new()) {
                retired = number;
            }
        }
        // The old stage is kept for the 7,744 frames left of the fade.
        assert!(retired >= 7744 / 256, "{retired}");
        let largest = |part: &[f32]| {
            let steps = part.windows(2).map(|pair| (pair[1] - pair[0]).abs());
            steps.fold(0.0, f32::max)
        };
        assert!(largest(&sound[3000..]) <= 1.01 * largest(&sound[3000..5000]));
        assert!(sound[sound.len() - 256..].iter().all(|s| *s == 0.0));
    }
}
