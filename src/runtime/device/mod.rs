//! Sound devices: opened, supervised, reopened after a loss.
//!
//! A [`Supervisor`] opens streams through a [`Backend`] (`CpalBackend` with the feature `play`). The render callback
//! moves from stream to stream as a [`LeasedCallback`], so the renderer survives its device. Without a device a null
//! device keeps the time.

#[cfg(any(
    all(target_os = "android", feature = "aaudio", not(feature = "oboe")),
    all(test, target_os = "linux")
))]
mod aaudio;
#[cfg(all(test, target_os = "linux"))]
mod aaudio_tests;
mod callback_slot;
#[cfg(feature = "play")]
mod cpal_backend;
pub mod null_device;
pub mod output;
pub mod reopen_policy;
pub mod sound_thread;
mod supervisor;

pub use crate::runtime::device::callback_slot::{CallbackSlot, LeasedCallback, RenderCallback};
#[cfg(feature = "play")]
pub use cpal_backend::CpalBackend;
pub use supervisor::{Backend, DeviceState, NullDeviceSettings, Supervisor};
