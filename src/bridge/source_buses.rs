//! Sources rendered apart, for a mixer of the app's own.
//!
//! Audio thread: wait-free and without allocation; errors have static messages. A handle serves one thread at a time.

use super::enumeration::Bus;
use super::error::{CallError, Status};
use super::pose::source_id;
use super::sound::{RENDERERS, RenderInfo};
use crate::runtime::BusStatus;

/// The result of a call by its status.
fn bus(status: BusStatus) -> Result<Bus, CallError> {
    const UNKNOWN: &str = "source: it was removed, or no graphics frame has it yet";
    const SIZE: &str =
        "frames: not those of the block, or outside 1 to the option block_frames; pass the block's";
    const ORDER: &str =
        "call foresound_render_begin, each source once, then foresound_render_reverb";
    const OFF: &str = "the engine has no source buses; create it with the option source_buses";
    let (status, message) = match status {
        BusStatus::Own => return Ok(Bus::Own),
        BusStatus::Shared => return Ok(Bus::Shared),
        BusStatus::Silent => return Ok(Bus::Silent),
        BusStatus::UnknownSource => (Status::StaleSource, UNKNOWN),
        BusStatus::WrongSize => (Status::BadArgument, SIZE),
        BusStatus::WrongOrder => (Status::State, ORDER),
        BusStatus::Off => (Status::State, OFF),
    };
    Err(CallError::fixed(status, message))
}

/// The error for another number of channels than the engine's.
const CHANNELS: CallError = CallError::fixed(
    Status::BadArgument,
    "channels: the engine has another number; pass that of foresound_renderer_channels",
);

/// Begins a block.
///
/// # Errors
/// Those of the handle; `Status::BadArgument` for a number of frames that the engine cannot render at once, `Status::State`
/// without source buses.
pub fn begin(renderer: u64, frames: usize) -> Result<(), CallError> {
    RENDERERS.try_with(renderer, |entry| {
        bus(entry.renderer.begin_block(frames)).map(drop)
    })
}

/// Renders one source; silence on failure. Without `dry` what it plays in the engine.
///
/// # Errors
/// Those of the handle; `Status::BadArgument` for lengths that are not the block's, `Status::StaleSource`, `Status::State` out of
/// order.
pub fn render_source(
    renderer: u64,
    source: u32,
    dry: &[f32],
    output: &mut [f32],
    channels: usize,
) -> Result<Bus, CallError> {
    let result = RENDERERS.try_with(renderer, |entry| {
        if entry.renderer.channels() != channels {
            return Err(CHANNELS);
        }
        bus(entry.renderer.render_source(source_id(source), dry, output))
    });
    if result.is_err() {
        output.fill(0.0);
    }
    result
}

/// Renders the late reverb and the rest, and ends the block; silence on failure.
///
/// # Errors
/// Those of the handle; `Status::BadArgument` for a length that is not the block's, which ends it too, `Status::State` out of order.
pub fn render_reverb(
    renderer: u64,
    output: &mut [f32],
    channels: usize,
) -> Result<RenderInfo, CallError> {
    let result = RENDERERS.try_with(renderer, |entry| {
        if entry.renderer.channels() != channels {
            return Err(CHANNELS);
        }
        let (status, report) = entry.renderer.render_reverb(output);
        bus(status).map(|_| report.into())
    });
    if result.is_err() {
        output.fill(0.0);
    }
    result
}

/// [`render_source`] for memory that other threads may access: `read` fills the dry block, if there is one, and `write` takes
/// the output.
///
/// # Errors
/// As [`render_source`].
#[cfg(feature = "jni")]
pub fn copy_source(
    renderer: u64,
    source: u32,
    frames: usize,
    read: Option<impl FnOnce(&mut [f32])>,
    write: impl FnOnce(&[f32]),
) -> Result<Bus, CallError> {
    RENDERERS.try_with(renderer, |entry| {
        let (renderer, output, dry) = entry.parts();
        let samples = frames.saturating_mul(renderer.channels());
        let (Some(output), Some(dry)) = (output.get_mut(..samples), dry.get_mut(..frames)) else {
            return bus(BusStatus::WrongSize);
        };
        let dry = match read {
            Some(read) => {
                read(dry);
                &*dry
            }
            None => &[],
        };
        let status = renderer.render_source(source_id(source), dry, output);
        write(output);
        bus(status)
    })
}

/// [`render_reverb`] for memory that other threads may access.
///
/// # Errors
/// As [`render_reverb`].
#[cfg(feature = "jni")]
pub fn copy_reverb(
    renderer: u64,
    frames: usize,
    write: impl FnOnce(&[f32]),
) -> Result<RenderInfo, CallError> {
    RENDERERS.try_with(renderer, |entry| {
        let (renderer, output, _) = entry.parts();
        let samples = frames.saturating_mul(renderer.channels());
        let Some(output) = output.get_mut(..samples) else {
            return Err(bus(BusStatus::WrongSize).err().unwrap_or(CHANNELS));
        };
        let (status, report) = renderer.render_reverb(output);
        write(output);
        bus(status).map(|_| report.into())
    })
}
