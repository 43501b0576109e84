//! Where the stages meet: schedules on a virtual clock, and the threads, clocks and atomics that drive them in real time.

pub mod affinity;
pub mod budget;
mod clock;
mod courses;
pub mod device;
pub mod device_output;
pub mod engine;
pub mod flush_to_zero;
mod handover;
mod lead;
pub mod null_device;
pub mod offline;
mod offline_instances;
pub mod phone;
mod published;
pub mod reopening;
pub mod schedule;
pub(crate) mod slot;
pub mod sound_thread;
mod system_trace;
pub mod trace;
pub mod workers;

pub use affinity::{AffinityPolicy, Placement};
pub use budget::{Budget, Tier, TierChoice};
pub use clock::thread_processor_time;
pub use device_output::{DeviceOutput, DeviceReport};
pub use engine::{
    Controller, Engine, EngineSchedule, EngineSettings, EngineState, FrameTime, RenderReport,
    Renderer, Statistics, StreamWriter,
};
pub use null_device::{NullDevice, NullDeviceReport, NullOutput};
pub use offline::{OfflineRenderer, OfflineReport, OfflineSettings};
pub use schedule::{Latency, Poses, Schedule};
pub use sound_thread::{RingOutput, SoundThread};
pub use trace::TraceLog;
pub use workers::{MOST_THREADS, Threads};
