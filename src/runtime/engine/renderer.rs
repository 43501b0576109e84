//! The audio half of an engine.
//!
//! Audio side: one thread at a time, the device's or a [`crate::runtime::SoundThread`]. [`Renderer::render`] neither
//! allocates, frees, locks nor waits; it reads the clock, which is no system call where the system maps it. It is bounded
//! by the number of paths, sources and audio frames. Dropping a renderer frees, so do that elsewhere.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::feed::Feed;
use super::messages::{AudioFrame, Delivery, FeedChange};
use super::settings::EngineSettings;
use super::statistics::{Meters, add};
use crate::extrapolation::{
    Continuation, Extrapolator, FramePaths, LATE_STEPS, extrapolation_level,
};
use crate::generation::Generator;
use crate::runtime::affinity::{Placement, ThreadRole, place_this_thread};
use crate::runtime::clock::now;
use crate::runtime::flush_to_zero::FlushToZero;
use crate::runtime::handover::Receiver;
use crate::scene::SourceId;

/// Most sources that a generator has slots for.
const MOST_SOURCES: usize = 256;
/// Longest ramp of a graphics frame, in seconds.
const LONGEST_RAMP_S: f64 = 0.1;
/// Time in seconds of the fade into and out of a pause.
const PAUSE_FADE_S: f32 = 0.005;

/// What one call of [`Renderer::render`] did.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RenderReport {
    /// Audio frames written.
    pub frames: u32,
    /// Graphics frames taken.
    pub graphics_frames: u32,
    /// Propagation updates taken.
    pub updates: u32,
    /// Extrapolation level L in force at the end.
    pub level: u32,
    /// Voices that lived or faded at the end.
    pub voices: u32,
    /// Paths without a voice.
    pub dropped_paths: u32,
    /// Samples that streams were late with.
    pub starved_samples: u32,
    /// Whether it took longer than what it rendered lasts.
    pub missed_deadline: bool,
    /// Whether the controller was dropped.
    pub controller_gone: bool,
}

/// What a renderer is made of.
pub(super) struct Parts {
    pub(super) frames: Receiver<AudioFrame>,
    pub(super) deliveries: Receiver<Delivery>,
    pub(super) feeds: rtrb::Consumer<FeedChange>,
    pub(super) retired: rtrb::Producer<Feed>,
    /// The graphics frame in use.
    pub(super) frame: Box<AudioFrame>,
    pub(super) extrapolator: Box<Extrapolator>,
    pub(super) generator: Generator,
    pub(super) meters: Arc<Meters>,
    pub(super) settings: EngineSettings,
}

/// What the renderer knows of one source slot.
#[derive(Default)]
struct Slot {
    feed: Feed,
    /// Whose feed it is.
    owner: SourceId,
    /// Who has the slot in the graphics frame in use.
    tenant: SourceId,
    is_present: bool,
    gain: f32,
    target: f32,
}

/// The audio half. Moves to the thread that makes sound; not shared.
pub struct Renderer {
    parts: Parts,
    slots: Vec<Slot>,
    /// One block a slot.
    inputs: Vec<f32>,
    frame_paths: FramePaths,
    /// Gain of everything, on its way to 0 in a pause.
    master: f32,
}

impl Renderer {
    pub(super) fn new(parts: Parts) -> Self {
        let settings = &parts.settings;
        let sources = settings.generation.max_sources;
        let mut frame_paths = FramePaths::default();
        let paths = Continuation::most_paths(settings.max_paths) + sources;
        frame_paths.paths.reserve(paths);
        frame_paths.late.reserve(sources * LATE_STEPS);
        Self {
            slots: (0..sources).map(|_| Slot::default()).collect(),
            inputs: vec![0.0; sources * settings.block_frames],
            frame_paths,
            master: 1.0,
            parts,
        }
    }

    /// Sample rate in Hz.
    pub fn rate_hz(&self) -> u32 {
        self.parts.settings.generation.rate_hz
    }

    /// Audio frames of a block.
    pub fn block_frames(&self) -> usize {
        self.parts.settings.block_frames
    }

    /// Audio frames by which sound is late against the geometry when the device calls directly (the limiter's
    /// look-ahead and interpolation), without the device's own buffer.
    pub fn latency_frames(&self) -> usize {
        self.parts.generator.latency_frames()
    }

    /// Places the calling thread by the engine's policy: core and priority. For a device's thread, once, before its first
    /// block; makes system calls.
    pub fn place_thread(&mut self) -> Placement {
        let placement = place_this_thread(self.parts.settings.affinity, ThreadRole::Sound);
        self.parts.meters.sound_placement.store(placement);
        placement
    }

    /// Renders interleaved stereo over `output`, of any length; blocks of [`Self::block_frames`] fit best.
    pub fn render(&mut self, output: &mut [f32]) -> RenderReport {
        let _flush = FlushToZero::begin();
        let started = now();
        let mut report = RenderReport::default();
        self.take_feeds();
        let block = 2 * self.parts.settings.block_frames;
        for chunk in output.chunks_mut(block) {
            self.take_frame(chunk.len() / 2, &mut report);
            self.render_block(chunk, &mut report);
        }
        let spent = started.elapsed();
        let meters = &self.parts.meters;
        let lasts_s = f64::from(report.frames) / f64::from(self.rate_hz());
        report.missed_deadline = spent.as_secs_f64() > lasts_s;
        report.level = meters.level.load(Ordering::Relaxed);
        report.controller_gone = self.parts.frames.is_abandoned();
        meters.block.record(spent);
        add(&meters.blocks, 1);
        add(&meters.missed, u64::from(report.missed_deadline));
        add(&meters.dropped_paths, u64::from(report.dropped_paths));
        add(&meters.starved_samples, u64::from(report.starved_samples));
        report
    }

    /// Takes new sounds as long as there is a place for the old ones to go.
    fn take_feeds(&mut self) {
        while !self.parts.retired.is_full() {
            let Ok(FeedChange { id, feed }) = self.parts.feeds.pop() else {
                return;
            };
            let mut old = feed;
            if let Some(slot) = self.slots.get_mut(id.slot()) {
                std::mem::swap(&mut slot.feed, &mut old);
                slot.owner = id;
            }
            // There is a place: this side alone fills it.
            if let Err(rtrb::PushError::Full(old)) = self.parts.retired.push(old) {
                std::mem::forget(old);
            }
        }
    }

    /// Takes the newest graphics frame, and with it the newest update.
    fn take_frame(&mut self, block_frames: usize, report: &mut RenderReport) {
        let Some(frame) = self.parts.frames.take() else {
            return;
        };
        let old = std::mem::replace(&mut self.parts.frame, frame);
        self.parts.frames.give_back(old);
        for slot in &mut self.slots {
            slot.is_present = false;
        }
        let frame = &self.parts.frame;
        for (pose, &gain) in frame.sources.iter().zip(&frame.gains) {
            if let Some(slot) = self.slots.get_mut(pose.id.slot()) {
                if slot.tenant != pose.id {
                    // Another source begins at its own gain.
                    slot.gain = gain;
                }
                slot.tenant = pose.id;
                slot.is_present = true;
                slot.target = gain;
            }
        }
        if !frame.is_new {
            return;
        }
        report.graphics_frames += 1;
        // Frames that no block hears are not graphics frames to extrapolation.
        let rate_hz = f64::from(self.parts.settings.generation.rate_hz);
        let frame_s = frame.frame_s.max(block_frames as f64 / rate_hz);
        let (frame_ns, meters) = ((frame_s * 1e9) as u64, &self.parts.meters);
        meters.frame_ns.store(frame_ns, Ordering::Relaxed);
        self.take_update(frame_s, report);
        let started = now();
        let (listener, sources) = (self.parts.frame.listener, &self.parts.frame.sources);
        self.parts
            .extrapolator
            .frame(&listener, sources, &mut self.frame_paths);
        self.parts.meters.extrapolation.record(started.elapsed());
        let ramp_frames = (frame_s.min(LONGEST_RAMP_S) * rate_hz).round() as u32;
        self.parts
            .generator
            .set_frame(&self.frame_paths, ramp_frames);
    }

    fn take_update(&mut self, frame_s: f64, report: &mut RenderReport) {
        let Some(mut delivery) = self.parts.deliveries.take() else {
            return;
        };
        let extrapolator = &mut self.parts.extrapolator;
        if let Some(fresh) = &mut delivery.extrapolator {
            std::mem::swap(extrapolator, fresh);
        }
        if let Some(predictor) = delivery.predictor.take() {
            delivery.predictor = Some(extrapolator.set_predictor(predictor));
        }
        let level = if delivery.synchronous {
            0
        } else {
            extrapolation_level(delivery.propagation_s, frame_s)
        };
        let paths = std::mem::take(&mut delivery.paths);
        let meters = &self.parts.meters;
        meters.level.store(level, Ordering::Relaxed);
        meters
            .paths
            .store(paths.paths.len() as u32, Ordering::Relaxed);
        add(&meters.updates, 1);
        report.updates += 1;
        delivery.paths = extrapolator.take_update(paths, level);
        self.parts.deliveries.give_back(delivery);
    }

    fn render_block(&mut self, output: &mut [f32], report: &mut RenderReport) {
        let frames = output.len() / 2;
        report.frames += frames as u32;
        let paused = self.parts.frame.paused;
        if paused && self.master == 0.0 {
            output.fill(0.0);
            return;
        }
        let started = now();
        let block = self.parts.settings.block_frames;
        let mut inputs: [&[f32]; MOST_SOURCES] = [&[]; MOST_SOURCES];
        let places = self.slots.iter_mut().zip(self.inputs.chunks_mut(block));
        for ((slot, place), input) in places.zip(&mut inputs) {
            let sounds = slot.is_present && slot.owner == slot.tenant;
            if !sounds || matches!(slot.feed, Feed::Silence) {
                continue;
            }
            let place = &mut place[..frames];
            report.starved_samples += slot.feed.fill(place);
            ramp(place, slot.gain, slot.target);
            slot.gain = slot.target;
            *input = place;
        }
        let inputs = &inputs[..self.slots.len()];
        let made = self.parts.generator.render(inputs, output);
        report.voices = made.voices;
        report.dropped_paths += made.dropped_paths + made.dropped_delays;
        self.fade_master(output, if paused { 0.0 } else { 1.0 });
        self.parts.meters.generation.record(started.elapsed());
    }

    fn fade_master(&mut self, output: &mut [f32], target: f32) {
        if self.master == target {
            return;
        }
        let step = 1.0 / (PAUSE_FADE_S * self.rate_hz() as f32);
        for pair in output.chunks_exact_mut(2) {
            self.master += (target - self.master).clamp(-step, step);
            pair[0] *= self.master;
            pair[1] *= self.master;
        }
    }
}

/// Multiplies by a gain that goes from one value to another.
fn ramp(block: &mut [f32], from: f32, to: f32) {
    if from == 1.0 && to == 1.0 {
        return;
    }
    let step = (to - from) / block.len() as f32;
    for (n, sample) in block.iter_mut().enumerate() {
        *sample *= from + step * (n + 1) as f32;
    }
}
