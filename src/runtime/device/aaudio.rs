//! Sound output on Android by AAudio, through the crate `ndk` (feature `aaudio`): no C++.
//!
//! The alternative to `output::oboe`, behind the same trait, with the same requests: low latency, exclusive access, callbacks of
//! the device's size, a buffer of two bursts. What Oboe adds is missing: conversion of sample rates that keeps the low-latency
//! path, OpenSL ES on Android 8.0, and the usage `Game`, which `ndk` links strongly and Android has since API 28.
//!
//! [`AaudioDevice::open`] and drop: control side. The data callback: the device's thread, wait-free; it exchanges two pointers
//! and calls [`DeviceCallback::fill`]. The error callback only reports: the supervisor closes the stream on its own thread.
//!
//! Own: `ndk` 0.9 ends the process when a callback panics, and panics when a stream does not close; neither happens here.
//!
//! Unsafe: AAudio's buffer as a slice; a stream moves between threads.

use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use ndk::audio::{
    AudioCallbackResult, AudioDirection, AudioError, AudioFormat, AudioPerformanceMode,
    AudioSharingMode, AudioStream, AudioStreamBuilder,
};

use crate::error::{Error, Result};
use crate::output::device::{Device, DeviceCallback, DeviceGrant, DeviceInterface, OpenDevice};
use crate::runtime::handover::atomic_box::AtomicBox;
use crate::runtime::threads::clock::now;

/// Channels of a stream.
const CHANNELS: usize = 2;

/// Buffer in bursts: one plays while the other is filled.
const BURSTS: i32 = 2;

/// Wait between stop and close. To Android 9, and sometimes later, a callback may start after the stop and read what the close
/// frees; Oboe waits as long (`AudioStream::sleepBeforeClose`).
const CLOSE_DELAY: Duration = Duration::from_millis(10);

/// Opens the default device.
pub(crate) struct AaudioDevice;

/// The callback, used by AAudio's data and error threads.
pub(super) struct SharedCallback {
    /// Empty while one of the threads uses it.
    slot: AtomicBox<Leased>,
    lost: AtomicBool,
}

struct Leased {
    callback: Box<dyn DeviceCallback>,
    reported: bool,
}

impl SharedCallback {
    pub(super) fn new(callback: Box<dyn DeviceCallback>) -> Self {
        let reported = false;
        Self {
            slot: AtomicBox::new(Some(Box::new(Leased { callback, reported }))),
            lost: AtomicBool::new(false),
        }
    }

    /// Fills a block; false once the device is lost. Wait-free. A panic becomes silence and the loss of the device.
    pub(super) fn fill(self: &Arc<Self>, output: &mut [f32]) -> bool {
        let Some(mut leased) = self.slot.take() else {
            // The error thread reports the loss.
            output.fill(0.0);
            return false;
        };
        if self.lost.load(Ordering::Acquire) {
            output.fill(0.0);
        } else if catch_unwind(AssertUnwindSafe(|| leased.callback.fill(output))).is_err() {
            output.fill(0.0);
            self.lost.store(true, Ordering::Release);
        }
        drop(self.slot.swap(Some(leased)));
        // The error thread may have found the slot empty: its exchange comes before this one, and so does its store.
        let lost = self.lost.load(Ordering::Acquire);
        if lost {
            self.report_loss();
        }
        !lost
    }

    /// Reports the loss, once; if the data thread has the callback, that thread does.
    pub(super) fn lose(self: &Arc<Self>) {
        self.lost.store(true, Ordering::Release);
        self.report_loss();
    }

    /// The supervisor may close the stream, and `ndk` free its closures, as soon as the loss is reported: from there on only what
    /// this function owns is used.
    fn report_loss(self: &Arc<Self>) {
        let kept = Arc::clone(self);
        if let Some(mut leased) = kept.slot.take() {
            if !leased.reported {
                leased.reported = true;
                // A panic must not cross into AAudio; the supervisor then finds that the device has stalled.
                drop(catch_unwind(AssertUnwindSafe(|| leased.callback.lost())));
            }
            drop(kept.slot.swap(Some(leased)));
        }
    }
}

/// AAudio's buffer as samples.
///
/// # Safety
/// `data` is null or points to `frames` audio frames of two floats, used by nobody else for the lifetime `'a`.
unsafe fn samples<'a>(data: *mut c_void, frames: i32) -> &'a mut [f32] {
    let count = CHANNELS * usize::try_from(frames).unwrap_or(0);
    if data.is_null() || count == 0 {
        return &mut [];
    }
    // SAFETY: not null, and the caller promises the rest; every bit pattern is a valid float.
    unsafe { std::slice::from_raw_parts_mut(data.cast(), count) }
}

struct Open {
    /// `None` in drop only.
    stream: Option<AudioStream>,
    grant: DeviceGrant,
}

// SAFETY: AAudio's functions may be called from any thread, by one at a time, which `&mut` and drop ensure. The callbacks are
// `Send`.
unsafe impl Send for Open {}

impl Device for AaudioDevice {
    fn open(
        &mut self,
        rate_hz: u32,
        callback: Box<dyn DeviceCallback>,
    ) -> Result<Box<dyn OpenDevice>> {
        let shared = Arc::new(SharedCallback::new(callback));
        let filling = Arc::clone(&shared);
        let stream = AudioStreamBuilder::new()
            .map_err(open_error)?
            .direction(AudioDirection::Output)
            .performance_mode(AudioPerformanceMode::LowLatency)
            .sharing_mode(AudioSharingMode::Exclusive)
            .sample_rate(i32::try_from(rate_hz).unwrap_or(i32::MAX))
            .channel_count(CHANNELS as i32)
            .format(AudioFormat::PCM_Float)
            .data_callback(Box::new(move |_, data, frames| {
                // SAFETY: AAudio gives so many frames of its own buffer for the duration of the call; format and channels are
                // those of the request, checked before the stream starts.
                let output = unsafe { samples(data, frames) };
                match filling.fill(output) {
                    true => AudioCallbackResult::Continue,
                    false => AudioCallbackResult::Stop,
                }
            }))
            .error_callback(Box::new(move |_, _| shared.lose()))
            .open_stream()
            .map_err(open_error)?;
        let mut open = Open {
            stream: Some(stream),
            grant: DeviceGrant::default(),
        };
        open.start(rate_hz)?;
        Ok(Box::new(open))
    }
}

impl Open {
    /// Checks what the callback relies on, sets the buffer's size, and starts.
    fn start(&mut self, rate_hz: u32) -> Result<()> {
        let Some(stream) = &self.stream else {
            return Ok(());
        };
        let (channels, format) = (stream.channel_count(), stream.format());
        let granted_hz = u32::try_from(stream.sample_rate()).unwrap_or(0);
        if channels != CHANNELS as i32 || format != AudioFormat::PCM_Float || granted_hz != rate_hz
        {
            let problem = format!(
                "the device plays {channels} channels of {format:?} at {granted_hz} Hz instead of {CHANNELS} of PCM_Float at \
                 {rate_hz} Hz"
            );
            let advice = "make the engine with the device's sample rate, or build with the feature oboe, which converts";
            return Err(Error::engine(problem, advice));
        }
        let burst = stream.frames_per_burst().max(1);
        // The device may choose another size, which is read back. `ndk` 0.9 returns the new size as an error.
        let _ = stream.set_buffer_size_in_frames(burst.saturating_mul(BURSTS));
        stream.request_start().map_err(open_error)?;
        self.grant = DeviceGrant {
            rate_hz: granted_hz,
            burst_frames: burst.unsigned_abs(),
            buffer_frames: stream.buffer_size_in_frames().max(0).unsigned_abs(),
            exclusive: stream.sharing_mode() == AudioSharingMode::Exclusive,
            low_latency: stream.performance_mode() == AudioPerformanceMode::LowLatency,
            interface: DeviceInterface::AAudio,
        };
        Ok(())
    }
}

fn open_error(error: AudioError) -> Error {
    let advice = "close other apps that use sound, or try again";
    Error::engine(format!("no sound device: {error}"), advice)
}

impl OpenDevice for Open {
    fn grant(&self) -> DeviceGrant {
        self.grant
    }

    fn xruns(&mut self) -> u32 {
        let stream = self.stream.as_ref();
        stream.map_or(0, |stream| stream.x_run_count().max(0).unsigned_abs())
    }
}

impl Drop for Open {
    fn drop(&mut self) {
        let Some(stream) = self.stream.take() else {
            return;
        };
        // Fails after a disconnection, where nothing is left to stop.
        let _ = stream.request_stop();
        let began = now();
        // An unpark ends one wait early.
        while began.elapsed() < CLOSE_DELAY {
            thread::park_timeout(CLOSE_DELAY);
        }
        // `ndk` panics if the close fails; the supervisor goes on and opens the next device.
        drop(catch_unwind(AssertUnwindSafe(|| drop(stream))));
    }
}
