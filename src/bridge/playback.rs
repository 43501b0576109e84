//! Playback of clips: settings, states, one-shots.
//!
//! Any control thread.

use super::clip::CLIPS;
use super::engine::{ENGINES, EngineControl, SourceOptions};
use super::enumeration::PlaybackState;
use super::error::CallError;
use super::pose::source_id;
use super::record::record;
use crate::runtime::{self, Clip, PlaySettings};

record! {
    /// How a clip plays. Begin with FORESOUND_PLAY_OPTIONS_INIT or foresound_play_options_default, then change fields.
    pub struct PlayOptions[size, zeros] {
        /// 1: the clip repeats; 0: it plays once.
        pub looped: u32,
        /// Audio frame of the clip at which its loop starts.
        pub loop_start: u32,
        /// Audio frame of the clip at which its loop ends, excluded; 0: the clip's end.
        pub loop_end: u32,
        /// Audio frame of the clip to start from.
        pub first_frame: u64,
        /// Audio frame of the engine at which it starts (ForesoundPlayback); earlier ones start at once.
        pub start_at: u64,
    }
}

record! {
    /// State and position of a source's clip.
    pub struct Playback[size, zeros] {
        /// The state.
        pub state: PlaybackState,
        /// Position in the clip in audio frames.
        pub frame: u64,
        /// Audio frames that the engine has rendered: the clock of `start_at`.
        pub engine_frame: u64,
    }
}

impl PlayOptions {
    fn settings(&self, frames: usize) -> Result<PlaySettings, CallError> {
        if self.looped > 1 {
            let text = format!("looped: {} is outside 0 to 1", self.looped);
            return Err(CallError::bad(text));
        }
        let has_points = self.loop_start > 0 || self.loop_end > 0;
        let end = match self.loop_end {
            0 => frames,
            end => end as usize,
        };
        Ok(PlaySettings {
            is_looped: self.looped == 1,
            loop_frames: has_points.then_some([self.loop_start as usize, end]),
            first_frame: self.first_frame as usize,
            start_at: self.start_at,
        })
    }
}

impl EngineControl {
    /// State and position of a source's clip.
    ///
    /// # Errors
    /// `Status::StaleSource`.
    pub fn playback(&mut self, source: u32) -> Result<Playback, CallError> {
        let controller = self.controller();
        let playback = controller.playback(source_id(source))?;
        Ok(Playback {
            state: match playback.state {
                runtime::PlaybackState::Idle => PlaybackState::Idle,
                runtime::PlaybackState::Scheduled => PlaybackState::Scheduled,
                runtime::PlaybackState::Playing => PlaybackState::Playing,
                runtime::PlaybackState::Paused => PlaybackState::Paused,
                runtime::PlaybackState::Finished => PlaybackState::Finished,
            },
            frame: playback.frame,
            engine_frame: controller.audio_frame(),
            ..Playback::default()
        })
    }
}

/// A clip for an engine at this rate.
fn clip_at(clip: u64, wanted_hz: u32) -> Result<Clip, CallError> {
    let (samples, rate_hz) = CLIPS.with(clip, |clip| Ok((clip.samples.clone(), clip.rate_hz)))?;
    if rate_hz == wanted_hz {
        return Ok(samples);
    }
    let text = format!(
        "the clip is at {rate_hz} Hz and the engine at {wanted_hz} Hz; make it for the engine's rate"
    );
    Err(CallError::bad(text))
}

/// Plays a clip. The clip's handle may be closed afterwards.
///
/// # Errors
/// Those of the handles; `Status::StaleSource`; `Status::BadArgument` for a clip at another rate and options out of range.
pub fn play(engine: u64, source: u32, clip: u64, options: &PlayOptions) -> Result<(), CallError> {
    ENGINES.with(engine, |engine| {
        let controller = engine.controller();
        let clip = clip_at(clip, controller.settings().generation.rate_hz)?;
        let settings = options.settings(clip.frames())?;
        Ok(controller.play_clip(source_id(source), clip, settings)?)
    })
}

/// Plays a clip once at a position; returns its source, which is removed at the end.
///
/// # Errors
/// Those of [`play`] and of adding and configuring a source.
pub fn play_once(
    engine: u64,
    clip: u64,
    position_m: [f32; 3],
    options: &PlayOptions,
    source: &SourceOptions,
) -> Result<u32, CallError> {
    ENGINES.with(engine, |engine| {
        let controller = engine.controller();
        let clip = clip_at(clip, controller.settings().generation.rate_hz)?;
        let settings = options.settings(clip.frames())?;
        let source = controller.play_once(position_m, clip, settings, source.settings()?)?;
        Ok(source.bits())
    })
}
