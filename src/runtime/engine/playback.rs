//! Playback of a source's clip: what the app asks for, and what has come of it.
//!
//! [`PlayState`] goes to the audio side with every graphics frame; [`PlaybackCell`] comes back through atomics, wait-free on
//! both sides.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};

/// Range of the pitch.
const PITCH: std::ops::RangeInclusive<f32> = 0.125..=4.0;

/// State of a source's clip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PlaybackState {
    /// No clip was played, or it was stopped.
    #[default]
    Idle,
    /// A clip waits for the audio thread, or for its start.
    Scheduled,
    /// A clip plays.
    Playing,
    /// A clip is paused.
    Paused,
    /// A clip has played to its end.
    Finished,
}

const STATES: [PlaybackState; 5] = [
    PlaybackState::Idle,
    PlaybackState::Scheduled,
    PlaybackState::Playing,
    PlaybackState::Paused,
    PlaybackState::Finished,
];

/// State and position of a source's clip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Playback {
    /// The state.
    pub state: PlaybackState,
    /// Position in the clip in audio frames.
    pub frame: u64,
}

/// How a clip plays; start from [`Default`] and assign fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PlaySettings {
    /// Whether the clip repeats.
    pub is_looped: bool,
    /// Audio frames of the clip between which it repeats, the end excluded; `None` for the whole clip. What is before is
    /// heard once, what is after is not. Range: start below end, end within the clip.
    pub loop_frames: Option<[usize; 2]>,
    /// Audio frame of the clip to start from, at most its length.
    pub first_frame: usize,
    /// Audio frame of the engine at which it starts ([`crate::Controller::audio_frame`]); earlier ones start at once.
    pub start_at: u64,
}

impl PlaySettings {
    /// The loop's frames of a clip of this length.
    ///
    /// # Errors
    /// [`Error::Setting`] names the value out of range.
    pub(super) fn check(&self, frames: usize) -> Result<Option<[usize; 2]>> {
        if self.first_frame > frames {
            let problem = format!("{} is beyond {frames} frames", self.first_frame);
            return Err(Error::setting(
                "first_frame",
                problem,
                "start within the clip",
            ));
        }
        let [start, end] = self.loop_frames.unwrap_or([0, frames]);
        if self.loop_frames.is_some() && !(start < end && end <= frames) {
            let problem = format!("{start} to {end} is no part of {frames} frames");
            let advice = "give a start below the end, and an end within the clip";
            return Err(Error::setting("loop_frames", problem, advice));
        }
        Ok((self.is_looped && start < end).then_some([start, end]))
    }
}

/// What the app asks of a source's clip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlayState {
    pub(crate) pitch: f32,
    pub(crate) is_paused: bool,
    /// Number of the seek, 0 for none, the playback it belongs to, and its position in audio frames.
    pub(crate) seek: u32,
    pub(crate) seek_serial: u32,
    pub(crate) seek_to: u64,
}

impl PlayState {
    /// Number of the last seek of a playback, 0 for none.
    pub(crate) fn seek_of(&self, serial: u32) -> u32 {
        match self.seek_serial == serial {
            true => self.seek,
            false => 0,
        }
    }
}

impl Default for PlayState {
    fn default() -> Self {
        Self {
            pitch: 1.0,
            is_paused: false,
            seek: 0,
            seek_serial: 0,
            seek_to: 0,
        }
    }
}

/// Checks a pitch.
///
/// # Errors
/// [`Error::Setting`] outside 0.125 to 4.
pub(super) fn check_pitch(pitch: f32) -> Result<()> {
    if PITCH.contains(&pitch) {
        return Ok(());
    }
    let problem = format!("{pitch} is out of range");
    Err(Error::setting(
        "pitch",
        problem,
        "choose a value from 0.125 to 4",
    ))
}

/// State of a source's clip, written by the audio side.
#[derive(Debug, Default)]
pub(crate) struct PlaybackCell {
    /// State, serial of the playback (from bit [`SERIAL`] on), and the low bits of its last seek (from bit [`SEEK`] on).
    state: AtomicU64,
    frame: AtomicU64,
}

const SERIAL: u32 = 8;
const SEEK: u32 = SERIAL + u32::BITS;

fn packed([serial, seek]: [u32; 2], state: PlaybackState) -> u64 {
    u64::from(seek) << SEEK | u64::from(serial) << SERIAL | state as u64
}

impl PlaybackCell {
    /// Audio side.
    pub(crate) fn store(&self, [serial, seek]: [u32; 2], state: PlaybackState, frame: u64) {
        self.frame.store(frame, Ordering::Relaxed);
        self.state
            .store(packed([serial, seek], state), Ordering::Release);
    }

    /// Whether a playback has ended, and the audio side knew its last seek then (0 for none).
    pub(crate) fn has_finished(&self, [serial, seek]: [u32; 2]) -> bool {
        let value = self.state.load(Ordering::Acquire);
        value == packed([serial, seek], PlaybackState::Finished)
    }

    /// The state of a playback: scheduled until the audio side knows it.
    pub(crate) fn load(&self, serial: u32) -> Playback {
        let value = self.state.load(Ordering::Acquire);
        if serial == 0 {
            return Playback::default();
        }
        if (value >> SERIAL) as u32 != serial {
            let state = PlaybackState::Scheduled;
            return Playback { state, frame: 0 };
        }
        Playback {
            state: STATES[(value & 0xff) as usize % STATES.len()],
            frame: self.frame.load(Ordering::Relaxed),
        }
    }
}
