//! Scenes.

use ::jni::EnvUnowned;
use ::jni::objects::{JClass, JDoubleArray, JFloatArray, JIntArray, JObjectArray, JString};
use ::jni::sys::jlong;

use super::answer;
use super::memory::{array, fill, optional_array, text};
use crate::bridge::fault::{Fault, Status};
use crate::bridge::numbers::Numbers;
use crate::bridge::scenes::{self, SceneOptions};

/// Options as numbers: up, scale, temperature, humidity, pressure; none for the defaults.
fn options(numbers: &[f64]) -> Result<SceneOptions, Fault> {
    let defaults = SceneOptions::default();
    if numbers.is_empty() {
        return Ok(defaults);
    }
    let mut next = Numbers::new("scene options", numbers, 5)?;
    Ok(SceneOptions {
        up: next.count()?,
        scale: next.number()? as f32,
        temperature_c: next.number()? as f32,
        humidity_percent: next.number()? as f32,
        pressure_kpa: next.number()? as f32,
        ..defaults
    })
}

/// Indices as Java has them.
fn unsigned(name: &str, indices: Vec<i32>) -> Result<Vec<u32>, Fault> {
    if let Some(below) = indices.iter().find(|i| **i < 0) {
        let text = format!("{name}: {below} is below zero");
        return Err(Fault::new(Status::BadArgument, text));
    }
    Ok(indices.into_iter().map(|i| i as u32).collect())
}

pub(super) extern "system" fn from_mesh<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    positions: JFloatArray<'l>,
    indices: JIntArray<'l>,
    triangle_materials: JIntArray<'l>,
    names: JObjectArray<'l, JString<'l>>,
    materials: JString<'l>,
    numbers: JDoubleArray<'l>,
) -> jlong {
    answer(env, |env| {
        let options = options(&optional_array(env, &numbers)?)?;
        let positions = array(env, "positions", &positions)?;
        let (positions, rest) = positions.as_chunks::<3>();
        if !rest.is_empty() {
            const THREE: &str = "positions: give three coordinates a vertex";
            return Err(Fault::fixed(Status::BadArgument, THREE));
        }
        let indices = unsigned("indices", array(env, "indices", &indices)?)?;
        let triangles = optional_array(env, &triangle_materials)?;
        let triangles = unsigned("triangleMaterials", triangles)?;
        let mut owned = Vec::new();
        if !names.is_null() {
            for i in 0..names.len(env)? {
                let name = names.get_element(env, i)?;
                let name = text(env, &name)?;
                owned.push(name.ok_or_else(|| Fault::null("a material's name"))?);
            }
        }
        let names: Vec<&str> = owned.iter().map(String::as_str).collect();
        let materials = text(env, &materials)?;
        let scene = scenes::from_mesh(
            positions,
            &indices,
            &names,
            &triangles,
            materials.as_deref(),
            &options,
        )?;
        Ok(scene as jlong)
    })
}

pub(super) extern "system" fn from_file<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    path: JString<'l>,
    materials: JString<'l>,
    numbers: JDoubleArray<'l>,
) -> jlong {
    answer(env, |env| {
        let options = options(&optional_array(env, &numbers)?)?;
        let path = text(env, &path)?.ok_or_else(|| Fault::null("path"))?;
        let materials = text(env, &materials)?;
        Ok(scenes::from_file(&path, materials.as_deref(), &options)? as jlong)
    })
}

pub(super) extern "system" fn info<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    scene: jlong,
    numbers: JDoubleArray<'l>,
) {
    answer(env, |env| {
        let info = scenes::describe(scene as u64)?;
        fill(env, "info", &numbers, &info.numbers())
    });
}
