//! A graphics frame in the renderer: taken, extrapolated in parts, committed to generation.
//!
//! Audio side. [`crate::runtime::engine::block_pacing`] decides how much of it a block does.

use std::sync::atomic::Ordering;
use std::time::Duration;

use super::{ListenerFrame, RenderReport, Renderer, RendererParts};
use crate::extrapolation::work_budget::{WorkBudget, cost};
use crate::extrapolation::{Extrapolator, PredictorState, ScenePair, extrapolation_level};
use crate::propagation::MAX_ORDER;
use crate::runtime::engine::block_pacing::ramp_frames;
use crate::runtime::engine::messages::{ListenerUpdate, UpdateMessage};
use crate::runtime::engine::settings::FrameTime;
use crate::runtime::engine::statistics::add;
use crate::runtime::threads::clock::now;
use crate::runtime::trace::SpanKind;

/// Longest ramp in seconds.
const MAX_RAMP_S: f64 = 0.1;

/// Voices that may start in a block without a free budget.
const MIN_STARTS: usize = 64;

/// Greatest change of a reflection order's gain per second.
const ORDER_FADE_PER_S: f64 = 4.0;

impl Renderer {
    /// Processes one block's part of the frame in progress; starts the newest frame and update if there is none.
    pub(super) fn advance_frame(&mut self, block_frames: usize, report: &mut RenderReport) {
        if !self.frame_in_progress {
            self.take_frame(report);
        }
        let waiting: usize = self.frames.iter().map(|own| own.waiting_voices).sum();
        if !self.frame_in_progress && waiting == 0 {
            return;
        }
        let block = self.parts.settings.block_frames as f64;
        let share = block_frames as f64 / block;
        // All waiting voices may start in this block.
        let voices = self.voices.saturating_add(waiting as u32);
        let mut work = self.pacing.work_budget(share, voices);
        self.start_voices(&mut work);
        if !self.frame_in_progress {
            return;
        }
        self.extrapolate_all(&mut work);
        let was_prepared = self.frames.iter().all(ListenerFrame::is_prepared);
        // Generation holds the paths of one frame at a time. Fades may last as long as a frame: one that waited for their voices would
        // be late, and has the waiting paths too.
        let must_prepare = self.pacing.must_prepare();
        let may_wait =
            |own: &ListenerFrame| own.waiting_voices > 0 && !(own.wait_for_fades && must_prepare);
        let is_blocked = !self.is_silent() && self.frames.iter().any(may_wait);
        if !is_blocked {
            self.prepare_all(&mut work);
        }
        // The commit is indivisible and expensive; beyond the budget it gets the next block.
        let paths: usize = self.frames.iter().map(|own| own.paths.paths.len()).sum();
        let taken = cost::TAKEN * paths;
        let is_prepared = self.frames.iter().all(ListenerFrame::is_prepared) && !is_blocked;
        let is_due = self.pacing.may_commit();
        if is_due && is_prepared && (was_prepared || taken <= work.left() as usize) {
            work.spend(taken);
            self.commit_frame(block_frames);
            self.start_voices(&mut work);
            self.frame_in_progress = false;
        }
        self.pacing.count(&work);
        if !self.frame_in_progress {
            self.pacing.end();
        }
    }

    /// Extrapolates the paths of each listener in turn, within the budget.
    fn extrapolate_all(&mut self, work: &mut WorkBudget) {
        for index in 0..self.frames.len() {
            if self.frames[index].is_extrapolated {
                continue;
            }
            if !self.extrapolate(index, work) {
                return;
            }
            if index == 0 {
                self.advance_order_gain(self.frame_s);
            }
            self.apply_order_gain(index);
            let own = &mut self.frames[index];
            (own.is_extrapolated, own.prepared) = (true, 0);
        }
    }

    /// Prepares the extrapolated paths of each listener for generation, within the budget.
    fn prepare_all(&mut self, work: &mut WorkBudget) {
        let generator = &mut self.parts.generator;
        for (index, own) in self.frames.iter_mut().enumerate() {
            if !own.is_extrapolated || own.is_prepared() {
                continue;
            }
            // Preparation discards the voices that still wait.
            own.waiting_voices = 0;
            let count = work.left() as usize / cost::PREPARED;
            let count = count.min(own.paths.paths.len() - own.prepared);
            generator.prepare_frame_of(index, &own.paths, count);
            own.prepared += count;
            work.spend(cost::PREPARED * count);
        }
    }

    fn take_frame(&mut self, report: &mut RenderReport) {
        let Some(frame) = self.parts.frames.take() else {
            return;
        };
        let old = std::mem::replace(&mut self.parts.frame, frame);
        let passed = self.parts.frame.ticks.saturating_sub(old.ticks).max(1);
        self.parts.frames.give_back(old);
        let frame = &self.parts.frame;
        if !frame.is_new {
            self.apply_routes();
            return;
        }
        report.graphics_frames += 1;
        let frame_s = self.clock.take(now(), frame.ticks);
        let (frame_ns, metrics) = ((frame_s * 1e9) as u64, &self.parts.metrics);
        metrics.frame_ns.store(frame_ns, Ordering::Relaxed);
        self.store_update(frame_s, report);
        self.take_output();
        self.frame_s = frame_s;
        self.pacing.begin(self.clock.tick_s());
        let frame = &self.parts.frame;
        for own in &mut self.frames {
            let extrapolator = &mut own.extrapolator;
            extrapolator.set_instance_poses(&frame.instances);
            extrapolator.record_sources(&frame.sources, self.clock.tick_s() * passed as f64);
            extrapolator.set_effort(self.pacing.effort());
            own.is_extrapolated = false;
        }
        self.frame_in_progress = true;
        self.elapsed = [Duration::ZERO; 2];
    }

    /// Extrapolates a listener's direct paths, then all others, within the budget; returns whether its frame is complete.
    fn extrapolate(&mut self, index: usize, work: &mut WorkBudget) -> bool {
        let RendererParts {
            frame,
            metrics,
            spans,
            ..
        } = &mut self.parts;
        let ListenerFrame {
            extrapolator,
            paths: frame_paths,
            ..
        } = &mut self.frames[index];
        let other = index
            .checked_sub(1)
            .and_then(|other| frame.others.get(other));
        let (listener, sources) = (*other.unwrap_or(&frame.listener), &frame.sources);
        let [took_direct, took_others] = &mut self.elapsed;
        let began = now();
        let part = extrapolator.direct_part(&listener, sources, work, frame_paths);
        let elapsed = began.elapsed();
        *took_direct += elapsed;
        spans.record(SpanKind::Direct, began, elapsed, part.rays);
        if !part.is_done {
            return false;
        }
        let began = now();
        let part = extrapolator.other_part(&listener, sources, work, frame_paths);
        let elapsed = began.elapsed();
        *took_others += elapsed;
        let paths = frame_paths.paths.len() as u64;
        spans.record(SpanKind::Extrapolation, began, elapsed, paths);
        if part.is_done {
            metrics.direct.record(*took_direct);
            metrics.extrapolation.record(*took_others);
        }
        part.is_done
    }

    /// Applies the frame's routes of all sources and publishes its number.
    fn apply_routes(&mut self) {
        let frame = &self.parts.frame;
        self.mixer.set_routes(&frame.routes);
        let applied = &self.parts.metrics.applied_tick;
        applied.store(frame.ticks, Ordering::Release);
    }

    /// Commits an extrapolated frame to generation.
    fn commit_frame(&mut self, block_frames: usize) {
        // Routes change together with the paths.
        self.apply_routes();
        let RendererParts { frame, numbers, .. } = &mut self.parts;
        numbers.send(frame.ticks, &self.frames[0].paths, &frame.routes);
        let settings = &self.parts.settings;
        let rate_hz = settings.generation.rate_hz;
        let ramp = match settings.frame_time {
            FrameTime::Measured => ramp_frames(self.frame_s, rate_hz, settings.block_frames),
            // Without a device, the ramp is exactly as long as the frame.
            FrameTime::Fixed(frame_s) => (frame_s * f64::from(rate_hz)).round() as u32,
        };
        // A block longer than a graphics frame is one ramp.
        let longest = (MAX_RAMP_S * f64::from(rate_hz)) as u32;
        let ramp_frames = ramp.max(block_frames as u32).min(longest);
        let generator = &mut self.parts.generator;
        for (index, own) in self.frames.iter_mut().enumerate() {
            own.waiting_voices = match self.pacing.is_even() {
                true => generator.take_prepared_frame_of(index, &own.paths, ramp_frames),
                false => {
                    generator.set_prepared_frame_of(index, &own.paths, ramp_frames);
                    0
                }
            };
        }
    }

    /// Whether voices of the last frame have to start before the next frame is committed. Not in a pause, where the
    /// fades they depend on are suspended; the next frame has their paths too.
    fn has_waiting_voices(&self) -> bool {
        self.frames.iter().any(|own| own.waiting_voices > 0) && !self.is_silent()
    }

    /// Starts waiting voices of the last committed frame.
    fn start_voices(&mut self, work: &mut WorkBudget) {
        if !self.has_waiting_voices() {
            return;
        }
        let generator = &mut self.parts.generator;
        for (index, own) in self.frames.iter_mut().enumerate() {
            if own.waiting_voices == 0 {
                continue;
            }
            let count = (work.left() as usize / cost::STARTED).max(MIN_STARTS);
            let left = generator.start_voices_of(index, count);
            let started = own.waiting_voices - left;
            work.spend(cost::STARTED * started);
            (own.waiting_voices, own.wait_for_fades) = (left, left > 0 && started < count);
        }
    }

    /// Moves the gains of reflection orders towards their targets.
    fn advance_order_gain(&mut self, frame_s: f64) {
        let step = (ORDER_FADE_PER_S * frame_s) as f32;
        for (gain, target) in self.order_gain.iter_mut().zip(&self.target_order_gain) {
            *gain += (target - *gain).clamp(-step, step);
        }
    }

    /// Applies the gains of reflection orders to a listener's paths.
    fn apply_order_gain(&mut self, index: usize) {
        if self.order_gain == [1.0; MAX_ORDER + 1] {
            return;
        }
        for path in &mut self.frames[index].paths.paths {
            let gain = self.order_gain.get(usize::from(path.order));
            let gain = gain.copied().unwrap_or(1.0);
            path.amplitude = path.amplitude.map(|amplitude| gain * amplitude);
        }
    }

    fn store_update(&mut self, frame_s: f64, report: &mut RenderReport) {
        let Some(mut message) = self.parts.updates.take() else {
            return;
        };
        let level = if message.synchronous {
            0
        } else {
            extrapolation_level(message.interval_s, frame_s)
        };
        self.target_order_gain = message.order_gain;
        for line in &mut message.lines {
            self.parts.generator.lengthen_line(line);
        }
        let paths = std::mem::take(&mut message.paths);
        let metrics = &self.parts.metrics;
        metrics.extrapolation_level.store(level, Ordering::Relaxed);
        metrics
            .paths
            .store(paths.paths.len() as u32, Ordering::Relaxed);
        add(&metrics.updates, 1);
        report.updates += 1;
        let Some((first, others)) = self.frames.split_first_mut() else {
            return;
        };
        let UpdateMessage {
            prepared,
            extrapolator,
            scenes,
            predictor,
            ..
        } = &mut *message;
        replace_parts(&mut first.extrapolator, extrapolator, scenes, predictor);
        let stored = first
            .extrapolator
            .store_prepared_update(paths, prepared, level);
        message.paths = stored;
        for (own, update) in others.iter_mut().zip(&mut message.others) {
            let ListenerUpdate {
                paths,
                prepared,
                extrapolator,
                scenes,
                predictor,
            } = update;
            replace_parts(&mut own.extrapolator, extrapolator, scenes, predictor);
            let taken = std::mem::take(paths);
            *paths = own
                .extrapolator
                .store_prepared_update(taken, prepared, level);
        }
        self.parts.updates.give_back(message);
    }
}

/// Takes over what an update brings besides paths; what was in use goes back in its place.
fn replace_parts(
    extrapolator: &mut Box<Extrapolator>,
    fresh: &mut Option<Box<Extrapolator>>,
    scenes: &mut Option<ScenePair>,
    predictor: &mut Option<PredictorState>,
) {
    if let Some(fresh) = fresh {
        std::mem::swap(extrapolator, fresh);
        extrapolator.take_motion(fresh);
    }
    if let Some(scenes) = scenes {
        extrapolator.swap_scene(scenes);
    }
    if let Some(state) = predictor.take() {
        *predictor = Some(extrapolator.set_predictor(state));
    }
}
