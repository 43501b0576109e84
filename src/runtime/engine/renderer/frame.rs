//! A graphics frame on its way through the renderer: taken, described by extrapolation in parts, handed to generation.
//!
//! Audio side, as all of [`Renderer`]; how much of it a block does is [`crate::runtime::engine::block_pacing`]'s to say.

use std::sync::atomic::Ordering;
use std::time::Duration;

use super::{RenderReport, Renderer, RendererParts};
use crate::extrapolation::extrapolation_level;
use crate::extrapolation::work_budget::{WorkBudget, cost};
use crate::propagation::MAX_ORDER;
use crate::runtime::engine::block_pacing::ramp_frames;
use crate::runtime::engine::settings::FrameTime;
use crate::runtime::engine::statistics::add;
use crate::runtime::threads::clock::now;
use crate::runtime::trace::SpanKind;

/// Longest ramp of a graphics frame, in seconds.
const MAX_RAMP_S: f64 = 0.1;

/// Voices that may start in any block.
const MIN_STARTS: usize = 64;

/// Most that an order's gain moves in a second, under the budget.
const ORDER_FADE_PER_S: f64 = 4.0;

impl Renderer {
    /// Takes the newest graphics frame, and with it the newest update, unless one is under way; and goes on with it.
    pub(super) fn advance_frame(&mut self, block_frames: usize, report: &mut RenderReport) {
        if !self.frame_in_progress {
            self.take_frame(report);
        }
        if !self.frame_in_progress && self.waiting_voices == 0 {
            return;
        }
        let block = self.parts.settings.block_frames as f64;
        let share = block_frames as f64 / block;
        // Those that wait may all start in this block.
        let voices = self.voices.saturating_add(self.waiting_voices as u32);
        let mut effort = self.pacing.work_budget(share, voices);
        self.start_voices(&mut effort);
        if !self.frame_in_progress {
            return;
        }
        if !self.is_extrapolated {
            self.is_extrapolated = self.extrapolate(&mut effort);
            if self.is_extrapolated {
                self.apply_order_gain(self.frame_s);
                self.prepared = 0;
            }
        }
        let paths = self.frame_paths.paths.len();
        let was_prepared = self.is_extrapolated && self.prepared == paths;
        // Generation knows one frame's paths at a time.
        let is_held_up = self.has_waiting_voices();
        if self.is_extrapolated && !was_prepared && !is_held_up {
            let most = effort.left() as usize / cost::PREPARED;
            let most = most.min(paths - self.prepared);
            self.parts.generator.prepare_frame(&self.frame_paths, most);
            self.prepared += most;
            effort.spend(cost::PREPARED * most);
        }
        // What generation takes over at once is much: it may have a block to itself.
        let taken = cost::TAKEN * paths;
        let is_prepared = self.is_extrapolated && self.prepared == paths && !is_held_up;
        if is_prepared && (was_prepared || taken <= effort.left() as usize) {
            effort.spend(taken);
            self.commit_frame(block_frames);
            self.start_voices(&mut effort);
            self.frame_in_progress = false;
        }
        self.pacing.count(&effort);
        if !self.frame_in_progress {
            self.pacing.end();
        }
    }

    fn take_frame(&mut self, report: &mut RenderReport) {
        let Some(frame) = self.parts.frames.take() else {
            return;
        };
        let old = std::mem::replace(&mut self.parts.frame, frame);
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
        let RendererParts {
            frame,
            extrapolator,
            ..
        } = &mut self.parts;
        extrapolator.set_instance_poses(&frame.instances);
        self.frame_s = frame_s;
        self.pacing.begin(self.clock.tick_s());
        (self.frame_in_progress, self.is_extrapolated) = (true, false);
        self.elapsed = [Duration::ZERO; 2];
    }

    /// Direct paths, then everything else, until the effort is spent; gives whether the frame is described.
    fn extrapolate(&mut self, effort: &mut WorkBudget) -> bool {
        let RendererParts {
            frame,
            extrapolator,
            metrics,
            spans,
            ..
        } = &mut self.parts;
        let (listener, sources) = (frame.listener, &frame.sources);
        let [took_direct, took_others] = &mut self.elapsed;
        let began = now();
        let part = extrapolator.direct_part(&listener, sources, effort, &mut self.frame_paths);
        let spent = began.elapsed();
        *took_direct += spent;
        spans.record(SpanKind::Direct, began, spent, part.rays);
        if !part.is_done {
            return false;
        }
        let began = now();
        let part = extrapolator.other_part(&listener, sources, effort, &mut self.frame_paths);
        let spent = began.elapsed();
        *took_others += spent;
        let paths = self.frame_paths.paths.len() as u64;
        spans.record(SpanKind::Extrapolation, began, spent, paths);
        if part.is_done {
            metrics.direct.record(*took_direct);
            metrics.extrapolation.record(*took_others);
        }
        part.is_done
    }

    /// Every sound to where the frame has it, and tells so.
    fn apply_routes(&mut self) {
        let frame = &self.parts.frame;
        self.mixer.set_routes(&frame.routes);
        let applied = &self.parts.metrics.applied_tick;
        applied.store(frame.ticks, Ordering::Release);
    }

    /// Gives a described frame to generation.
    fn commit_frame(&mut self, block_frames: usize) {
        // Sounds come and go with their sources' paths.
        self.apply_routes();
        let settings = &self.parts.settings;
        let rate_hz = settings.generation.rate_hz;
        let ramp = match settings.frame_time {
            FrameTime::Measured => ramp_frames(self.frame_s, rate_hz, settings.block_frames),
            // What is rendered apart from a device is as long as the frame says.
            FrameTime::Fixed(frame_s) => (frame_s * f64::from(rate_hz)).round() as u32,
        };
        // A block that lasts longer than a graphics frame is ramped as a whole.
        let longest = (MAX_RAMP_S * f64::from(rate_hz)) as u32;
        let ramp_frames = ramp.max(block_frames as u32).min(longest);
        let generator = &mut self.parts.generator;
        if !self.pacing.is_even() {
            generator.set_prepared_frame(&self.frame_paths, ramp_frames);
            return;
        }
        self.waiting_voices = generator.take_prepared_frame(&self.frame_paths, ramp_frames);
    }

    /// Whether voices of the last frame have to start before generation may be told of the next. In the silence of a pause
    /// no fade goes on that they wait for: the next frame has their paths, too, and may be the pause's end.
    fn has_waiting_voices(&self) -> bool {
        self.waiting_voices > 0 && !self.is_silent()
    }

    /// Starts voices of the last frame that was handed over, if some wait.
    fn start_voices(&mut self, effort: &mut WorkBudget) {
        if !self.has_waiting_voices() {
            return;
        }
        let most = (effort.left() as usize / cost::STARTED).max(MIN_STARTS);
        let generator = &mut self.parts.generator;
        let before = std::mem::replace(&mut self.waiting_voices, generator.start_voices(most));
        effort.spend(cost::STARTED * (before - self.waiting_voices));
    }

    /// Moves the gains of the orders towards what the budget wants, and applies them.
    fn apply_order_gain(&mut self, frame_s: f64) {
        let step = (ORDER_FADE_PER_S * frame_s) as f32;
        for (gain, wanted) in self.order_gain.iter_mut().zip(&self.target_order_gain) {
            *gain += (wanted - *gain).clamp(-step, step);
        }
        if self.order_gain == [1.0; MAX_ORDER + 1] {
            return;
        }
        for path in &mut self.frame_paths.paths {
            let gain = self.order_gain.get(usize::from(path.order));
            let gain = gain.copied().unwrap_or(1.0);
            path.amplitude = path.amplitude.map(|amplitude| gain * amplitude);
        }
    }

    fn store_update(&mut self, frame_s: f64, report: &mut RenderReport) {
        let Some(mut delivery) = self.parts.updates.take() else {
            return;
        };
        let extrapolator = &mut self.parts.extrapolator;
        if let Some(fresh) = &mut delivery.extrapolator {
            std::mem::swap(extrapolator, fresh);
        }
        if let Some(scenes) = &mut delivery.scenes {
            extrapolator.swap_scene(scenes);
        }
        if let Some(predictor) = delivery.predictor.take() {
            delivery.predictor = Some(extrapolator.set_predictor(predictor));
        }
        let level = if delivery.synchronous {
            0
        } else {
            extrapolation_level(delivery.interval_s, frame_s)
        };
        self.target_order_gain = delivery.order_gain;
        let paths = std::mem::take(&mut delivery.paths);
        let metrics = &self.parts.metrics;
        metrics.extrapolation_level.store(level, Ordering::Relaxed);
        metrics
            .paths
            .store(paths.paths.len() as u32, Ordering::Relaxed);
        add(&metrics.updates, 1);
        report.updates += 1;
        delivery.paths = extrapolator.store_prepared_update(paths, &mut delivery.prepared, level);
        self.parts.updates.give_back(delivery);
    }
}
