//! Thermal readings of the system, and the quality limit that follows from them.
//!
//! The headroom forecasts severe throttling (at 1.0); the status is the throttling in force. Quality goes down before
//! the phone throttles, which would cost more. Limits are own, near the platform's advice to reduce load from 0.85 on.

use std::ffi::c_int;

use super::symbols::{Handle, ThermalSymbols};
use crate::runtime::budget::{LAST_QUALITY_LEVEL, QualityLevel};

/// Forecast time of the headroom in seconds: the thermal response to a change of load.
const FORECAST_S: c_int = 10;

/// Seconds between two readings; the system answers NaN to more frequent ones.
const PERIOD_S: f64 = 1.0;

/// Headroom from which on level 1, 2, 3 and 4 is the limit.
const HEADROOM: [f32; 4] = [0.85, 0.92, 0.97, 1.05];

/// Hysteresis of the headroom before quality goes up.
const SLACK: f32 = 0.05;

/// Seconds between two steps up.
const DWELL_S: f64 = 10.0;

/// Seconds after which a headroom expires.
const STALE_S: f64 = 30.0;

/// A thermal reading of the system.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ThermalReading {
    /// Forecast headroom, 1.0 at severe throttling; `None` if unknown.
    pub headroom: Option<f32>,
    /// 0 none, 1 light, 2 moderate, 3 severe, 4 critical, 5 emergency, 6 shutdown; `None` if unknown.
    pub status: Option<u8>,
}

/// Quality limit by thermal readings, with hysteresis. Reads no clock.
#[derive(Debug, Clone, Copy, Default)]
pub struct ThermalPolicy {
    level: u8,
    changed_s: f64,
    /// Last valid headroom and its time.
    headroom: Option<(f32, f64)>,
}

/// Limit by a headroom, with thresholds lowered by `slack`.
fn of_headroom(headroom: f32, slack: f32) -> u8 {
    let reached = |limit: &&f32| headroom >= **limit - slack;
    HEADROOM.iter().take_while(reached).count() as u8
}

/// Limit by a status.
fn of_status(status: u8) -> u8 {
    match status {
        0 => 0,
        1 => 1,
        2 => 2,
        3 => 4,
        _ => LAST_QUALITY_LEVEL,
    }
}

impl ThermalPolicy {
    /// Takes a reading at a time in seconds into account.
    pub fn observe(&mut self, time_s: f64, reading: ThermalReading) {
        if let Some(headroom) = reading.headroom.filter(|h| h.is_finite() && *h >= 0.0) {
            self.headroom = Some((headroom, time_s));
        }
        let fresh = |(headroom, at_s): (f32, f64)| (time_s - at_s <= STALE_S).then_some(headroom);
        let headroom = self.headroom.and_then(fresh).unwrap_or(0.0);
        let status = of_status(reading.status.unwrap_or(0));
        let limit = of_headroom(headroom, 0.0).max(status);
        if limit > self.level {
            self.level = limit;
            self.changed_s = time_s;
        } else if of_headroom(headroom, SLACK).max(status) < self.level
            && time_s - self.changed_s >= DWELL_S
        {
            self.level -= 1;
            self.changed_s = time_s;
        }
    }

    /// The lowest quality level number allowed.
    pub fn quality_level(&self) -> QualityLevel {
        QualityLevel(self.level)
    }
}

/// Reads the system's thermal state once a second at most. One thread at a time; calls may block on another process.
pub struct ThermalMonitor {
    symbols: ThermalSymbols,
    manager: Handle,
    read_s: Option<f64>,
    reading: ThermalReading,
    policy: ThermalPolicy,
}

// SAFETY: the system's manager may be used from any thread.
unsafe impl Send for ThermalMonitor {}

impl ThermalMonitor {
    /// Acquires the system's manager; `None` if there is none.
    pub fn open(symbols: ThermalSymbols) -> Option<Self> {
        // SAFETY: takes nothing.
        let manager = unsafe { (symbols.acquire)() };
        (!manager.is_null()).then(|| Self {
            symbols,
            manager,
            read_s: None,
            reading: ThermalReading::default(),
            policy: ThermalPolicy::default(),
        })
    }

    /// The lowest quality level number allowed at a time in seconds, which is monotonic.
    pub fn quality_level(&mut self, time_s: f64) -> QualityLevel {
        if self.read_s.is_none_or(|at_s| time_s - at_s >= PERIOD_S) {
            self.read_s = Some(time_s);
            self.reading = self.read();
            self.policy.observe(time_s, self.reading);
        }
        self.policy.quality_level()
    }

    /// The last reading.
    pub fn reading(&self) -> ThermalReading {
        self.reading
    }

    fn read(&self) -> ThermalReading {
        // SAFETY: the manager is acquired.
        let status = unsafe { (self.symbols.status)(self.manager) };
        let headroom = self.symbols.headroom.map(|headroom| {
            // SAFETY: as above.
            unsafe { headroom(self.manager, FORECAST_S) }
        });
        ThermalReading {
            headroom: headroom.filter(|h| h.is_finite() && *h >= 0.0),
            // Errors are negative.
            status: u8::try_from(status).ok(),
        }
    }
}

impl Drop for ThermalMonitor {
    fn drop(&mut self) {
        // SAFETY: acquired, and released once.
        unsafe { (self.symbols.release)(self.manager) };
    }
}
