//! A silent device: requests blocks in real time, as a sound card does, and counts late ones.
//!
//! It runs on a thread with the sound thread's core and priority and sleeps between blocks. For soak tests and machines
//! without a sound card.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::error::{Error, Result};
use crate::output::device::{Device, DeviceCallback, DeviceGrant, OpenDevice};
use crate::runtime::threads::affinity::{AffinityPolicy, Placement, ThreadRole, place_this_thread};
use crate::runtime::threads::clock::now;

/// Audio frames that [`NullOutput`] requests at once.
const BURST_FRAMES: u32 = 192;

/// Counts of a null device.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct NullDeviceReport {
    /// Blocks requested.
    pub blocks: u64,
    /// Blocks that took longer than their period: dropouts on a sound card.
    pub missed: u64,
    /// Core and priority of the thread.
    pub placement: Placement,
}

/// A running null device. Ends when dropped.
///
/// ```
/// use foresound::{AffinityPolicy, Engine, EngineSettings, device::NullDevice};
///
/// # fn main() -> foresound::Result<()> {
/// let (_controller, mut renderer) = Engine::new(EngineSettings::default())?;
/// let device = NullDevice::start(44_100, 256, AffinityPolicy::System, move |block| {
///     renderer.render(block);
/// })?;
/// println!("{} late blocks", device.stop().missed);
/// # Ok(())
/// # }
/// ```
pub struct NullDevice {
    thread: Option<JoinHandle<NullDeviceReport>>,
    stop: Arc<AtomicBool>,
}

impl NullDevice {
    /// Starts a thread that calls `fill` for interleaved stereo, `block_frames` audio frames at a time at `rate_hz`.
    ///
    /// # Errors
    /// [`Error::Setting`] if either number is 0, [`Error::Engine`] if no thread can be started.
    pub fn start(
        rate_hz: u32,
        block_frames: usize,
        policy: AffinityPolicy,
        fill: impl FnMut(&mut [f32]) + Send + 'static,
    ) -> Result<Self> {
        if rate_hz == 0 || block_frames == 0 {
            let problem = format!("{block_frames} audio frames at {rate_hz} Hz is no block");
            let advice = "give numbers above 0";
            return Err(Error::setting("block_frames", problem, advice));
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

    /// Stops after the current block; `fill` is dropped on the device's thread.
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

/// The null device as a [`Device`].
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
        let device = NullDevice::start(rate_hz, frames, AffinityPolicy::System, fill)?;
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
        // The block is late if it is not ready at the end of its period.
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
    reason = "the device waits for the next block"
)]
fn pause(time: Duration) {
    thread::sleep(time);
}
