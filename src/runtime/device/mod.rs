//! Sound devices that come and go: one that is lost is opened again, and meanwhile nobody hears but time goes on.
//!
//! [`Supervisor`] knows no device; a [`Backend`] opens one. What fills the blocks goes from stream to stream as a
//! [`LeasedCallback`], so the renderer is the same before and after. The backend for a host's devices is `CpalBackend`, with the
//! feature `play`.

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
