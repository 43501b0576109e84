//! Tells mesh formats apart by content, and reads those that are known.
//!
//! Control side. A file's name says nothing: an exporter's mistake is found, and unknown formats are refused by name.

use std::io::{BufRead, BufReader};
use std::path::Path;

use super::mesh_file::{MeshFile, MeshOptions, Position};
use super::{obj, ply};
use crate::error::{Error, Result};

/// What to do about a path without a file.
const PATH_ADVICE: &str = "give the path of a readable OBJ, PLY or glTF file";

/// Optional first bytes of a UTF-8 text.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Bytes of a binary STL file before its triangles, and of a triangle.
const STL_HEADER: u64 = 84;
const STL_TRIANGLE: u64 = 50;

/// Advice for formats that modellers convert.
const EXPORT: &str = "export the model as glTF, GLB, OBJ or PLY";

/// Formats that are not read: first bytes, name and advice. The bytes are those of the formats' descriptions.
const FOREIGN: [(&[u8], &str, &str); 26] = [
    (b"\x89FSCENE\n", "a saved scene", "load it by Scene::load"),
    (b"Kaydara FBX Binary", "an FBX file", EXPORT),
    (b"; FBX", "an FBX file", EXPORT),
    (b"BLENDER", "a Blender file", EXPORT),
    (
        b"\x28\xb5\x2f\xfd",
        "a file packed by zstd, as Blender's are",
        EXPORT,
    ),
    (b"solid ", "an STL file", EXPORT),
    (b"PXR-USDC", "a USD file", EXPORT),
    (b"#usda", "a USD file", EXPORT),
    (b"#VRML", "a VRML file", EXPORT),
    (b"#X3D", "an X3D file", EXPORT),
    (b"ISO-10303-21", "a STEP or IFC file", EXPORT),
    (b"OFF\n", "an OFF file", EXPORT),
    (b"OFF\r", "an OFF file", EXPORT),
    (b"MM", "a 3DS file", EXPORT),
    (b"AC10", "a DWG drawing", EXPORT),
    (b"  0\nSECTION", "a DXF drawing", EXPORT),
    (b"  0\r\nSECTION", "a DXF drawing", EXPORT),
    (b"FORM", "a LightWave file", EXPORT),
    (b"\xff\xfeS\0k\0e\0t\0c\0h\0U\0p", "a SketchUp file", EXPORT),
    (b"\xff\xfe\xff\x0e", "a SketchUp file", EXPORT),
    (b"DRACO", "a Draco file", EXPORT),
    (
        b"PK\x03\x04",
        "a ZIP archive",
        "unpack it, and give the model inside",
    ),
    (
        b"\x1f\x8b",
        "a gzip archive",
        "unpack it, and give the model inside",
    ),
    (b"\x89PNG", "a PNG picture", "give a model"),
    (b"RIFF", "a RIFF file such as WAV", "give a model"),
    (b"%PDF", "a PDF document", "give a model"),
];

/// Words within the first bytes of an XML text, with the format.
const FOREIGN_XML: [(&str, &str); 4] = [
    ("<COLLADA", "a COLLADA file"),
    ("<X3D", "an X3D file"),
    ("<!DOCTYPE X3D", "an X3D file"),
    ("<?xml", "an XML file"),
];

/// A format, by its first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Obj,
    Ply,
    Glb,
    Gltf,
    /// Name and advice of what is not read.
    Foreign(&'static str, &'static str),
}

impl Format {
    /// The format of a file by its first bytes and its length. What no other format begins with may be OBJ.
    fn of(start: &[u8], length: u64) -> Self {
        if start.starts_with(b"glTF") {
            return Self::Glb;
        }
        if start.starts_with(b"ply\n") || start.starts_with(b"ply\r") {
            return Self::Ply;
        }
        let triangles = start.get(80..84).and_then(|count| count.try_into().ok());
        let triangles = u64::from(triangles.map_or(0, u32::from_le_bytes));
        if triangles > 0 && length == STL_HEADER + STL_TRIANGLE * triangles {
            return Self::Foreign("an STL file", EXPORT);
        }
        if let Some(&(_, name, advice)) = FOREIGN.iter().find(|f| start.starts_with(f.0)) {
            return Self::Foreign(name, advice);
        }
        let text = start.strip_prefix(BYTE_ORDER_MARK).unwrap_or(start);
        let text = text.trim_ascii_start();
        if text.starts_with(b"{") {
            return Self::Gltf;
        }
        if text.starts_with(b"<") {
            let text = String::from_utf8_lossy(text);
            if let Some(&(_, name)) = FOREIGN_XML.iter().find(|(word, _)| text.contains(word)) {
                return Self::Foreign(name, EXPORT);
            }
        }
        Self::Obj
    }
}

/// Reads a mesh file: Wavefront OBJ, PLY (text and binary), glTF 2.0 and GLB, told apart by content. glTF needs the feature
/// `gltf`.
///
/// Polygons of any number of corners are cut into triangles, concave ones too. Materials have the names of `usemtl` in OBJ,
/// of materials or `acoustic_material` in glTF, and `default` where a face has none. Instances and scaled nodes of glTF
/// become triangles at their places.
///
/// # Errors
/// [`Error::Setting`] for a scale that is not above zero; [`Error::File`] where the file, or one that it refers to, cannot be
/// read; [`Error::Format`] for another format, broken content, a face that refers to no vertex, a vertex in use that is not
/// finite or farther out than `LARGEST_COORDINATE_M`, more of anything than [`MeshOptions::max_triangles`] allows, an
/// extension that glTF requires and this reader lacks, and a file without faces.
///
/// # Examples
/// ```
/// use foresound::mesh::{MeshOptions, load_mesh};
///
/// let path = std::env::temp_dir().join("foresound_load_mesh_example.obj");
/// std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 1 0 1\nusemtl wood_floor\nf 1 2 3\n")?;
/// let file = load_mesh(&path, &MeshOptions::default())?;
/// assert_eq!(file.mesh.material_names, ["wood_floor"]);
/// # std::fs::remove_file(&path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn load_mesh(path: &Path, options: &MeshOptions) -> Result<MeshFile> {
    options.check()?;
    let file = super::open(path, PATH_ADVICE)?;
    let length = file.metadata().map_or(0, |metadata| metadata.len());
    let mut input = BufReader::with_capacity(1 << 16, file);
    let start = input.fill_buf().map_err(|_| super::unreadable(path))?;
    match Format::of(start, length) {
        Format::Obj => obj::read(path, input, options),
        Format::Ply => ply::read(path, input, options),
        #[cfg(feature = "gltf")]
        Format::Glb => super::gltf::read_glb(path, input, options),
        #[cfg(feature = "gltf")]
        Format::Gltf => super::gltf::read_text(path, input, options),
        #[cfg(not(feature = "gltf"))]
        Format::Glb | Format::Gltf => Err(unread(
            path,
            "a glTF file",
            "build the library with its feature `gltf`, or export the model as OBJ or PLY",
        )),
        Format::Foreign(name, advice) => Err(unread(path, name, advice)),
    }
}

fn unread(path: &Path, name: &str, advice: &str) -> Error {
    Position { path, line: None }.error(format!("is {name}, which is not read"), advice)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_told_by_their_first_bytes() {
        let stl = [&[b'x'; 80][..], &2u32.to_le_bytes(), &[0; 100]].concat();
        let name = |start: &[u8]| match Format::of(start, start.len() as u64) {
            Format::Foreign(name, _) => name,
            known => panic!("{known:?}"),
        };
        assert_eq!(name(&stl), "an STL file");
        assert_eq!(name(b"solid x\nfacet"), "an STL file");
        assert_eq!(name(b"Kaydara FBX Binary  \0\x1a\0"), "an FBX file");
        assert_eq!(name(b"PK\x03\x04"), "a ZIP archive");
        let collada = b"\xef\xbb\xbf<?xml version=\"1.0\"?>\n<COLLADA xmlns";
        assert_eq!(name(collada), "a COLLADA file");
        for (start, expected) in [
            (&b"ply\r\nformat"[..], Format::Ply),
            (b"glTF\x02\0\0\0", Format::Glb),
            (b"\xef\xbb\xbf \n{\"asset\"", Format::Gltf),
            (b"# a comment\nv 0 0 0", Format::Obj),
            (b"plywood", Format::Obj),
            (b"", Format::Obj),
        ] {
            assert_eq!(Format::of(start, start.len() as u64), expected);
        }
    }
}
