//! The audio side of the bridge: rendering, streams, and devices that play a renderer.
//!
//! [`render`] and [`write_stream`] are wait-free, allocate nothing, and fail with texts that were there before. One thread
//! at a time a handle; another one that comes meanwhile gets [`Status::Busy`] and silence.

use super::fault::{Fault, Status};
use super::table::{Kind, Table};
use crate::runtime::device::output::{DeviceOutput, DeviceReport};
use crate::runtime::{RenderReport, Renderer, StreamWriter};

/// A renderer, with a block to render into where the caller's memory is not its own.
pub struct Voice {
    /// The engine's audio half.
    pub renderer: Renderer,
    block: Box<[f32]>,
}

impl From<Renderer> for Voice {
    fn from(renderer: Renderer) -> Self {
        let block = vec![0.0; 2 * renderer.block_frames()].into();
        Self { renderer, block }
    }
}

/// All renderers that no device plays.
pub static RENDERERS: Table<Voice> = Table::new(Kind::Renderer);
/// All streams.
pub static STREAMS: Table<StreamWriter> = Table::new(Kind::Stream);
/// All devices.
pub static OUTPUTS: Table<DeviceOutput> = Table::new(Kind::Output);

/// What one call of [`render`] did.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RenderInfo {
    /// Audio frames written.
    pub frames: u32,
    /// Graphics frames taken.
    pub graphics_frames: u32,
    /// Propagation updates taken.
    pub updates: u32,
    /// Extrapolation level L in force.
    pub level: u32,
    /// Voices that live or fade.
    pub voices: u32,
    /// Paths without a voice.
    pub dropped_paths: u32,
    /// Samples that streams were late with.
    pub starved_samples: u32,
    /// 1 if it took longer than what it rendered lasts.
    pub missed_deadline: u32,
    /// 1 if the engine was closed: sound goes on with the last poses.
    pub engine_gone: u32,
}

impl From<RenderReport> for RenderInfo {
    fn from(from: RenderReport) -> Self {
        Self {
            frames: from.frames,
            graphics_frames: from.graphics_frames,
            updates: from.updates,
            level: from.extrapolation_level,
            voices: from.voices,
            dropped_paths: from.dropped_paths,
            starved_samples: from.underrun_samples,
            missed_deadline: from.missed_deadline.into(),
            engine_gone: from.controller_dropped.into(),
        }
    }
}

/// Renders interleaved stereo over all of `output`; silence if it fails.
///
/// # Errors
/// The handle's, [`Status::Busy`] among them.
pub fn render(renderer: u64, output: &mut [f32]) -> Result<RenderInfo, Fault> {
    let result = RENDERERS.try_with(renderer, |voice| Ok(voice.renderer.render(output).into()));
    if result.is_err() {
        output.fill(0.0);
    }
    result
}

/// Renders interleaved stereo block by block and gives each to `take`: for memory that others may look at meanwhile.
/// What is more than a block takes several graphics frames.
///
/// # Errors
/// The handle's, [`Status::Busy`] among them, and `take`'s.
pub fn render_blocks(
    renderer: u64,
    frames: usize,
    mut take: impl FnMut(usize, &[f32]) -> Result<(), Fault>,
) -> Result<RenderInfo, Fault> {
    RENDERERS.try_with(renderer, |voice| {
        let mut total = RenderInfo::default();
        let mut done = 0;
        while done < frames {
            let count = (frames - done).min(voice.block.len() / 2);
            let block = &mut voice.block[..2 * count];
            let made = RenderInfo::from(voice.renderer.render(block));
            total = RenderInfo {
                frames: total.frames + made.frames,
                graphics_frames: total.graphics_frames + made.graphics_frames,
                updates: total.updates + made.updates,
                dropped_paths: total.dropped_paths + made.dropped_paths,
                starved_samples: total.starved_samples + made.starved_samples,
                missed_deadline: total.missed_deadline | made.missed_deadline,
                ..made
            };
            take(2 * done, block)?;
            done += count;
        }
        Ok(total)
    })
}

/// Audio frames by which sound is late against the geometry, without the device's own buffer.
///
/// # Errors
/// The handle's. Control side.
pub fn latency_frames(renderer: u64) -> Result<u32, Fault> {
    RENDERERS.with(renderer, |voice| Ok(voice.renderer.latency_frames() as u32))
}

/// Appends as many samples to a stream as fit, gives their number.
///
/// # Errors
/// The handle's; [`Status::State`] once nobody reads the stream any more.
pub fn write_stream(stream: u64, samples: &[f32]) -> Result<usize, Fault> {
    STREAMS.try_with(stream, |writer| {
        if writer.is_abandoned() {
            const GONE: &str = "the source has other sound or is gone; close the stream";
            return Err(Fault::fixed(Status::State, GONE));
        }
        Ok(writer.write(samples))
    })
}

/// Plays a renderer on the system's device, through a thread that renders `blocks_ahead` blocks ahead; gives the output's
/// handle. The renderer's handle is closed by it. On Android the device is Oboe's; elsewhere nobody hears it. Control side.
///
/// # Errors
/// The handle's; [`Status::BadArgument`] for a number outside 1 to 64, and the renderer stays; [`Status::State`] if no thread
/// can be started. A device that does not open is tried again and reported by [`report_output`].
pub fn start_output(renderer: u64, blocks_ahead: usize) -> Result<u64, Fault> {
    if !(1..=64).contains(&blocks_ahead) {
        let text = format!("blocks_ahead: {blocks_ahead} is outside 1 to 64");
        return Err(Fault::new(Status::BadArgument, text));
    }
    let voice = RENDERERS.remove(renderer)?;
    let device = crate::runtime::device::output::system_device();
    OUTPUTS.insert(DeviceOutput::start(voice.renderer, blocks_ahead, device)?)
}

/// How many numbers the structure is as a list.
pub const OUTPUT_NUMBERS: usize = 17;

/// What a device granted, and how it goes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OutputInfo {
    /// 0 closed and to be tried again, 1 playing.
    pub playing: u32,
    /// Granted rate in Hz.
    pub rate_hz: u32,
    /// Audio frames that the device takes at once.
    pub burst_frames: u32,
    /// Audio frames of the device's buffer.
    pub buffer_frames: u32,
    /// 1 if nobody else uses the device.
    pub exclusive: u32,
    /// 1 if the low-latency way was granted.
    pub low_latency: u32,
    /// 1 AAudio, 2 OpenSL ES, 0 neither.
    pub interface: u32,
    /// Audio frames that the ring adds to the latency.
    pub ring_frames: u32,
    /// Times that a device was opened.
    pub opened: u32,
    /// Times that opening failed.
    pub refused: u32,
    /// Times that the device was lost: unplugged, taken, died.
    pub lost: u32,
    /// Times that the device stopped asking and was closed for it.
    pub stalled: u32,
    /// Gaps that the device itself has counted since it was opened.
    pub xruns: u32,
    /// Least audio frames that the device has asked for at once.
    pub least_frames: u32,
    /// Most audio frames that the device has asked for at once.
    pub most_frames: u32,
    /// Calls of the device.
    pub callbacks: u64,
    /// Audio frames that were not ready in time.
    pub starved_frames: u64,
}

impl OutputInfo {
    /// All fields in their order, as numbers: how Java gets them.
    pub fn numbers(&self) -> [f64; OUTPUT_NUMBERS] {
        let counts = [
            self.playing,
            self.rate_hz,
            self.burst_frames,
            self.buffer_frames,
            self.exclusive,
            self.low_latency,
            self.interface,
            self.ring_frames,
            self.opened,
            self.refused,
            self.lost,
            self.stalled,
            self.xruns,
            self.least_frames,
            self.most_frames,
        ];
        let mut numbers = [0.0; OUTPUT_NUMBERS];
        for (number, count) in numbers.iter_mut().zip(counts) {
            *number = count.into();
        }
        numbers[15] = self.callbacks as f64;
        numbers[16] = self.starved_frames as f64;
        numbers
    }
}

impl From<DeviceReport> for OutputInfo {
    fn from(from: DeviceReport) -> Self {
        let grant = from.grant.unwrap_or_default();
        Self {
            playing: from.grant.is_some().into(),
            rate_hz: grant.rate_hz,
            burst_frames: grant.burst_frames,
            buffer_frames: grant.buffer_frames,
            exclusive: grant.exclusive.into(),
            low_latency: grant.low_latency.into(),
            interface: grant.interface as u32,
            ring_frames: from.ring_frames,
            opened: from.opened,
            refused: from.refused,
            lost: from.lost,
            stalled: from.stalled,
            xruns: from.xruns,
            least_frames: from.min_callback_frames,
            most_frames: from.max_callback_frames,
            callbacks: from.callbacks,
            starved_frames: from.underrun_frames,
        }
    }
}

/// What a device granted, and how it goes. Control side.
///
/// # Errors
/// The handle's.
pub fn report_output(output: u64) -> Result<OutputInfo, Fault> {
    OUTPUTS.with(output, |output| Ok(output.report().into()))
}
