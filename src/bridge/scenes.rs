//! Scenes, from arrays or from a file.
//!
//! Any control thread. Building the BVH takes milliseconds to seconds: not for the thread that draws.

use std::path::Path;
use std::sync::Arc;

use super::error::CallError;
use super::handles::{HandleTable, Kind};
use super::record::record;
use crate::scene::io::obj::{ObjOptions, UpAxis, load_obj};
use crate::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh};

/// Scenes.
pub static SCENES: HandleTable<Arc<Scene>> = HandleTable::new(Kind::Scene);

record! {
    /// Settings of a scene. Fill it with the defaults, then change fields.
    pub struct SceneOptions[size] {
        /// Up axis of a file: 0 for +y, 1 for +z.
        pub up: u32,
        /// Metres a unit of a file, above zero.
        pub scale: f32,
        /// Air temperature in degrees Celsius.
        pub temperature_c: f32,
        /// Relative humidity in percent.
        pub humidity_percent: f32,
        /// Static pressure in kPa.
        pub pressure_kpa: f32,
    }
}

impl Default for SceneOptions {
    fn default() -> Self {
        let medium = SceneSettings::default().medium;
        Self {
            size: size_of::<Self>() as u32,
            up: 0,
            scale: ObjOptions::default().scale,
            temperature_c: medium.temperature_c as f32,
            humidity_percent: medium.humidity_percent as f32,
            pressure_kpa: medium.pressure_kpa as f32,
        }
    }
}

impl SceneOptions {
    fn settings(&self) -> SceneSettings {
        let mut settings = SceneSettings::default();
        // The default in single precision stands for the default in double precision.
        let change = |value: f32, target: &mut f64| {
            if value != *target as f32 {
                *target = f64::from(value);
            }
        };
        change(self.temperature_c, &mut settings.medium.temperature_c);
        change(self.humidity_percent, &mut settings.medium.humidity_percent);
        change(self.pressure_kpa, &mut settings.medium.pressure_kpa);
        settings
    }

    fn obj(&self) -> Result<ObjOptions, CallError> {
        let up = match self.up {
            0 => UpAxis::Y,
            1 => UpAxis::Z,
            other => {
                let text = format!("up: {other} is not 0 (+y) or 1 (+z)");
                return Err(CallError::bad(text));
            }
        };
        Ok(ObjOptions::default().with_scale(self.scale).with_up(up))
    }
}

record! {
    /// Properties of a scene.
    #[derive(Default)]
    pub struct SceneInfo {
        /// Triangles of the mesh.
        pub triangles_in: u64,
        /// Triangles kept: finite, with an area.
        pub triangles: u64,
        /// Plane surfaces that they form.
        pub surfaces: u64,
        /// Materials that no table defines; they have the default's properties.
        pub unknown_materials: u64,
        /// Memory of the scene in bytes.
        pub memory_bytes: u64,
        /// Speed of sound in m/s.
        pub speed_of_sound_m_s: f64,
        /// Minimum coordinates in metres.
        pub bounds_min_m: [f32; 3],
        /// Maximum coordinates in metres.
        pub bounds_max_m: [f32; 3],
    }
}

/// The built-in materials, overridden by those of a TOML text.
fn materials(text: Option<&str>) -> Result<MaterialTable, CallError> {
    let mut table = MaterialTable::built_in();
    if let Some(text) = text {
        table.extend(MaterialTable::parse(Path::new("materials"), text)?);
    }
    Ok(table)
}

fn commit(
    mesh: &TriangleMesh,
    text: Option<&str>,
    options: &SceneOptions,
) -> Result<u64, CallError> {
    let scene = Scene::commit(mesh, &materials(text)?, &options.settings())?;
    SCENES.insert(Arc::new(scene))
}

/// Builds a scene from triangles in metres, +y up. Both material lists may be empty: then every triangle has the
/// material `default`. `materials` is the text of a materials file (TOML).
///
/// # Errors
/// `Status::Format` for an invalid mesh or materials,
/// `Status::BadArgument` for a property of air out of range.
pub fn from_mesh(
    positions: &[[f32; 3]],
    indices: &[u32],
    names: &[&str],
    triangle_materials: &[u32],
    materials: Option<&str>,
    options: &SceneOptions,
) -> Result<u64, CallError> {
    let mesh = TriangleMesh::from_slices(positions, indices, names, triangle_materials)?;
    commit(&mesh, materials, options)
}

/// Builds a scene from an OBJ file. `materials` is the text of a materials file (TOML).
///
/// # Errors
/// `Status::File` for an unreadable file; those of [`from_mesh`].
pub fn from_file(
    path: &str,
    materials: Option<&str>,
    options: &SceneOptions,
) -> Result<u64, CallError> {
    let file = load_obj(Path::new(path), &options.obj()?)?;
    commit(&file.mesh, materials, options)
}

/// Properties of a scene.
///
/// # Errors
/// Those of [`HandleTable::with`].
pub fn info(scene: u64) -> Result<SceneInfo, CallError> {
    SCENES.with(scene, |scene| {
        let report = scene.report();
        Ok(SceneInfo {
            triangles_in: report.triangles_in as u64,
            triangles: report.triangles as u64,
            surfaces: scene.surfaces().len() as u64,
            unknown_materials: scene.defaulted_materials().len() as u64,
            memory_bytes: scene.memory_bytes() as u64,
            speed_of_sound_m_s: scene.speed_of_sound_m_s(),
            bounds_min_m: report.bounds_min.to_array(),
            bounds_max_m: report.bounds_max.to_array(),
        })
    })
}
