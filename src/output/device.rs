//! The interface of sound devices: they open, request blocks, and may disappear at any time.
//!
//! The control side opens and drops; the device calls back on threads of its own. Implementations: `oboe` on Android, and
//! whatever a test needs.

use crate::error::Result;

/// The interface that a device speaks.
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

/// The properties that a device granted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DeviceGrant {
    /// Sample rate in Hz.
    pub rate_hz: u32,
    /// Audio frames that the device takes at once.
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

/// What a device calls, on threads of its own.
pub trait DeviceCallback: Send {
    /// Fills interleaved stereo of any length. Audio side: wait-free, never panics.
    fn fill(&mut self, output: &mut [f32]);

    /// The device is gone, for whatever reason. Not on the audio side; nothing is asked of this callback afterwards, but
    /// a `fill` that is under way may still end.
    fn lost(&mut self);
}

/// A device that plays. Closed when dropped.
pub trait OpenDevice: Send {
    /// What it granted.
    fn grant(&self) -> DeviceGrant;

    /// Gaps that it has counted itself; 0 where it does not count.
    fn xruns(&mut self) -> u32;
}

/// A way to open devices.
pub trait Device: Send {
    /// Opens and starts the system's present device: stereo, float, at this rate, as fast and as alone as it can be had.
    ///
    /// # Errors
    /// [`crate::Error::Engine`] with the system's words.
    fn open(
        &mut self,
        rate_hz: u32,
        callback: Box<dyn DeviceCallback>,
    ) -> Result<Box<dyn OpenDevice>>;
}
