//! Sources, clips and streams.

use super::answer;
use super::memory::{give, read_options, slice};
use crate::bridge::clip as clips;
use crate::bridge::fault::Status;
use crate::bridge::pose::source_id;
use crate::bridge::session::{self, ENGINES, SourceOptions};

/// Adds a silent source and gives its number. Any thread but the audio thread.
///
/// # Safety
/// `source` is the address of a variable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_source_add(
    engine: u64,
    x_m: f32,
    y_m: f32,
    z_m: f32,
    source: *mut u32,
) -> Status {
    answer(|| {
        // SAFETY: the caller's word.
        unsafe { give("source", source, u32::MAX) }?;
        let added = ENGINES.with(engine, |session| session.add_source([x_m, y_m, z_m]))?;
        // SAFETY: the caller's word.
        unsafe { give("source", source, added) }
    })
}

/// Removes a source from the next tick on: what it has sent fades. Its number is stale at once and never another
/// source's. Any thread but the audio thread.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_source_remove(engine: u64, source: u32) -> Status {
    answer(|| ENGINES.with(engine, |session| session.remove_source(source)))
}

/// The default options. Call it before changing any.
///
/// # Safety
/// `options` is the address of such a structure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_source_options_default(options: *mut SourceOptions) -> Status {
    // SAFETY: the caller's word.
    answer(|| unsafe { give("options", options, SourceOptions::default()) })
}

/// Says what a source is like, from the next tick on. Any thread but the audio thread.
///
/// # Safety
/// `options` is the address of such a structure, or null for the defaults.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_source_configure(
    engine: u64,
    source: u32,
    options: *const SourceOptions,
) -> Status {
    answer(|| {
        // SAFETY: the caller's word; options are plain numbers behind their size.
        let wanted = unsafe { read_options("options", options) }?;
        ENGINES.with(engine, |session| session.configure(source, &wanted))
    })
}

/// Sets a source's gain, a pressure ratio from 0 to 1000, from the next tick on. Any thread but the audio thread.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_source_set_gain(engine: u64, source: u32, gain: f32) -> Status {
    answer(|| {
        ENGINES.with(engine, |session| {
            let controller = session.controller();
            Ok(controller.set_source_gain(source_id(source), gain)?)
        })
    })
}

/// Silences a source (any number but 0) or lets it be heard again; its sound goes on unheard. Any thread but the audio
/// thread.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_source_mute(engine: u64, source: u32, muted: u32) -> Status {
    answer(|| {
        ENGINES.with(engine, |session| {
            let controller = session.controller();
            Ok(controller.mute_source(source_id(source), muted != 0)?)
        })
    })
}

/// Plays a clip from its beginning, once (0) or for ever. The clip's handle may be closed at once. Any thread but the
/// audio thread.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_source_play(
    engine: u64,
    source: u32,
    clip: u64,
    looped: u32,
) -> Status {
    answer(|| session::play(engine, source, clip, looped != 0))
}

/// Silences a source and lets go of its clip or stream. Any thread but the audio thread.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_source_stop(engine: u64, source: u32) -> Status {
    answer(|| {
        ENGINES.with(engine, |session| {
            Ok(session.controller().stop(source_id(source))?)
        })
    })
}

/// Plays what is written to a stream from now on, through a ring for `capacity` samples (1 to 16,777,216); gives the
/// stream's handle. Any thread but the audio thread.
///
/// # Safety
/// `stream` is the address of a variable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_source_stream(
    engine: u64,
    source: u32,
    capacity: usize,
    stream: *mut u64,
) -> Status {
    answer(|| {
        // SAFETY: the caller's word.
        unsafe { give("stream", stream, 0) }?;
        let made = session::stream(engine, source, capacity)?;
        // SAFETY: the caller's word.
        unsafe { give("stream", stream, made) }
    })
}

/// Makes a clip of mono samples at `rate_hz` for engines at `engine_rate_hz`; 1 is the pressure at 1 m. The samples are
/// copied, and converted if the rates differ. Any thread but the audio thread.
///
/// # Safety
/// `samples` is the address of `count` samples, `clip` of a variable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_clip_from_samples(
    samples: *const f32,
    count: usize,
    rate_hz: u32,
    engine_rate_hz: u32,
    clip: *mut u64,
) -> Status {
    answer(|| {
        // SAFETY: the caller's word.
        unsafe { give("clip", clip, 0) }?;
        // SAFETY: the caller's word.
        let samples = unsafe { slice("samples", samples, count) }?;
        let made = clips::from_samples(samples, rate_hz, engine_rate_hz)?;
        // SAFETY: the caller's word.
        unsafe { give("clip", clip, made) }
    })
}

/// Makes a clip of the bytes of a WAV file (PCM of 8 to 32 bits or float; channels are averaged) for engines at
/// `engine_rate_hz`. Any thread but the audio thread.
///
/// # Safety
/// `bytes` is the address of `count` bytes, `clip` of a variable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_clip_from_wav(
    bytes: *const u8,
    count: usize,
    engine_rate_hz: u32,
    clip: *mut u64,
) -> Status {
    answer(|| {
        // SAFETY: the caller's word.
        unsafe { give("clip", clip, 0) }?;
        // SAFETY: the caller's word.
        let bytes = unsafe { slice("bytes", bytes, count) }?;
        let made = clips::from_wav(bytes, engine_rate_hz)?;
        // SAFETY: the caller's word.
        unsafe { give("clip", clip, made) }
    })
}
