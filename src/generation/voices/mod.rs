//! Voices: one per audible path; their ranking, planning, start and rendering.

pub(crate) mod frame_plan;
pub(crate) mod pending_voices;
pub(crate) mod ranking;
pub(crate) mod voice;
pub(crate) mod voice_set;
