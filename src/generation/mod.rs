//! SGS: the sound generation stage. Renders the paths of each graphics frame for headphones, loudspeakers or Ambisonics.
//!
//! Runs on the caller's audio thread. Input: [`crate::extrapolation::FramePaths`] and one mono signal per source; output:
//! the interleaved channels of a [`Layout`]. Control side: settings, [`Hrtf`] and [`Generator::new`]. Audio side, wait-free and without
//! allocation: [`Generator::set_frame`] and [`Generator::render`].
//!
//! Signal flow: [`BandFilter`] splits a source into eight bands, and a delay line stores them. Each path has a voice, which
//! mixes the bands with the path's gains and reads the mixture at the delays of the two ears. Buses sum the ear signals with
//! the weights of the HRTF set; each bus has one filter. The late reverb reads the delay lines and adds its plane waves to
//! the same buses. A [`Limiter`] follows.

#[cfg(feature = "sofa")]
pub mod baking;
pub mod bands;
mod bed;
pub mod binaural;
pub mod delay;
mod generator;
mod limiter;
mod listener_output;
mod longer_line;
mod output_stage;
pub mod panning;
mod ramp;
mod render_context;
mod report;
pub mod reverb;
mod settings;
mod sound_field;
#[cfg(test)]
#[path = "../../tests/reference/synthetic_hrtf.rs"]
mod synthetic_hrtf;
pub mod voices;

pub use crate::generation::bands::band_correction::BandCorrection;
pub use crate::generation::bands::band_filter::BandFilter;
pub use crate::generation::binaural::hrtf::Hrtf;
pub use crate::generation::panning::layout::Layout;
pub use bed::Bed;
pub use generator::Generator;
pub use limiter::Limiter;
pub(crate) use longer_line::{LongerLine, first_longest_s};
pub(crate) use output_stage::OutputStage;
pub use report::BlockReport;
pub use settings::GeneratorSettings;

/// Frames rendered at once: the buffers of a path fit in a first-level cache, and no ramp ends within a chunk.
/// Independent of the caller's block.
const CHUNK: usize = 256;
