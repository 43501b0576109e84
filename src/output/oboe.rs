//! Sound output on Android by Oboe, through AAudio or OpenSL ES.
//!
//! The stream requests low latency and exclusive access. The device determines the callback size: a fixed one costs a
//! buffer. The buffer has two bursts. Oboe converts sample rates other than the device's own, which preserves the
//! low-latency path. The caller handles the loss of a device ([`DeviceCallback::lost`]).
//!
//! [`OboeDevice::open`] and drop: control side. The callback: the device's thread, wait-free; it only calls
//! [`DeviceCallback::fill`].

use oboe::{
    AudioApi, AudioOutputCallback, AudioOutputStreamSafe, AudioStream, AudioStreamAsync,
    AudioStreamBase, AudioStreamBuilder, AudioStreamSafe, ContentType, DataCallbackResult, Output,
    PerformanceMode, SampleRateConversionQuality, SharingMode, Stereo, Usage,
};

use super::device::{Device, DeviceCallback, DeviceGrant, DeviceInterface, OpenDevice};
use crate::error::{Error, Result};

/// Buffer in bursts: one plays while the other is filled.
const BURSTS: i32 = 2;

/// Opens the default device.
pub struct OboeDevice;

struct Callback(Box<dyn DeviceCallback>);

impl AudioOutputCallback for Callback {
    type FrameType = (f32, Stereo);

    fn on_audio_ready(
        &mut self,
        _: &mut dyn AudioOutputStreamSafe,
        frames: &mut [(f32, f32)],
    ) -> DataCallbackResult {
        self.0.fill(samples(frames));
        DataCallbackResult::Continue
    }

    fn on_error_before_close(&mut self, _: &mut dyn AudioOutputStreamSafe, _: oboe::Error) {
        self.0.lost();
    }
}

/// Pairs as interleaved samples.
fn samples(frames: &mut [(f32, f32)]) -> &mut [f32] {
    const { assert!(size_of::<(f32, f32)>() == 2 * size_of::<f32>()) };
    let count = 2 * frames.len();
    // SAFETY: a pair of floats is two floats without padding (asserted above), with the alignment of one. The borrow lasts
    // for the lifetime of the result, and every bit pattern is a valid float.
    unsafe { std::slice::from_raw_parts_mut(frames.as_mut_ptr().cast(), count) }
}

struct Open {
    stream: AudioStreamAsync<Output, Callback>,
    grant: DeviceGrant,
}

// SAFETY: the stream is a reference-counted pointer to an internally locked Oboe object; one thread at a time uses it
// (`&mut`), and its callback is `Send`.
unsafe impl Send for Open {}

impl Device for OboeDevice {
    fn open(
        &mut self,
        rate_hz: u32,
        callback: Box<dyn DeviceCallback>,
    ) -> Result<Box<dyn OpenDevice>> {
        let open_error = |error: oboe::Error| {
            let advice = "close other apps that use sound, or try again";
            Error::engine(format!("no sound device: {error}"), advice)
        };
        let mut stream = AudioStreamBuilder::default()
            .set_output()
            .set_performance_mode(PerformanceMode::LowLatency)
            .set_sharing_mode(SharingMode::Exclusive)
            .set_usage(Usage::Game)
            .set_content_type(ContentType::Sonification)
            .set_sample_rate(rate_hz as i32)
            .set_sample_rate_conversion_quality(SampleRateConversionQuality::Medium)
            .set_format_conversion_allowed(true)
            .set_channel_conversion_allowed(true)
            .set_stereo()
            .set_f32()
            .set_callback(Callback(callback))
            .open_stream()
            .map_err(open_error)?;
        let burst = stream.get_frames_per_burst().max(1);
        // The device may reject the size; the actual size is read back below.
        let _ = stream.set_buffer_size_in_frames(BURSTS * burst);
        stream.start().map_err(open_error)?;
        let grant = DeviceGrant {
            rate_hz: stream.get_sample_rate().max(0) as u32,
            burst_frames: burst as u32,
            buffer_frames: stream.get_buffer_size_in_frames().max(0) as u32,
            exclusive: stream.get_sharing_mode() == SharingMode::Exclusive,
            low_latency: stream.get_performance_mode() == PerformanceMode::LowLatency,
            interface: match stream.get_audio_api() {
                AudioApi::AAudio => DeviceInterface::AAudio,
                AudioApi::OpenSLES => DeviceInterface::OpenSlEs,
                AudioApi::Unspecified => DeviceInterface::Other,
            },
        };
        Ok(Box::new(Open { stream, grant }))
    }
}

impl OpenDevice for Open {
    fn grant(&self) -> DeviceGrant {
        self.grant
    }

    fn xruns(&mut self) -> u32 {
        self.stream.get_xrun_count().map_or(0, |n| n.max(0) as u32)
    }
}
