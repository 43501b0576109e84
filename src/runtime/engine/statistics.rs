//! Statistics of the engine: written by every thread, read by the app.
//!
//! Wait-free for writers: relaxed atomics without order between values. A reader sees a recent value of each.

use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, AtomicU64, Ordering};

use super::histogram::{Histogram, Percentiles};
use crate::runtime::budget::QualityLevel;
use crate::runtime::handover::shared_value::SharedValue;
use crate::runtime::phone::{DeviceHintsReport, SoundLoad};
use crate::runtime::threads::affinity::Placement;

/// Counters and times of all threads.
#[derive(Default)]
pub(super) struct Metrics {
    pub(super) propagation: Histogram,
    pub(super) direct: Histogram,
    pub(super) extrapolation: Histogram,
    pub(super) generation: Histogram,
    pub(super) block: Histogram,
    pub(super) blocks: AtomicU64,
    /// The graphics frame applied last, and audio frames mixed so far.
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
    /// Load of the sound thread in thousandths of a core.
    pub(super) sound_millicores: AtomicU32,
    pub(super) unheard_sources: AtomicU32,
    pub(super) rays: AtomicU64,
    pub(super) propagation_ns: AtomicU64,
    pub(super) frame_ns: AtomicU64,
    pub(super) propagation_failed: AtomicBool,
    pub(super) propagation_placement: AtomicPlacement,
    pub(super) sound_placement: AtomicPlacement,
    /// Kernel thread id of the sound thread, once placed.
    pub(super) sound_thread: AtomicI32,
    /// Longest rendering time of a block since the last report, and the duration of a block.
    pub(super) block_peak_ns: AtomicU64,
    pub(super) block_lasts_ns: AtomicU64,
    pub(super) device_hints: SharedValue<DeviceHintsReport>,
}

/// A [`Placement`], stored by its thread and read by the app.
#[derive(Default)]
pub(super) struct AtomicPlacement {
    cores: AtomicU64,
    pinned: AtomicBool,
    realtime_priority: AtomicI32,
    nice: AtomicI32,
}

impl AtomicPlacement {
    pub(super) fn store(&self, placement: Placement) {
        self.cores.store(placement.cores, Ordering::Relaxed);
        self.pinned.store(placement.pinned, Ordering::Relaxed);
        self.realtime_priority
            .store(placement.realtime_priority, Ordering::Relaxed);
        self.nice.store(placement.nice, Ordering::Relaxed);
    }

    fn load(&self) -> Placement {
        Placement {
            cores: self.cores.load(Ordering::Relaxed),
            pinned: self.pinned.load(Ordering::Relaxed),
            realtime_priority: self.realtime_priority.load(Ordering::Relaxed),
            nice: self.nice.load(Ordering::Relaxed),
        }
    }
}

/// Statistics of an engine since it was made.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Statistics {
    /// Time of propagation updates.
    pub propagation: Percentiles,
    /// Time of the direct paths per graphics frame.
    pub direct: Percentiles,
    /// Time of extrapolation per graphics frame, without direct paths.
    pub extrapolation: Percentiles,
    /// Time of generation per block.
    pub generation: Percentiles,
    /// Time of whole calls of [`super::Renderer::render`].
    pub block: Percentiles,
    /// Calls of [`super::Renderer::render`].
    pub blocks: u64,
    /// Calls that took longer than the duration of the rendered sound.
    pub missed_deadlines: u64,
    /// Updates used by the renderer.
    pub updates: u64,
    /// Paths in the update in use.
    pub paths: u32,
    /// Paths dropped beyond [`super::EngineSettings::max_paths`], over all updates.
    pub trimmed_paths: u64,
    /// Paths dropped for lack of a voice, over all graphics frames.
    pub dropped_paths: u64,
    /// Samples missing in streams.
    pub underrun_samples: u64,
    /// T_SPS: time of the newest update, in seconds.
    pub propagation_s: f64,
    /// T_g: time between rendered graphics frames, in seconds.
    pub graphics_frame_s: f64,
    /// Extrapolation level L, by Eq. 1 from those two. At 0 an update fits in a frame and extrapolation is bypassed.
    pub extrapolation_level: u32,
    /// Quality level in force, or the target of the transition under way.
    pub quality_level: QualityLevel,
    /// Recent load of the sound thread as a fraction of a core.
    pub sound_share: f64,
    /// Sources without a slot in the newest tick, as nothing of them would be heard: they play nothing, are below −100 dB re full
    /// scale, or are masked, with less than a millionth (−60 dB) of the energy of all sources at the listener. 0 while there are as
    /// many slots as sources.
    pub unheard_sources: u32,
    /// Rays of the newest update.
    pub rays: u64,
    /// Core and priority of the propagation thread.
    pub propagation_placement: Placement,
    /// Core and priority of the sound thread, once placed.
    pub sound_placement: Placement,
    /// Thermal state of a phone, and whether performance hints are in use.
    pub device_hints: DeviceHintsReport,
}

impl Metrics {
    /// Recent load of the sound thread as a fraction of a core.
    pub(super) fn sound_share(&self) -> f64 {
        f64::from(self.sound_millicores.load(Ordering::Relaxed)) * 1e-3
    }

    /// Load of the sound thread since the last call.
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
            unheard_sources: self.unheard_sources.load(Ordering::Relaxed),
            rays: count(&self.rays),
            propagation_placement: self.propagation_placement.load(),
            sound_placement: self.sound_placement.load(),
            device_hints: self.device_hints.load(),
        }
    }
}

/// Adds to a counter.
pub(super) fn add(counter: &AtomicU64, amount: u64) {
    counter.fetch_add(amount, Ordering::Relaxed);
}
