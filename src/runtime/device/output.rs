//! A renderer on a system device: sound thread, ring, thin callback, and a thread that reopens a lost device.
//!
//! ```text
//! Renderer ──sound thread──► ring ──callback──► device          audio side
//!                             supervisor ──opens, closes──►      control side, polls twenty times a second
//! ```
//!
//! The callback takes the ring from an atomic box, copies and puts it back; an overlapping old stream finds the box
//! empty and is silent. It is wait-free and does not allocate. Without a device the ring stays full and the sound
//! thread sleeps.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::error::{Error, Result};
use crate::output::device::{Device, DeviceCallback, DeviceGrant, OpenDevice};
use crate::runtime::device::reopen_policy::{ReopenAction, ReopenCounts, ReopenPolicy};
use crate::runtime::device::sound_thread::{RingOutput, SoundThread};
use crate::runtime::engine::Renderer;
use crate::runtime::handover::atomic_box::AtomicBox;
use crate::runtime::handover::shared_value::SharedValue;
use crate::runtime::threads::clock::now;

/// Channels of a device.
const DEVICE_CHANNELS: usize = 2;

/// Period of the supervisor.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// State shared by callback and supervisor.
struct Shared {
    ring: AtomicBox<RingOutput>,
    stop: AtomicBool,
    callbacks: AtomicU64,
    underrun_frames: AtomicU64,
    min_frames: AtomicU32,
    max_frames: AtomicU32,
    report: SharedValue<DeviceSnapshot>,
}

/// Last state of the device.
#[derive(Clone, Copy, Default)]
struct DeviceSnapshot {
    counts: ReopenCounts,
    grant: Option<DeviceGrant>,
    xruns: u32,
}

/// State and counts of an output since its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct DeviceReport {
    /// Properties of the open device; `None` while none is open.
    pub grant: Option<DeviceGrant>,
    /// Audio frames that the ring adds to the latency.
    pub ring_frames: u32,
    /// Devices opened.
    pub opened: u32,
    /// Failed attempts to open one.
    pub refused: u32,
    /// Devices that reported their loss.
    pub lost: u32,
    /// Devices closed because they stopped calling back.
    pub stalled: u32,
    /// Dropouts counted by the open device.
    pub xruns: u32,
    /// Fewest audio frames of a callback; 0 before the first.
    pub min_callback_frames: u32,
    /// Most audio frames of a callback.
    pub max_callback_frames: u32,
    /// Callbacks.
    pub callbacks: u64,
    /// Audio frames that the ring did not have in time.
    pub underrun_frames: u64,
}

/// A renderer that plays on a [`Device`]; [`system_device`] has an example. Ends when dropped, which waits for its two
/// threads. Control side.
pub struct DeviceOutput {
    sound: Option<SoundThread>,
    supervisor: Option<JoinHandle<()>>,
    shared: Arc<Shared>,
    ring_frames: u32,
}

struct RingCallback {
    shared: Arc<Shared>,
    lost: Arc<AtomicBool>,
}

impl DeviceCallback for RingCallback {
    fn fill(&mut self, output: &mut [f32]) {
        let shared = &*self.shared;
        let frames = (output.len() / 2) as u32;
        shared.callbacks.fetch_add(1, Ordering::Relaxed);
        shared.min_frames.fetch_min(frames, Ordering::Relaxed);
        shared.max_frames.fetch_max(frames, Ordering::Relaxed);
        let underrun = match shared.ring.take() {
            Some(mut ring) => {
                let underrun = ring.read(output);
                shared.ring.swap(Some(ring));
                underrun
            }
            None => {
                output.fill(0.0);
                output.len() / 2
            }
        };
        shared
            .underrun_frames
            .fetch_add(underrun as u64, Ordering::Relaxed);
    }

    fn lost(&mut self) {
        self.lost.store(true, Ordering::Release);
    }
}

impl DeviceOutput {
    /// Starts the sound thread and the supervisor, which opens the device. `blocks_ahead` as for
    /// [`SoundThread::start`].
    ///
    /// # Errors
    /// As [`SoundThread::start`]; [`Error::Setting`] for a renderer without two channels, which is dropped. A device that
    /// does not open is no error: it is retried.
    pub fn start(renderer: Renderer, blocks_ahead: usize, device: Box<dyn Device>) -> Result<Self> {
        check_device_channels(renderer.channels())?;
        let rate_hz = renderer.rate_hz();
        let (sound, ring) = SoundThread::start(renderer, blocks_ahead)?;
        let ring_frames = ring.latency_frames() as u32;
        let shared = Arc::new(Shared {
            ring: AtomicBox::new(Some(Box::new(ring))),
            stop: AtomicBool::new(false),
            callbacks: AtomicU64::new(0),
            underrun_frames: AtomicU64::new(0),
            min_frames: AtomicU32::new(u32::MAX),
            max_frames: AtomicU32::new(0),
            report: SharedValue::default(),
        });
        let supervised = Arc::clone(&shared);
        let supervisor = thread::Builder::new()
            .name("foresound-device".into())
            .spawn(move || supervise(device, rate_hz, &supervised))
            .map_err(|error| {
                let advice = "end some threads";
                Error::engine(format!("no device thread: {error}"), advice)
            })?;
        Ok(Self {
            sound: Some(sound),
            supervisor: Some(supervisor),
            shared,
            ring_frames,
        })
    }

    /// The current state. Any thread but the audio thread.
    pub fn report(&self) -> DeviceReport {
        let shared = &*self.shared;
        let device = shared.report.load();
        let least_frames = shared.min_frames.load(Ordering::Relaxed);
        DeviceReport {
            grant: device.grant,
            ring_frames: self.ring_frames,
            opened: device.counts.opened,
            refused: device.counts.refused,
            lost: device.counts.lost,
            stalled: device.counts.stalled,
            xruns: device.xruns,
            min_callback_frames: if least_frames == u32::MAX {
                0
            } else {
                least_frames
            },
            max_callback_frames: shared.max_frames.load(Ordering::Relaxed),
            callbacks: shared.callbacks.load(Ordering::Relaxed),
            underrun_frames: shared.underrun_frames.load(Ordering::Relaxed),
        }
    }

    /// Closes the device and returns the renderer; `None` if a thread panicked.
    pub fn stop(mut self) -> Option<Renderer> {
        self.close_device();
        self.sound.take()?.stop()
    }

    fn close_device(&mut self) {
        self.shared.stop.store(true, Ordering::Release);
        if let Some(supervisor) = self.supervisor.take() {
            supervisor.thread().unpark();
            // A panic has closed the device already.
            drop(supervisor.join());
        }
    }
}

impl Drop for DeviceOutput {
    fn drop(&mut self) {
        self.close_device();
    }
}

/// Checks that devices, which are stereo, play so many channels.
///
/// # Errors
/// [`Error::Setting`] for another number than two.
pub fn check_device_channels(channels: usize) -> Result<()> {
    if channels == DEVICE_CHANNELS {
        return Ok(());
    }
    let problem = format!("the engine has {channels} channels, but the device is stereo");
    let advice = "make the engine with 2 channels, or pass its blocks to another device yourself";
    Err(Error::setting("channels", problem, advice))
}

fn supervise(mut device: Box<dyn Device>, rate_hz: u32, shared: &Arc<Shared>) {
    let began = now();
    let mut reopening = ReopenPolicy::new();
    let mut open: Option<Box<dyn OpenDevice>> = None;
    let mut lost = Arc::new(AtomicBool::new(false));
    while !shared.stop.load(Ordering::Acquire) {
        let now_s = began.elapsed().as_secs_f64();
        let callbacks = shared.callbacks.load(Ordering::Relaxed);
        match reopening.step(now_s, callbacks, lost.load(Ordering::Acquire)) {
            ReopenAction::Wait => thread::park_timeout(POLL_INTERVAL),
            ReopenAction::Close => open = None,
            ReopenAction::Open => {
                // A new flag: an earlier device may still set its own.
                lost = Arc::new(AtomicBool::new(false));
                let callback = RingCallback {
                    shared: Arc::clone(shared),
                    lost: Arc::clone(&lost),
                };
                match device.open(rate_hz, Box::new(callback)) {
                    Ok(opened) => open = Some(opened),
                    Err(error) => log::warn!("{error}"),
                }
                let now_s = began.elapsed().as_secs_f64();
                reopening.opened(now_s, callbacks, open.is_some());
            }
        }
        shared.report.store(DeviceSnapshot {
            counts: reopening.counts(),
            grant: open.as_ref().map(|open| open.grant()),
            xruns: open.as_mut().map_or(0, |open| open.xruns()),
        });
    }
}

/// The system's sound output on Android: Oboe's with the feature `oboe` (the default), else AAudio's (`aaudio`). Elsewhere
/// a null device, which is silent; `CpalBackend` (feature `play`) has the desktop's. For [`DeviceOutput::start`], which opens
/// the device and reopens it after a loss. Control side; cannot fail.
///
/// ```
/// use foresound::device::{DeviceOutput, system_device};
/// use foresound::{AffinityPolicy, Engine, EngineSettings};
///
/// # fn main() -> foresound::Result<()> {
/// let mut settings = EngineSettings::default();
/// settings.generation.rate_hz = 48_000; // the device's own rate, if it is one of the HRTF sets
/// settings.affinity = AffinityPolicy::System; // as Android advises
/// let (_controller, renderer) = Engine::new(settings)?;
/// // Two blocks ahead of the device: 512 audio frames.
/// let output = DeviceOutput::start(renderer, 2, system_device())?;
/// // The game calls the controller's `tick` meanwhile; a debug overlay shows the report.
/// println!("{} dropouts", output.report().xruns);
/// // When the app leaves the foreground. The renderer can be started again.
/// let _renderer = output.stop();
/// # Ok(())
/// # }
/// ```
pub fn system_device() -> Box<dyn Device> {
    #[cfg(all(target_os = "android", feature = "oboe"))]
    {
        Box::new(crate::output::oboe::OboeDevice)
    }
    #[cfg(all(target_os = "android", feature = "aaudio", not(feature = "oboe")))]
    {
        Box::new(crate::runtime::device::aaudio::AaudioDevice)
    }
    #[cfg(not(target_os = "android"))]
    {
        Box::new(crate::runtime::device::null_device::NullOutput)
    }
}

#[cfg(all(target_os = "android", not(any(feature = "oboe", feature = "aaudio"))))]
compile_error!(
    "Android needs a sound output: turn on the feature `oboe` (the default) or `aaudio`"
);
