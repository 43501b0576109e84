//! Where sound goes: a sink asks for blocks.

pub mod device;
#[cfg(target_os = "android")]
pub mod oboe;
#[cfg(feature = "files")]
pub mod wav;
pub mod whole_file;

pub use device::{Device, DeviceCallback, DeviceGrant, DeviceInterface, OpenDevice};
#[cfg(feature = "files")]
pub use wav::{WavFormat, WavSink};
pub use whole_file::WholeFile;
