//! Scenes.

use std::ffi::c_char;

use super::answer;
use super::memory::{give, read_options, slice, text};
use crate::bridge::fault::{Fault, Status};
use crate::bridge::scenes::{self, SceneInfo, SceneOptions};

/// The default options. Call it before changing any.
///
/// # Safety
/// `options` is the address of such a structure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_scene_options_default(options: *mut SceneOptions) -> Status {
    // SAFETY: the caller's word.
    answer(|| unsafe { give("options", options, SceneOptions::default()) })
}

/// Builds a scene from triangles: `vertex_count` times three coordinates in metres, +y up, and `index_count` indices,
/// three a triangle. With materials: their names, and one index into them a triangle; without, all null and zero.
/// `materials_toml` is the text of a materials file, or null. Takes as long as a tree over the triangles does, so not the
/// thread that draws, and never the audio thread.
///
/// # Safety
/// The pointers are the addresses of as many values as the counts say, texts end with a zero, `scene` is the address of a
/// variable.
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
    scene: *mut u64,
) -> Status {
    answer(|| {
        // SAFETY: the caller's word.
        unsafe { give("scene", scene, 0) }?;
        // SAFETY: the caller's word; options are plain numbers behind their size.
        let wanted = unsafe { read_options("options", options) }?;
        let numbers = vertex_count.checked_mul(3).ok_or_else(|| {
            let text = "vertex_count: more than memory has";
            Fault::fixed(Status::BadArgument, text)
        })?;
        // SAFETY: the caller's word.
        let positions = unsafe { slice("positions", positions_m, numbers) }?;
        let (positions, _) = positions.as_chunks::<3>();
        // SAFETY: the caller's word.
        let indices = unsafe { slice("indices", indices, index_count) }?;
        // SAFETY: the caller's word.
        let pointers = unsafe { slice("material_names", material_names, material_count) }?;
        let triangles = if pointers.is_empty() {
            &[]
        } else {
            // SAFETY: the caller's word.
            unsafe { slice("triangle_materials", triangle_materials, index_count / 3) }?
        };
        let mut names = Vec::with_capacity(pointers.len());
        for &pointer in pointers {
            // SAFETY: the caller's word.
            let name = unsafe { text("material name", pointer) }?;
            names.push(name.ok_or_else(|| Fault::null("a material name"))?);
        }
        // SAFETY: the caller's word.
        let table = unsafe { text("materials_toml", materials_toml) }?;
        let made = scenes::from_mesh(positions, indices, &names, triangles, table, &wanted)?;
        // SAFETY: the caller's word.
        unsafe { give("scene", scene, made) }
    })
}

/// Builds a scene from an OBJ file; `usemtl` names its materials. Else as foresound_scene_from_mesh.
///
/// # Safety
/// The texts end with a zero, `scene` is the address of a variable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_scene_from_file(
    path: *const c_char,
    materials_toml: *const c_char,
    options: *const SceneOptions,
    scene: *mut u64,
) -> Status {
    answer(|| {
        // SAFETY: the caller's word.
        unsafe { give("scene", scene, 0) }?;
        // SAFETY: the caller's word; options are plain numbers behind their size.
        let wanted = unsafe { read_options("options", options) }?;
        // SAFETY: the caller's word.
        let path = unsafe { text("path", path) }?.ok_or_else(|| Fault::null("path"))?;
        // SAFETY: the caller's word.
        let table = unsafe { text("materials_toml", materials_toml) }?;
        let made = scenes::from_file(path, table, &wanted)?;
        // SAFETY: the caller's word.
        unsafe { give("scene", scene, made) }
    })
}

/// What became of a scene's mesh. Any thread but the audio thread.
///
/// # Safety
/// `info` is the address of such a structure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_scene_info(scene: u64, info: *mut SceneInfo) -> Status {
    answer(|| {
        let found = scenes::describe(scene)?;
        // SAFETY: the caller's word.
        unsafe { give("info", info, found) }
    })
}
