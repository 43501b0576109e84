//! Keeps a device open: polls, waits longer after each failure, lets a null device stand in.
//!
//! Control side, one thread: whoever calls [`Supervisor::poll`], some times a second. It reads no clock: the caller says
//! how late it is, so that a test can.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::berth::{Berth, Loan};
use crate::error::Result;
use crate::runtime::affinity::AffinityPolicy;
use crate::runtime::null_device::NullDevice;

/// Seconds until a lost device is tried again, at first and at most; doubled by each failure.
const BACK_OFF_S: (f64, f64) = (0.1, 5.0);

/// Seconds that a stream has to last for its loss to count as a first one.
const STEADY_S: f64 = 5.0;

/// Opens streams to a device.
pub trait Backend {
    /// A running stream; dropping it ends the stream and drops the loan.
    type Stream;

    /// Opens the device of the moment and starts asking the loan for blocks of interleaved stereo. `lost` is to be set,
    /// from any thread, when the stream has ended by itself.
    ///
    /// # Errors
    /// Those of the device; the loan has to be dropped then.
    fn open(&mut self, loan: Loan, lost: Arc<AtomicBool>) -> Result<Self::Stream>;
}

/// A null device's shape, for the time without a device.
#[derive(Debug, Clone, Copy)]
pub struct StandIn {
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

enum Now<S> {
    Playing {
        stream: S,
        lost: Arc<AtomicBool>,
        since_s: f64,
    },
    Waiting {
        until_s: f64,
        because: String,
        stand_in: Option<NullDevice>,
    },
}

/// Keeps a device open.
pub struct Supervisor<B: Backend> {
    backend: B,
    berth: Berth,
    stand_in: Option<StandIn>,
    now: Now<B::Stream>,
    back_off_s: f64,
    opens: u64,
    losses: u64,
}

impl<B: Backend> Supervisor<B> {
    /// With what fills the blocks. Nothing is opened before the first [`Self::poll`]. Where `stand_in` is given, time
    /// goes on without a device.
    pub fn new(
        backend: B,
        fill: impl FnMut(&mut [f32]) + Send + 'static,
        stand_in: Option<StandIn>,
    ) -> Self {
        Self {
            backend,
            berth: Berth::new(fill),
            stand_in,
            now: Now::Waiting {
                until_s: f64::NEG_INFINITY,
                because: "not opened yet".into(),
                stand_in: None,
            },
            back_off_s: BACK_OFF_S.0,
            opens: 0,
            losses: 0,
        }
    }

    /// Looks after the device; `time_s` is the caller's clock, which never goes back.
    pub fn poll(&mut self, time_s: f64) -> DeviceState {
        if let Now::Playing { lost, since_s, .. } = &self.now
            && lost.load(Ordering::Acquire)
        {
            self.losses += 1;
            if time_s - since_s >= STEADY_S {
                self.back_off_s = BACK_OFF_S.0;
            }
            // Ends the old stream first, so that the loan is back.
            self.wait(time_s, "the device was lost".into());
        }
        if let Now::Waiting { until_s, .. } = self.now
            && time_s >= until_s
        {
            self.attempt(time_s);
        }
        match &self.now {
            Now::Playing { .. } => DeviceState::Playing,
            Now::Waiting {
                until_s, because, ..
            } => DeviceState::Waiting {
                until_s: *until_s,
                because: because.clone(),
            },
        }
    }

    fn attempt(&mut self, time_s: f64) {
        if let Now::Waiting { stand_in, .. } = &mut self.now {
            drop(stand_in.take());
        }
        let Some(loan) = self.berth.lend() else {
            // A stream that is still ending has it.
            self.wait(time_s, "the last stream has not ended yet".into());
            return;
        };
        let lost = Arc::new(AtomicBool::new(false));
        match self.backend.open(loan, Arc::clone(&lost)) {
            Ok(stream) => {
                self.opens += 1;
                self.now = Now::Playing {
                    stream,
                    lost,
                    since_s: time_s,
                };
            }
            Err(error) => self.wait(time_s, error.to_string()),
        }
    }

    /// Waits for the next attempt, and longer for the one after it.
    fn wait(&mut self, time_s: f64, because: String) {
        self.now = Now::Waiting {
            until_s: time_s + self.back_off_s,
            because,
            stand_in: None,
        };
        self.back_off_s = (2.0 * self.back_off_s).min(BACK_OFF_S.1);
        let Some(shape) = self.stand_in else { return };
        let Some(mut loan) = self.berth.lend() else {
            return;
        };
        let (rate_hz, frames) = (shape.rate_hz, shape.block_frames);
        let started = NullDevice::start(rate_hz, frames, shape.affinity, move |block| {
            loan.fill(block);
        });
        if let Now::Waiting { stand_in, .. } = &mut self.now {
            // Without a thread for it, time stands still until the next attempt.
            *stand_in = started.ok();
        }
    }

    /// The stream that plays, if one does.
    pub fn stream(&self) -> Option<&B::Stream> {
        match &self.now {
            Now::Playing { stream, .. } => Some(stream),
            Now::Waiting { .. } => None,
        }
    }

    /// Streams opened so far.
    pub fn opens(&self) -> u64 {
        self.opens
    }

    /// Streams lost so far.
    pub fn losses(&self) -> u64 {
        self.losses
    }
}

#[cfg(test)]
#[path = "supervisor_tests.rs"]
mod tests;
