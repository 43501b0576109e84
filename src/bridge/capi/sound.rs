//! Sound: what the audio thread calls, and devices.

use super::answer;
use super::memory::{give, present, slice, slice_mut};
use crate::bridge::fault::{Fault, Status, guarded};
use crate::bridge::sound::{self, OutputInfo, RenderInfo};

/// Renders `frames` audio frames of interleaved stereo over `output`; silence if it fails.
/// For the audio thread: wait-free, allocates nothing, leaves no text. One thread at a time a renderer; another one that
/// comes meanwhile gets FORESOUND_STATUS_BUSY. Multiples of the engine's block fit best.
///
/// # Safety
/// `output` is the address of 2 x `frames` floats, `info` of such a structure or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_render(
    renderer: u64,
    output: *mut f32,
    frames: usize,
    info: *mut RenderInfo,
) -> Status {
    let result = guarded(|| {
        const TOO_MANY: Fault = Fault::fixed(Status::BadArgument, "too many frames");
        if frames > 1 << 24 {
            return Err(TOO_MANY);
        }
        if frames > 0 {
            present(output)?;
        }
        // SAFETY: the caller's word.
        let output = unsafe { slice_mut("output", output, 2 * frames) }?;
        let made = sound::render(renderer, output)?;
        if !info.is_null() {
            // SAFETY: the caller's word.
            unsafe { give("info", info, made) }?;
        }
        Ok(())
    });
    result.map_or_else(|fault| fault.status, |()| Status::Ok)
}

/// Appends as many samples to a stream as fit and gives their number; what does not fit is the caller's to keep.
/// Any one thread at a time, the audio thread too: wait-free, allocates nothing, leaves no text. Fails with
/// FORESOUND_STATUS_STATE once nobody reads the stream any more.
///
/// # Safety
/// `samples` is the address of `count` samples, `written` of a variable or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_stream_write(
    stream: u64,
    samples: *const f32,
    count: usize,
    written: *mut usize,
) -> Status {
    let result = guarded(|| {
        const TOO_MANY: Fault = Fault::fixed(Status::BadArgument, "too many samples");
        if count > 1 << 28 {
            return Err(TOO_MANY);
        }
        if count > 0 {
            present(samples)?;
        }
        // SAFETY: the caller's word.
        let samples = unsafe { slice("samples", samples, count) }?;
        let fitted = sound::write_stream(stream, samples)?;
        if !written.is_null() {
            // SAFETY: the caller's word.
            unsafe { give("written", written, fitted) }?;
        }
        Ok(())
    });
    result.map_or_else(|fault| fault.status, |()| Status::Ok)
}

/// Audio frames by which sound is late against the geometry, without the device's own buffer. Any thread but the audio
/// thread.
///
/// # Safety
/// `frames` is the address of a variable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_renderer_latency(renderer: u64, frames: *mut u32) -> Status {
    answer(|| {
        let latency = sound::latency_frames(renderer)?;
        // SAFETY: the caller's word.
        unsafe { give("frames", frames, latency) }
    })
}

/// Plays a renderer on the system's device (Oboe on Android, elsewhere a device that nobody hears), rendered
/// `blocks_ahead` blocks ahead (1 to 64) on a thread of its own. The renderer's handle is closed by it. A device that is lost or does
/// not open is opened again, farther and farther apart. Any thread but the audio thread.
///
/// # Safety
/// `output` is the address of a variable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_output_start(
    renderer: u64,
    blocks_ahead: usize,
    output: *mut u64,
) -> Status {
    answer(|| {
        // SAFETY: the caller's word.
        unsafe { give("output", output, 0) }?;
        let started = sound::start_output(renderer, blocks_ahead)?;
        // SAFETY: the caller's word.
        unsafe { give("output", output, started) }
    })
}

/// What the device granted, and how it goes. Any thread but the audio thread.
///
/// # Safety
/// `info` is the address of such a structure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_output_info(output: u64, info: *mut OutputInfo) -> Status {
    answer(|| {
        let report = sound::report_output(output)?;
        // SAFETY: the caller's word.
        unsafe { give("info", info, report) }
    })
}
