//! A performance hint session: threads, target duration and actual duration of periodic work.
//!
//! The system adjusts clocks until the actual duration meets the target. A session that refuses a report is closed for
//! good.

use super::symbols::{Handle, HintSymbols};

/// Range of reported times in nanoseconds; the system refuses zero.
const RANGE_NS: (i64, i64) = (1_000, 10_000_000_000);

/// A hint session. One thread at a time; calls may block on another process.
pub struct HintSession {
    symbols: HintSymbols,
    session: Handle,
    target_ns: i64,
}

// SAFETY: a session allows one call at a time from any thread; `&mut` guarantees that.
unsafe impl Send for HintSession {}

/// Seconds in nanoseconds, within range.
fn nanoseconds(seconds: f64) -> i64 {
    // NaN becomes 0.
    ((1e9 * seconds) as i64).clamp(RANGE_NS.0, RANGE_NS.1)
}

impl HintSession {
    /// For threads of this process by kernel id, with a target in seconds; `None` if the system refuses.
    pub fn open(symbols: HintSymbols, threads: &[i32], target_s: f64) -> Option<Self> {
        // SAFETY: takes nothing.
        let manager = unsafe { (symbols.manager)() };
        if manager.is_null() || threads.is_empty() {
            return None;
        }
        let target_ns = nanoseconds(target_s);
        // SAFETY: a valid manager; pointer and length of a slice, which the system copies.
        let session =
            unsafe { (symbols.create)(manager, threads.as_ptr(), threads.len(), target_ns) };
        (!session.is_null()).then_some(Self {
            symbols,
            session,
            target_ns,
        })
    }

    /// Reports actual and target duration in seconds; false if the system refuses.
    #[must_use = "a session that refuses has to be closed"]
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
