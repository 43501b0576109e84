//! What the engine's threads did when: spans in rings, a file that Perfetto opens.
//!
//! Each thread has a ring of its own, made beforehand; a full ring drops spans and counts them. The app empties the rings
//! into a [`TraceLog`] now and then, and writes it at the end.

mod log;
mod span;
pub(crate) mod system_trace;

pub use log::TraceLog;
pub use span::{Span, SpanKind, Track};

pub(super) use span::{SpanReader, SpanWriter, spans};
