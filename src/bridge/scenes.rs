//! Scenes, from arrays or from a file.
//!
//! Any control thread. Building the BVH takes milliseconds to seconds: not for the thread that draws.

use std::path::Path;
use std::sync::Arc;

use super::enumeration::UpAxis;
use super::error::CallError;
use super::handles::{HandleTable, Kind};
use super::progress::observer;
use super::record::record;
use crate::scene::committed::saved::is_saved;
use crate::scene::io::mesh_file;
use crate::scene::{MaterialTable, MeshOptions, Scene, SceneSettings, TriangleMesh, load_mesh};

/// Scenes.
pub static SCENES: HandleTable<Arc<Scene>> = HandleTable::new(Kind::Scene);

record! {
    /// Settings of a scene. Begin with FORESOUND_SCENE_OPTIONS_INIT or foresound_scene_options_default, then change fields.
    pub struct SceneOptions[size] {
        /// Upward axis of a file.
        pub up: UpAxis,
        /// Metres a unit of a file, above zero.
        pub scale: f32,
        /// Air temperature in degrees Celsius.
        pub temperature_c: f32,
        /// Relative humidity in percent.
        pub humidity_percent: f32,
        /// Static pressure in kPa.
        pub pressure_kpa: f32,
        /// Least area in m² of a connected plane panel that reflects like a mirror; smaller ones block and scatter.
        pub min_panel_m2: f32,
        /// Largest area in m² of a panel whose free edges limit its reflection; 0: none.
        pub max_finite_panel_m2: f32,
        /// Distance in metres from a common plane within which corners of neighbouring triangles are roughness of one plane
        /// surface, 0 to 0.5; -1: an eighth of the wavelength at 1 kHz.
        pub acoustic_tolerance_m: f32,
        /// Maximum number of triangles; a mesh with more is refused.
        pub max_triangles: u32,
    }
}

impl Default for SceneOptions {
    fn default() -> Self {
        let settings = SceneSettings::default();
        let medium = settings.medium;
        Self {
            size: size_of::<Self>() as u32,
            up: UpAxis::Y,
            scale: MeshOptions::default().scale,
            temperature_c: medium.temperature_c as f32,
            humidity_percent: medium.humidity_percent as f32,
            pressure_kpa: medium.pressure_kpa as f32,
            min_panel_m2: settings.min_panel_m2 as f32,
            max_finite_panel_m2: settings.max_finite_panel_m2 as f32,
            acoustic_tolerance_m: settings.acoustic_tolerance_m.map_or(-1.0, |m| m as f32),
            max_triangles: settings.max_triangles as u32,
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
        change(self.min_panel_m2, &mut settings.min_panel_m2);
        change(self.max_finite_panel_m2, &mut settings.max_finite_panel_m2);
        if self.acoustic_tolerance_m != -1.0 {
            settings.acoustic_tolerance_m = Some(self.acoustic_tolerance_m.into());
        }
        settings.max_triangles = self.max_triangles as usize;
        settings
    }

    fn mesh(&self) -> Result<MeshOptions, CallError> {
        let up = match self.up {
            UpAxis::Y => mesh_file::UpAxis::Y,
            UpAxis::Z => mesh_file::UpAxis::Z,
            UpAxis(other) => {
                let text = format!("up: {other} is not 0 (+y) or 1 (+z)");
                return Err(CallError::bad(text));
            }
        };
        let mut options = MeshOptions::default().with_scale(self.scale).with_up(up);
        options.max_triangles = self.max_triangles as usize;
        Ok(options)
    }
}

record! {
    /// Properties of a scene.
    pub struct SceneInfo[size, zeros] {
        /// Materials that no table defines; they have the default's properties.
        pub unknown_materials: u32,
        /// Triangles of the mesh.
        pub triangles_in: u64,
        /// Triangles kept: finite, with an area.
        pub triangles: u64,
        /// Plane surfaces that they form.
        pub surfaces: u64,
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

/// The built-in materials, overridden by those of a mesh file, and those by a TOML text.
fn materials(of_file: MaterialTable, text: Option<&str>) -> Result<MaterialTable, CallError> {
    let mut table = MaterialTable::built_in();
    table.extend(of_file);
    if let Some(text) = text {
        table.extend(MaterialTable::parse(Path::new("materials"), text)?);
    }
    Ok(table)
}

/// Builds a scene from a mesh. `text` is the text of a materials file (TOML); `progress` a handle of
/// [`super::progress`] or 0.
///
/// # Errors
/// `Status::Format` for an invalid mesh or materials, `Status::BadArgument` for a property of air out of range,
/// `Status::Cancelled`.
pub fn from_mesh(
    mesh: &TriangleMesh,
    text: Option<&str>,
    options: &SceneOptions,
    progress: u64,
) -> Result<u64, CallError> {
    let table = materials(MaterialTable::default(), text)?;
    commit(mesh, &table, options, progress)
}

fn commit(
    mesh: &TriangleMesh,
    table: &MaterialTable,
    options: &SceneOptions,
    progress: u64,
) -> Result<u64, CallError> {
    let observe = &mut observer(progress)?;
    let scene = Scene::commit_observed(mesh, table, &options.settings(), observe)?;
    SCENES.insert(Arc::new(scene))
}

/// Builds a scene from a mesh file: OBJ, PLY, and with the feature `gltf` glTF and GLB; `text` is the text of a materials
/// file (TOML). Or loads a saved scene, for which the other arguments mean nothing.
///
/// # Errors
/// `Status::File` for an unreadable file; those of [`from_mesh`].
pub fn from_file(
    path: &str,
    text: Option<&str>,
    options: &SceneOptions,
    progress: u64,
) -> Result<u64, CallError> {
    let path = Path::new(path);
    if is_saved(path) {
        return SCENES.insert(Arc::new(Scene::load(path)?));
    }
    let file = load_mesh(path, &options.mesh()?)?;
    commit(
        &file.mesh,
        &materials(file.materials, text)?,
        options,
        progress,
    )
}

/// Loads a saved scene from its bytes.
///
/// # Errors
/// `Status::Format` for bytes that are no saved scene, damaged, or of another version.
pub fn from_bytes(bytes: &[u8]) -> Result<u64, CallError> {
    SCENES.insert(Arc::new(Scene::from_bytes(bytes)?))
}

/// Saves a scene to a file.
///
/// # Errors
/// `Status::File` for a file that cannot be written; those of [`HandleTable::with`].
pub fn save(scene: u64, path: &str) -> Result<(), CallError> {
    let scene = SCENES.with(scene, |scene| Ok(Arc::clone(scene)))?;
    Ok(scene.save(Path::new(path))?)
}

/// Properties of a scene.
///
/// # Errors
/// Those of [`HandleTable::with`].
pub fn info(scene: u64) -> Result<SceneInfo, CallError> {
    SCENES.with(scene, |scene| {
        let report = scene.report();
        Ok(SceneInfo {
            size: size_of::<SceneInfo>() as u32,
            unknown_materials: scene.defaulted_materials().len() as u32,
            triangles_in: report.triangles_in as u64,
            triangles: report.triangles as u64,
            surfaces: scene.surfaces().len() as u64,

            memory_bytes: scene.memory_bytes() as u64,
            speed_of_sound_m_s: scene.speed_of_sound_m_s(),
            bounds_min_m: report.bounds_min.to_array(),
            bounds_max_m: report.bounds_max.to_array(),
        })
    })
}
