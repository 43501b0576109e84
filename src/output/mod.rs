//! Sound output: devices and WAV files.

pub mod device;
#[cfg(target_os = "android")]
pub mod oboe;
pub mod wav;
pub mod whole_file;

pub use device::{Device, DeviceCallback, DeviceGrant, DeviceInterface, OpenDevice};
pub use wav::{WavFormat, WavSink};
pub use whole_file::WholeFile;
