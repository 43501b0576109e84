//! A virtual clock, which counts graphics frames, and the update under way on it.

use std::time::Duration;

use super::messages::UpdateMessage;

/// Graphics frames and updates of a [`super::VirtualEngine`].
#[derive(Debug, Clone, PartialEq)]
pub struct VirtualClock {
    /// Graphics frames per second, 1 to 1,000.
    pub graphics_rate_hz: f64,
    /// Graphics frames from a whole update's poses to its arrival, for each update in turn, from the start again after the
    /// last. An update after a jump takes a share of them, as measured, and at least one. 0 counts as 1. Empty: every update arrives in the next graphics frame. In the synchronous schedule unused.
    pub delays: Vec<u32>,
}

impl VirtualClock {
    /// Every update arrives L + 1 graphics frames after its poses.
    pub fn at_level(graphics_rate_hz: f64, extrapolation_level: u32) -> Self {
        Self {
            graphics_rate_hz,
            delays: vec![extrapolation_level.saturating_add(1)],
        }
    }
}

/// The update under way.
pub(super) struct VirtualArrivals {
    clock: VirtualClock,
    /// Ticks and updates so far.
    pub(super) tick: u64,
    pub(super) updates: usize,
    /// A finished update, and the tick in which it is sent.
    pub(super) pending: Option<(u64, Box<UpdateMessage>)>,
}

impl VirtualArrivals {
    pub(super) fn new(clock: VirtualClock) -> Self {
        Self {
            clock,
            tick: 0,
            updates: 0,
            pending: None,
        }
    }

    /// Graphics frames that the next update takes.
    pub(super) fn delay(&self) -> u32 {
        let index = self.updates.saturating_sub(1) % self.clock.delays.len().max(1);
        let delay = self.clock.delays.get(index);
        delay.map_or(1, |delay| (*delay).max(1))
    }

    /// Time of an update that arrives after so many graphics frames; a nanosecond less, since Eq. 1 rounds up.
    pub(super) fn time_of(&self, delay: u64) -> Duration {
        let frames_s = delay as f64 / self.clock.graphics_rate_hz;
        Duration::from_secs_f64(frames_s).saturating_sub(Duration::from_nanos(1))
    }
}
