//! Reads glTF 2.0 and GLB files (\[GLTF2\]): the nodes of the default scene with their meshes, in metres and +y up.
//!
//! Control side. The crate `gltf` panics over quantised positions and has no way to refuse extensions by name, so the
//! document is read with `serde_json` and every index and range is checked here. Skins and morph targets are left in their
//! resting shape.

mod accessors;
mod acoustics;
mod buffers;
mod document;
mod placements;
mod primitives;

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};

use super::mesh_file::{MeshFile, MeshOptions, Position, UNNAMED_MATERIAL, UpAxis, shortened};
use super::unreadable;
use crate::error::{Error, Result};
use crate::scene::materials::MaterialTable;
use crate::scene::mesh::TriangleMesh;
use accessors::Accessors;
use buffers::{Buffers, missing};
use document::{Document, Node};

/// What to do about broken content.
const ADVICE: &str = "export the model again; Khronos' glTF Validator lists what is broken";

const FILE_ADVICE: &str = "keep the files that a .gltf refers to beside it, or export one GLB file";

/// Bytes of the longest document, with its base64.
const LONGEST_DOCUMENT: u64 = 1 << 29;

/// Type of the chunk of a GLB that is the document.
const JSON_CHUNK: &[u8] = b"JSON";
/// Bytes of a chunk's header.
const CHUNK_HEADER: u64 = 8;

/// Starts of the names of extensions that change nothing here, or that are read.
const HARMLESS: [&str; 10] = [
    "EXT_lights_",
    "EXT_mesh_gpu_instancing",
    "EXT_texture_",
    "KHR_animation_",
    "KHR_lights_",
    "KHR_materials_",
    "KHR_mesh_quantization",
    "KHR_texture_",
    "KHR_xmp",
    "MSFT_texture_",
];

/// Reads a GLB file.
///
/// # Errors
/// As [`load_mesh`](super::formats::load_mesh).
pub(super) fn read_glb(
    path: &Path,
    mut input: BufReader<File>,
    options: &MeshOptions,
) -> Result<MeshFile> {
    let position = Position { path, line: None };
    let mut head = [0; 20];
    let broken = || {
        position.error(
            "the GLB file is broken or cut off",
            "copy or export the file again",
        )
    };
    input.read_exact(&mut head).map_err(|_| broken())?;
    let word = |at: usize| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
    if word(4) != 2 {
        return Err(old_version(position, &word(4).to_string()));
    }
    let length = u64::from(word(12));
    if head[16..] != *JSON_CHUNK || length > LONGEST_DOCUMENT {
        return Err(broken());
    }
    let mut text = Vec::new();
    let read = input.by_ref().take(length).read_to_end(&mut text);
    read.map_err(|_| unreadable(path))?;
    if text.len() as u64 != length {
        return Err(broken());
    }
    let start = input.stream_position().map_err(|_| unreadable(path))? + CHUNK_HEADER;
    read_document(position, &text, Some((input, start)), options)
}

/// Reads a glTF file that is a text.
///
/// # Errors
/// As [`load_mesh`](super::formats::load_mesh).
pub(super) fn read_text(
    path: &Path,
    input: BufReader<File>,
    options: &MeshOptions,
) -> Result<MeshFile> {
    let position = Position { path, line: None };
    let mut text = Vec::new();
    let read = input.take(LONGEST_DOCUMENT + 1).read_to_end(&mut text);
    read.map_err(|_| unreadable(path))?;
    if text.len() as u64 > LONGEST_DOCUMENT {
        let problem = format!("larger than {} MiB", LONGEST_DOCUMENT >> 20);
        return Err(position.error(problem, FILE_ADVICE));
    }
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&text);
    read_document(position, text, None, options)
}

fn old_version(position: Position, version: &str) -> Error {
    let problem = format!("glTF {}, which is not read", shortened(version));
    position.error(problem, "export the model as glTF 2.0")
}

/// The error of an extension that a file cannot do without.
fn unsupported(position: Position, extension: &str) -> Error {
    let problem = format!(
        "needs the glTF extension {}, which is not read",
        extension.replace(char::is_control, "?")
    );
    let advice = match extension {
        primitives::DRACO => "export without Draco compression",
        "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            "export without meshopt compression (gltfpack without -c)"
        }
        _ => "export without this extension",
    };
    position.error(problem, advice)
}

fn read_document(
    position: Position,
    text: &[u8],
    binary: Option<(BufReader<File>, u64)>,
    options: &MeshOptions,
) -> Result<MeshFile> {
    let document: Document = serde_json::from_slice(text).map_err(|error| {
        let line = (binary.is_none()).then_some(error.line().max(1));
        let text = error.to_string().replace(char::is_control, " ");
        let problem = text.split(" at line ").next().unwrap_or_default();
        Position { line, ..position }.error(format!("no glTF document: {problem}"), ADVICE)
    })?;
    if !document.asset.version.starts_with("2.") {
        return Err(old_version(position, &document.asset.version));
    }
    let is_unknown = |name: &&String| !HARMLESS.iter().any(|start| name.starts_with(start));
    if let Some(extension) = document.extensions_required.iter().find(is_unknown) {
        return Err(unsupported(position, extension));
    }
    let most_items = options.max_triangles.saturating_mul(3);
    let buffers = Buffers::new(position, &document, binary);
    let mut reader = Reader {
        position,
        options,
        document: &document,
        accessors: Accessors::new(position, &document, buffers, most_items),
        meshes: document.meshes.iter().map(|_| None).collect(),
        mesh: TriangleMesh::default(),
        materials: MaterialTable::default(),
        unused: 0,
        resting: 0,
    };
    let units = f64::from(options.scale);
    let turn = match options.up {
        UpAxis::Y => DMat3::IDENTITY,
        UpAxis::Z => DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y),
    };
    let root = DAffine3::from_mat3(turn * units);
    placements::visit(position, &document, root, &mut |node, placement| {
        reader.place(node, placement)
    })?;
    reader.finish()
}

/// The mesh so far.
struct Reader<'a> {
    position: Position<'a>,
    options: &'a MeshOptions,
    document: &'a Document,
    accessors: Accessors<'a>,
    /// Meshes that were read, in their own coordinates.
    meshes: Vec<Option<TriangleMesh>>,
    mesh: TriangleMesh,
    materials: MaterialTable,
    /// Primitives that are points or lines.
    unused: usize,
    /// Nodes with skins and primitives with morph targets.
    resting: usize,
}

impl Reader<'_> {
    /// Adds a node's mesh, once or by its instances.
    fn place(&mut self, node: &Node, placement: &DAffine3) -> Result<()> {
        let Some(index) = node.mesh else {
            return Ok(());
        };
        let count = self.meshes.len();
        let slot = self.meshes.get(index);
        if slot
            .ok_or_else(|| missing(self.position, "mesh", index, count))?
            .is_none()
        {
            self.meshes[index] = Some(self.read_mesh(index)?);
        }
        self.resting += usize::from(node.skin.is_some());
        let name = node.name.as_deref().unwrap_or("node");
        let own = acoustics::material_name(
            self.position,
            node.extras.as_ref(),
            name,
            &mut self.materials,
        )?;
        let instances = match &node.extensions.instancing {
            None => vec![DAffine3::IDENTITY],
            Some(instancing) => {
                placements::instances(self.position, instancing, &mut self.accessors)?
            }
        };
        let Some(part) = &self.meshes[index] else {
            return Ok(());
        };
        let most = self.options.max_triangles;
        for instance in instances {
            let start = self.mesh.triangles.len();
            self.position
                .check_count((start + part.triangles.len()) as u64, most, "triangles")?;
            self.mesh.append(part, &(*placement * instance))?;
            if let Some(own) = &own {
                let material = self.mesh.material(own);
                self.mesh.triangle_materials[start..].fill(material);
            }
        }
        Ok(())
    }

    /// The triangles of a mesh, in its own coordinates.
    fn read_mesh(&mut self, index: usize) -> Result<TriangleMesh> {
        let mut mesh = TriangleMesh::default();
        let document = self.document;
        let source = &document.meshes[index];
        let name = source.name.as_deref().unwrap_or("mesh");
        let own = acoustics::material_name(
            self.position,
            source.extras.as_ref(),
            name,
            &mut self.materials,
        )?;
        for primitive in &source.primitives {
            let name = match (&own, primitive.material) {
                (Some(own), _) => own.clone(),
                (None, Some(material)) => self.material_name(material)?,
                (None, None) => UNNAMED_MATERIAL.to_owned(),
            };
            let material = mesh.material(&name);
            let most = self.options.max_triangles;
            let is_used = primitives::add(
                &mut mesh,
                self.position,
                primitive,
                material,
                &mut self.accessors,
                most,
            )?;
            self.unused += usize::from(!is_used);
            self.resting += usize::from(!primitive.targets.is_empty());
        }
        Ok(mesh)
    }

    /// Name of a material: that of its extras, its own, or its number.
    fn material_name(&mut self, index: usize) -> Result<String> {
        let materials = &self.document.materials;
        let count = materials.len();
        let material = materials
            .get(index)
            .ok_or_else(|| missing(self.position, "material", index, count))?;
        let name = material
            .name
            .clone()
            .unwrap_or_else(|| format!("material_{index}"));
        let own = acoustics::material_name(
            self.position,
            material.extras.as_ref(),
            &name,
            &mut self.materials,
        )?;
        Ok(own.unwrap_or(name))
    }

    fn finish(mut self) -> Result<MeshFile> {
        if self.mesh.triangles.is_empty() {
            return Err(self.position.error(
                "empty mesh: no node of the scene has triangles",
                "export the model with its meshes, in the scene that is shown",
            ));
        }
        self.position.check_vertices(&self.mesh.vertices)?;
        self.mesh.drop_unused_materials();
        let path = self.position.path.display();
        let mut warnings = Vec::new();
        if self.unused > 0 {
            warnings.push(format!(
                "{path}: {} primitives of points or lines are left out; only triangles reflect",
                self.unused
            ));
        }
        if self.resting > 0 {
            warnings.push(format!(
                "{path}: {} skins or morph targets are left in their resting shape",
                self.resting
            ));
        }
        Ok(MeshFile {
            mesh: self.mesh,
            materials: self.materials,
            warnings,
        })
    }
}
