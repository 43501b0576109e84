//! Interface of sound devices, which request blocks and may disappear at any time.
//!
//! The control side opens and drops devices; callbacks run on the device's threads. Implementations: `oboe` and
//! `runtime::device::aaudio` on Android, and those of the tests.

use crate::error::Result;

/// The system interface of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DeviceInterface {
    /// None of the others.
    #[default]
    Other = 0,
    /// Android's AAudio.
    AAudio = 1,
    /// Android's OpenSL ES.
    OpenSlEs = 2,
}

/// Actual properties of an open device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DeviceGrant {
    /// Sample rate in Hz.
    pub rate_hz: u32,
    /// Audio frames per burst.
    pub burst_frames: u32,
    /// Audio frames of its buffer.
    pub buffer_frames: u32,
    /// Whether the stream is exclusive.
    pub exclusive: bool,
    /// Whether it is a low-latency stream.
    pub low_latency: bool,
    /// The interface in use.
    pub interface: DeviceInterface,
}

/// Callback of a device, on the device's threads.
pub trait DeviceCallback: Send {
    /// Fills interleaved stereo of any length. Audio side: wait-free, never panics.
    fn fill(&mut self, output: &mut [f32]);

    /// Reports the loss of the device. Not on the audio side. No call of `fill` starts afterwards, but a running one may
    /// still end.
    fn lost(&mut self);
}

/// An open, playing device. Closes on drop.
pub trait OpenDevice: Send {
    /// The actual properties.
    fn grant(&self) -> DeviceGrant;

    /// Underruns counted by the device; 0 if it does not count them.
    fn xruns(&mut self) -> u32;
}

/// Opens devices. Control side.
pub trait Device: Send {
    /// Opens and starts the system's default device: stereo, float, at `rate_hz`, with low latency and exclusive access if
    /// available.
    ///
    /// # Errors
    /// [`Error::Engine`](crate::Error::Engine) with the system's error text.
    fn open(
        &mut self,
        rate_hz: u32,
        callback: Box<dyn DeviceCallback>,
    ) -> Result<Box<dyn OpenDevice>>;
}
