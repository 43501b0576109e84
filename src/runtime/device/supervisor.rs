//! Keeps a device open: does what [`ReopenPolicy`] says, and lets a null device stand in meanwhile.
//!
//! Control side, one thread: whoever calls [`Supervisor::poll`], some times a second. It reads no clock: the caller says
//! how late it is, so that a test can.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::Result;
use crate::runtime::device::callback_slot::{CallbackSlot, LeasedCallback};
use crate::runtime::device::null_device::NullDevice;
use crate::runtime::device::reopen_policy::{ReopenAction, ReopenCounts, ReopenPolicy};
use crate::runtime::threads::affinity::AffinityPolicy;

/// Opens streams to a device.
pub trait Backend {
    /// A running stream; dropping it ends the stream and drops the loan.
    type Stream;

    /// Opens the device of the moment and starts asking the loan for blocks of interleaved stereo. `lost` is to be set,
    /// from any thread, when the stream has ended by itself.
    ///
    /// # Errors
    /// Those of the device; the loan has to be dropped then.
    fn open(&mut self, loan: LeasedCallback, lost: Arc<AtomicBool>) -> Result<Self::Stream>;
}

/// A null device's shape, for the time without a device.
#[derive(Debug, Clone, Copy)]
pub struct NullDeviceSettings {
    /// Sample rate in Hz.
    pub rate_hz: u32,
    /// Audio frames a block.
    pub block_frames: usize,
    /// Where its thread runs.
    pub affinity: AffinityPolicy,
}

/// How it stands with the device.
#[derive(Debug, Clone, PartialEq)]
pub enum DeviceState {
    /// A device plays.
    Playing,
    /// None does; the next attempt is due at a time of the caller's clock, in seconds.
    Waiting {
        /// When.
        until_s: f64,
        /// What the last attempt said, or what was lost.
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
        stand_in: Option<NullDevice>,
    },
}

/// Keeps a device open.
pub struct Supervisor<B: Backend> {
    backend: B,
    slot: CallbackSlot,
    stand_in: Option<NullDeviceSettings>,
    state: SupervisorState<B::Stream>,
    reopening: ReopenPolicy,
}

impl<B: Backend> Supervisor<B> {
    /// With what fills the blocks. Nothing is opened before the first [`Self::poll`]. Where `stand_in` is given, time
    /// goes on without a device.
    pub fn new(
        backend: B,
        fill: impl FnMut(&mut [f32]) + Send + 'static,
        stand_in: Option<NullDeviceSettings>,
    ) -> Self {
        Self {
            backend,
            slot: CallbackSlot::new(fill),
            stand_in,
            state: SupervisorState::Waiting {
                because: "not opened yet".into(),
                stand_in: None,
            },
            reopening: ReopenPolicy::new(),
        }
    }

    /// Looks after the device; `time_s` is the caller's clock, which never goes back.
    pub fn poll(&mut self, time_s: f64) -> DeviceState {
        let lost = match &self.state {
            SupervisorState::Playing { lost, .. } => lost.load(Ordering::Acquire),
            SupervisorState::Waiting { .. } => false,
        };
        match self.reopening.step(time_s, self.slot.blocks(), lost) {
            ReopenAction::Wait => {}
            ReopenAction::Close if lost => self.wait("the device was lost".into()),
            ReopenAction::Close => self.wait("the device asked for nothing any more".into()),
            ReopenAction::Open => self.attempt(time_s),
        }
        match &self.state {
            SupervisorState::Playing { .. } => DeviceState::Playing,
            SupervisorState::Waiting { because, .. } => DeviceState::Waiting {
                until_s: self.reopening.due_s().unwrap_or(time_s),
                because: because.clone(),
            },
        }
    }

    fn attempt(&mut self, time_s: f64) {
        if let SupervisorState::Waiting { stand_in, .. } = &mut self.state {
            drop(stand_in.take());
        }
        let lost = Arc::new(AtomicBool::new(false));
        let refusal = match self.slot.lease() {
            Some(loan) => match self.backend.open(loan, Arc::clone(&lost)) {
                Ok(stream) => {
                    self.state = SupervisorState::Playing { stream, lost };
                    None
                }
                Err(error) => Some(error.to_string()),
            },
            // A stream that is still ending has it.
            None => Some("the last stream has not ended yet".into()),
        };
        let blocks = self.slot.blocks();
        self.reopening.opened(time_s, blocks, refusal.is_none());
        if let Some(because) = refusal {
            self.wait(because);
        }
    }

    /// Ends the stream, so that the loan is back, and lets the null device play.
    fn wait(&mut self, because: String) {
        self.state = SupervisorState::Waiting {
            because,
            stand_in: None,
        };
        let Some(shape) = self.stand_in else { return };
        let Some(mut loan) = self.slot.lease() else {
            return;
        };
        let (rate_hz, frames) = (shape.rate_hz, shape.block_frames);
        let started = NullDevice::start(rate_hz, frames, shape.affinity, move |block| {
            loan.fill(block);
        });
        if let SupervisorState::Waiting { stand_in, .. } = &mut self.state {
            // Without a thread for it, time stands still until the next attempt.
            *stand_in = started.ok();
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
        self.reopening.counts()
    }
}

#[cfg(test)]
#[path = "supervisor_tests.rs"]
mod tests;
