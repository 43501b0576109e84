//! Timeline of the engine's threads: spans in rings, written as a file for Perfetto.
//!
//! Each thread has a preallocated ring; a full ring drops spans and counts them. The app moves spans to a [`TraceLog`].

mod log;
mod span;
pub(crate) mod system_trace;

pub use log::TraceLog;
pub use span::{Span, SpanKind, Track};

pub(super) use span::{SpanReader, SpanWriter, spans};
