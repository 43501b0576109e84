//! A device that nobody hears: asks for blocks in real time, as a sound card would, and counts those that are late.
//!
//! A thread of its own with the sound thread's place and priority; it sleeps until each block's time is there. For soak
//! tests and machines without sound.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::error::{Error, Result};
use crate::output::device::{Device, DeviceCallback, DeviceGrant, OpenDevice};
use crate::runtime::threads::affinity::{AffinityPolicy, Placement, ThreadRole, place_this_thread};
use crate::runtime::threads::clock::now;

/// Audio frames that [`NullOutput`] asks for at once.
const BURST_FRAMES: u32 = 192;

/// What a null device has seen.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NullDeviceReport {
    /// Blocks asked for.
    pub blocks: u64,
    /// Blocks that were ready only after their period had passed: on a sound card, gaps.
    pub missed: u64,
    /// How the thread was placed.
    pub placement: Placement,
}

/// A running null device.
pub struct NullDevice {
    thread: Option<JoinHandle<NullDeviceReport>>,
    stop: Arc<AtomicBool>,
}

impl NullDevice {
    /// Starts asking `fill` for interleaved stereo, `block_frames` audio frames at a time.
    ///
    /// # Errors
    /// [`Error::Setting`] for a rate or a block of nothing, [`Error::Engine`] if no thread can be started.
    pub fn start(
        rate_hz: u32,
        block_frames: usize,
        policy: AffinityPolicy,
        fill: impl FnMut(&mut [f32]) + Send + 'static,
    ) -> Result<Self> {
        if rate_hz == 0 || block_frames == 0 {
            let problem = format!("{block_frames} audio frames at {rate_hz} Hz are no block");
            return Err(Error::setting("block_frames", problem, "give both"));
        }
        let period = Duration::from_secs_f64(block_frames as f64 / f64::from(rate_hz));
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = thread::Builder::new()
            .name("foresound-null".into())
            .spawn(move || run(fill, block_frames, period, policy, &stopped))
            .map_err(|error| {
                let advice = "end some threads";
                Error::engine(format!("no device thread: {error}"), advice)
            })?;
        let thread = Some(thread);
        Ok(Self { thread, stop })
    }

    /// Ends after the block under way; `fill` is dropped on the device's thread.
    pub fn stop(mut self) -> NullDeviceReport {
        self.join()
    }

    fn join(&mut self) -> NullDeviceReport {
        self.stop.store(true, Ordering::Release);
        let ended = self.thread.take().and_then(|thread| thread.join().ok());
        ended.unwrap_or_default()
    }
}

impl Drop for NullDevice {
    fn drop(&mut self) {
        self.join();
    }
}

/// A null device in a device's place.
pub struct NullOutput;

struct OpenNull {
    /// Ends when dropped.
    _device: NullDevice,
    grant: DeviceGrant,
}

impl Device for NullOutput {
    fn open(
        &mut self,
        rate_hz: u32,
        mut callback: Box<dyn DeviceCallback>,
    ) -> Result<Box<dyn OpenDevice>> {
        let fill = move |output: &mut [f32]| callback.fill(output);
        let frames = BURST_FRAMES as usize;
        let device = NullDevice::start(rate_hz, frames, AffinityPolicy::None, fill)?;
        let grant = DeviceGrant {
            rate_hz,
            burst_frames: BURST_FRAMES,
            buffer_frames: BURST_FRAMES,
            ..DeviceGrant::default()
        };
        Ok(Box::new(OpenNull {
            _device: device,
            grant,
        }))
    }
}

impl OpenDevice for OpenNull {
    fn grant(&self) -> DeviceGrant {
        self.grant
    }

    fn xruns(&mut self) -> u32 {
        0
    }
}

fn run(
    mut fill: impl FnMut(&mut [f32]),
    block_frames: usize,
    period: Duration,
    policy: AffinityPolicy,
    stop: &AtomicBool,
) -> NullDeviceReport {
    let mut report = NullDeviceReport {
        placement: place_this_thread(policy, ThreadRole::Sound),
        ..NullDeviceReport::default()
    };
    let mut block = vec![0.0; 2 * block_frames];
    let mut due = now();
    while !stop.load(Ordering::Acquire) {
        // The block asked for now has to be there when the period is over.
        fill(&mut block);
        due += period;
        report.blocks += 1;
        match due.checked_duration_since(now()) {
            Some(rest) => pause(rest),
            None => {
                report.missed += 1;
                due = now();
            }
        }
    }
    report
}

#[expect(
    clippy::disallowed_methods,
    reason = "a device keeps time; runtime is where threads wait"
)]
fn pause(time: Duration) {
    thread::sleep(time);
}
