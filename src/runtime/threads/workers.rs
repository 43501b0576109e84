//! Persistent threads that share the phases of one propagation update: the synchronous schedule's two threads.
//!
//! Made and dropped on the control side; [`Threads::for_each`] is called by the propagation thread, which works too.
//! Waking allocates nothing. A job that panics ends neither thread nor program on its own: all other jobs are done,
//! then the panic goes on in the caller. Own.
//!
//! Holds unsafe code: the list and the job live on the caller's stack while other threads use them.

#![expect(
    clippy::disallowed_types,
    reason = "the propagation thread waits for its helpers here, never the audio side"
)]

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

use crate::error::{Error, Result};
use crate::propagation::{MOST_WORKERS, Serial, Workers};
use crate::runtime::threads::flush_to_zero::{FlushToZero, flushes};

/// Most threads that are started.
pub const MAX_THREADS: usize = MOST_WORKERS;

/// Turns that a helper waits awake for the next phase before it sleeps, and the caller for a helper's last job: some tens
/// of microseconds, about what the caller needs between two phases of an update.
const SPINS: u32 = if cfg!(miri) { 4 } else { 4000 };

/// A job for a thread and an index: threads have numbers, the caller's is 0.
type Task<'a> = dyn Fn(usize, usize) + Sync + 'a;

/// A job with its lifetime taken off.
#[derive(Clone, Copy)]
struct Job(*const Task<'static>);

// SAFETY: what it points to is `Sync`, and `Threads::share_out` keeps it alive until no helper holds it.
unsafe impl Send for Job {}

#[derive(Default)]
struct Round {
    job: Option<Job>,
    count: usize,
    /// Whether the caller flushes subnormal numbers: helpers do as it does, or the bits would tell them apart.
    flushes: bool,
    /// Helpers that sleep until the next round.
    asleep: usize,
    panic: Option<Box<dyn Any + Send>>,
}

/// What [`PoolState::gate`] says: a round's number, whether helpers may still join it, and how many are in it.
///
/// A helper that comes late finds the gate shut and is not waited for, so a slow wake-up costs nothing but its help.
#[derive(Clone, Copy)]
struct Gate(u64);

impl Gate {
    const OPEN: u64 = 1 << 15;
    const INSIDE: u64 = Self::OPEN - 1;
    const ROUND: u64 = 1 << 16;

    fn number(self) -> u64 {
        self.0 / Self::ROUND
    }

    fn is_open(self) -> bool {
        self.0 & Self::OPEN != 0
    }

    fn is_empty(self) -> bool {
        self.0 & Self::INSIDE == 0
    }

    /// The next round's, open and empty.
    fn next(self) -> Self {
        Self(((self.number() + 1) * Self::ROUND) | Self::OPEN)
    }
}

#[derive(Default)]
struct PoolState {
    round: Mutex<Round>,
    begins: Condvar,
    ends: Condvar,
    /// A [`Gate`]; opens under the lock.
    gate: AtomicU64,
    next: AtomicUsize,
    closing: AtomicBool,
}

impl PoolState {
    /// A panic under the lock leaves nothing half done: it is caught before.
    fn round(&self) -> MutexGuard<'_, Round> {
        self.round.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn gate(&self) -> Gate {
        Gate(self.gate.load(Ordering::Acquire))
    }

    /// Takes index after index until none is left, on thread number `thread`.
    fn work(&self, thread: usize, count: usize, job: &Task<'_>) {
        loop {
            let index = self.next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                return;
            }
            if let Err(panic) = catch_unwind(AssertUnwindSafe(|| job(thread, index))) {
                self.round().panic.get_or_insert(panic);
            }
        }
    }

    /// Life of helper number `thread`.
    fn help(&self, thread: usize) {
        let mut seen = 0;
        loop {
            let gate = self.wait_for_round(seen);
            seen = gate.number();
            if self.closing.load(Ordering::Relaxed) {
                return;
            }
            if self.enter(seen) {
                let (job, count, flushes) = {
                    let round = self.round();
                    (round.job, round.count, round.flushes)
                };
                let flush = flushes.then(FlushToZero::begin);
                if let Some(Job(job)) = job {
                    // SAFETY: this helper is inside the gate, and the caller keeps the job until nobody is.
                    let job = unsafe { &*job };
                    self.work(thread, count, job);
                }
                drop(flush);
                self.leave();
            }
        }
    }

    /// Comes back with another round than the one seen last: awake at first, asleep if it takes long.
    fn wait_for_round(&self, seen: u64) -> Gate {
        for _ in 0..SPINS {
            let gate = self.gate();
            if gate.number() != seen {
                return gate;
            }
            std::hint::spin_loop();
        }
        let mut round = self.round();
        round.asleep += 1;
        while self.gate().number() == seen {
            round = self
                .begins
                .wait(round)
                .unwrap_or_else(PoisonError::into_inner);
        }
        round.asleep -= 1;
        self.gate()
    }

    /// Goes through the gate of a round, unless it is shut or another's by now.
    fn enter(&self, number: u64) -> bool {
        let enter = |gate: u64| {
            let gate = Gate(gate);
            (gate.is_open() && gate.number() == number).then_some(gate.0 + 1)
        };
        self.gate
            .fetch_update(Ordering::AcqRel, Ordering::Relaxed, enter)
            .is_ok()
    }

    fn leave(&self) {
        let left = Gate(self.gate.fetch_sub(1, Ordering::AcqRel) - 1);
        if left.is_empty() && !left.is_open() {
            // Under the lock, so that a caller who is about to sleep hears of it.
            let _round = self.round();
            self.ends.notify_one();
        }
    }

    /// Shuts the gate and comes back when nobody is inside.
    fn close(&self) {
        self.gate.fetch_and(!Gate::OPEN, Ordering::AcqRel);
        for _ in 0..SPINS {
            if self.gate().is_empty() {
                return;
            }
            std::hint::spin_loop();
        }
        let mut round = self.round();
        while !self.gate().is_empty() {
            round = self
                .ends
                .wait(round)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Opens the next round and wakes those that sleep.
    fn open(&self, job: Option<Job>, count: usize) {
        let mut round = self.round();
        round.job = job;
        round.count = count;
        round.flushes = flushes();
        self.next.store(0, Ordering::Relaxed);
        self.gate.store(self.gate().next().0, Ordering::Release);
        if round.asleep > 0 {
            self.begins.notify_all();
        }
    }
}

/// A number of threads, the caller's among them.
pub struct Threads {
    pool: Arc<PoolState>,
    helpers: Vec<JoinHandle<()>>,
    /// Held through a round: a second caller, or a job that calls again, works alone.
    caller: Mutex<()>,
}

impl std::fmt::Debug for Threads {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Threads({})", self.count())
    }
}

impl Threads {
    /// Starts `count` − 1 helpers; 1 is the caller alone.
    ///
    /// # Errors
    /// [`Error::Setting`] for none or more than [`MAX_THREADS`], or if the system refuses a thread.
    pub fn start(count: usize) -> Result<Self> {
        if !(1..=MAX_THREADS).contains(&count) {
            let problem = format!("{count} is outside 1 to {MAX_THREADS}");
            return Err(Error::setting(
                "threads",
                problem,
                "choose a value in that range",
            ));
        }
        let mut threads = Self {
            pool: Arc::default(),
            helpers: Vec::with_capacity(count - 1),
            caller: Mutex::new(()),
        };
        for number in 1..count {
            let pool = Arc::clone(&threads.pool);
            let helper = Builder::new()
                .name(format!("propagation-{number}"))
                .spawn(move || pool.help(number))
                .map_err(|error| {
                    Error::setting("threads", error.to_string(), "choose fewer threads")
                })?;
            threads.helpers.push(helper);
        }
        Ok(threads)
    }

    fn run_jobs(&self, count: usize, job: &Task<'_>) {
        // SAFETY: only the lifetime changes; `close` does not return before every helper has left the round, and nothing before it unwinds.
        let lasting: *const Task<'static> = unsafe { std::mem::transmute(job) };
        self.pool.open(Some(Job(lasting)), count);
        self.pool.work(0, count, job);
        self.pool.close();
        let mut round = self.pool.round();
        round.job = None;
        let panic = round.panic.take();
        drop(round);
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
    }
}

/// The first item of a list that threads take items of.
struct SharedItems<T>(*mut T);

// SAFETY: every index is handed out once, so no two threads have the same item, and each thread has its own scratch; both may
// change threads.
unsafe impl<T: Send> Sync for SharedItems<T> {}

impl<T> SharedItems<T> {
    /// # Safety
    /// `index` is below the list's length, and nobody else has that item.
    #[expect(
        clippy::mut_from_ref,
        reason = "who asks for an index has it alone, so no two references meet"
    )]
    unsafe fn item(&self, index: usize) -> &mut T {
        // SAFETY: the index lies in the list, as the caller promises.
        let item = unsafe { self.0.add(index) };
        // SAFETY: nobody else has the item, as the caller promises; it lives as long as the round.
        unsafe { &mut *item }
    }
}

impl Workers for Threads {
    fn count(&self) -> usize {
        self.helpers.len() + 1
    }

    fn for_both<A: Send, B: Send, S: Send>(
        &self,
        (a, b): (&mut [A], &mut [B]),
        scratch: &mut [S],
        first: impl Fn(usize, &mut A, &mut S) + Sync,
        second: impl Fn(usize, &mut B, &mut S) + Sync,
    ) {
        assert!(scratch.len() >= self.count(), "scratch for every thread");
        let busy = self.caller.try_lock();
        let (middle, count) = (a.len(), a.len() + b.len());
        if busy.is_err() || self.helpers.is_empty() || count < 2 {
            Serial.for_both((a, b), scratch, first, second);
            return;
        }
        let (a, b) = (SharedItems(a.as_mut_ptr()), SharedItems(b.as_mut_ptr()));
        let scratch = SharedItems(scratch.as_mut_ptr());
        self.run_jobs(count, &|thread, index| {
            // SAFETY: threads have different numbers below `count`, and each does one job at a time.
            let scratch = unsafe { scratch.item(thread) };
            if index < middle {
                // SAFETY: `PoolState::work` hands out each index below the sum of lengths once.
                first(index, unsafe { a.item(index) }, scratch);
            } else {
                // SAFETY: as above; what is beyond the first list lies in the second.
                second(index - middle, unsafe { b.item(index - middle) }, scratch);
            }
        });
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        self.pool.closing.store(true, Ordering::Relaxed);
        self.pool.open(None, 0);
        for helper in self.helpers.drain(..) {
            // Jobs' panics are caught, so a helper ends well.
            let _ = helper.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounds of a test: Miri takes its time.
    const ROUNDS: usize = if cfg!(miri) { 3 } else { 50 };

    #[test]
    fn every_item_is_visited_once_by_any_number_of_threads() {
        for count in [1, 2, 3, 5] {
            let threads = Threads::start(count).unwrap();
            for length in [0usize, 1, 2, 7, 100] {
                let mut items = vec![0usize; length];
                for _ in 0..ROUNDS {
                    threads.for_each(&mut items, |index, item| *item += index + 1);
                }
                let expected: Vec<usize> = (0..length).map(|i| ROUNDS * (i + 1)).collect();
                assert_eq!(items, expected, "{count} threads");
            }
        }
    }

    #[test]
    fn a_panic_reaches_the_caller_and_the_threads_go_on() {
        let threads = Threads::start(3).unwrap();
        let mut items = [0; 20];
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            threads.for_each(&mut items, |index, item| {
                assert_ne!(index, 7, "the seventh fails");
                *item = 1;
            });
        }));
        assert!(outcome.is_err());
        assert_eq!(items.iter().sum::<i32>(), 19);
        threads.for_each(&mut items, |_, item| *item = 2);
        assert_eq!(items, [2; 20]);
    }

    #[test]
    fn two_lists_are_worked_off_as_one() {
        let threads = Threads::start(2).unwrap();
        let (mut a, mut b) = ([0; 5], vec![String::new(); 9]);
        let mut counts = [0; 2];
        for _ in 0..200 {
            threads.for_both(
                (&mut a, &mut b),
                &mut counts,
                |index, item, count| {
                    *count += 1;
                    *item += index;
                },
                |index, item, count| {
                    *count += 1;
                    *item = index.to_string();
                },
            );
        }
        assert_eq!(counts.iter().sum::<usize>(), 200 * 14);
        assert_eq!(a, [0, 200, 400, 600, 800]);
        assert!((0..9).all(|index| b[index] == index.to_string()));
    }

    #[test]
    #[expect(clippy::disallowed_methods, reason = "the helper has to fall asleep")]
    fn a_helper_that_sleeps_is_not_waited_for() {
        let threads = Threads::start(2).unwrap();
        let mut items = [0; 2];
        for _ in 0..20 {
            std::thread::sleep(std::time::Duration::from_millis(2));
            threads.for_each(&mut items, |_, item| *item += 1);
        }
        assert_eq!(items, [20; 2]);
    }

    #[test]
    fn a_job_may_ask_again() {
        let threads = Threads::start(2).unwrap();
        let mut items = [[0; 3]; 4];
        threads.for_each(&mut items, |_, row| {
            threads.for_each(row, |_, item| *item += 1)
        });
        assert_eq!(items, [[1; 3]; 4]);
    }

    #[test]
    fn helpers_flush_subnormals_if_the_caller_does() {
        let threads = Threads::start(3).unwrap();
        let mut modes = [true; 64];
        threads.for_each(&mut modes, |_, mode| *mode = flushes());
        assert_eq!(modes, [false; 64]);
        let _flush = FlushToZero::begin();
        threads.for_each(&mut modes, |_, mode| *mode = flushes());
        assert_eq!(modes, [flushes(); 64]);
    }

    #[test]
    fn no_threads_are_refused() {
        assert!(Threads::start(0).is_err());
        assert!(Threads::start(MAX_THREADS + 1).is_err());
    }
}
