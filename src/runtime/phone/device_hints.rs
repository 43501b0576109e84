//! What the propagation thread does about heat and hints, between two updates.

use crate::runtime::budget::{Budget, QualityChoice, QualityLevel};
use crate::runtime::handover::seqlock::{Words, halves, pair};
use crate::runtime::phone::hints::HintSession;
use crate::runtime::phone::symbols::Symbols;
use crate::runtime::phone::thermal::{ThermalMonitor, ThermalReading};

/// Seconds that an update should take where no budget says: extrapolation follows two frames at 60 Hz without effort, and
/// clocks raised beyond that would cost heat for nothing that is heard.
const UPDATE_TARGET_S: f64 = 1.0 / 30.0;

/// Share of a block's time that rendering it should take: the rest is for what else the thread waits for.
const BLOCK_SHARE: f64 = 0.5;

/// Seconds between two reports of sound: blocks are shorter than what the system wants to hear of.
const SOUND_PERIOD_S: f64 = 0.05;

/// Which manners are wanted, and the system's functions for them.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct DeviceHintsSettings {
    /// Whether heat lowers detail ([`crate::runtime::phone::ThermalPolicy`]).
    pub thermal: bool,
    /// Whether the system is told how long updates and blocks take.
    pub hints: bool,
    /// The system's functions.
    pub symbols: &'static Symbols,
}

impl Default for DeviceHintsSettings {
    /// Both, where the system has them.
    fn default() -> Self {
        Self {
            thermal: true,
            hints: true,
            symbols: Symbols::of_this_system(),
        }
    }
}

/// What came of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct DeviceHintsReport {
    /// The system's last word on its heat.
    pub reading: ThermalReading,
    /// The least tier because of it.
    pub thermal_quality: QualityLevel,
    /// Whether the propagation thread has a session of hints.
    pub hints_propagation: bool,
    /// Whether the sound thread has one.
    pub hints_sound: bool,
}

impl Words<3> for DeviceHintsReport {
    fn to_words(self) -> [u64; 3] {
        let ThermalReading { headroom, status } = self.reading;
        let hints = u32::from(self.hints_propagation) | u32::from(self.hints_sound) << 1;
        let perhaps = |known: Option<u32>| known.map_or(0, |number| pair(1, number));
        [
            perhaps(headroom.map(f32::to_bits)),
            perhaps(status.map(u32::from)),
            pair(self.thermal_quality.0.into(), hints),
        ]
    }

    fn from_words(words: [u64; 3]) -> Self {
        let [headroom, status, [level, hints]] = words.map(halves);
        let perhaps = |[is_known, number]: [u32; 2]| (is_known == 1).then_some(number);
        Self {
            reading: ThermalReading {
                headroom: perhaps(headroom).map(f32::from_bits),
                status: perhaps(status).map(|status| status as u8),
            },
            thermal_quality: QualityLevel(level as u8),
            hints_propagation: hints & 1 == 1,
            hints_sound: hints & 2 == 2,
        }
    }
}

/// A session that is to be, is, or will not be.
enum Hints {
    Pending,
    Open(HintSession),
    Ended,
}

/// Heat and hints. One thread at a time: whoever runs propagation; its calls may wait for another process.
pub struct DeviceHints {
    settings: DeviceHintsSettings,
    thermal: Option<ThermalMonitor>,
    updates: Hints,
    sound: Hints,
    /// The sound thread's number, as of the session that is open.
    sound_thread: i32,
    sound_report_s: f64,
    thermal_quality: QualityLevel,
}

/// How sound goes, as the propagation thread sees it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SoundLoad {
    /// Kernel's number of the thread, 0 before it has placed itself.
    pub thread: i32,
    /// Longest time of a block lately, in seconds; 0 if there was none.
    pub block_s: f64,
    /// Seconds that a block lasts.
    pub duration_s: f64,
}

impl DeviceHints {
    /// Begins to watch.
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

    /// The propagation thread is another one now, or none.
    pub fn reset_thread(&mut self) {
        if let Hints::Open(_) = self.updates {
            self.updates = Hints::Pending;
        }
    }

    /// The budget with what heat allows; `time_s` is a clock that never goes back. A tier that the app has fixed stays.
    pub fn limit_budget(&mut self, budget: Budget, time_s: f64) -> Budget {
        if let Some(thermal) = &mut self.thermal {
            self.thermal_quality = thermal.quality_level(time_s);
        }
        let tiers = match budget.quality {
            _ if self.thermal_quality == QualityLevel::default() => budget.quality,
            QualityChoice::Free => QualityChoice::AtLeast(self.thermal_quality),
            QualityChoice::AtLeast(level) => {
                QualityChoice::AtLeast(level.max(self.thermal_quality))
            }
            QualityChoice::Exactly(level) => QualityChoice::Exactly(level),
        };
        Budget {
            quality: tiers,
            ..budget
        }
    }

    /// Tells what an update of the calling thread took, in seconds.
    pub fn report_update(&mut self, elapsed_s: f64, budget: &Budget) {
        let target_s = budget.update_s.unwrap_or(UPDATE_TARGET_S);
        let hints = std::mem::replace(&mut self.updates, Hints::Ended);
        self.updates = self.report_work(hints, this_thread, elapsed_s, target_s);
    }

    /// Whether it is time to tell of sound.
    pub fn is_sound_report_due(&self, time_s: f64) -> bool {
        !matches!(self.sound, Hints::Ended) && time_s - self.sound_report_s >= SOUND_PERIOD_S
    }

    /// Tells how sound goes.
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

    /// What has come of it.
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

/// The kernel's number of the calling thread; 0 where it has none.
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
