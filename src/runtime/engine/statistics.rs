//! What the engine tells about itself: filled by every thread, read by the app.
//!
//! Wait-free for the threads that fill it: atomic operations without order between figures. A reader sees each
//! figure as of some recent moment.

use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, AtomicU64, Ordering};

use super::histogram::{Histogram, Percentiles};
use crate::runtime::budget::QualityLevel;
use crate::runtime::handover::seqlock::Seqlock;
use crate::runtime::phone::{DeviceHintsReport, SoundLoad};
use crate::runtime::threads::affinity::Placement;

/// Counters and times that the engine's threads share.
#[derive(Default)]
pub(super) struct Metrics {
    pub(super) propagation: Histogram,
    pub(super) direct: Histogram,
    pub(super) extrapolation: Histogram,
    pub(super) generation: Histogram,
    pub(super) block: Histogram,
    pub(super) blocks: AtomicU64,
    /// The app's newest graphics frame in use, and audio frames mixed so far.
    pub(super) applied_tick: AtomicU64,
    pub(super) mixed_frames: AtomicU64,
    pub(super) missed: AtomicU64,
    pub(super) updates: AtomicU64,
    pub(super) trimmed_paths: AtomicU64,
    pub(super) dropped_paths: AtomicU64,
    pub(super) underrun_samples: AtomicU64,
    pub(super) paths: AtomicU32,
    pub(super) extrapolation_level: AtomicU32,
    pub(super) quality_level: AtomicU32,
    /// Thousandths of a core that sound takes.
    pub(super) sound_millicores: AtomicU32,
    pub(super) masked_sources: AtomicU32,
    pub(super) rays: AtomicU64,
    pub(super) propagation_ns: AtomicU64,
    pub(super) frame_ns: AtomicU64,
    pub(super) propagation_failed: AtomicBool,
    pub(super) propagation_placement: Seqlock<Placement, 3>,
    pub(super) sound_placement: Seqlock<Placement, 3>,
    /// Kernel's number of the sound thread, once it has placed itself.
    pub(super) sound_thread: AtomicI32,
    /// The longest block since propagation has looked, and what it lasts.
    pub(super) block_peak_ns: AtomicU64,
    pub(super) block_lasts_ns: AtomicU64,
    pub(super) device_hints: Seqlock<DeviceHintsReport, 3>,
}

/// A look at the engine. Counts are since it began.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Statistics {
    /// Time of propagation updates.
    pub propagation: Percentiles,
    /// Time of the direct paths a graphics frame: a ray a source, and more where walls let sound through.
    pub direct: Percentiles,
    /// Time of extrapolation a graphics frame, without direct paths.
    pub extrapolation: Percentiles,
    /// Time of generation a block.
    pub generation: Percentiles,
    /// Time of whole calls of [`super::Renderer::render`].
    pub block: Percentiles,
    /// Calls of [`super::Renderer::render`].
    pub blocks: u64,
    /// Calls that took longer than what they rendered lasts.
    pub missed_deadlines: u64,
    /// Updates that the renderer has taken.
    pub updates: u64,
    /// Paths in the update in use.
    pub paths: u32,
    /// Paths that propagation left out beyond [`super::EngineSettings::max_paths`], the quietest, over all updates.
    pub trimmed_paths: u64,
    /// Paths that generation had no voice for, over all graphics frames.
    pub dropped_paths: u64,
    /// Samples that streams were late with.
    pub underrun_samples: u64,
    /// T_SPS: time of the newest update, in seconds.
    pub propagation_s: f64,
    /// T_g: time between the graphics frames that are heard, in seconds.
    pub graphics_frame_s: f64,
    /// Extrapolation level L in use, by Eq. 1 from those two. At 0 updates fit in a frame and extrapolation is bypassed.
    pub extrapolation_level: u32,
    /// The budget's tier in force, or on its way to be.
    pub quality_level: QualityLevel,
    /// Share of a core that sound takes, lately.
    pub sound_share: f64,
    /// Sources that others mask, of the newest tick; always 0 while every source has a slot.
    pub masked_sources: u32,
    /// Rays of the newest update.
    pub rays: u64,
    /// Where the propagation thread runs.
    pub propagation_placement: Placement,
    /// Where the sound thread runs, once it has placed itself.
    pub sound_placement: Placement,
    /// What a phone's system says of its heat, and whether it hears our hints.
    pub device_hints: DeviceHintsReport,
}

impl Metrics {
    /// Share of a core that sound takes, lately.
    pub(super) fn sound_share(&self) -> f64 {
        f64::from(self.sound_millicores.load(Ordering::Relaxed)) * 1e-3
    }

    /// How sound has gone since this was asked last.
    pub(super) fn take_sound_load(&self) -> SoundLoad {
        SoundLoad {
            thread: self.sound_thread.load(Ordering::Relaxed),
            block_s: self.block_peak_ns.swap(0, Ordering::Relaxed) as f64 * 1e-9,
            duration_s: self.block_lasts_ns.load(Ordering::Relaxed) as f64 * 1e-9,
        }
    }

    pub(super) fn read(&self) -> Statistics {
        let count = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Statistics {
            propagation: self.propagation.percentiles(),
            direct: self.direct.percentiles(),
            extrapolation: self.extrapolation.percentiles(),
            generation: self.generation.percentiles(),
            block: self.block.percentiles(),
            blocks: count(&self.blocks),
            missed_deadlines: count(&self.missed),
            updates: count(&self.updates),
            paths: self.paths.load(Ordering::Relaxed),
            trimmed_paths: count(&self.trimmed_paths),
            dropped_paths: count(&self.dropped_paths),
            underrun_samples: count(&self.underrun_samples),
            propagation_s: count(&self.propagation_ns) as f64 * 1e-9,
            graphics_frame_s: count(&self.frame_ns) as f64 * 1e-9,
            extrapolation_level: self.extrapolation_level.load(Ordering::Relaxed),
            quality_level: QualityLevel(self.quality_level.load(Ordering::Relaxed) as u8),
            sound_share: self.sound_share(),
            masked_sources: self.masked_sources.load(Ordering::Relaxed),
            rays: count(&self.rays),
            propagation_placement: self.propagation_placement.load(),
            sound_placement: self.sound_placement.load(),
            device_hints: self.device_hints.load(),
        }
    }
}

/// Adds to a counter; order does not matter.
pub(super) fn add(counter: &AtomicU64, amount: u64) {
    counter.fetch_add(amount, Ordering::Relaxed);
}
