//! A session of performance hints: threads, how long their work should take, how long it takes.
//!
//! The system sets clocks so that the one meets the other, up and down. It wants work that comes again and again; ours
//! does. A session that refuses a report is closed and not begun again.

use super::symbols::{Handle, HintSymbols};

/// Shortest and longest time told, in nanoseconds: the system refuses zero.
const RANGE_NS: (i64, i64) = (1_000, 10_000_000_000);

/// A session. One thread at a time; the calls may wait for another process.
pub struct HintSession {
    symbols: HintSymbols,
    session: Handle,
    target_ns: i64,
}

// SAFETY: the system's session asks for one call at a time, not for one thread; `&mut` sees to that.
unsafe impl Send for HintSession {}

/// Seconds as the system counts them.
fn nanoseconds(seconds: f64) -> i64 {
    // What is not a number becomes 0.
    ((1e9 * seconds) as i64).clamp(RANGE_NS.0, RANGE_NS.1)
}

impl HintSession {
    /// For threads of this process by their kernel numbers, with a target in seconds; `None` where the system makes none.
    pub fn open(symbols: HintSymbols, threads: &[i32], target_s: f64) -> Option<Self> {
        // SAFETY: takes nothing.
        let manager = unsafe { (symbols.manager)() };
        if manager.is_null() || threads.is_empty() {
            return None;
        }
        let target_ns = nanoseconds(target_s);
        // SAFETY: the manager is the system's; the numbers are there and as many, and are copied.
        let session =
            unsafe { (symbols.create)(manager, threads.as_ptr(), threads.len(), target_ns) };
        (!session.is_null()).then_some(Self {
            symbols,
            session,
            target_ns,
        })
    }

    /// Tells what one piece of work took and should take, in seconds; false if the system will not hear it any more.
    #[must_use = "a session that refuses is to be ended"]
    pub fn report(&mut self, elapsed_s: f64, target_s: f64) -> bool {
        let target_ns = nanoseconds(target_s);
        if target_ns != self.target_ns {
            // SAFETY: an open session.
            let refused = unsafe { (self.symbols.target)(self.session, target_ns) };
            if refused != 0 {
                return false;
            }
            self.target_ns = target_ns;
        }
        // SAFETY: an open session.
        let refused = unsafe { (self.symbols.report)(self.session, nanoseconds(elapsed_s)) };
        refused == 0
    }
}

impl Drop for HintSession {
    fn drop(&mut self) {
        // SAFETY: open, and closed once.
        unsafe { (self.symbols.close)(self.session) };
    }
}
