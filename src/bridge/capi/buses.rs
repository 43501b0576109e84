//! Functions of the audio thread that render sources or listeners apart, into the caller's memory.

use super::audio_answer;
use super::memory::{check_samples, info_of, output_of, slice, store};
use crate::bridge::enumeration::Bus;
use crate::bridge::error::{CallError, Status};
use crate::bridge::sound::{self, RenderInfo};
use crate::bridge::source_buses;

/// Most frames of a block.
const MAX_FRAMES: usize = 4096;

/// Begins a block of `frames` audio frames, 1 to the option `block_frames` (else FORESOUND_STATUS_BAD_ARGUMENT), whose sources are
/// rendered apart: for a game with a mixer of its own, in place of foresound_render. Then call foresound_render_source for each
/// source and foresound_render_reverb once: the sum of their outputs is what foresound_render renders, without its limiter. Needs
/// the option `source_buses` (else FORESOUND_STATUS_STATE). One thread at a time a renderer. Audio thread: wait-free, without
/// allocation, without a message.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_render_begin(renderer: u64, frames: usize) -> Status {
    audio_answer(|| source_buses::begin(renderer, frames))
}

/// Renders one source of the block into `output`: `frames` audio frames of interleaved `channels`, those of the engine
/// (foresound_renderer_channels); silence on failure. Its paths, without the late reverb. `dry`: the block's mono samples of the
/// source, 1 being the pressure at 1 m, or null for what the source plays in the engine. `bus` (null if unused) receives
/// what the output holds. Once a source and block; a source that is not rendered is in foresound_render_reverb's output. A
/// source that was removed, or that no graphics frame has yet, fails with FORESOUND_STATUS_STALE_SOURCE; a second call for it, or
/// one outside a block, with FORESOUND_STATUS_STATE; other frames or channels than the block's with FORESOUND_STATUS_BAD_ARGUMENT.
/// Audio thread: as foresound_render_begin.
///
/// # Safety
/// Pointers are null or valid as the header says; `dry` has `frames` elements, `output` `channels` x `frames`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_render_source(
    renderer: u64,
    source: u32,
    dry: *const f32,
    output: *mut f32,
    channels: u32,
    frames: usize,
    bus: *mut Bus,
) -> Status {
    audio_answer(|| {
        // SAFETY: the caller's obligation.
        let output = unsafe { output_of(output, channels, frames) }?;
        let checked = match dry.is_null() {
            true => Ok(&[][..]),
            false => check_samples(dry, frames, MAX_FRAMES)
                // SAFETY: not null and aligned; the length is the caller's obligation.
                .and_then(|()| unsafe { slice("dry", dry, frames) }),
        };
        let dry = checked.inspect_err(|_| output.fill(0.0))?;
        let held = source_buses::render_source(renderer, source, dry, output, channels as usize)?;
        if bus.is_null() {
            return Ok(());
        }
        // SAFETY: the caller's obligation.
        unsafe { store("bus", bus, held) }
    })
}

/// Ends the block: renders the late reverb of all sources into `output`, and with it everything without a bus of its own in this
/// block: sources that were not rendered, that share slots (with more sources than slots) or have no position, and the
/// fading sound of removed ones. Silence on failure: FORESOUND_STATUS_STATE outside a block, FORESOUND_STATUS_BAD_ARGUMENT for other
/// channels or frames than the block's; a wrong number of frames ends the block too. `info`: null if unused; of the whole block.
/// Audio thread: as foresound_render_begin.
///
/// # Safety
/// Pointers are null or valid as the header says; `output` has `channels` x `frames` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_render_reverb(
    renderer: u64,
    output: *mut f32,
    channels: u32,
    frames: usize,
    info: *mut RenderInfo,
) -> Status {
    audio_answer(|| {
        // SAFETY: the caller's obligation.
        let output = unsafe { output_of(output, channels, frames) }?;
        // SAFETY: the caller's obligation.
        let info = unsafe { info_of(info) }.inspect_err(|_| output.fill(0.0))?;
        let rendered = source_buses::render_reverb(renderer, output, channels as usize)?;
        info.map_or(Ok(()), |info| info.store(rendered))
    })
}

/// Renders each of several listeners into its own part of `output`, one after the other: `listeners` times `frames` audio frames of
/// interleaved `channels`, the option `listeners` and the engine's channels (else FORESOUND_STATUS_BAD_ARGUMENT); silence on
/// failure. foresound_render gives their mix, for listeners at one pair of loudspeakers. `info`: null if unused. Audio thread: as
/// foresound_render.
///
/// # Safety
/// Pointers are null or valid as the header says; `output` has `listeners` x `channels` x `frames` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_render_listeners(
    renderer: u64,
    output: *mut f32,
    listeners: u32,
    channels: u32,
    frames: usize,
    info: *mut RenderInfo,
) -> Status {
    const LISTENERS: CallError = CallError::fixed(Status::BadArgument, "listeners: outside 1 to 4");
    audio_answer(|| {
        if !(1..=4).contains(&listeners) {
            return Err(LISTENERS);
        }
        // SAFETY: the caller's obligation.
        let output =
            unsafe { output_of(output, channels, frames.saturating_mul(listeners as usize)) }?;
        // SAFETY: the caller's obligation.
        let info = unsafe { info_of(info) }.inspect_err(|_| output.fill(0.0))?;
        let counts = [listeners as usize, channels as usize];
        let rendered = sound::render_listeners(renderer, output, counts)?;
        info.map_or(Ok(()), |info| info.store(rendered))
    })
}
