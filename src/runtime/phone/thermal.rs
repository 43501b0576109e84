//! Heat: the system's reading, and the least detail that follows from it.
//!
//! The headroom forecasts how near the device is to severe throttling (1.0 is there; what stands beyond is left to the
//! system); a status says what it does already. A phone that is about to throttle takes far more from us than a tier
//! does, so detail goes before. Limits are own, in the spirit of the platform's advice to shed load from 0.85 on.

use std::ffi::c_int;

use super::symbols::{Handle, ThermalSymbols};
use crate::runtime::budget::{LAST_QUALITY_LEVEL, QualityLevel};

/// Seconds that the headroom is forecast for: as long as it takes heat to answer a change of load.
const FORECAST_S: c_int = 10;

/// Seconds between two readings: asked more often the system answers with no number.
const PERIOD_S: f64 = 1.0;

/// Headroom from which on each tier is the least, from tier 1.
const HEADROOM: [f32; 4] = [0.85, 0.92, 0.97, 1.05];

/// Below its limit by so much before a tier's detail may come back.
const SLACK: f32 = 0.05;

/// Seconds between two steps back up: heat is slow.
const DWELL_S: f64 = 10.0;

/// Seconds after which an old headroom counts for nothing.
const STALE_S: f64 = 30.0;

/// What the system says of its heat.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ThermalReading {
    /// Share of the way to severe throttling, forecast; `None` where the system has no number.
    pub headroom: Option<f32>,
    /// 0 none, 1 light, 2 moderate, 3 severe, 4 critical, 5 emergency, 6 shutdown; `None` where it is not known.
    pub status: Option<u8>,
}

/// Makes a least tier of readings. Pure: it is told the time.
#[derive(Debug, Clone, Copy, Default)]
pub struct ThermalPolicy {
    level: u8,
    changed_s: f64,
    /// The last headroom that was a number, and when.
    headroom: Option<(f32, f64)>,
}

/// The least tier of a headroom, with limits lowered by `slack`.
fn of_headroom(headroom: f32, slack: f32) -> u8 {
    let reached = |limit: &&f32| headroom >= **limit - slack;
    HEADROOM.iter().take_while(reached).count() as u8
}

/// The least tier of a status: throttling that has begun wants more than a forecast of it.
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
    /// Takes notice of a reading at a time in seconds.
    pub fn observe(&mut self, time_s: f64, reading: ThermalReading) {
        if let Some(headroom) = reading.headroom.filter(|h| h.is_finite() && *h >= 0.0) {
            self.headroom = Some((headroom, time_s));
        }
        let fresh = |(headroom, at_s): (f32, f64)| (time_s - at_s <= STALE_S).then_some(headroom);
        let headroom = self.headroom.and_then(fresh).unwrap_or(0.0);
        let status = of_status(reading.status.unwrap_or(0));
        let wanted = of_headroom(headroom, 0.0).max(status);
        if wanted > self.level {
            self.level = wanted;
            self.changed_s = time_s;
        } else if of_headroom(headroom, SLACK).max(status) < self.level
            && time_s - self.changed_s >= DWELL_S
        {
            self.level -= 1;
            self.changed_s = time_s;
        }
    }

    /// The least tier.
    pub fn quality_level(&self) -> QualityLevel {
        QualityLevel(self.level)
    }
}

/// Asks the system, once a second at most, and keeps the policy. One thread at a time; the calls may wait for another
/// process.
pub struct ThermalMonitor {
    symbols: ThermalSymbols,
    manager: Handle,
    read_s: Option<f64>,
    reading: ThermalReading,
    policy: ThermalPolicy,
}

// SAFETY: the system's manager may be used from any thread; ours has no thread of its own.
unsafe impl Send for ThermalMonitor {}

impl ThermalMonitor {
    /// With the system's manager; `None` if it has none.
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

    /// The least tier at a time in seconds, which never goes back.
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
        // SAFETY: the manager is acquired and not released.
        let status = unsafe { (self.symbols.status)(self.manager) };
        let headroom = self.symbols.headroom.map(|headroom| {
            // SAFETY: as above.
            unsafe { headroom(self.manager, FORECAST_S) }
        });
        ThermalReading {
            headroom: headroom.filter(|h| h.is_finite() && *h >= 0.0),
            // An error is below zero.
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
