//! Saved scenes: the fixed part of a committed scene as bytes, ready for rays.
//!
//! Control side. The bytes are a magic number, the version of the format, the length and the checksum of the rest
//! (`crate::binary`, little-endian). They hold for every machine: the tree is stored by its structure and gets the boxes
//! of the loading machine's instruction set. Bytes of any content end in a scene or in an error: indices and ranges that
//! queries rely on are checked, whatever the checksum says.

use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use super::Scene;
use super::blocks::TriangleBlocks;
use super::instances::Instances;
use crate::acoustics::BandArray;
use crate::acoustics::material::{Material, Reflectance};
use crate::acoustics::medium::HIGH_AIR_HZ;
use crate::binary::{Reader, Stored, Writer, checksum, stored};
use crate::error::{Error, Result};
use crate::geometry::bvh::SavedTree;
use crate::scene::commit::CommittedMesh;
use crate::scene::edges::EdgeSet;
use crate::scene::surface::finite_panel::FinitePanels;

/// First bytes of a saved scene. The first is no text and the last a line end: a file that was copied as text is found.
pub const MAGIC: [u8; 8] = *b"\x89FSCENE\n";

/// Version of the format. It rises with every change of what commit makes or how it is stored.
const VERSION: u32 = 3;

/// Bytes before the content.
pub const HEADER_BYTES: usize = 32;

const DAMAGED_ADVICE: &str = "copy the file again, or save the scene again";

/// Where errors say that bytes without a file come from.
const NO_FILE: &str = "saved scene";

stored!(Header {
    magic: [u32; 2],
    version: u32,
    reserved: u32,
    length: u64,
    checksum: u64,
});

struct Header {
    magic: [u32; 2],
    version: u32,
    reserved: u32,
    length: u64,
    checksum: u64,
}

/// What of a scene is no list.
struct Sound {
    speed_of_sound_m_s: f64,
    length_scale: f64,
    air_np_per_m: BandArray,
    high_air_np_per_m: [f32; HIGH_AIR_HZ.len()],
    acoustic_tolerance_m: f64,
    diagonal_m: f32,
}

stored!(Sound {
    speed_of_sound_m_s: f64,
    length_scale: f64,
    air_np_per_m: BandArray,
    high_air_np_per_m: [f32; HIGH_AIR_HZ.len()],
    acoustic_tolerance_m: f64,
    diagonal_m: f32,
});

/// Whether a file begins as a saved scene does; not if it cannot be read.
pub fn is_saved(path: &Path) -> bool {
    let mut start = [0; MAGIC.len()];
    let file = std::fs::File::open(path);
    file.is_ok_and(|mut file| file.read_exact(&mut start).is_ok()) && start == MAGIC
}

/// A content behind its header.
pub fn sealed(content: &[u8]) -> Vec<u8> {
    let mut file = Writer::default();
    Header {
        magic: magic(),
        version: VERSION,
        reserved: 0,
        length: content.len() as u64,
        checksum: checksum(content),
    }
    .store(&mut file);
    let mut bytes = file.into_bytes();
    bytes.extend_from_slice(content);
    bytes
}

fn magic() -> [u32; 2] {
    let (words, _) = MAGIC.as_chunks::<4>();
    [words[0], words[1]].map(u32::from_le_bytes)
}

impl Scene {
    /// The scene as bytes that [`Self::from_bytes`] makes a scene of, on any machine and without the work of
    /// [`Self::commit`]. Control side; takes as long as building the tree.
    ///
    /// # Errors
    /// [`Error::Setting`] for a scene with instances: parts are saved by themselves.
    ///
    /// # Examples
    /// ```
    /// use foresound::{MaterialTable, Scene, SceneSettings, shoebox};
    ///
    /// let room = shoebox([8.0, 3.0, 5.0], "plaster");
    /// let scene = Scene::commit(&room, &MaterialTable::built_in(), &SceneSettings::default())?;
    /// let loaded = Scene::from_bytes(&scene.to_bytes()?)?;
    /// assert_eq!(loaded.surfaces(), scene.surfaces());
    /// # Ok::<(), foresound::Error>(())
    /// ```
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        if self.has_instances() {
            return Err(Error::setting(
                "scene",
                "it has instances, which are not saved",
                "save the fixed scene and each part by themselves, and add instances after loading",
            ));
        }
        let Self {
            mesh,
            bvh: _,
            blocks: _,
            edges,
            materials,
            reflectances,
            transmission_factors: _,
            speed_of_sound_m_s,
            length_scale,
            air_np_per_m,
            high_air_np_per_m,
            acoustic_tolerance_m,
            diagonal_m,
            finite_panels,
            instances: _,
        } = self;
        let sound = Sound {
            speed_of_sound_m_s: *speed_of_sound_m_s,
            length_scale: *length_scale,
            air_np_per_m: *air_np_per_m,
            high_air_np_per_m: *high_air_np_per_m,
            acoustic_tolerance_m: *acoustic_tolerance_m,
            diagonal_m: *diagonal_m,
        };
        let mut content = Writer::default();
        sound.store(&mut content);
        mesh.store(&mut content);
        SavedTree::build(&mesh.vertices, &mesh.triangles).store(&mut content);
        edges.store(&mut content);
        finite_panels.store(&mut content);
        reflectances.to_vec().store(&mut content);
        materials.to_vec().store(&mut content);
        Ok(sealed(&content.into_bytes()))
    }

    /// The scene that [`Self::to_bytes`] made bytes of. Control side; a twentieth of the time of [`Self::commit`] or less.
    ///
    /// # Errors
    /// [`Error::Format`] for bytes that are no saved scene, damaged, or of another version.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        Self::of_bytes(Path::new(NO_FILE), bytes)
    }

    /// Writes [`Self::to_bytes`] to a file.
    ///
    /// # Errors
    /// As [`Self::to_bytes`]; [`Error::File`] where the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        let bytes = self.to_bytes()?;
        std::fs::write(path, bytes)
            .map_err(|error| Error::file(path, error, "check the path and the disk"))
    }

    /// Loads a file that [`Self::save`] wrote.
    ///
    /// # Errors
    /// As [`Self::from_bytes`]; [`Error::File`] where the file cannot be read.
    pub fn load(path: &Path) -> Result<Self> {
        let advice = "give the path of a saved scene";
        let unreadable = |error| Error::file(path, error, advice);
        let mut file = std::fs::File::open(path).map_err(unreadable)?;
        let mut bytes = Vec::new();
        let header_bytes = HEADER_BYTES as u64;
        let read = file.by_ref().take(header_bytes).read_to_end(&mut bytes);
        read.map_err(unreadable)?;
        // Other files are not read to their end.
        let header = header(path, &bytes)?;
        bytes.reserve(usize::try_from(header.length.min(1 << 20)).unwrap_or(0));
        let rest = file.take(header.length.saturating_add(1));
        { rest }.read_to_end(&mut bytes).map_err(unreadable)?;
        Self::of_bytes(path, &bytes)
    }

    fn of_bytes(path: &Path, bytes: &[u8]) -> Result<Self> {
        let header = header(path, bytes)?;
        let content = &bytes[HEADER_BYTES..];
        let is_whole = content.len() as u64 == header.length && header.reserved == 0;
        if !is_whole || checksum(content) != header.checksum {
            return Err(damaged(path));
        }
        restored(content).ok_or_else(|| damaged(path))
    }
}

fn damaged(path: &Path) -> Error {
    Error::format(
        path,
        None,
        "the saved scene is damaged or cut off",
        DAMAGED_ADVICE,
    )
}

/// The header of a file of this version.
fn header(path: &Path, bytes: &[u8]) -> Result<Header> {
    let error = |problem: &str, advice: &str| Err(Error::format(path, None, problem, advice));
    let Some(start) = bytes.get(..HEADER_BYTES) else {
        return match bytes.starts_with(&MAGIC) {
            true => Err(damaged(path)),
            false => error("is no saved scene", "give the path of a saved scene"),
        };
    };
    let header = Header::load(&mut Reader::new(start));
    if header.magic != magic() {
        return error("is no saved scene", "give the path of a saved scene");
    }
    match header.version.cmp(&VERSION) {
        std::cmp::Ordering::Greater => error(
            "the scene was saved by a newer version of Foresound",
            "save the scene again with this version, or use the newer one",
        ),
        std::cmp::Ordering::Less => error(
            "the scene was saved by an older version of Foresound",
            "save the scene again with this version",
        ),
        std::cmp::Ordering::Equal => Ok(header),
    }
}

/// The scene of a content; none if it contradicts itself.
fn restored(content: &[u8]) -> Option<Scene> {
    let mut from = Reader::new(content);
    let sound = Sound::load(&mut from);
    let mesh = CommittedMesh::load(&mut from);
    let tree = SavedTree::load(&mut from);
    let edges = EdgeSet::load(&mut from);
    let finite_panels = FinitePanels::load(&mut from);
    let reflectances: Vec<Reflectance> = Vec::load(&mut from);
    let materials: Vec<Material> = Vec::load(&mut from);
    let surfaces = mesh.surfaces.surfaces.len();
    let is_consistent = from.is_sound()
        && mesh.is_consistent()
        && edges.is_consistent(&mesh.surfaces)
        && finite_panels.is_consistent(surfaces)
        && reflectances.len() == mesh.materials.len()
        && materials.len() == mesh.materials.len()
        && sound.speed_of_sound_m_s > 0.0
        && sound.length_scale > 0.0;
    if !is_consistent {
        return None;
    }
    let groups = &mesh.surfaces.triangle_surface;
    let bvh = tree.restore(&mesh.vertices, &mesh.triangles, groups)?;
    Some(Scene {
        bvh: Arc::new(bvh),
        edges: Arc::new(edges),
        finite_panels: Arc::new(finite_panels),
        reflectances: reflectances.into(),
        transmission_factors: materials
            .iter()
            .map(Material::transmission_factor)
            .collect(),
        materials: materials.into(),
        speed_of_sound_m_s: sound.speed_of_sound_m_s,
        length_scale: sound.length_scale,
        air_np_per_m: sound.air_np_per_m,
        high_air_np_per_m: sound.high_air_np_per_m,
        acoustic_tolerance_m: sound.acoustic_tolerance_m,
        blocks: TriangleBlocks::build(&mesh.vertices, &mesh.triangles),
        diagonal_m: sound.diagonal_m,
        mesh: Arc::new(mesh),
        instances: Instances::default(),
    })
}
