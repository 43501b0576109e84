//! A pool of persistent threads for the phases of a propagation update.
//!
//! Made and dropped on the control side; [`Threads::for_each`] is called by the propagating thread, which takes part.
//! Does not allocate. If a job panics, all other jobs are done before the panic resumes in the caller. Own.
//!
//! Unsafe: helpers access lists and job on the caller's stack.

#![expect(
    clippy::disallowed_types,
    reason = "the propagation thread waits for its helpers; the audio side never does"
)]

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::{Builder, JoinHandle};

use crate::error::{Error, Result};
use crate::propagation::{MOST_WORKERS, Serial, Workers};
use crate::runtime::threads::flush_to_zero::{FlushToZero, flushes};

/// Greatest number of threads.
pub const MAX_THREADS: usize = MOST_WORKERS;

/// Spins of a helper before it sleeps, and of the caller before it waits: some tens of microseconds, about the time
/// between two phases of an update.
const SPINS: u32 = if cfg!(miri) { 4 } else { 4000 };

/// A job, given thread number (the caller's is 0) and item index.
type Task<'a> = dyn Fn(usize, usize) + Sync + 'a;

/// A job with its lifetime erased.
#[derive(Clone, Copy)]
struct Job(*const Task<'static>);

// SAFETY: the job is `Sync`, and `Threads::run_jobs` keeps it alive until no helper uses it.
unsafe impl Send for Job {}

#[derive(Default)]
struct Round {
    job: Option<Job>,
    count: usize,
    /// Whether the caller flushes subnormal numbers; helpers copy its mode for identical results.
    flushes: bool,
    /// Sleeping helpers.
    asleep: usize,
    panic: Option<Box<dyn Any + Send>>,
}

/// Value of [`PoolState::gate`]: number of a round, whether helpers may still enter, and how many are inside. The
/// caller does not wait for a helper that wakes up after the gate has closed.
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
    /// Ignores poisoning: panics of jobs are caught outside the lock.
    fn round(&self) -> MutexGuard<'_, Round> {
        self.round.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn gate(&self) -> Gate {
        Gate(self.gate.load(Ordering::Acquire))
    }

    /// Runs the job for one index after the other until none is left.
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

    /// Main loop of a helper.
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
                    // SAFETY: this helper is inside the gate; the caller keeps the job alive until the gate is empty.
                    let job = unsafe { &*job };
                    self.work(thread, count, job);
                }
                drop(flush);
                self.leave();
            }
        }
    }

    /// Waits for a round other than `seen`: spins first, then sleeps.
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

    /// Enters a round, unless its gate has closed.
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
            // Under the lock, or a caller about to wait would miss it.
            let _round = self.round();
            self.ends.notify_one();
        }
    }

    /// Closes the gate and waits until no helper is inside.
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

    /// Opens the next round and wakes sleeping helpers.
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

/// A pool of threads, including the caller's, for [`crate::propagation::Propagator::update_with`].
///
/// ```
/// use foresound::paths::{Threads, Workers};
///
/// # fn main() -> foresound::Result<()> {
/// let threads = Threads::start(2)?;
/// let mut squares = [1, 2, 3, 4];
/// threads.for_each(&mut squares, |_index, n| *n *= *n);
/// assert_eq!(squares, [1, 4, 9, 16]);
/// # Ok(())
/// # }
/// ```
pub struct Threads {
    pool: Arc<PoolState>,
    helpers: Vec<JoinHandle<()>>,
    /// Locked during a round: a second or nested caller works alone.
    caller: Mutex<()>,
}

impl std::fmt::Debug for Threads {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Threads({})", self.count())
    }
}

impl Threads {
    /// Starts `count` − 1 helper threads; with 1 the caller works alone. Control side.
    ///
    /// # Errors
    /// [`Error::Setting`] for 0 or more than `MAX_THREADS`, or if no thread can be started.
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
        // SAFETY: only the lifetime changes; `close` returns after every helper has left, and nothing before it
        // unwinds.
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

/// Pointer to the first item of a list shared by threads.
struct SharedItems<T>(*mut T);

// SAFETY: each index is taken once, so no two threads access the same item; items are `Send`.
unsafe impl<T: Send> Sync for SharedItems<T> {}

impl<T> SharedItems<T> {
    /// # Safety
    /// `index` is below the list's length, and no other reference to that item exists.
    #[expect(
        clippy::mut_from_ref,
        reason = "each index is taken once, so references do not alias"
    )]
    unsafe fn item(&self, index: usize) -> &mut T {
        // SAFETY: the index lies in the list, as the caller promises.
        let item = unsafe { self.0.add(index) };
        // SAFETY: the only reference to the item, as the caller promises; it outlives the round.
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
        // A panic of a job poisons the lock, which guards nothing but the turn.
        let turn = match self.caller.try_lock() {
            Ok(turn) => Some(turn),
            Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        };
        let (middle, count) = (a.len(), a.len() + b.len());
        if turn.is_none() || self.helpers.is_empty() || count < 2 {
            Serial.for_both((a, b), scratch, first, second);
            return;
        }
        let (a, b) = (SharedItems(a.as_mut_ptr()), SharedItems(b.as_mut_ptr()));
        let scratch = SharedItems(scratch.as_mut_ptr());
        self.run_jobs(count, &|thread, index| {
            // SAFETY: threads have different numbers below `count`, and each does one job at a time.
            let scratch = unsafe { scratch.item(thread) };
            if index < middle {
                // SAFETY: `PoolState::work` takes each index below the sum of lengths once.
                first(index, unsafe { a.item(index) }, scratch);
            } else {
                // SAFETY: as above; indices beyond the first list belong to the second.
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
            // Helpers catch panics of jobs.
            let _ = helper.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::threads::clock::now;

    /// Rounds of a test; fewer under Miri, which is slow.
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
    fn a_panic_reaches_the_caller_and_the_threads_survive() {
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

    /// Two jobs wait for each other, which one thread cannot run.
    #[test]
    fn helpers_work_on_after_a_panic() {
        const PATIENCE: std::time::Duration = std::time::Duration::from_secs(20);
        let threads = Threads::start(2).unwrap();
        let mut items = [false; 2];
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            threads.for_each(&mut items, |_, _| panic!("every job fails"));
        }));
        assert!(outcome.is_err());
        let begun = AtomicUsize::new(0);
        threads.for_each(&mut items, |_, item| {
            begun.fetch_add(1, Ordering::AcqRel);
            let start = now();
            while begun.load(Ordering::Acquire) < 2 && start.elapsed() < PATIENCE {
                std::thread::yield_now();
            }
            *item = begun.load(Ordering::Acquire) == 2;
        });
        assert_eq!(items, [true; 2], "both jobs at the same time");
    }

    #[test]
    fn two_lists_run_in_one_round() {
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
    fn a_sleeping_helper_does_not_delay_a_round() {
        let threads = Threads::start(2).unwrap();
        let mut items = [0; 2];
        for _ in 0..20 {
            std::thread::sleep(std::time::Duration::from_millis(2));
            threads.for_each(&mut items, |_, item| *item += 1);
        }
        assert_eq!(items, [20; 2]);
    }

    #[test]
    fn a_job_may_start_a_nested_round() {
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
