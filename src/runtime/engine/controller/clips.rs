//! Clips of sources: play, pause, seek, pitch, ramps, one-shots.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use glam::Vec3;

use super::Controller;
use crate::error::Result;
use crate::runtime::engine::clip_player::{Clip, ClipPlayer};
use crate::runtime::engine::playback::{PlaySettings, Playback};
use crate::runtime::engine::sample_source::SampleSource;
use crate::scene::{SourceId, SourceSettings};

impl Controller {
    /// Plays a clip from its start, once or in a loop: mono samples at the engine's rate, 1 being the pressure at 1 m.
    /// An empty clip is silence that ends at once. [`Self::play_clip`] plays stereo, parts, and at a set time.
    ///
    /// # Errors
    /// [`Error::StaleSource`](crate::Error::StaleSource).
    pub fn play(&mut self, id: SourceId, samples: Arc<[f32]>, looped: bool) -> Result<()> {
        let settings = PlaySettings {
            is_looped: looped,
            ..PlaySettings::default()
        };
        self.play_clip(id, samples, settings)
    }

    /// Plays a clip, in place of what the source plays. A pause of the source ends; its pitch stays.
    ///
    /// ```
    /// # fn main() -> foresound::Result<()> {
    /// use foresound::{Clip, PlaySettings};
    /// # let (mut controller, _renderer) = foresound::Engine::new(Default::default())?;
    /// # let source = controller.add_source([0.0, 1.5, -2.0])?;
    /// // An engine's sound: the start once, then the middle again and again; a tenth of a second from now.
    /// let clip = Clip::mono((0..44_100).map(|frame| 0.5 * (frame as f32 * 0.01).sin()).collect::<Vec<_>>());
    /// let mut settings = PlaySettings::default();
    /// settings.is_looped = true;
    /// settings.loop_frames = Some([10_000, 40_000]);
    /// settings.start_at = controller.audio_frame() + 4_410;
    /// controller.play_clip(source, clip, settings)?;
    /// controller.set_source_pitch(source, 1.2)?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`Error::StaleSource`](crate::Error::StaleSource); [`Error::Setting`](crate::Error::Setting) for frames outside the clip.
    pub fn play_clip(
        &mut self,
        id: SourceId,
        clip: impl Into<Clip>,
        settings: PlaySettings,
    ) -> Result<()> {
        let clip = clip.into();
        self.sources.check(id)?;
        let looped = settings.check(clip.frames())?;
        let (serial, cell) = self.sources.play(id)?;
        let start = [settings.first_frame as u64, settings.start_at];
        let kernel = Arc::clone(&self.kernel);
        let player = ClipPlayer::new(clip, looped, start, serial, cell, kernel);
        self.send_source(id, SampleSource::Clip(Box::new(player)));
        Ok(())
    }

    /// Plays a clip once at a position in metres and forgets it: its source is removed when the clip has ended and its last
    /// path has arrived. The handle may be used until then. A loop ends with [`Self::stop`] and [`Self::remove_source`].
    ///
    /// # Errors
    /// Those of [`Self::add_source`], [`Self::configure_source`] and [`Self::play_clip`]; nothing is added then.
    pub fn play_once(
        &mut self,
        position: impl Into<Vec3>,
        clip: impl Into<Clip>,
        settings: PlaySettings,
        source: SourceSettings,
    ) -> Result<SourceId> {
        let id = self.add_source(position)?;
        let begun = self
            .configure_source(id, source)
            .and_then(|()| self.play_clip(id, clip, settings))
            .and_then(|()| self.sources.set_one_shot(id));
        if let Err(error) = begun {
            self.remove_source(id)?;
            return Err(error);
        }
        Ok(id)
    }

    /// State and position of a source's clip, as of the last block; of a stream idle.
    ///
    /// # Errors
    /// [`Error::StaleSource`](crate::Error::StaleSource), also of a one-shot that has ended.
    pub fn playback(&self, id: SourceId) -> Result<Playback> {
        self.sources.playback(id)
    }

    /// Pauses a source's clip from the next tick on, or continues it; fades within 6 ms.
    ///
    /// # Errors
    /// [`Error::StaleSource`](crate::Error::StaleSource).
    pub fn pause_source(&mut self, id: SourceId, paused: bool) -> Result<()> {
        self.sources.set_paused(id, paused)
    }

    /// Continues a source's clip at another audio frame of it from the next tick on, with a cross-fade of 6 ms. Beyond the end is
    /// the end.
    ///
    /// # Errors
    /// [`Error::StaleSource`](crate::Error::StaleSource); [`Error::Engine`](crate::Error::Engine) for a source without a clip.
    pub fn seek_source(&mut self, id: SourceId, frame: u64) -> Result<()> {
        self.sources.seek(id, frame)
    }

    /// Sets the speed of a source's clips, 0.125 to 4, from the next tick on: 2 is an octave up. The pitch glides.
    ///
    /// # Errors
    /// [`Error::StaleSource`](crate::Error::StaleSource); [`Error::Setting`](crate::Error::Setting) outside the range.
    pub fn set_source_pitch(&mut self, id: SourceId, pitch: f32) -> Result<()> {
        self.sources.set_pitch(id, pitch)
    }

    /// Ramps a source's linear gain to 0 to 1000 within 0 to 3600 seconds from the next tick on.
    ///
    /// # Errors
    /// [`Error::StaleSource`](crate::Error::StaleSource); [`Error::Setting`](crate::Error::Setting) outside the ranges.
    pub fn fade_source_gain(&mut self, id: SourceId, gain: f32, seconds: f32) -> Result<()> {
        self.sources.set_gain(id, gain, seconds)
    }

    /// Audio frames that the renderer has rendered without a pause: the clock of [`PlaySettings::start_at`].
    pub fn audio_frame(&self) -> u64 {
        self.channels.metrics.mixed_frames.load(Ordering::Relaxed)
    }

    /// Ends clips that have played to their ends, and the sources of one-shots.
    pub(super) fn end_clips(&mut self, time_s: f64) {
        let mut ended = std::mem::take(&mut self.ended);
        let tail_s = self.settings.generation.max_delay_s;
        self.sources.begin_frame(time_s, tail_s, &mut ended);
        for id in ended.drain(..) {
            // Present: it was just found.
            let _ = self.remove_source(id);
        }
        self.ended = ended;
    }
}
