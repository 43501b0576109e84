//! The host's default output device, by the crate `cpal` (feature `play`).
//!
//! The device's thread does not allocate. A device with more than two channels plays on the first two, a mono device
//! the mean of both.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use cpal::traits::{DeviceTrait, HostTrait, StreamTrait};
use cpal::{ErrorKind, FromSample, SampleFormat, SizedSample, StreamConfig};

use super::supervisor::Backend;
use crate::error::{Error, Result};
use crate::runtime::device::callback_slot::LeasedCallback;

/// Audio frames rendered at once for a device.
const CHUNK_FRAMES: usize = 256;

/// Opens the host's default output device at a fixed sample rate.
pub struct CpalBackend {
    rate_hz: u32,
}

impl CpalBackend {
    /// For an engine's sample rate in Hz.
    pub fn new(rate_hz: u32) -> Self {
        Self { rate_hz }
    }

    /// The default device's own sample rate in Hz; `None` without a device.
    pub fn preferred_rate_hz() -> Option<u32> {
        let device = cpal::default_host().default_output_device()?;
        Some(device.default_output_config().ok()?.sample_rate())
    }

    fn config(&self, device: &cpal::Device) -> Result<(StreamConfig, SampleFormat)> {
        let ranges = device.supported_output_configs().map_err(refused)?;
        let fits = ranges.filter_map(|range| range.try_with_sample_rate(self.rate_hz));
        // Stereo floats, or the nearest format.
        let distance = |format| match format {
            SampleFormat::F32 => 0,
            SampleFormat::I16 | SampleFormat::I32 => 1,
            _ => 8,
        };
        let best = fits
            .filter(|fit| distance(fit.sample_format()) < 8)
            .min_by_key(|fit| (distance(fit.sample_format()), fit.channels().abs_diff(2)));
        let advice = "choose another device, or its rate in the system's settings";
        let problem = || format!("the device does not play {} Hz", self.rate_hz);
        let best = best.ok_or_else(|| Error::engine(problem(), advice))?;
        Ok((best.config(), best.sample_format()))
    }
}

impl Backend for CpalBackend {
    type Stream = cpal::Stream;

    fn open(&mut self, callback: LeasedCallback, lost: Arc<AtomicBool>) -> Result<cpal::Stream> {
        let device = cpal::default_host().default_output_device();
        let device = device.ok_or_else(|| {
            let advice = "plug one in, or start the sound system";
            Error::engine("there is no sound device", advice)
        })?;
        let (config, format) = self.config(&device)?;
        match format {
            SampleFormat::I16 => open_as::<i16>(&device, config, callback, lost),
            SampleFormat::I32 => open_as::<i32>(&device, config, callback, lost),
            _ => open_as::<f32>(&device, config, callback, lost),
        }
    }
}

fn open_as<T: SizedSample + FromSample<f32>>(
    device: &cpal::Device,
    config: StreamConfig,
    mut callback: LeasedCallback,
    lost: Arc<AtomicBool>,
) -> Result<cpal::Stream> {
    let channels = usize::from(config.channels.max(1));
    let mut stereo = vec![0.0; 2 * CHUNK_FRAMES];
    let callback = move |output: &mut [T], _: &cpal::OutputCallbackInfo| {
        for chunk in output.chunks_mut(channels * CHUNK_FRAMES) {
            let stereo = &mut stereo[..2 * (chunk.len() / channels)];
            callback.fill(stereo);
            for (frame, pair) in chunk.chunks_mut(channels).zip(stereo.chunks_exact(2)) {
                spread(frame, [pair[0], pair[1]]);
            }
        }
    };
    let on_error = move |error: cpal::Error| match error.kind() {
        ErrorKind::DeviceChanged | ErrorKind::Xrun | ErrorKind::RealtimeDenied => {}
        _ => lost.store(true, Ordering::Release),
    };
    let stream = device
        .build_output_stream(config, callback, on_error, None)
        .map_err(refused)?;
    stream.play().map_err(refused)?;
    Ok(stream)
}

/// Writes two ears to a device's channels.
fn spread<T: SizedSample + FromSample<f32>>(frame: &mut [T], ears: [f32; 2]) {
    if let [mono] = frame {
        *mono = T::from_sample(0.5 * (ears[0] + ears[1]));
        return;
    }
    for (channel, sample) in frame.iter_mut().enumerate() {
        *sample = T::from_sample(ears.get(channel).copied().unwrap_or(0.0));
    }
}

fn refused(error: cpal::Error) -> Error {
    let advice = "look whether another program has it, or plug in another";
    Error::engine(format!("the sound device refuses: {error}"), advice)
}
