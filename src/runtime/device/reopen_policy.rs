//! When a lost device is reopened: a state machine without clock, thread or device.
//!
//! A device is lost by an error on opening, by an error callback, or silently: some systems stop calling back an app in
//! the background. Attempts follow at doubling intervals.

/// First wait after a loss, in seconds; doubles with each further loss.
pub const FIRST_WAIT_S: f64 = 0.1;
/// Longest wait in seconds.
pub const MAX_WAIT_S: f64 = 5.0;
/// Seconds without a callback after which a device has stalled. Bluetooth streams take half of it to start.
pub const STALL_S: f64 = 1.0;
/// Seconds of playing after which the next wait is [`FIRST_WAIT_S`] again.
pub const STABLE_S: f64 = 2.0;

/// The next action.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReopenAction {
    /// Wait.
    Wait,
    /// Open the device and report the result to [`ReopenPolicy::opened`].
    Open,
    /// Close the device, which was lost or has stalled.
    Close,
}

/// Counts of events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ReopenCounts {
    /// Devices opened.
    pub opened: u32,
    /// Failed attempts to open one.
    pub refused: u32,
    /// Devices that reported their loss.
    pub lost: u32,
    /// Devices that stopped calling back.
    pub stalled: u32,
}

enum State {
    /// Closed until a time.
    Closed { until_s: f64 },
    /// Playing, with the number of callbacks and the time of the last one.
    Open {
        since_s: f64,
        callbacks: u64,
        progress_s: f64,
    },
}

/// Decides when to open and close a device.
pub struct ReopenPolicy {
    state: State,
    wait_s: f64,
    counts: ReopenCounts,
}

impl ReopenPolicy {
    /// Closed, to be opened at once.
    pub fn new() -> Self {
        Self {
            state: State::Closed {
                until_s: f64::NEG_INFINITY,
            },
            wait_s: FIRST_WAIT_S,
            counts: ReopenCounts::default(),
        }
    }

    /// The action at `now_s`, given the total number of callbacks and whether the open device has reported its loss.
    pub fn step(&mut self, now_s: f64, callbacks: u64, lost: bool) -> ReopenAction {
        match &mut self.state {
            State::Closed { until_s } if now_s >= *until_s => ReopenAction::Open,
            State::Closed { .. } => ReopenAction::Wait,
            State::Open { since_s, .. } if lost => {
                let since_s = *since_s;
                self.counts.lost += 1;
                self.close(now_s, now_s - since_s);
                ReopenAction::Close
            }
            State::Open {
                callbacks: seen,
                progress_s: moved_s,
                since_s,
            } => {
                if *seen != callbacks {
                    *seen = callbacks;
                    *moved_s = now_s;
                } else if now_s - *moved_s >= STALL_S {
                    let played_s = *moved_s - *since_s;
                    self.counts.stalled += 1;
                    self.close(now_s, played_s);
                    return ReopenAction::Close;
                }
                ReopenAction::Wait
            }
        }
    }

    /// Takes the result of [`ReopenAction::Open`].
    pub fn opened(&mut self, now_s: f64, callbacks: u64, success: bool) {
        if success {
            self.counts.opened += 1;
            self.state = State::Open {
                since_s: now_s,
                callbacks,
                progress_s: now_s,
            };
        } else {
            self.counts.refused += 1;
            self.close(now_s, 0.0);
        }
    }

    fn close(&mut self, now_s: f64, played_s: f64) {
        if played_s >= STABLE_S {
            self.wait_s = FIRST_WAIT_S;
        }
        self.state = State::Closed {
            until_s: now_s + self.wait_s,
        };
        self.wait_s = (2.0 * self.wait_s).min(MAX_WAIT_S);
    }

    /// Time of the next [`ReopenAction::Open`] in seconds; `None` while the device is open.
    pub fn due_s(&self) -> Option<f64> {
        match self.state {
            State::Closed { until_s } => Some(until_s),
            State::Open { .. } => None,
        }
    }

    /// Counts so far.
    pub fn counts(&self) -> ReopenCounts {
        self.counts
    }
}

impl Default for ReopenPolicy {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failed_attempts_follow_at_growing_intervals() {
        let mut policy = ReopenPolicy::new();
        let mut attempts = Vec::new();
        for tick in 0..3000 {
            let now_s = f64::from(tick) * 0.01;
            if policy.step(now_s, 0, false) == ReopenAction::Open {
                attempts.push(now_s);
                policy.opened(now_s, 0, false);
            }
        }
        let waits: Vec<f64> = attempts.windows(2).map(|pair| pair[1] - pair[0]).collect();
        for (n, wait) in waits.iter().enumerate() {
            let wanted = (FIRST_WAIT_S * 2f64.powi(n as i32)).min(MAX_WAIT_S);
            // Steps are a hundredth apart.
            assert!((wait - wanted).abs() < 0.011, "{n}: {wait}");
        }
        assert_eq!(policy.counts().refused as usize, attempts.len());
    }

    #[test]
    fn the_wait_resets_after_stable_playing() {
        let mut policy = ReopenPolicy::new();
        let mut now_s = 0.0;
        for round in 0..4 {
            assert_eq!(policy.step(now_s, round, false), ReopenAction::Open);
            policy.opened(now_s, round, true);
            // A little more than the limit: sums of decimal fractions are rounded.
            now_s += STABLE_S + 1e-6;
            assert_eq!(policy.step(now_s, round + 1, true), ReopenAction::Close);
            assert_eq!(
                policy.step(now_s + 0.09, round + 1, true),
                ReopenAction::Wait
            );
            now_s += FIRST_WAIT_S + 1e-6;
        }
        let counts = policy.counts();
        assert_eq!((counts.opened, counts.lost, counts.stalled), (4, 4, 0));
    }

    #[test]
    fn missing_callbacks_are_a_stall_and_late_loss_flags_are_ignored() {
        let mut policy = ReopenPolicy::new();
        assert_eq!(policy.step(0.0, 0, false), ReopenAction::Open);
        policy.opened(0.0, 0, true);
        assert_eq!(policy.step(0.9, 0, false), ReopenAction::Wait);
        assert_eq!(policy.step(0.95, 1, false), ReopenAction::Wait);
        assert_eq!(policy.step(1.9, 1, false), ReopenAction::Wait);
        assert_eq!(policy.step(1.96, 1, false), ReopenAction::Close);
        assert_eq!(policy.step(1.97, 1, true), ReopenAction::Wait);
        assert_eq!(policy.counts().stalled, 1);
        assert_eq!(policy.counts().lost, 0);
    }
}
