//! Keeps a device open by [`ReopenPolicy`]; a null device plays while none is open.
//!
//! Control side, on the thread that calls [`Supervisor::poll`], some times a second. Reads no clock: times are
//! arguments.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::Result;
use crate::runtime::device::callback_slot::{CallbackSlot, LeasedCallback};
use crate::runtime::device::null_device::NullDevice;
use crate::runtime::device::reopen_policy::{ReopenAction, ReopenCounts, ReopenPolicy};
use crate::runtime::threads::affinity::AffinityPolicy;

/// Opens streams to a device.
pub trait Backend {
    /// A running stream; dropping it ends the stream and drops the callback.
    type Stream;

    /// Opens the current device, which calls `callback` for blocks of interleaved stereo. The backend sets `lost`, from
    /// any thread, when the stream ends by itself.
    ///
    /// # Errors
    /// Those of the device; the callback has to be dropped then.
    fn open(&mut self, callback: LeasedCallback, lost: Arc<AtomicBool>) -> Result<Self::Stream>;
}

/// Settings of the null device that plays while no device is open.
#[derive(Debug, Clone, Copy)]
pub struct NullDeviceSettings {
    /// Sample rate in Hz.
    pub rate_hz: u32,
    /// Audio frames per block.
    pub block_frames: usize,
    /// Core and priority of its thread.
    pub affinity: AffinityPolicy,
}

/// State of a supervised device.
#[derive(Debug, Clone, PartialEq)]
pub enum DeviceState {
    /// The device plays.
    Playing,
    /// No device is open.
    Waiting {
        /// Time of the next attempt on the caller's clock, in seconds.
        until_s: f64,
        /// Error of the last attempt, or reason of the loss.
        because: String,
    },
}

enum SupervisorState<S> {
    Playing {
        stream: S,
        lost: Arc<AtomicBool>,
    },
    Waiting {
        because: String,
        null_device: Option<NullDevice>,
    },
}

/// Keeps a device open: reopens it after a loss.
///
/// ```no_run
/// # fn example<B: foresound::device::Backend>(backend: B) -> foresound::Result<()> {
/// use foresound::{Engine, EngineSettings, device::Supervisor};
///
/// let (_controller, mut renderer) = Engine::new(EngineSettings::default())?;
/// let fill = move |block: &mut [f32]| {
///     renderer.render(block);
/// };
/// let mut device = Supervisor::new(backend, fill, None);
/// let began = std::time::Instant::now();
/// // Some times a second:
/// device.poll(began.elapsed().as_secs_f64());
/// # Ok(())
/// # }
/// ```
pub struct Supervisor<B: Backend> {
    backend: B,
    slot: CallbackSlot,
    null_device: Option<NullDeviceSettings>,
    state: SupervisorState<B::Stream>,
    policy: ReopenPolicy,
}

impl<B: Backend> Supervisor<B> {
    /// With the callback that fills blocks. The first [`Self::poll`] opens the device. With `null_device`, a null
    /// device calls back while no device is open; without, the callback pauses.
    pub fn new(
        backend: B,
        fill: impl FnMut(&mut [f32]) + Send + 'static,
        null_device: Option<NullDeviceSettings>,
    ) -> Self {
        Self {
            backend,
            slot: CallbackSlot::new(fill),
            null_device,
            state: SupervisorState::Waiting {
                because: "not opened yet".into(),
                null_device: None,
            },
            policy: ReopenPolicy::new(),
        }
    }

    /// Opens, checks and closes the device as needed; `time_s` is a monotonic clock of the caller.
    pub fn poll(&mut self, time_s: f64) -> DeviceState {
        let lost = match &self.state {
            SupervisorState::Playing { lost, .. } => lost.load(Ordering::Acquire),
            SupervisorState::Waiting { .. } => false,
        };
        match self.policy.step(time_s, self.slot.blocks(), lost) {
            ReopenAction::Wait => {}
            ReopenAction::Close if lost => self.wait("the device was lost".into()),
            ReopenAction::Close => self.wait("the device stopped calling back".into()),
            ReopenAction::Open => self.attempt(time_s),
        }
        match &self.state {
            SupervisorState::Playing { .. } => DeviceState::Playing,
            SupervisorState::Waiting { because, .. } => DeviceState::Waiting {
                until_s: self.policy.due_s().unwrap_or(time_s),
                because: because.clone(),
            },
        }
    }

    fn attempt(&mut self, time_s: f64) {
        if let SupervisorState::Waiting { null_device, .. } = &mut self.state {
            drop(null_device.take());
        }
        let lost = Arc::new(AtomicBool::new(false));
        let refusal = match self.slot.lease() {
            Some(callback) => match self.backend.open(callback, Arc::clone(&lost)) {
                Ok(stream) => {
                    self.state = SupervisorState::Playing { stream, lost };
                    None
                }
                Err(error) => Some(error.to_string()),
            },
            // The old stream still has it.
            None => Some("the last stream has not ended yet".into()),
        };
        let blocks = self.slot.blocks();
        self.policy.opened(time_s, blocks, refusal.is_none());
        if let Some(because) = refusal {
            self.wait(because);
        }
    }

    /// Ends the stream, which returns the callback, and starts the null device.
    fn wait(&mut self, because: String) {
        self.state = SupervisorState::Waiting {
            because,
            null_device: None,
        };
        let Some(shape) = self.null_device else {
            return;
        };
        let Some(mut callback) = self.slot.lease() else {
            return;
        };
        let (rate_hz, frames) = (shape.rate_hz, shape.block_frames);
        let started = NullDevice::start(rate_hz, frames, shape.affinity, move |block| {
            callback.fill(block);
        });
        if let SupervisorState::Waiting { null_device, .. } = &mut self.state {
            // Without a thread, the callback pauses until the next attempt.
            *null_device = started.ok();
        }
    }

    /// The stream that plays, if one does.
    pub fn stream(&self) -> Option<&B::Stream> {
        match &self.state {
            SupervisorState::Playing { stream, .. } => Some(stream),
            SupervisorState::Waiting { .. } => None,
        }
    }

    /// Streams opened, refused, lost and stalled so far.
    pub fn counts(&self) -> ReopenCounts {
        self.policy.counts()
    }
}

#[cfg(test)]
#[path = "supervisor_tests.rs"]
mod tests;
