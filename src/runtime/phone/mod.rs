//! A phone's manners: what the system is told of our work (performance hints), and what it says of its heat.
//!
//! Both are of Android and younger than API 26, so their functions are looked up at run time ([`Symbols`]); where they are
//! not found, nothing happens. [`DeviceHints`] is what the propagation thread has of them: it asks for the thermal state once a
//! second and makes a lowest tier of it for the budget ([`ThermalPolicy`]), and it reports how long updates and blocks
//! take ([`HintSession`]). All calls are the system's and may wait for another process: propagation's thread only, never
//! the audio side, whose part is one number in an atomic.

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
