//! The street door: the engine under handles, for Java and C.
//!
//! A handle is a number. Behind it stands a table slot with a generation, so a handle that was closed, or is another
//! kind's, or never was one, is an error and nothing else. Whoever uses a handle has its object to itself for the call
//! ([`table`]); control calls wait for each other, sound calls never wait. Every call catches panics: the object that
//! panicked answers nothing but *close* from then on.
//!
//! Control side, any thread: everything but two. Audio side, wait-free: [`sound::render`] and [`sound::write_stream`],
//! which neither allocate nor lock and touch no thread-local variable.

pub mod clip;
pub mod fault;
pub mod health;
pub mod instances;
pub mod numbers;
pub mod options;
pub mod picture;
pub mod pose;
pub mod scenes;
pub mod session;
pub mod sound;
pub mod statistics;
pub mod table;

#[cfg(feature = "capi")]
pub mod capi;
#[cfg(feature = "jni")]
pub mod jni;

pub use fault::{Fault, Status};
pub use options::Options;
pub use pose::Pose;
pub use statistics::EngineStatistics;

/// Version of this interface: 65,536 × major + 256 × minor + patch. Another major number breaks callers.
pub const VERSION: u32 = 0x0001_0200;

/// Closes any handle: ends what it stands for. An engine waits for the update under way.
///
/// # Errors
/// [`Status::Closed`] and [`Status::WrongKind`] as for every use of a handle.
pub fn close(handle: u64) -> Result<(), Fault> {
    use table::Kind;
    match table::kind_of(handle)? {
        Kind::Engine => session::ENGINES.remove(handle).map(drop),
        Kind::Renderer => sound::RENDERERS.remove(handle).map(drop),
        Kind::Scene => scenes::SCENES.remove(handle).map(drop),
        Kind::Clip => clip::CLIPS.remove(handle).map(drop),
        Kind::Stream => sound::STREAMS.remove(handle).map(drop),
        Kind::Output => sound::OUTPUTS.remove(handle).map(drop),
    }
}

/// Handles that are open, of all kinds: for tests that look for leaks.
pub fn open_handles() -> usize {
    session::ENGINES.len()
        + sound::RENDERERS.len()
        + scenes::SCENES.len()
        + clip::CLIPS.len()
        + sound::STREAMS.len()
        + sound::OUTPUTS.len()
}
