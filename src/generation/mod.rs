//! SGS: the sound generation stage. Paths of each graphics frame become two ears of sound.
//!
//! Runs on the audio thread that its caller owns (none of its own), takes [`crate::extrapolation::FramePaths`] and one
//! mono signal a source, gives interleaved stereo. Control side: settings, [`Hrtf`] and [`Generator::new`]. Audio side,
//! wait-free and without allocation: [`Generator::set_frame`] and [`Generator::render`].
//!
//! Signal flow: [`BandFilter`] splits a source into eight bands and a delay line stores them. Each path has a voice, which
//! mixes the bands at the path's gains and reads the mixture at the two ears' delays. Buses sum the ear signals by weights
//! of the HRTF set, with one filter a bus. The late reverb reads the delay lines and returns as eight plane waves on the
//! same buses. A [`Limiter`] is last.

pub mod bands;
pub mod binaural;
pub mod delay;
mod generator;
mod limiter;
mod ramp;
mod render_context;
mod report;
pub mod reverb;
mod settings;
#[cfg(test)]
#[path = "../../tests/reference/synthetic_hrtf.rs"]
mod synthetic_hrtf;
pub mod voices;

pub use crate::generation::bands::band_correction::BandCorrection;
pub use crate::generation::bands::band_filter::BandFilter;
pub use crate::generation::binaural::hrtf::Hrtf;
pub use generator::Generator;
pub use limiter::Limiter;
pub use report::BlockReport;
pub use settings::GeneratorSettings;

/// Frames rendered at once: a chunk of every buffer on a path's way fits a first-level cache, and no ramp ends within
/// one. Independent of the caller's block.
const CHUNK: usize = 256;
