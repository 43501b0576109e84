//! Scenes: from an app's buffers or from a file.
//!
//! Control side, any thread; takes as long as building a tree does, so not the thread that draws.

use std::path::Path;
use std::sync::Arc;

use super::fault::{Fault, Status};
use super::table::{Kind, Table};
use crate::scene::io::obj::{ObjOptions, UpAxis, load_obj};
use crate::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh};

/// All scenes.
pub static SCENES: Table<Arc<Scene>> = Table::new(Kind::Scene);

/// How a scene is made. Fill it with the defaults first, then change what is to differ.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneOptions {
    /// Bytes of this structure, as the caller knows it: what lies beyond takes its default.
    pub size: u32,
    /// Upward axis of a file: 0 for +y, 1 for +z.
    pub up: u32,
    /// Metres a unit of a file, above zero.
    pub scale: f32,
    /// Temperature of the air in degrees Celsius.
    pub temperature_c: f32,
    /// Relative humidity in percent.
    pub humidity_percent: f32,
    /// Static pressure in kPa.
    pub pressure_kpa: f32,
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
        // A number that is the default's means the default, not its rounding.
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

    fn obj(&self) -> Result<ObjOptions, Fault> {
        let up = match self.up {
            0 => UpAxis::Y,
            1 => UpAxis::Z,
            other => {
                let text = format!("up: {other} is no axis; give 0 for +y or 1 for +z");
                return Err(Fault::new(Status::BadArgument, text));
            }
        };
        Ok(ObjOptions::default().with_scale(self.scale).with_up(up))
    }
}

/// How many numbers the structure is as a list.
pub const SCENE_NUMBERS: usize = 12;

/// What became of a mesh.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SceneInfo {
    /// Triangles that came.
    pub triangles_in: u64,
    /// Triangles that stay.
    pub triangles: u64,
    /// Plane surfaces that they make up.
    pub surfaces: u64,
    /// Materials whose name no table knows.
    pub unknown_materials: u64,
    /// Memory that the scene occupies, in bytes.
    pub memory_bytes: u64,
    /// Speed of sound in m/s.
    pub speed_of_sound_m_s: f64,
    /// Least coordinates in metres.
    pub bounds_min_m: [f32; 3],
    /// Greatest coordinates in metres.
    pub bounds_max_m: [f32; 3],
}

impl SceneInfo {
    /// All fields in their order, as numbers: how Java gets them.
    pub fn numbers(&self) -> [f64; SCENE_NUMBERS] {
        let [a, b, c] = self.bounds_min_m.map(f64::from);
        let [d, e, f] = self.bounds_max_m.map(f64::from);
        [
            self.triangles_in as f64,
            self.triangles as f64,
            self.surfaces as f64,
            self.unknown_materials as f64,
            self.memory_bytes as f64,
            self.speed_of_sound_m_s,
            a,
            b,
            c,
            d,
            e,
            f,
        ]
    }
}

/// The built-in materials and those of a TOML text, which win.
fn materials(text: Option<&str>) -> Result<MaterialTable, Fault> {
    let mut table = MaterialTable::built_in();
    if let Some(text) = text {
        table.extend(MaterialTable::parse(Path::new("materials"), text)?);
    }
    Ok(table)
}

fn commit(mesh: &TriangleMesh, text: Option<&str>, options: &SceneOptions) -> Result<u64, Fault> {
    let scene = Scene::commit(mesh, &materials(text)?, &options.settings())?;
    SCENES.insert(Arc::new(scene))
}

/// Builds a scene from triangles in metres, +y up. Both material lists may be empty: then every triangle has the
/// material `default`. `materials` is a TOML text of materials.
///
/// # Errors
/// [`Status::Format`] for a mesh or materials of which no scene can be made, [`Status::BadArgument`] for air that is none.
pub fn from_mesh(
    positions: &[[f32; 3]],
    indices: &[u32],
    names: &[&str],
    triangle_materials: &[u32],
    materials: Option<&str>,
    options: &SceneOptions,
) -> Result<u64, Fault> {
    let mesh = TriangleMesh::from_slices(positions, indices, names, triangle_materials)?;
    commit(&mesh, materials, options)
}

/// Builds a scene from an OBJ file. `materials` is a TOML text of materials.
///
/// # Errors
/// [`Status::File`] where it cannot be read; as [`from_mesh`].
pub fn from_file(
    path: &str,
    materials: Option<&str>,
    options: &SceneOptions,
) -> Result<u64, Fault> {
    let file = load_obj(Path::new(path), &options.obj()?)?;
    commit(&file.mesh, materials, options)
}

/// What became of a scene's mesh.
///
/// # Errors
/// The handle's.
pub fn describe(scene: u64) -> Result<SceneInfo, Fault> {
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
