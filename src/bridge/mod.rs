//! The engine for C and Java: objects behind handles, one table of functions, structures of plain numbers.
//!
//! A handle is a number with a generation ([`handles`]): a closed, foreign or invented one is an error and nothing else. A
//! call has the handle's object exclusively. Control calls wait for each other, audio calls never wait. Every call catches
//! panics; the object of a call that panicked accepts only *close*. Functions common to C and Java are declared in
//! [`interface`], structures with [`record`].
//!
//! Threads: any control thread, except [`sound::render`] and [`sound::write_stream`], which are for the audio thread:
//! wait-free, without allocation, locks or thread-local variables.

pub mod clip;
pub mod engine;
pub mod enumeration;
pub mod error;
mod function;
pub mod handles;
pub mod health;
pub mod instances;
pub mod interface;
mod kind;
pub mod logging;
pub mod numbers;
pub mod options;
pub mod playback;
pub mod pose;
pub mod progress;
pub mod record;
mod resampling;
pub mod scenes;
pub mod shown_paths;
pub mod sound;
pub mod source_buses;
pub mod statistics;
#[cfg(feature = "testing")]
mod structures;

#[cfg(feature = "capi")]
pub mod capi;
#[cfg(feature = "jni")]
pub mod jni;

pub use error::{CallError, Status};
pub use options::Options;
pub use pose::Pose;
pub use statistics::EngineStatistics;

/// Version of this interface: 65,536 × major + 256 × minor + patch. Another major number breaks callers.
pub const VERSION: u32 = 0x0003_0000;

/// Closes a handle of any kind and destroys its object. An engine waits for its running update.
///
/// # Errors
/// [`Status::Closed`] and [`Status::WrongKind`].
pub fn close(handle: u64) -> Result<(), CallError> {
    use handles::Kind;
    match handles::kind_of(handle)? {
        Kind::Engine => engine::ENGINES.remove(handle).map(drop),
        Kind::Renderer => sound::RENDERERS.remove(handle).map(drop),
        Kind::Scene => scenes::SCENES.remove(handle).map(drop),
        Kind::Clip => clip::CLIPS.remove(handle).map(drop),
        Kind::Stream => sound::STREAMS.remove(handle).map(drop),
        Kind::Output => sound::OUTPUTS.remove(handle).map(drop),
        Kind::Progress => progress::PROGRESSES.remove(handle).map(drop),
    }
}

/// Open handles of all kinds, for leak tests.
pub fn open_handles() -> usize {
    engine::ENGINES.len()
        + sound::RENDERERS.len()
        + scenes::SCENES.len()
        + clip::CLIPS.len()
        + sound::STREAMS.len()
        + sound::OUTPUTS.len()
        + progress::PROGRESSES.len()
}
