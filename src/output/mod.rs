//! Sound output: devices and WAV files; reading of compressed sound files.

#[cfg(feature = "compressed")]
pub mod compressed;
pub mod device;
#[cfg(all(target_os = "android", feature = "oboe"))]
pub mod oboe;
#[cfg(feature = "files")]
pub mod wav;
#[cfg(feature = "files")]
pub mod wav_chunks;
#[cfg(feature = "files")]
pub mod whole_file;

pub use device::{Device, DeviceCallback, DeviceGrant, DeviceInterface, OpenDevice};
#[cfg(feature = "files")]
pub use wav::{WavFormat, WavSink};
#[cfg(feature = "files")]
pub use wav_chunks::wav_chunks;
#[cfg(feature = "files")]
pub use whole_file::{WholeFile, watch_temporary_files};
