//! Sources and their samples.

use glam::Vec3;

use super::Controller;
use crate::error::{Error, Result};
use crate::runtime::engine::messages::SampleSourceChange;
use crate::runtime::engine::sample_source::SampleSource;
use crate::runtime::engine::stream::StreamWriter;
use crate::scene::{SourceId, SourceSettings};

impl Controller {
    /// Adds a silent source at a position in metres. In the slot of a source just removed it starts after the fade-out
    /// of that one, 0.15 s of audio (more with blocks above 1,000 frames), without loss of samples.
    ///
    /// ```
    /// # fn main() -> foresound::Result<()> {
    /// # let (mut controller, _renderer) = foresound::Engine::new(Default::default())?;
    /// let source = controller.add_source([0.0, 1.5, -2.0])?;
    /// let mut click = vec![0.0; 22_050];
    /// click[..64].fill(0.5);
    /// controller.play(source, click.into(), false)?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`Error::Engine`] at [`crate::runtime::EngineSettings::max_sources`] sources, [`Error::Setting`] for a position
    /// that is not finite or beyond 1,000 km.
    pub fn add_source(&mut self, position: impl Into<Vec3>) -> Result<SourceId> {
        self.sources.add(position.into())
    }

    /// Removes a source from the next tick on; its sound fades out, its handle is stale at once.
    ///
    /// # Errors
    /// [`Error::StaleSource`].
    pub fn remove_source(&mut self, id: SourceId) -> Result<()> {
        self.sources.remove(id, self.ticks + 1)?;
        self.send_source(id, SampleSource::Silence);
        Ok(())
    }

    /// Moves a source to a position in metres from the next tick on. Its orientation and settings stay.
    ///
    /// # Errors
    /// [`Error::StaleSource`]; [`Error::Setting`] for a position that is not finite or beyond 1,000 km: the last good
    /// one stays.
    pub fn move_source(&mut self, id: SourceId, position: impl Into<Vec3>) -> Result<()> {
        self.sources.move_to(id, position.into())
    }

    /// Sets a source's directivity, radius, effects and mix from the next tick on, until a pose with other settings. A pose that
    /// [`Self::tick`] refuses changes nothing of it.
    ///
    /// # Errors
    /// [`Error::StaleSource`]; [`Error::Setting`] names a value of the mix out of range: the settings stay.
    pub fn configure_source(&mut self, id: SourceId, settings: SourceSettings) -> Result<()> {
        self.sources.configure(id, settings)
    }

    /// A source's directivity, radius, effects and mix, as last set.
    ///
    /// # Errors
    /// [`Error::StaleSource`].
    pub fn source_settings(&self, id: SourceId) -> Result<SourceSettings> {
        self.sources.settings(id)
    }

    /// Mutes or unmutes a source from the next tick on; its samples advance meanwhile.
    ///
    /// # Errors
    /// [`Error::StaleSource`].
    pub fn mute_source(&mut self, id: SourceId, muted: bool) -> Result<()> {
        self.sources.set_muted(id, muted)
    }

    /// Sets a source's linear gain, 0 to 1000, from the next tick on.
    ///
    /// # Errors
    /// [`Error::StaleSource`]; [`Error::Setting`] outside the range.
    pub fn set_source_gain(&mut self, id: SourceId, gain: f32) -> Result<()> {
        self.sources.set_gain(id, gain, 0.0)
    }

    /// Plays samples that the app writes, through a ring for `capacity` samples (1 to 2^24). Samples are mono at the engine's
    /// rate, 1 being full scale at 1 m; they are not converted. An underrun fades out and
    /// in within 256 audio frames and counts in [`crate::runtime::Statistics::underrun_samples`].
    ///
    /// # Errors
    /// [`Error::StaleSource`]; [`Error::Setting`] for a capacity outside the range.
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

    /// Stops a source: fades out and releases its clip or stream.
    ///
    /// # Errors
    /// [`Error::StaleSource`].
    pub fn stop(&mut self, id: SourceId) -> Result<()> {
        self.sources.set_plays(id, false)?;
        self.send_source(id, SampleSource::Silence);
        Ok(())
    }

    /// Number of sources added and not removed.
    pub fn source_count(&self) -> usize {
        self.sources.count()
    }

    pub(super) fn send_source(&mut self, id: SourceId, feed: SampleSource) {
        self.waiting_changes
            .retain(|change| change.id.slot() != id.slot());
        self.waiting_changes
            .push_back(SampleSourceChange { id, source: feed });
        self.send_waiting_changes();
    }

    /// Sends waiting changes and frees returned samples.
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
