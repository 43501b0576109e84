//! Thermal state and performance hints, handled by the propagation thread between two updates.

use crate::runtime::budget::{Budget, QualityChoice, QualityLevel};
use crate::runtime::phone::hints::HintSession;
use crate::runtime::phone::symbols::Symbols;
use crate::runtime::phone::thermal::{ThermalMonitor, ThermalReading};

/// Target time of an update in seconds without a budget: extrapolation covers two frames at 60 Hz inaudibly, and faster
/// updates would only cost heat.
const UPDATE_TARGET_S: f64 = 1.0 / 30.0;

/// Target rendering time of a block as a fraction of its duration.
const BLOCK_SHARE: f64 = 0.5;

/// Seconds between two reports of the sound thread; blocks are too short for one each.
const SOUND_PERIOD_S: f64 = 0.05;

/// Which hints are used, and the system's functions.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct DeviceHintsSettings {
    /// Whether heat lowers the quality level.
    pub thermal: bool,
    /// Whether times of updates and blocks are reported to the system.
    pub hints: bool,
    /// The system's functions.
    pub symbols: &'static Symbols,
}

impl Default for DeviceHintsSettings {
    /// Both, if the system has them.
    fn default() -> Self {
        Self {
            thermal: true,
            hints: true,
            symbols: Symbols::of_this_system(),
        }
    }
}

/// Thermal state and hint sessions in use.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct DeviceHintsReport {
    /// Last thermal reading.
    pub reading: ThermalReading,
    /// Lowest quality level number allowed by it.
    pub thermal_quality: QualityLevel,
    /// Whether the propagation thread has a hint session.
    pub hints_propagation: bool,
    /// Whether the sound thread has one.
    pub hints_sound: bool,
}

/// State of a hint session.
enum Hints {
    Pending,
    Open(HintSession),
    Ended,
}

/// Thermal and performance hints. On the propagating thread; calls may block on another process.
pub struct DeviceHints {
    settings: DeviceHintsSettings,
    thermal: Option<ThermalMonitor>,
    updates: Hints,
    sound: Hints,
    /// Kernel thread id of the sound thread in the open session.
    sound_thread: i32,
    sound_report_s: f64,
    thermal_quality: QualityLevel,
}

/// Load of the sound thread.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SoundLoad {
    /// Kernel thread id, 0 before the thread is placed.
    pub thread: i32,
    /// Longest recent rendering time of a block in seconds; 0 without a block.
    pub block_s: f64,
    /// Duration of a block in seconds.
    pub duration_s: f64,
}

impl DeviceHints {
    /// Acquires the system's managers.
    pub fn new(settings: DeviceHintsSettings) -> Self {
        let thermal = settings.symbols.thermal.filter(|_| settings.thermal);
        let hints = || match settings.hints && settings.symbols.hints.is_some() {
            true => Hints::Pending,
            false => Hints::Ended,
        };
        Self {
            thermal: thermal.and_then(ThermalMonitor::open),
            updates: hints(),
            sound: hints(),
            sound_thread: 0,
            sound_report_s: f64::NEG_INFINITY,
            thermal_quality: QualityLevel::default(),
            settings,
        }
    }

    /// Ends the session of the propagation thread, which changes or ends.
    pub fn reset_thread(&mut self) {
        if let Hints::Open(_) = self.updates {
            self.updates = Hints::Pending;
        }
    }

    /// The budget within the thermal limit; `time_s` is a monotonic clock. A fixed level stays.
    pub fn limit_budget(&mut self, budget: Budget, time_s: f64) -> Budget {
        if let Some(thermal) = &mut self.thermal {
            self.thermal_quality = thermal.quality_level(time_s);
        }
        let quality = match budget.quality {
            _ if self.thermal_quality == QualityLevel::default() => budget.quality,
            QualityChoice::Free => QualityChoice::AtLeast(self.thermal_quality),
            QualityChoice::AtLeast(level) => {
                QualityChoice::AtLeast(level.max(self.thermal_quality))
            }
            QualityChoice::Exactly(level) => QualityChoice::Exactly(level),
        };
        Budget { quality, ..budget }
    }

    /// Reports the time of an update of the calling thread, in seconds.
    pub fn report_update(&mut self, elapsed_s: f64, budget: &Budget) {
        let target_s = budget.update_s.unwrap_or(UPDATE_TARGET_S);
        let hints = std::mem::replace(&mut self.updates, Hints::Ended);
        self.updates = self.report_work(hints, this_thread, elapsed_s, target_s);
    }

    /// Whether a report of the sound thread is due.
    pub fn is_sound_report_due(&self, time_s: f64) -> bool {
        !matches!(self.sound, Hints::Ended) && time_s - self.sound_report_s >= SOUND_PERIOD_S
    }

    /// Reports the load of the sound thread.
    pub fn report_sound(&mut self, load: SoundLoad, time_s: f64) {
        if load.thread == 0 || load.block_s <= 0.0 {
            return;
        }
        self.sound_report_s = time_s;
        if load.thread != self.sound_thread && matches!(self.sound, Hints::Open(_)) {
            self.sound = Hints::Pending;
        }
        self.sound_thread = load.thread;
        let target_s = BLOCK_SHARE * load.duration_s;
        let hints = std::mem::replace(&mut self.sound, Hints::Ended);
        self.sound = self.report_work(hints, || load.thread, load.block_s, target_s);
    }

    fn report_work(
        &self,
        hints: Hints,
        thread: impl FnOnce() -> i32,
        elapsed_s: f64,
        target_s: f64,
    ) -> Hints {
        let session = match (hints, self.settings.symbols.hints) {
            (Hints::Open(session), _) => Some(session),
            (Hints::Pending, Some(symbols)) => HintSession::open(symbols, &[thread()], target_s),
            _ => None,
        };
        match session {
            Some(mut session) => match session.report(elapsed_s, target_s) {
                true => Hints::Open(session),
                false => Hints::Ended,
            },
            None => Hints::Ended,
        }
    }

    /// Thermal state and sessions in use.
    pub fn report(&self) -> DeviceHintsReport {
        DeviceHintsReport {
            reading: self
                .thermal
                .as_ref()
                .map(ThermalMonitor::reading)
                .unwrap_or_default(),
            thermal_quality: self.thermal_quality,
            hints_propagation: matches!(self.updates, Hints::Open(_)),
            hints_sound: matches!(self.sound, Hints::Open(_)),
        }
    }
}

/// Kernel thread id of the calling thread; 0 on systems without one.
pub fn this_thread() -> i32 {
    #[cfg(any(target_os = "linux", target_os = "android"))]
    {
        // SAFETY: takes nothing and cannot fail.
        unsafe { libc::gettid() }
    }
    #[cfg(not(any(target_os = "linux", target_os = "android")))]
    {
        0
    }
}
