//! Mesh files of every format, written here byte by byte: the same room has the same paths, whatever the format.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a helper's failure is the test's"
)]

mod glb;
mod gltf_files;
mod ply_files;

use std::path::PathBuf;
use std::sync::Arc;

use foresound::propagation::{Path, PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, MeshFile, MeshOptions, Scene, SceneSettings, SourceId, SourcePose,
    load_mesh,
};
use foresound::{Error, Result};

/// Corners of the room of 8 m x 3 m x 5 m, in the order of the bits of their number: x, y, z.
pub(crate) fn corners(size: [f32; 3]) -> Vec<[f32; 3]> {
    let corner = |n: usize| [0, 1, 2].map(|axis| if n >> axis & 1 == 1 { size[axis] } else { 0.0 });
    (0..8).map(corner).collect()
}

pub(crate) const SIZE: [f32; 3] = [8.0, 3.0, 5.0];

/// Walls by their corners, in the order of the ring.
pub(crate) const WALLS: [[u32; 4]; 6] = [
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
];

/// Triangles of [`WALLS`], as a fan cuts them.
pub(crate) fn triangles() -> Vec<u32> {
    WALLS
        .iter()
        .flat_map(|&[a, b, c, d]| [a, b, c, a, c, d])
        .collect()
}

fn obj() -> String {
    let vertices = corners(SIZE);
    let vertices = vertices.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let faces = WALLS.iter().map(|wall| {
        let [a, b, c, d] = wall.map(|corner| corner + 1);
        format!("f {a} {b} {c} {d}\n")
    });
    vertices.chain(faces).collect()
}

/// Reads bytes as a file of a name in a folder of its own.
pub(crate) fn read_with(name: &str, bytes: &[u8], options: &MeshOptions) -> Result<MeshFile> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    load_mesh(&path, options)
}

pub(crate) fn read(name: &str, bytes: &[u8]) -> MeshFile {
    read_with(name, bytes, &MeshOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The text of the error behind the file's name; one line.
pub(crate) fn problem(name: &str, bytes: &[u8]) -> String {
    let error = read_with(name, bytes, &MeshOptions::default()).unwrap_err();
    let text = error.to_string();
    assert_eq!(text.lines().count(), 1, "{text}");
    let (_, problem) = text.split_once(name).unwrap_or_else(|| panic!("{text}"));
    problem.to_owned()
}

/// All paths of the room in one update, of concrete throughout.
pub(crate) fn paths(file: &MeshFile) -> Vec<Path> {
    let mut mesh = file.mesh.clone();
    mesh.material_names = vec!["concrete".into(); mesh.material_names.len()];
    let scene =
        Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default()).unwrap();
    let settings = PropagationSettings {
        guide_rays: 256,
        ..Default::default()
    };
    let mut propagator = Propagator::new(Arc::new(scene), settings).unwrap();
    let mut set = PathSet::default();
    let source = SourcePose::at(SourceId::new(0, 0), [2.0, 1.5, 1.0]);
    propagator.update(
        &ListenerPose::facing([5.5, 1.7, 3.5], 0.0),
        &[source],
        0.0,
        &mut set,
    );
    assert!(set.paths.len() > 30, "{} paths", set.paths.len());
    set.paths
}

#[test]
fn the_same_room_in_every_format_has_the_same_paths() {
    let expected = paths(&read("room.obj", obj().as_bytes()));
    let unit_cube = glb::Model::room([1.0; 3]).with_node(r#""scale":[8,3,5]"#);
    for (name, bytes) in [
        ("text.ply", ply_files::text()),
        ("little.ply", ply_files::binary(false)),
        ("big.ply", ply_files::binary(true)),
        ("room.glb", glb::Model::room(SIZE).glb()),
        ("room.gltf", glb::Model::room(SIZE).text()),
        ("scaled.glb", unit_cube.glb()),
        // The content tells the format, not the name.
        ("glb_by_mistake.obj", glb::Model::room(SIZE).glb()),
    ] {
        assert_eq!(paths(&read(name, &bytes)), expected, "{name}");
    }
}

#[test]
fn scale_and_up_axis_hold_for_every_format() {
    let options = MeshOptions::default()
        .with_scale(0.5)
        .with_up(foresound::scene::UpAxis::Z);
    let of_obj = read_with("room.obj", obj().as_bytes(), &options).unwrap();
    for (name, bytes) in [
        ("room.ply", ply_files::text()),
        ("room.glb", glb::Model::room(SIZE).glb()),
    ] {
        let file = read_with(name, &bytes, &options).unwrap();
        let places = |file: &MeshFile| {
            let mesh = &file.mesh;
            let corners = mesh.triangles.iter().flatten();
            corners
                .map(|&c| mesh.vertices[c as usize])
                .collect::<Vec<_>>()
        };
        assert_eq!(places(&file), places(&of_obj), "{name}");
    }
}

#[test]
fn other_formats_are_refused_by_name() {
    for (bytes, expected) in [
        (
            &b"Kaydara FBX Binary  \0\x1a\0"[..],
            "is an FBX file, which is not read; export the model as glTF",
        ),
        (b"<?xml version=\"1.0\"?><COLLADA/>", "is a COLLADA file"),
        (b"BLENDER-v300", "is a Blender file"),
        (b"solid x\n", "is an STL file"),
        (b"ISO-10303-21;", "is a STEP or IFC file"),
        (
            b"PK\x03\x04rest",
            "is a ZIP archive, which is not read; unpack it",
        ),
        (b"RIFF....WAVE", "is a RIFF file such as WAV"),
    ] {
        let text = problem("model", bytes);
        assert!(text.starts_with(&format!(": {expected}")), "{text}");
    }
}

#[test]
fn a_file_beside_that_is_missing_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.gltf");
    let model = glb::Model::room(SIZE);
    std::fs::write(&path, model.document(r#""uri":"the%20room.bin","#)).unwrap();
    let error = load_mesh(&path, &MeshOptions::default()).unwrap_err();
    assert!(matches!(error, Error::File { .. }), "{error}");
    assert!(
        error.to_string().contains("the room.bin: No such file"),
        "{error}"
    );
    let binary: PathBuf = folder.path().join("the room.bin");
    std::fs::write(&binary, &model.binary).unwrap();
    assert_eq!(
        load_mesh(&path, &MeshOptions::default()).unwrap(),
        read("room.glb", &model.glb())
    );
    // A buffer that is shorter than the document says.
    std::fs::write(&binary, &model.binary[..50]).unwrap();
    let error = load_mesh(&path, &MeshOptions::default()).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("the room.bin: the file is shorter than it says"),
        "{error}"
    );
}
