//! Functions with arrays in the caller's memory.

use std::ffi::c_char;

use super::memory::{
    Elements, check_samples, element, elements, info_of, output_of, slice, store, structure, text,
};
use super::{answer, audio_answer};
use crate::bridge::engine::ENGINES;
use crate::bridge::error::{CallError, Status};
use crate::bridge::numbers::SourcePath;
use crate::bridge::pose::Pose;
use crate::bridge::scenes::{self, SceneOptions};
use crate::bridge::shown_paths::ShownPath;
use crate::bridge::sound::{self, RenderInfo};
use crate::scene::TriangleMesh;

/// Submits a graphics frame: the listener's pose, and the poses of the sources that moved. Meant for one call a frame;
/// never waits for propagation or sound, except that the synchronous schedule runs propagation in it. After an invalid pose
/// (FORESOUND_STATUS_BAD_ARGUMENT: not finite, beyond 1,000 km, an orientation of no length) or an unknown source
/// (FORESOUND_STATUS_STALE_SOURCE) it fails, and the frame is submitted with the last valid poses. `sources`: null if none.
/// `pose_size`: sizeof(ForesoundPose). Control thread.
///
/// # Safety
/// Pointers are null or valid as the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_engine_tick(
    engine: u64,
    listener: *const Pose,
    sources: *const Pose,
    source_count: usize,
    pose_size: usize,
) -> Status {
    answer(|| {
        // SAFETY: the caller's obligation.
        let listener = unsafe { element("listener", listener, pose_size) }?;
        // SAFETY: the caller's obligation.
        let poses = unsafe { elements("sources", sources, source_count, pose_size) }?;
        ENGINES.with(engine, |engine| engine.tick(listener.listener(), poses))
    })
}

/// Writes the loudest paths of the newest update, in no order, as many as fit, and their number. At most the option
/// `shown_paths` of them are available. `path_size`: sizeof(ForesoundShownPath). Control thread.
///
/// # Safety
/// Pointers are null or valid as the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_engine_paths(
    engine: u64,
    paths: *mut ShownPath,
    path_size: usize,
    capacity: usize,
    count: *mut usize,
) -> Status {
    answer(|| {
        // SAFETY: the caller's obligation.
        unsafe { store("count", count, 0) }?;
        if capacity > 16_384 {
            let text = format!("capacity: {capacity} is outside 0 to 16384");
            return Err(CallError::bad(text));
        }
        // SAFETY: the caller's obligation.
        let paths = unsafe { Elements::new("paths", paths, capacity, path_size) }?;
        let written = ENGINES.with(engine, |engine| Ok(paths.store(engine.shown_paths())))?;
        // SAFETY: the caller's obligation.
        unsafe { store("count", count, written) }
    })
}

/// Writes a source's paths in the frame taken last (foresound_engine_take_numbers), by identity, as many as fit, and their
/// number. `path_size`: sizeof(ForesoundSourcePath). Control thread.
///
/// # Safety
/// Pointers are null or valid as the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_source_paths(
    engine: u64,
    source: u32,
    paths: *mut SourcePath,
    path_size: usize,
    capacity: usize,
    count: *mut usize,
) -> Status {
    answer(|| {
        // SAFETY: the caller's obligation.
        unsafe { store("count", count, 0) }?;
        if capacity > MAX_SOURCE_PATHS {
            let text = format!("capacity: {capacity} is outside 0 to {MAX_SOURCE_PATHS}");
            return Err(CallError::bad(text));
        }
        // SAFETY: the caller's obligation.
        let paths = unsafe { Elements::new("paths", paths, capacity, path_size) }?;
        let written = ENGINES.with(engine, |engine| {
            Ok(paths.store(engine.source_paths(source)?))
        })?;
        // SAFETY: the caller's obligation.
        unsafe { store("count", count, written) }
    })
}

/// Most paths of a graphics frame, above which a capacity is uninitialised.
const MAX_SOURCE_PATHS: usize = 65_536;

/// Builds a scene from triangles: three coordinates a vertex in metres, +y up, and three indices a triangle. With
/// materials: their names, and one index into them a triangle; without: null and zero. `materials_toml`: the text of a
/// materials file, or null. `options`: null for the defaults. `progress`: a handle of foresound_progress_create, or 0. Fails
/// with FORESOUND_STATUS_FORMAT for a mesh or a materials file that is invalid, FORESOUND_STATUS_BAD_ARGUMENT for an option out of
/// range, FORESOUND_STATUS_CANCELLED after foresound_progress_cancel. Takes milliseconds to seconds: a control thread, but not
/// the one that draws.
///
/// # Safety
/// Pointers are null or valid as the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_scene_from_mesh(
    positions_m: *const f32,
    vertex_count: usize,
    indices: *const u32,
    index_count: usize,
    triangle_materials: *const u32,
    material_names: *const *const c_char,
    material_count: usize,
    materials_toml: *const c_char,
    options: *const SceneOptions,
    progress: u64,
    scene: *mut u64,
) -> Status {
    answer(|| {
        // SAFETY: the caller's obligation.
        unsafe { store("scene", scene, 0) }?;
        // SAFETY: the caller's obligation.
        let options = unsafe { structure("options", options) }?;
        // SAFETY: the caller's obligation.
        let positions =
            unsafe { slice("positions", positions_m.cast::<[f32; 3]>(), vertex_count) }?;
        // SAFETY: the caller's obligation.
        let indices = unsafe { slice("indices", indices, index_count) }?;
        // SAFETY: the caller's obligation.
        let pointers = unsafe { slice("material_names", material_names, material_count) }?;
        let triangle_count = if pointers.is_empty() {
            0
        } else {
            index_count / 3
        };
        // SAFETY: the caller's obligation.
        let triangle_materials =
            unsafe { slice("triangle_materials", triangle_materials, triangle_count) }?;
        let mut names = Vec::with_capacity(pointers.len());
        for &pointer in pointers {
            // SAFETY: the caller's obligation.
            let name = unsafe { text("material name", pointer) }?;
            names.push(name.ok_or_else(|| CallError::null("a material name"))?);
        }
        // SAFETY: the caller's obligation.
        let toml = unsafe { text("materials_toml", materials_toml) }?;
        let mesh = TriangleMesh::from_slices(positions, indices, &names, triangle_materials)?;
        let made = scenes::from_mesh(&mesh, toml, &options, progress)?;
        // SAFETY: the caller's obligation.
        unsafe { store("scene", scene, made) }
    })
}

/// Renders `frames` audio frames of interleaved stereo into `output`; silence on failure. An engine of another number of
/// channels than two fails with FORESOUND_STATUS_BAD_ARGUMENT: use foresound_render_channels. `info`: null if unused. One thread at
/// a time a renderer; a second concurrent call gets FORESOUND_STATUS_BUSY. Multiples of the engine's block size are the most
/// efficient. Audio thread: wait-free, without allocation, without a message.
///
/// # Safety
/// Pointers are null or valid as the header says; `output` has 2 x `frames` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_render(
    renderer: u64,
    output: *mut f32,
    frames: usize,
    info: *mut RenderInfo,
) -> Status {
    // SAFETY: the caller's obligation.
    unsafe { render(renderer, output, 2, frames, info) }
}

/// Renders `frames` audio frames of `channels` interleaved channels into `output`, as foresound_render; `channels` is the
/// number of the engine (foresound_renderer_channels), another one gets FORESOUND_STATUS_BAD_ARGUMENT and silence. Audio
/// thread: wait-free, without allocation, without a message.
///
/// # Safety
/// Pointers are null or valid as the header says; `output` has `channels` x `frames` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_render_channels(
    renderer: u64,
    output: *mut f32,
    channels: u32,
    frames: usize,
    info: *mut RenderInfo,
) -> Status {
    // SAFETY: the caller's obligation.
    unsafe { render(renderer, output, channels, frames, info) }
}

/// Renders into a caller's array.
///
/// # Safety
/// As [`foresound_render_channels`].
unsafe fn render(
    renderer: u64,
    output: *mut f32,
    channels: u32,
    frames: usize,
    info: *mut RenderInfo,
) -> Status {
    audio_answer(|| {
        // SAFETY: the caller's obligation.
        let output = unsafe { output_of(output, channels, frames) }?;
        // SAFETY: the caller's obligation.
        let info = unsafe { info_of(info) }.inspect_err(|_| output.fill(0.0))?;
        let rendered = sound::render(renderer, output, channels as usize)?;
        info.map_or(Ok(()), |info| info.store(rendered))
    })
}

/// Appends as many of `count` samples to a stream as fit; `written` (null if unused) receives their number. Samples are
/// mono at the engine's rate, 1 being full scale at 1 m; they are not converted. Fails with FORESOUND_STATUS_STATE once the
/// stream has no reader. Any one thread at a time, the audio thread included: wait-free, without allocation, without a message.
///
/// # Safety
/// Pointers are null or valid as the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_stream_write(
    stream: u64,
    samples: *const f32,
    count: usize,
    written: *mut usize,
) -> Status {
    audio_answer(|| {
        check_samples(samples, count, 1 << 28)?;
        // SAFETY: the caller's obligation.
        let samples = unsafe { slice("samples", samples, count) }?;
        let fitted = sound::write_stream(stream, samples)?;
        if !written.is_null() {
            // SAFETY: the caller's obligation.
            unsafe { store("written", written, fitted) }?;
        }
        Ok(())
    })
}
