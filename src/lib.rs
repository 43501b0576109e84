//! Real-time ray-traced sound for phones.
//!
//! A game hands over a triangle mesh, sound sources and a listener. Foresound traces rays through the mesh, finds exact
//! paths (direct, reflected, diffracted, transmitted) and the energy of the late reverb, and renders both for two ears.
//! It needs two threads: one that propagates at its own pace, and the one that makes sound.
//!
//! # First sound
//!
//! ```
//! use std::sync::Arc;
//! use foresound::{Engine, EngineSettings, ListenerPose, MaterialTable, Scene, SceneSettings, TriangleMesh};
//!
//! # fn main() -> foresound::Result<()> {
//! // A floor of 10 m x 10 m: positions, three indices a triangle, a material name and its index for each triangle.
//! let corners = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 0.0, 10.0], [0.0, 0.0, 10.0]];
//! let mesh = TriangleMesh::from_slices(&corners, &[0, 2, 1, 0, 3, 2], &["concrete"], &[0, 0])?;
//! let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())?;
//!
//! let (mut controller, mut renderer) = Engine::new(EngineSettings::default())?;
//! controller.set_scene(Arc::new(scene))?;
//! let source = controller.add_source([2.0, 1.5, 3.0])?;
//! // A click every half second: mono samples at the engine's 44,100 Hz, looped.
//! let mut clip = vec![0.0; 22_050];
//! clip[..64].fill(0.5);
//! controller.play(source, clip.into(), true)?;
//!
//! // The app, once a graphics frame:
//! controller.tick(ListenerPose::facing([5.0, 1.7, 5.0], 0.0), &[])?;
//! // The audio callback, once a block of interleaved stereo:
//! let mut block = [0.0; 2 * 256];
//! renderer.render(&mut block);
//! # Ok(())
//! # }
//! ```
//!
//! # Map
//!
//! | what you have or want | where |
//! |---|---|
//! | a mesh, materials, poses | [`TriangleMesh`], [`Scene`], [`MaterialTable`], [`ListenerPose`], [`SourcePose`], [`InstancePose`] |
//! | sound in a game | [`Engine`], its halves [`Controller`] and [`Renderer`], [`EngineSettings`], [`Budget`] |
//! | sound on a device | [`device`] |
//! | sound into a file | [`offline`] |
//! | the paths themselves | [`paths`] |
//! | what the engine does, and how long it takes | [`diagnostics`] |
//!
//! # Units and threads
//!
//! Metres, seconds, hertz; right-handed coordinates, +y up; bands are the eight octaves from 63 Hz to 8 kHz ([`BANDS`]). A
//! function that takes a position takes anything that becomes a [`Vec3`](glam::Vec3): `[f32; 3]` does, in any version of `glam`. The pose
//! of an instance has double precision: `[f64; 3]`.
//! A [`Controller`] belongs to the app's thread and returns errors with advice. A [`Renderer`] belongs to the audio thread:
//! it neither allocates, locks nor fails.
//!
//! # Features
//!
//! `builtin-hrtf` (default) has the HRTF sets inside the library. `files` (default) reads OBJ, PLY and TOML files and writes WAV
//! files. `gltf` reads glTF and GLB files, `sofa` HRTF sets. `compressed` reads FLAC and Ogg Vorbis for the C and Kotlin
//! interfaces; in Rust a crate such as `hound` reads sound files. `play` has sound devices of a desktop
//! ([`device::Supervisor`], `device::CpalBackend`). Android's sound output is Oboe (`oboe`, default) or, without C++, AAudio
//! (`aaudio` and not `oboe`): [`device::DeviceOutput`] plays a renderer through [`device::system_device`]. `capi` and `jni` are
//! for the shared library. `testing` shows the modules to this repository's own tests and tools and is not part of the interface.
#![cfg_attr(
    not(feature = "testing"),
    allow(
        dead_code,
        unreachable_pub,
        unused_imports,
        reason = "tests and tools reach what the public interface does not show"
    )
)]

#[cfg(not(feature = "testing"))]
mod acoustics;
#[cfg(feature = "testing")]
pub mod acoustics;
mod binary;
#[cfg(all(any(feature = "capi", feature = "jni"), not(feature = "testing")))]
mod bridge;
#[cfg(feature = "testing")]
pub mod bridge;
#[cfg(not(feature = "testing"))]
mod error;
#[cfg(feature = "testing")]
pub mod error;
#[cfg(not(feature = "testing"))]
mod extrapolation;
#[cfg(feature = "testing")]
pub mod extrapolation;
#[cfg(not(feature = "testing"))]
mod generation;
#[cfg(feature = "testing")]
pub mod generation;
#[cfg(not(feature = "testing"))]
mod geometry;
#[cfg(feature = "testing")]
pub mod geometry;
#[cfg(not(feature = "testing"))]
mod output;
#[cfg(feature = "testing")]
pub mod output;
#[cfg(not(feature = "testing"))]
mod propagation;
#[cfg(feature = "testing")]
pub mod propagation;
#[cfg(not(feature = "testing"))]
mod runtime;
#[cfg(feature = "testing")]
pub mod runtime;
#[cfg(not(feature = "testing"))]
mod scene;
#[cfg(feature = "testing")]
pub mod scene;
#[cfg(not(feature = "testing"))]
mod simd;
#[cfg(feature = "testing")]
pub mod simd;

pub use glam;

pub use acoustics::{BANDS, BandArray, Material};
pub use error::{Error, Result};
pub use extrapolation::{GeometricSettings, PredictionTarget, PredictorKind};
pub use generation::{BlockReport, GeneratorSettings, Hrtf, Layout};
pub use propagation::PropagationSettings;
pub use runtime::{
    AffinityPolicy, Budget, BusStatus, Clip, Controller, Engine, EngineSchedule, EngineSettings,
    EngineState, FrameTime, PlaySettings, Playback, PlaybackState, QualityChoice, QualityLevel,
    RenderReport, Renderer, StreamWriter,
};
pub use scene::{
    DEFAULT_PRIORITY, Directivity, DirectivityTable, DistanceCurve, DistanceTable, Effects,
    InstanceId, InstancePose, ListenerPose, MAX_DISTANCE_POINTS, MAX_EXTENT_POINTS, MaterialTable,
    Scene, SceneSettings, SourceExtent, SourceId, SourceMix, SourcePose, SourceSettings,
    TriangleMesh, procedural::shoebox,
};

/// Reading meshes from files, and what the intake of a mesh found.
pub mod mesh {
    pub use crate::scene::IntakeReport;
    #[cfg(feature = "files")]
    pub use crate::scene::{MeshFile, MeshOptions, UpAxis, load_mesh};
}

/// Propagation by itself: paths with amplitudes in eight bands, without sound.
pub mod paths {
    pub use crate::extrapolation::{
        FramePath, FramePaths, LATE_DIRECTION_VECTORS, LATE_DIRECTIONS, LATE_GROUPS, LateGroup,
        LateSend, Obstruction, PathKind, WideArrival,
    };
    pub use crate::propagation::{
        EdgeLimits, LATE_SEGMENTS, LateEnergy, MAX_DIFFRACTION_ORDER, MAX_ORDER, Path, PathId,
        PathSet, Propagator, ReflectionEdge, Serial, Workers,
    };
    pub use crate::runtime::Threads;
    pub use crate::runtime::engine::{FrameNumbers, SourceNumbers};
}

/// Rendering on a virtual clock: the same input gives the same bits.
pub mod offline {
    #[cfg(feature = "files")]
    pub use crate::output::{WavFormat, WavSink};
    pub use crate::runtime::{
        Latency, OfflineRenderer, OfflineReport, OfflineSettings, Poses, Schedule,
    };
}

/// Sound devices: opened, lost, opened again.
pub mod device {
    pub use crate::output::{Device, DeviceCallback, DeviceGrant, DeviceInterface, OpenDevice};
    #[cfg(feature = "play")]
    pub use crate::runtime::device::CpalBackend;
    pub use crate::runtime::device::{
        Backend, DeviceState, LeasedCallback, NullDeviceSettings, RenderCallback, Supervisor,
    };
    pub use crate::runtime::{
        DeviceOutput, DeviceReport, NullDevice, NullDeviceReport, NullOutput, Placement,
        RingOutput, SoundThread, system_device,
    };
}

/// What the engine does and how long it takes.
pub mod diagnostics {
    pub use crate::runtime::engine::{Percentiles, SnapshotPath};
    pub use crate::runtime::{Statistics, TraceLog};
}

/// The Rust code of the pages, run by `cargo test --doc`.
#[cfg(doctest)]
mod pages {
    #[cfg(doctest)]
    #[doc = include_str!("../README.md")]
    mod readme {}
    #[cfg(doctest)]
    #[doc = include_str!("../docs/src/first-sound.md")]
    mod first_sound {}
    #[cfg(doctest)]
    #[doc = include_str!("../docs/src/geometry.md")]
    mod geometry {}
    #[cfg(doctest)]
    #[doc = include_str!("../docs/src/mixing.md")]
    mod mixing {}
    #[cfg(doctest)]
    #[doc = include_str!("../docs/src/phone.md")]
    mod phone {}
}
