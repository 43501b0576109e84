//! Collected spans, written in Chrome's trace event format (\[CHROMETRACE\]) for Perfetto. Control side.

use std::io::{self, Write};

use super::span::{Span, SpanKind, SpanReader, Track};

/// Spans of a run, in the order of collection.
#[derive(Debug, Clone, Default)]
pub struct TraceLog {
    spans: Vec<(Track, Span)>,
    lost: u64,
}

impl Track {
    const ALL: [Self; 3] = [Self::App, Self::Propagation, Self::Sound];

    fn name(self) -> &'static str {
        match self {
            Self::App => "app",
            Self::Propagation => "propagation",
            Self::Sound => "sound",
        }
    }

    /// Thread number in the file.
    fn number(self) -> u32 {
        self as u32 + 1
    }
}

impl SpanKind {
    /// Name in the file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tick => "tick",
            Self::Update => "update (SPS)",
            Self::Block => "block",
            Self::Direct => "direct paths",
            Self::Extrapolation => "extrapolation (EPS)",
            Self::Generation => "generation (SGS)",
            Self::QualityLevel => "tier",
        }
    }

    /// Name of the value.
    fn value_name(self) -> &'static str {
        match self {
            Self::Tick => "sources",
            Self::Update | Self::Extrapolation => "paths",
            Self::Block => "level",
            Self::Direct => "rays",
            Self::Generation => "voices",
            Self::QualityLevel => "tier",
        }
    }
}

impl TraceLog {
    /// Moves all spans out of a ring.
    pub(crate) fn collect(&mut self, reader: &mut SpanReader) {
        while let Some(span) = reader.take() {
            self.spans.push((reader.track, span));
        }
        self.lost += reader.take_lost();
    }

    /// All spans collected.
    pub fn spans(&self) -> &[(Track, Span)] {
        &self.spans
    }

    /// Spans dropped by full rings: collect more often or make the rings larger.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Writes the file: events in microseconds on named threads; extrapolation level, paths and quality level as
    /// counters.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_json(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(out, "{{\"displayTimeUnit\":\"ms\",\"traceEvents\":[")?;
        writeln!(
            out,
            "{{\"name\":\"process_name\",\"ph\":\"M\",\"pid\":1,\"args\":{{\"name\":\"foresound\"}}}},"
        )?;
        for track in Track::ALL {
            let (name, thread) = (track.name(), track.number());
            writeln!(
                out,
                "{{\"name\":\"thread_name\",\"ph\":\"M\",\"pid\":1,\"tid\":{thread},\"args\":{{\"name\":\"{name}\"}}}},"
            )?;
        }
        for (track, span) in &self.spans {
            let (name, what) = (span.kind.name(), span.kind.value_name());
            let (thread, value) = (track.number(), span.value);
            let at_us = span.began_ns as f64 * 1e-3;
            let lasted_us = span.duration_ns as f64 * 1e-3;
            if span.kind != SpanKind::QualityLevel {
                writeln!(
                    out,
                    "{{\"name\":\"{name}\",\"ph\":\"X\",\"pid\":1,\"tid\":{thread},\"ts\":{at_us:.3},\"dur\":{lasted_us:.3},\"args\":{{\"{what}\":{value}}}}},"
                )?;
            }
            if matches!(
                span.kind,
                SpanKind::Update | SpanKind::Block | SpanKind::QualityLevel
            ) {
                writeln!(
                    out,
                    "{{\"name\":\"{what}\",\"ph\":\"C\",\"pid\":1,\"ts\":{at_us:.3},\"args\":{{\"{what}\":{value}}}}},"
                )?;
            }
        }
        let lost = self.lost;
        writeln!(
            out,
            "{{\"name\":\"lost spans\",\"ph\":\"M\",\"pid\":1,\"tid\":1,\"args\":{{\"lost\":{lost}}}}}"
        )?;
        writeln!(out, "]}}")
    }
}

#[cfg(test)]
mod tests {
    use super::super::span::spans;
    use super::*;
    use crate::runtime::threads::clock::now;
    use std::time::Duration;

    #[test]
    fn a_file_names_its_threads_and_holds_every_span() {
        let epoch = now();
        let mut log = TraceLog::default();
        for (track, kind) in [
            (Track::Sound, SpanKind::Block),
            (Track::Propagation, SpanKind::Update),
            (Track::Propagation, SpanKind::QualityLevel),
        ] {
            let (mut writer, mut reader) = spans(track, 4, epoch);
            let began = epoch + Duration::from_micros(1500);
            writer.record(kind, began, Duration::from_nanos(2500), 12);
            log.collect(&mut reader);
        }
        assert_eq!((log.spans().len(), log.lost()), (3, 0));
        let mut file = Vec::new();
        log.write_json(&mut file).unwrap();
        let text = String::from_utf8(file).unwrap();
        assert_eq!(text.matches("\"ph\":\"X\"").count(), 2);
        assert_eq!(text.matches("\"ph\":\"C\"").count(), 3);
        assert!(text.contains("\"ts\":1500.000,\"dur\":2.500,\"args\":{\"level\":12}"));
        for track in Track::ALL {
            assert!(text.contains(&format!("\"args\":{{\"name\":\"{}\"}}", track.name())));
        }
        #[cfg(feature = "testing")]
        assert!(serde_json::from_str::<serde_json::Value>(&text).is_ok());
    }
}
