//! Where sound goes: a sink asks for blocks.

pub mod wav;
pub mod whole_file;

pub use wav::{WavFormat, WavSink};
pub use whole_file::WholeFile;
