//! Sources and their sounds.

use std::sync::Arc;

use glam::Vec3;

use super::Controller;
use crate::error::{Error, Result};
use crate::runtime::engine::messages::SampleSourceChange;
use crate::runtime::engine::sample_source::SampleSource;
use crate::runtime::engine::stream::StreamWriter;
use crate::scene::SourceId;

impl Controller {
    /// Adds a silent source. Where only slots are left whose last source has just been removed, it begins to sound when that
    /// one has been heard to its end, after 0.15 s of audio (more where blocks are longer than 1,000 frames), and loses
    /// nothing of its beginning.
    ///
    /// # Errors
    /// [`Error::Engine`] if there are [`crate::runtime::EngineSettings::most_sources`] already, [`Error::Setting`] for a
    /// position that is none.
    pub fn add_source(&mut self, position: Vec3) -> Result<SourceId> {
        self.sources.add(position)
    }

    /// Removes a source from the next tick on: what it has sent fades, its handle is stale at once.
    ///
    /// # Errors
    /// [`Error::StaleSource`], as for every handle that is not a present source's.
    pub fn remove_source(&mut self, id: SourceId) -> Result<()> {
        self.sources.remove(id, self.ticks + 1)?;
        self.send_source(id, SampleSource::Silence);
        Ok(())
    }

    /// Moves a source from the next tick on.
    ///
    /// # Errors
    /// [`Error::StaleSource`]; [`Error::Setting`] for a position that is none, and the last good one is kept.
    pub fn move_source(&mut self, id: SourceId, position: Vec3) -> Result<()> {
        self.sources.move_to(id, position)
    }

    /// Silences a source from the next tick on, or lets it be heard again; its sound goes on unheard.
    ///
    /// # Errors
    /// [`Error::StaleSource`].
    pub fn mute_source(&mut self, id: SourceId, muted: bool) -> Result<()> {
        self.sources.set_muted(id, muted)
    }

    /// Sets a source's gain, a pressure ratio from 0 to 1000, from the next tick on.
    ///
    /// # Errors
    /// [`Error::StaleSource`]; [`Error::Setting`] outside the range.
    pub fn set_source_gain(&mut self, id: SourceId, gain: f32) -> Result<()> {
        self.sources.set_gain(id, gain)
    }

    /// Plays a clip from its beginning, once or for ever: mono samples at the engine's rate, in which 1 is the pressure at
    /// 1 m. An empty clip is silence.
    ///
    /// # Errors
    /// [`Error::StaleSource`].
    pub fn play(&mut self, id: SourceId, samples: Arc<[f32]>, looped: bool) -> Result<()> {
        self.sources.set_plays(id, !samples.is_empty())?;
        let clip = SampleSource::Clip {
            samples,
            next: 0,
            looped,
        };
        self.send_source(id, clip);
        Ok(())
    }

    /// Plays what the app writes from now on, through a ring for `capacity` samples (1 to 2^24). Where samples are late,
    /// the last one fades within 256 audio frames, and what comes later rises; [`Statistics::starved_samples`] counts
    /// them.
    ///
    /// [`Statistics::starved_samples`]: crate::runtime::Statistics::starved_samples
    ///
    /// # Errors
    /// [`Error::StaleSource`]; [`Error::Setting`] for another capacity.
    pub fn stream(&mut self, id: SourceId, capacity: usize) -> Result<StreamWriter> {
        self.sources.check(id)?;
        if !(1..=1 << 24).contains(&capacity) {
            let advice = "choose 1 to 16777216 samples";
            let problem = format!("{capacity} is out of range");
            return Err(Error::setting("capacity", problem, advice));
        }
        let (writer, stream) = StreamWriter::new(capacity);
        self.sources.set_plays(id, true)?;
        self.send_source(id, SampleSource::Stream(stream));
        Ok(writer)
    }

    /// Silences a source and lets go of its clip or stream.
    ///
    /// # Errors
    /// [`Error::StaleSource`].
    pub fn stop(&mut self, id: SourceId) -> Result<()> {
        self.sources.set_plays(id, false)?;
        self.send_source(id, SampleSource::Silence);
        Ok(())
    }

    /// Number of sources.
    pub fn source_count(&self) -> usize {
        self.sources.count()
    }

    fn send_source(&mut self, id: SourceId, feed: SampleSource) {
        self.waiting_changes.retain(|change| change.id.slot() != id.slot());
        self.waiting_changes.push_back(SampleSourceChange { id, source: feed });
        self.send_waiting_changes();
    }

    /// Sends what waits and frees what came back.
    pub(super) fn send_waiting_changes(&mut self) {
        while self.channels.retired.pop().is_ok() {}
        if self.channels.source_changes.is_abandoned() {
            self.waiting_changes.clear();
        }
        while !self.channels.source_changes.is_full() {
            let Some(change) = self.waiting_changes.pop_front() else {
                break;
            };
            if self.channels.source_changes.push(change).is_err() {
                break;
            }
        }
    }
}
