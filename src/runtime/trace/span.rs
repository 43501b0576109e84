//! Spans of time, and their ring. [`SpanWriter::record`] is wait-free and does not allocate.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::runtime::threads::clock::nanoseconds;

/// The thread of a span. Propagation runs on the app's thread in the synchronous schedule.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Track {
    /// [`crate::runtime::Controller::tick`].
    App,
    /// Propagation updates.
    Propagation,
    /// [`crate::runtime::Renderer::render`] and its stages.
    Sound,
}

/// The work of a span.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpanKind {
    /// A call of `tick`; the value is the number of sources.
    Tick,
    /// A propagation update (SPS); the value is its number of paths.
    Update,
    /// A call of the renderer; the value is the extrapolation level L.
    Block,
    /// The direct paths of a graphics frame; the value is the number of rays.
    Direct,
    /// Extrapolation of a graphics frame (EPS); the value is the number of paths.
    Extrapolation,
    /// Generation of a block (SGS); the value is the number of voices.
    Generation,
    /// A change of quality level, of no duration; the value is the new level.
    QualityLevel,
}

/// A span of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// The work.
    pub kind: SpanKind,
    /// Start in nanoseconds since the engine was made.
    pub began_ns: u64,
    /// Duration in nanoseconds.
    pub duration_ns: u64,
    /// See [`SpanKind`].
    pub value: u64,
}

/// The thread's end of the ring.
pub(crate) struct SpanWriter {
    ring: rtrb::Producer<Span>,
    lost: Arc<AtomicU64>,
    epoch: Instant,
    is_on: bool,
}

/// The app's end.
pub(crate) struct SpanReader {
    ring: rtrb::Consumer<Span>,
    lost: Arc<AtomicU64>,
    pub(super) track: Track,
}

/// A ring for `capacity` spans; 0 turns recording off.
pub(crate) fn spans(track: Track, capacity: usize, epoch: Instant) -> (SpanWriter, SpanReader) {
    let (producer, consumer) = rtrb::RingBuffer::new(capacity);
    let lost = Arc::new(AtomicU64::new(0));
    let writer = SpanWriter {
        ring: producer,
        lost: Arc::clone(&lost),
        epoch,
        is_on: capacity > 0,
    };
    let reader = SpanReader {
        ring: consumer,
        lost,
        track,
    };
    (writer, reader)
}

impl SpanWriter {
    /// Records a span.
    pub(crate) fn record(&mut self, kind: SpanKind, began: Instant, lasted: Duration, value: u64) {
        if !self.is_on {
            return;
        }
        let span = Span {
            kind,
            began_ns: nanoseconds(began.saturating_duration_since(self.epoch)),
            duration_ns: nanoseconds(lasted),
            value,
        };
        if self.ring.push(span).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl SpanReader {
    /// The oldest span in the ring.
    pub(super) fn take(&mut self) -> Option<Span> {
        self.ring.pop().ok()
    }

    /// Spans lost since the last call.
    pub(super) fn take_lost(&self) -> u64 {
        self.lost.swap(0, Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::threads::clock::now;

    #[test]
    fn a_full_ring_drops_and_counts_spans() {
        let epoch = now();
        let (mut writer, mut reader) = spans(Track::Sound, 2, epoch);
        for value in 0..5 {
            let began = epoch + Duration::from_nanos(10 * value);
            writer.record(SpanKind::Block, began, Duration::from_nanos(7), value);
        }
        let first = reader.take().expect("recorded");
        assert_eq!((first.began_ns, first.duration_ns, first.value), (0, 7, 0));
        assert_eq!(reader.take().map(|span| span.began_ns), Some(10));
        assert_eq!((reader.take(), reader.take_lost()), (None, 3));
        assert_eq!(reader.take_lost(), 0);
    }

    #[test]
    fn disabled_recording_drops_nothing() {
        let epoch = now();
        let (mut writer, mut reader) = spans(Track::App, 0, epoch);
        writer.record(SpanKind::Tick, epoch, Duration::ZERO, 0);
        assert_eq!((reader.take(), reader.take_lost()), (None, 0));
    }
}
