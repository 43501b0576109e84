//! A renderer on a device that comes and goes: sound thread, ring, thin callback, and a thread that opens the device again.
//!
//! ```text
//! Renderer ──sound thread──► ring ──callback──► device          audio side
//!                             supervisor ──opens, closes──►      control side, looks twenty times a second
//! ```
//!
//! The callback owns nothing but a place where the ring lies: it takes the ring, copies, counts, and puts it back, so a
//! dying stream and its successor may overlap and either finds it or is silent. Callback: wait-free, allocates nothing.
//! The sound thread goes on while no device is open; its ring is full then, and it rests.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::error::{Error, Result};
use crate::output::device::{Device, DeviceCallback, DeviceGrant, DeviceInterface, OpenDevice};
use crate::runtime::device::reopen_policy::{ReopenAction, ReopenCounts, ReopenPolicy};
use crate::runtime::device::sound_thread::{RingOutput, SoundThread};
use crate::runtime::engine::Renderer;
use crate::runtime::handover::atomic_box::AtomicBox;
use crate::runtime::handover::seqlock::{Seqlock, Words, halves, pair};
use crate::runtime::threads::clock::now;

/// How often the supervisor looks.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// What callback and supervisor share.
struct Shared {
    ring: AtomicBox<RingOutput>,
    stop: AtomicBool,
    callbacks: AtomicU64,
    underrun_frames: AtomicU64,
    min_frames: AtomicU32,
    max_frames: AtomicU32,
    report: Seqlock<DeviceSnapshot, 5>,
}

/// What the supervisor has seen last.
#[derive(Clone, Copy, Default)]
struct DeviceSnapshot {
    counts: ReopenCounts,
    grant: Option<DeviceGrant>,
    xruns: u32,
}

impl Words<5> for DeviceSnapshot {
    fn to_words(self) -> [u64; 5] {
        let (counts, grant) = (self.counts, self.grant.unwrap_or_default());
        let flags = u32::from(self.grant.is_some())
            | u32::from(grant.exclusive) << 1
            | u32::from(grant.low_latency) << 2
            | (grant.interface as u32) << 3;
        [
            pair(counts.opened, counts.refused),
            pair(counts.lost, counts.stalled),
            pair(grant.rate_hz, grant.burst_frames),
            pair(grant.buffer_frames, flags),
            self.xruns.into(),
        ]
    }

    fn from_words(words: [u64; 5]) -> Self {
        let [
            [opened, refused],
            [lost, stalled],
            [rate_hz, burst_frames],
            [buffer_frames, flags],
            [_, xruns],
        ] = words.map(halves);
        let has = |bit: u32| flags >> bit & 1 == 1;
        let grant = DeviceGrant {
            rate_hz,
            burst_frames,
            buffer_frames,
            exclusive: has(1),
            low_latency: has(2),
            interface: match flags >> 3 {
                1 => DeviceInterface::AAudio,
                2 => DeviceInterface::OpenSlEs,
                _ => DeviceInterface::Other,
            },
        };
        Self {
            counts: ReopenCounts {
                opened,
                refused,
                lost,
                stalled,
            },
            grant: has(0).then_some(grant),
            xruns,
        }
    }
}

/// How an output goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DeviceReport {
    /// What the open device granted; `None` while there is none.
    pub grant: Option<DeviceGrant>,
    /// Audio frames that the ring adds to the latency.
    pub ring_frames: u32,
    /// Times that a device was opened.
    pub opened: u32,
    /// Times that opening failed.
    pub refused: u32,
    /// Times that the device was lost.
    pub lost: u32,
    /// Times that the device asked for nothing any more and was closed for it.
    pub stalled: u32,
    /// Gaps that the open device has counted itself.
    pub xruns: u32,
    /// Least audio frames asked for at once; 0 before the first call.
    pub min_callback_frames: u32,
    /// Most audio frames asked for at once.
    pub max_callback_frames: u32,
    /// Calls of the device.
    pub callbacks: u64,
    /// Audio frames that were not there in time.
    pub underrun_frames: u64,
}

/// A renderer that plays. Ends when dropped, which waits for its two threads.
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
        let starved = match shared.ring.take() {
            Some(mut ring) => {
                let starved = ring.read(output);
                shared.ring.swap(Some(ring));
                starved
            }
            None => {
                output.fill(0.0);
                output.len() / 2
            }
        };
        shared
            .underrun_frames
            .fetch_add(starved as u64, Ordering::Relaxed);
    }

    fn lost(&mut self) {
        self.lost.store(true, Ordering::Release);
    }
}

impl DeviceOutput {
    /// Starts both threads; the device is opened by the second one. `blocks_ahead` as for [`SoundThread::start`].
    ///
    /// # Errors
    /// As [`SoundThread::start`]. A device that does not open is no error: it is tried again.
    pub fn start(renderer: Renderer, blocks_ahead: usize, device: Box<dyn Device>) -> Result<Self> {
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
            report: Seqlock::default(),
        });
        let watched = Arc::clone(&shared);
        let supervisor = thread::Builder::new()
            .name("foresound-device".into())
            .spawn(move || supervise(device, rate_hz, &watched))
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

    /// How it goes. Any thread.
    pub fn report(&self) -> DeviceReport {
        let shared = &*self.shared;
        let watched = shared.report.load();
        let least_frames = shared.min_frames.load(Ordering::Relaxed);
        DeviceReport {
            grant: watched.grant,
            ring_frames: self.ring_frames,
            opened: watched.counts.opened,
            refused: watched.counts.refused,
            lost: watched.counts.lost,
            stalled: watched.counts.stalled,
            xruns: watched.xruns,
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

    /// Closes the device and gives the renderer back; `None` if a thread panicked.
    pub fn stop(mut self) -> Option<Renderer> {
        self.close_device();
        self.sound.take()?.stop()
    }

    fn close_device(&mut self) {
        self.shared.stop.store(true, Ordering::Release);
        if let Some(supervisor) = self.supervisor.take() {
            supervisor.thread().unpark();
            // Its panic has left the device closed; there is nothing else to do about it.
            drop(supervisor.join());
        }
    }
}

impl Drop for DeviceOutput {
    fn drop(&mut self) {
        self.close_device();
    }
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
                // A late word of an earlier device is not heard here.
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

/// The system's device: Oboe's on Android, elsewhere one that nobody hears.
pub fn system_device() -> Box<dyn Device> {
    #[cfg(target_os = "android")]
    {
        Box::new(crate::output::oboe::OboeDevice)
    }
    #[cfg(not(target_os = "android"))]
    {
        Box::new(crate::runtime::device::null_device::NullOutput)
    }
}
