//! The sound thread: renders ahead of a device into a ring; the device's callback only copies.
//!
//! The ring adds its length to the latency, and a block may take as long as the ring lasts. Without it, the device
//! calls [`Renderer::render`] within each period. While the ring is full the thread sleeps for half a block at a time;
//! the callback never wakes it, which would be a system call.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::error::{Error, Result};
use crate::runtime::engine::Renderer;
use crate::runtime::threads::flush_to_zero::FlushToZero;

/// A thread that renders into a ring. Ends when dropped.
pub struct SoundThread {
    thread: Option<JoinHandle<Renderer>>,
    stop: Arc<AtomicBool>,
}

/// The device's end of the ring; wait-free.
pub struct RingOutput {
    ring: rtrb::Consumer<f32>,
    capacity_frames: usize,
    channels: usize,
}

impl SoundThread {
    /// Starts the thread with a ring of `blocks_ahead` blocks, 1 to 64. Core and priority follow the engine's settings.
    ///
    /// # Errors
    /// [`Error::Setting`] outside the range, [`Error::Engine`] if no thread can be started. Both drop the renderer.
    pub fn start(renderer: Renderer, blocks_ahead: usize) -> Result<(Self, RingOutput)> {
        if !(1..=64).contains(&blocks_ahead) {
            let problem = format!("{blocks_ahead} is outside 1 to 64");
            let advice = "choose a number in that range";
            return Err(Error::setting("blocks_ahead", problem, advice));
        }
        let capacity_frames = blocks_ahead * renderer.block_frames();
        let channels = renderer.channels();
        let (producer, ring) = rtrb::RingBuffer::new(channels * capacity_frames);
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = thread::Builder::new()
            .name("foresound-sound".into())
            .spawn(move || run(renderer, producer, &stopped))
            .map_err(|error| {
                let advice = "let the device call the renderer";
                Error::engine(format!("no sound thread: {error}"), advice)
            })?;
        let output = RingOutput {
            ring,
            capacity_frames,
            channels,
        };
        let thread = Some(thread);
        Ok((Self { thread, stop }, output))
    }

    /// Stops the thread after the current block and returns the renderer; `None` if it panicked.
    pub fn stop(mut self) -> Option<Renderer> {
        self.join()
    }

    fn join(&mut self) -> Option<Renderer> {
        self.stop.store(true, Ordering::Release);
        self.thread.take()?.join().ok()
    }
}

impl Drop for SoundThread {
    fn drop(&mut self) {
        self.join();
    }
}

impl RingOutput {
    /// Audio frames that the ring adds to the latency.
    pub fn latency_frames(&self) -> usize {
        self.capacity_frames
    }

    /// Channels of an audio frame.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Fills `output` with interleaved frames of [`Self::channels`]; returns the number of missing audio frames, which are
    /// silent.
    pub fn read(&mut self, output: &mut [f32]) -> usize {
        // Whole audio frames only, to keep channels apart.
        let count = self.ring.slots().min(output.len()) / self.channels * self.channels;
        if let Ok(chunk) = self.ring.read_chunk(count) {
            let (first, second) = chunk.as_slices();
            output[..first.len()].copy_from_slice(first);
            output[first.len()..count].copy_from_slice(second);
            chunk.commit_all();
        }
        output[count..].fill(0.0);
        (output.len() - count) / self.channels
    }
}

fn run(mut renderer: Renderer, mut ring: rtrb::Producer<f32>, stop: &AtomicBool) -> Renderer {
    renderer.place_thread();
    let _flush = FlushToZero::begin();
    let mut block = vec![0.0; renderer.channels() * renderer.block_frames()];
    let block_s = renderer.block_frames() as f64 / f64::from(renderer.rate_hz());
    let pause = Duration::from_secs_f64(block_s / 2.0);
    while !stop.load(Ordering::Acquire) && !ring.is_abandoned() {
        if ring.slots() < block.len() {
            thread::park_timeout(pause);
            continue;
        }
        renderer.render(&mut block);
        if let Ok(chunk) = ring.write_chunk_uninit(block.len()) {
            chunk.fill_from_iter(block.iter().copied());
        }
    }
    renderer
}
