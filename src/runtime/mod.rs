//! The engine in real time (threads, clocks, atomics, devices), and offline rendering on a virtual clock.

pub mod budget;
pub mod device;
pub mod engine;
pub mod handover;
pub mod offline;
pub mod phone;
pub(crate) mod pipeline;
pub mod threads;
pub mod trace;

pub use crate::runtime::device::null_device::{NullDevice, NullDeviceReport, NullOutput};
pub use crate::runtime::device::output::{DeviceOutput, DeviceReport, system_device};
pub use crate::runtime::device::sound_thread::{RingOutput, SoundThread};
pub use crate::runtime::offline::renderer::{OfflineRenderer, OfflineReport, OfflineSettings};
pub use crate::runtime::offline::schedule::{Latency, Poses, Schedule};
pub use crate::runtime::threads::affinity::{AffinityPolicy, Placement};
pub use crate::runtime::threads::clock::thread_processor_time;
pub use crate::runtime::threads::workers::{MAX_THREADS, Threads};
pub use budget::{Budget, QualityChoice, QualityLevel};
pub use engine::{
    BusStatus, Clip, Controller, Engine, EngineSchedule, EngineSettings, EngineState, FrameTime,
    PlaySettings, Playback, PlaybackState, RenderReport, Renderer, Statistics, StreamWriter,
    VirtualClock, VirtualEngine,
};
pub use trace::TraceLog;
