//! SGS: the sound generation stage. Paths of each graphics frame become two ears of sound.
//!
//! Runs on the audio thread that its caller owns (none of its own), takes [`crate::extrapolation::FramePaths`] and one
//! mono signal a source, gives interleaved stereo. Control side: settings, [`Hrtf`] and [`Generator::new`]. Audio side,
//! wait-free and without allocation: [`Generator::set_frame`] and [`Generator::render`].
//!
//! The way of a sample: [`BandFilter`] splits a source into eight bands, a delay line remembers them, every path has a
//! voice that mixes the bands in its proportions and reads the mixture at the two ears' delays, buses collect the ear
//! signals by weights of the head-related set, one filter a bus finishes them. The late reverb takes bands from the delay
//! lines and comes back as eight far arrivals on the same buses. A [`Limiter`] guards the end.

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
