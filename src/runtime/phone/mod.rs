//! Device hints of Android: thermal state and performance hints.
//!
//! Their functions are newer than API 26 and looked up at run time ([`Symbols`]); without them nothing happens.
//! [`DeviceHints`] runs on the propagation thread: it reads the thermal state once a second and limits the quality
//! level ([`ThermalPolicy`]), and it reports times of updates and blocks ([`HintSession`]). Calls may block on another
//! process and never run on the audio side, which only stores its load in atomics.

mod device_hints;
mod hints;
mod symbols;
mod thermal;

pub use crate::runtime::phone::device_hints::{
    DeviceHints, DeviceHintsReport, DeviceHintsSettings, SoundLoad, this_thread,
};
pub use hints::HintSession;
pub use symbols::{Handle, HintSymbols, Lookup, Symbols, ThermalSymbols};
pub use thermal::{ThermalMonitor, ThermalPolicy, ThermalReading};

#[cfg(test)]
mod fake;
#[cfg(test)]
mod tests;
