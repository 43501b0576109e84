//! The propagation thread: one step per new poses, asleep otherwise. Started, woken and stopped by the control side.
//!
//! A panic of a step is caught and ends the thread; the worker returns, to be used again with a new propagator. It stays where a
//! thread cannot be started, too.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::settings::{EngineSchedule, EngineSettings};
use super::worker::Worker;
use crate::error::{Error, Result};
use crate::propagation::Workers;
use crate::runtime::handover::atomic_box::AtomicBox;
use crate::runtime::threads::affinity::{AffinityPolicy, ThreadRole, place_this_thread};
use crate::runtime::threads::clock::now;
use crate::runtime::threads::flush_to_zero::FlushToZero;
use crate::runtime::threads::workers::Threads;

/// Longest sleep, in case a wake-up is lost.
const MAX_SLEEP: Duration = Duration::from_millis(100);

/// Owner of the worker.
pub(super) enum Propagation {
    /// On the app's thread: steps in `wake`.
    Inline(Box<Worker>),
    /// On the app's thread, asynchronous on a virtual clock: a tick in `wake`.
    Virtual(Box<Worker>),
    /// On the propagation thread.
    Threaded {
        thread: JoinHandle<Option<Box<Worker>>>,
        stop: Arc<AtomicBool>,
    },
    /// Not started yet, or a thread could not be started.
    Idle(Box<Worker>),
    /// Lost: the thread panicked outside of a step.
    Lost,
}

impl Propagation {
    /// Starts the worker by the schedule, after the current step of an earlier start. After an error it is idle.
    pub(super) fn start(&mut self, settings: &EngineSettings) -> Result<()> {
        let Some(mut worker) = self.stop() else {
            let advice = "make another engine";
            return Err(Error::engine("propagation was lost", advice));
        };
        worker
            .metrics
            .propagation_failed
            .store(false, Ordering::Release);
        worker.synchronous = settings.schedule == EngineSchedule::Synchronous;
        let tracers = match settings.schedule {
            EngineSchedule::Synchronous => settings.tracing_threads,
            EngineSchedule::Asynchronous => 1,
        };
        if worker.threads.count() != tracers {
            match Threads::start(tracers) {
                Ok(threads) => worker.threads = threads,
                Err(error) => {
                    *self = Self::Idle(worker);
                    return Err(error);
                }
            }
        }
        *self = match worker.virtual_arrivals {
            _ if worker.synchronous => Self::Inline(worker),
            Some(_) => Self::Virtual(worker),
            None => return self.start_thread(worker, settings.affinity),
        };
        Ok(())
    }

    fn start_thread(&mut self, worker: Box<Worker>, policy: AffinityPolicy) -> Result<()> {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        // The thread takes the worker out: what a thread that does not start was given is lost.
        let handed = Arc::new(AtomicBox::new(Some(worker)));
        let taken = Arc::clone(&handed);
        let started = thread::Builder::new()
            .name("foresound-propagation".into())
            .spawn(move || Some(run(taken.take()?, &stopped, policy)));
        match started {
            Ok(thread) => *self = Self::Threaded { thread, stop },
            Err(error) => {
                *self = handed.take().map_or(Self::Lost, Self::Idle);
                let advice = "end some threads or use the synchronous schedule";
                let problem = format!("no propagation thread: {error}");
                return Err(Error::engine(problem, advice));
            }
        }
        Ok(())
    }

    /// Whether no step follows until another start.
    pub(super) fn has_ended(&self) -> bool {
        match self {
            Self::Inline(_) | Self::Virtual(_) => false,
            Self::Threaded { thread, .. } => thread.is_finished(),
            Self::Idle(_) | Self::Lost => true,
        }
    }

    /// Signals new poses or a new propagator.
    pub(super) fn wake(&mut self) {
        match self {
            Self::Inline(worker) => {
                let failed = worker.metrics.propagation_failed.load(Ordering::Acquire);
                if !failed {
                    let _flush = FlushToZero::begin();
                    try_step(worker);
                }
            }
            Self::Virtual(worker) => {
                let _flush = FlushToZero::begin();
                worker.virtual_tick();
            }
            Self::Threaded { thread, .. } => thread.thread().unpark(),
            Self::Idle(_) | Self::Lost => {}
        }
    }

    /// Waits for the current step and returns the worker; `None` if it is lost.
    pub(super) fn stop(&mut self) -> Option<Box<Worker>> {
        match std::mem::replace(self, Self::Lost) {
            Self::Inline(worker) | Self::Virtual(worker) | Self::Idle(worker) => Some(worker),
            Self::Threaded { thread, stop } => {
                stop.store(true, Ordering::Release);
                thread.thread().unpark();
                thread.join().ok().flatten()
            }
            Self::Lost => None,
        }
    }
}

fn run(mut worker: Box<Worker>, stop: &AtomicBool, policy: AffinityPolicy) -> Box<Worker> {
    worker.device_hints.reset_thread();
    let placement = place_this_thread(policy, ThreadRole::Propagation);
    worker.metrics.propagation_placement.store(placement);
    let _flush = FlushToZero::begin();
    while !stop.load(Ordering::Acquire) {
        match try_step(&mut worker) {
            Some(Some(pause)) => wait(pause, stop),
            Some(None) => thread::park_timeout(MAX_SLEEP),
            None => break,
        }
    }
    worker.device_hints.reset_thread();
    worker
}

/// Pauses, ignoring wake-ups, until the time is over or `stop` is set.
fn wait(pause: Duration, stop: &AtomicBool) {
    let began = now();
    while let Some(left) = pause.checked_sub(began.elapsed()) {
        if left.is_zero() || stop.load(Ordering::Acquire) {
            return;
        }
        thread::park_timeout(left);
    }
}

/// One step; `None` if it panicked.
fn try_step(worker: &mut Worker) -> Option<Option<Duration>> {
    // A panic may leave the propagator inconsistent, which is replaced before the next step.
    let result = catch_unwind(AssertUnwindSafe(|| worker.step()));
    if result.is_err() {
        worker
            .metrics
            .propagation_failed
            .store(true, Ordering::Release);
    }
    result.ok()
}
