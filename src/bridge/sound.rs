//! Rendering, streams, and devices that play a renderer.
//!
//! [`render`] and [`write_stream`] are wait-free and do not allocate; their errors have static messages. A handle serves one
//! thread at a time; a second concurrent call gets [`Status::Busy`] and silence.

use super::enumeration::DeviceApi;
use super::error::{CallError, Status};
use super::handles::{HandleTable, Kind};
use super::record::record;
use crate::output::DeviceInterface;
use crate::runtime::device::output::{DeviceOutput, DeviceReport, check_device_channels};
use crate::runtime::{RenderReport, Renderer, StreamWriter};

/// A renderer with a private block, for callers whose memory other threads may access.
pub struct BlockRenderer {
    /// The engine's audio half.
    pub renderer: Renderer,
    block: Box<[f32]>,
    /// A source's block.
    #[cfg(feature = "jni")]
    dry: Box<[f32]>,
}

#[cfg(feature = "jni")]
impl BlockRenderer {
    /// The renderer, its private block, and a source's.
    pub(super) fn parts(&mut self) -> (&mut Renderer, &mut [f32], &mut [f32]) {
        (&mut self.renderer, &mut self.block, &mut self.dry)
    }
}

impl From<Renderer> for BlockRenderer {
    fn from(renderer: Renderer) -> Self {
        let frames = renderer.listeners() * renderer.block_frames();
        let block = vec![0.0; renderer.channels() * frames].into();
        Self {
            #[cfg(feature = "jni")]
            dry: vec![0.0; renderer.block_frames()].into(),
            renderer,
            block,
        }
    }
}

/// Bits of a renderer's constant that are its latency; its channels are above them, and then its listeners.
const LATENCY_BITS: u32 = 20;
const CHANNEL_BITS: u32 = 6;

/// Adds a renderer; its constant is its latency, channels and listeners. Control thread.
///
/// # Errors
/// Those of [`HandleTable::insert_with`].
pub fn insert_renderer(renderer: Renderer) -> Result<u64, CallError> {
    RENDERERS.insert_with(|| {
        let constant = renderer.latency_frames() as u32;
        let constant = constant | (renderer.channels() as u32) << LATENCY_BITS;
        let listeners = renderer.listeners() as u32;
        let constant = constant | listeners << (LATENCY_BITS + CHANNEL_BITS);
        Ok((renderer.into(), constant))
    })
}

/// Renderers without a device.
pub static RENDERERS: HandleTable<BlockRenderer> = HandleTable::new(Kind::Renderer);
/// Streams.
pub static STREAMS: HandleTable<StreamWriter> = HandleTable::new(Kind::Stream);
/// Devices.
pub static OUTPUTS: HandleTable<DeviceOutput> = HandleTable::new(Kind::Output);

record! {
    /// Result of one foresound_render.
    pub struct RenderInfo[size, zeros] {
        /// Audio frames written.
        pub frames: u32,
        /// Graphics frames consumed.
        pub graphics_frames: u32,
        /// Propagation updates consumed.
        pub updates: u32,
        /// Graphics frames that an update lasts (the paper's L); at 0 every frame has an update of its own.
        pub extrapolation_level: u32,
        /// Voices, fading ones included.
        pub voices: u32,
        /// Paths without a voice.
        pub dropped_paths: u32,
        /// Samples missing from streams at their time.
        pub underrun_samples: u32,
        /// 1 if the call took longer than the duration of its sound.
        pub missed_deadline: u32,
        /// 1 if the engine was closed: sound continues with the last poses.
        pub engine_gone: u32,
    }
}

impl RenderInfo {
    /// The information of two blocks.
    fn and(self, next: Self) -> Self {
        Self {
            frames: self.frames + next.frames,
            graphics_frames: self.graphics_frames + next.graphics_frames,
            updates: self.updates + next.updates,
            dropped_paths: self.dropped_paths + next.dropped_paths,
            underrun_samples: self.underrun_samples + next.underrun_samples,
            missed_deadline: self.missed_deadline | next.missed_deadline,
            ..next
        }
    }
}

impl From<RenderReport> for RenderInfo {
    fn from(from: RenderReport) -> Self {
        Self {
            size: size_of::<Self>() as u32,
            frames: from.frames,
            graphics_frames: from.graphics_frames,
            updates: from.updates,
            extrapolation_level: from.extrapolation_level,
            voices: from.voices,
            dropped_paths: from.dropped_paths,
            underrun_samples: from.underrun_samples,
            missed_deadline: from.missed_deadline.into(),
            engine_gone: from.controller_dropped.into(),
        }
    }
}

/// Renders interleaved frames of `channels` channels into `output`; silence on failure. Audio thread.
///
/// # Errors
/// Those of [`HandleTable::try_with`]; [`Status::BadArgument`] for another number of channels than the engine's.
pub fn render(renderer: u64, output: &mut [f32], channels: usize) -> Result<RenderInfo, CallError> {
    const CHANNELS: CallError = CallError::fixed(
        Status::BadArgument,
        "channels: the engine has another number; pass that of foresound_renderer_channels",
    );
    let result = RENDERERS.try_with(renderer, |entry| {
        if entry.renderer.channels() != channels {
            return Err(CHANNELS);
        }
        Ok(entry.renderer.render(output).into())
    });
    if result.is_err() {
        output.fill(0.0);
    }
    result
}

/// Renders each of several listeners into its own part of `output`; silence on failure. Audio thread.
///
/// # Errors
/// Those of [`HandleTable::try_with`]; [`Status::BadArgument`] for another number of listeners or channels than the engine's.
pub fn render_listeners(
    renderer: u64,
    output: &mut [f32],
    [listeners, channels]: [usize; 2],
) -> Result<RenderInfo, CallError> {
    const NUMBERS: CallError = CallError::fixed(
        Status::BadArgument,
        "listeners, channels: the engine has other numbers; pass those of its options",
    );
    let result = RENDERERS.try_with(renderer, |entry| {
        let renderer = &mut entry.renderer;
        if [renderer.listeners(), renderer.channels()] != [listeners, channels] {
            return Err(NUMBERS);
        }
        Ok(renderer.render_listeners(output).into())
    });
    if result.is_err() {
        output.fill(0.0);
    }
    result
}

/// [`render_listeners`] block by block, as [`render_blocks`]: `take` gets each listener's blocks with their index in the output.
///
/// # Errors
/// Those of [`HandleTable::try_with`].
#[cfg(feature = "jni")]
pub fn render_listener_blocks(
    renderer: u64,
    frames: usize,
    mut take: impl FnMut(usize, &[f32]),
) -> Result<RenderInfo, CallError> {
    RENDERERS.try_with(renderer, |entry| {
        let (listeners, channels) = (entry.renderer.listeners(), entry.renderer.channels());
        let mut total = RenderInfo::default();
        let mut done = 0;
        while done < frames {
            let count = (frames - done).min(entry.renderer.block_frames());
            let block = &mut entry.block[..listeners * channels * count];
            let made = RenderInfo::from(entry.renderer.render_listeners(block));
            total = total.and(made);
            for (listener, own) in block.chunks_exact(channels * count).enumerate() {
                take(channels * (listener * frames + done), own);
            }
            done += count;
        }
        Ok(total)
    })
}

/// Renders interleaved channels block by block and passes each to `take` with its index in samples: for memory that other
/// threads may access. Several blocks consume several graphics frames. Audio thread.
///
/// # Errors
/// Those of [`HandleTable::try_with`], and `take`'s.
pub fn render_blocks(
    renderer: u64,
    frames: usize,
    mut take: impl FnMut(usize, &[f32]) -> Result<(), CallError>,
) -> Result<RenderInfo, CallError> {
    RENDERERS.try_with(renderer, |entry| {
        let mut total = RenderInfo::default();
        let mut done = 0;
        while done < frames {
            let channels = entry.renderer.channels();
            let count = (frames - done).min(entry.renderer.block_frames());
            let block = &mut entry.block[..channels * count];
            let made = RenderInfo::from(entry.renderer.render(block));
            total = total.and(made);
            take(channels * done, block)?;
            done += count;
        }
        Ok(total)
    })
}

/// Latency from geometry to sound in audio frames, without the device's buffer. Does not disturb [`render`]. Any thread.
///
/// # Errors
/// Those of [`HandleTable::constant`].
pub fn latency_frames(renderer: u64) -> Result<u32, CallError> {
    Ok(RENDERERS.constant(renderer)? & ((1 << LATENCY_BITS) - 1))
}

/// Channels of what a renderer writes. Does not disturb [`render`]. Any thread.
///
/// # Errors
/// Those of [`HandleTable::constant`].
pub fn channels(renderer: u64) -> Result<u32, CallError> {
    Ok(RENDERERS.constant(renderer)? >> LATENCY_BITS & ((1 << CHANNEL_BITS) - 1))
}

/// Listeners of a renderer. Does not disturb [`render`]. Any thread.
///
/// # Errors
/// Those of [`HandleTable::constant`].
pub fn listeners(renderer: u64) -> Result<usize, CallError> {
    Ok((RENDERERS.constant(renderer)? >> (LATENCY_BITS + CHANNEL_BITS)) as usize)
}

/// Appends as many samples to a stream as fit; returns their number. Any one thread, the audio thread included.
///
/// # Errors
/// Those of [`HandleTable::try_with`]; [`Status::State`] once the stream has no reader.
pub fn write_stream(stream: u64, samples: &[f32]) -> Result<usize, CallError> {
    STREAMS.try_with(stream, |writer| {
        if writer.is_abandoned() {
            const GONE: &str = "the source was removed or plays another signal; close the stream";
            return Err(CallError::fixed(Status::State, GONE));
        }
        Ok(writer.write(samples))
    })
}

/// Plays a renderer on the system's device, through a thread that renders `blocks_ahead` blocks ahead; returns the output's
/// handle and closes the renderer's. The device is Oboe's on Android and silent elsewhere. Control thread.
///
/// # Errors
/// Those of [`HandleTable::remove`]; [`Status::BadArgument`] outside 1 to 64, or for a renderer without two channels, and
/// the renderer stays open; [`Status::State`]
/// if no thread can be started. A device that does not open is tried again and reported by [`output_info`].
pub fn start_output(renderer: u64, blocks_ahead: usize) -> Result<u64, CallError> {
    if !(1..=64).contains(&blocks_ahead) {
        let text = format!("blocks_ahead: {blocks_ahead} is outside 1 to 64");
        return Err(CallError::bad(text));
    }
    check_device_channels(channels(renderer)? as usize)?;
    OUTPUTS.insert_with(|| {
        let entry = RENDERERS.remove(renderer)?;
        let device = crate::runtime::device::output::system_device();
        Ok((
            DeviceOutput::start(entry.renderer, blocks_ahead, device)?,
            0,
        ))
    })
}

record! {
    /// Properties and state of a device.
    pub struct OutputInfo[size, zeros] {
        /// 1 playing, 0 closed and to be opened again.
        pub playing: u32,
        /// Granted sample rate in Hz.
        pub rate_hz: u32,
        /// Audio frames of the device's burst.
        pub burst_frames: u32,
        /// Audio frames of the device's buffer.
        pub buffer_frames: u32,
        /// 1 in exclusive mode.
        pub exclusive: u32,
        /// 1 in low-latency mode.
        pub low_latency: u32,
        /// System library of the device.
        pub device_api: DeviceApi,
        /// Latency of the ring buffer in audio frames.
        pub ring_frames: u32,
        /// Successful attempts to open a device.
        pub opened: u32,
        /// Failed attempts to open a device.
        pub refused: u32,
        /// Disconnections of the device.
        pub lost: u32,
        /// Times that the device stopped its callbacks and was closed.
        pub stalled: u32,
        /// Underruns counted by the device since it was opened.
        pub xruns: u32,
        /// Minimum audio frames of a callback.
        pub min_callback_frames: u32,
        /// Maximum audio frames of a callback.
        pub max_callback_frames: u32,
        /// Callbacks.
        pub callbacks: u64,
        /// Audio frames that were not rendered in time.
        pub underrun_frames: u64,
    }
}

impl From<DeviceReport> for OutputInfo {
    fn from(from: DeviceReport) -> Self {
        let grant = from.grant.unwrap_or_default();
        Self {
            size: size_of::<Self>() as u32,
            playing: from.grant.is_some().into(),
            rate_hz: grant.rate_hz,
            burst_frames: grant.burst_frames,
            buffer_frames: grant.buffer_frames,
            exclusive: grant.exclusive.into(),
            low_latency: grant.low_latency.into(),
            device_api: match grant.interface {
                DeviceInterface::Other => DeviceApi::Other,
                DeviceInterface::AAudio => DeviceApi::Aaudio,
                DeviceInterface::OpenSlEs => DeviceApi::OpenslEs,
            },
            ring_frames: from.ring_frames,
            opened: from.opened,
            refused: from.refused,
            lost: from.lost,
            stalled: from.stalled,
            xruns: from.xruns,
            min_callback_frames: from.min_callback_frames,
            max_callback_frames: from.max_callback_frames,
            callbacks: from.callbacks,
            underrun_frames: from.underrun_frames,
        }
    }
}

/// Properties and state of a device. Control thread.
///
/// # Errors
/// Those of [`HandleTable::with`].
pub fn output_info(output: u64) -> Result<OutputInfo, CallError> {
    OUTPUTS.with(output, |output| Ok(output.report().into()))
}
