//! glTF: hierarchies, instances, every kind of accessor, acoustic extras, and what is refused.

use foresound::scene::{MaterialTable, MeshFile, MeshOptions, Scene, SceneSettings};
use glam::Vec3;

use super::glb::Model;
use super::{SIZE, paths, problem, read, read_with};

/// Lowest and highest coordinates.
fn bounds(file: &MeshFile) -> [Vec3; 2] {
    let points = &file.mesh.vertices;
    let low = points.iter().copied().reduce(Vec3::min).unwrap();
    [low, points.iter().copied().reduce(Vec3::max).unwrap()]
}

/// Volume that a mesh encloses: positive if its triangles are wound outward.
fn volume_m3(file: &MeshFile) -> f32 {
    let mesh = &file.mesh;
    let of_triangle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|corner| mesh.vertices[corner as usize]);
        a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles.iter().map(of_triangle).sum()
}

#[test]
fn nodes_place_turn_and_scale_their_meshes() {
    // A quarter turn about +y takes x to −z; the parent moves it and doubles its height.
    let rest = r#""nodes":[{"children":[1],"matrix":[1,0,0,0, 0,2,0,0, 0,0,1,0, 10,0,0,1]},{"mesh":0,"rotation":[0,0.7071068,0,0.7071068]}]"#;
    let model = Model::room(SIZE).with(r#""nodes":[{"mesh":0}]"#, rest);
    let file = read("house.glb", &model.glb());
    let [low, high] = bounds(&file);
    assert!(low.abs_diff_eq(Vec3::new(10.0, 0.0, -8.0), 1e-5), "{low}");
    assert!(high.abs_diff_eq(Vec3::new(15.0, 6.0, 0.0), 1e-5), "{high}");
    assert_eq!(file.mesh.triangles.len(), 12);
}

#[test]
fn instances_share_a_mesh_and_mirrored_ones_keep_their_outside() {
    let plain = read("room.glb", &Model::room(SIZE).glb());
    let twice = Model::room(SIZE)
        .with(r#""nodes":[0]"#, r#""nodes":[0,1]"#)
        .with(
            r#"[{"mesh":0}]"#,
            r#"[{"mesh":0},{"mesh":0,"translation":[20,0,0],"scale":[-1,1,1]}]"#,
        );
    let file = read("rooms.glb", &twice.glb());
    assert_eq!(file.mesh.triangles.len(), 24);
    assert!((volume_m3(&file) - 2.0 * volume_m3(&plain)).abs() < 1e-3);
    let scene = Scene::commit(
        &file.mesh,
        &MaterialTable::built_in(),
        &SceneSettings::default(),
    );
    assert!(scene.unwrap().report().watertight);
    // Nodes outside the scene that is shown are left out.
    let unused = twice.with(r#""nodes":[0,1]"#, r#""nodes":[1]"#);
    assert_eq!(read("room.glb", &unused.glb()).mesh.triangles.len(), 12);
}

#[test]
fn instances_of_one_node_are_placed() {
    let mut model = Model::room(SIZE)
        .with(r#"{"mesh":0}"#, r#"{"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":2}}}}"#)
        .with(r#""type":"SCALAR"}]"#, r#""type":"SCALAR"},{"bufferView":2,"componentType":5126,"count":2,"type":"VEC3"}]"#)
        .with(r#""byteLength":72}]"#, r#""byteLength":72},{"buffer":0,"byteOffset":168,"byteLength":24}]"#);
    let places = [0.0f32, 0.0, 0.0, 0.0, 0.0, 30.0];
    model
        .binary
        .extend(places.iter().flat_map(|n| n.to_le_bytes()));
    let file = read("rooms.glb", &model.glb());
    assert_eq!(file.mesh.triangles.len(), 24);
    assert_eq!(bounds(&file)[1], Vec3::new(8.0, 3.0, 35.0));
}

#[test]
fn quantised_positions_are_read() {
    // 16-bit shares of 32,767, four to an entry of 8 bytes, scaled back by the node: `KHR_mesh_quantization`.
    let mut model = Model::room(SIZE)
        .with_node(r#""scale":[8,3,5]"#)
        .with(
            r#""componentType":5126,"count":8"#,
            r#""componentType":5122,"normalized":true,"count":8"#,
        )
        .with(r#""byteLength":96}"#, r#""byteLength":64,"byteStride":8}"#)
        .with(r#""byteOffset":96"#, r#""byteOffset":64"#)
        .with(
            r#""scene":0"#,
            r#""extensionsRequired":["KHR_mesh_quantization"],"scene":0"#,
        );
    let indices = model.binary.split_off(96);
    let corner = |[x, y, z]: [f32; 3]| [x, y, z, 0.5].map(|n| (n * 32_767.0) as i16);
    let values = super::corners([1.0; 3]).into_iter().flat_map(corner);
    model.binary = values.flat_map(i16::to_le_bytes).collect();
    model.binary.extend(indices);
    let expected = paths(&read("room.glb", &Model::room(SIZE).glb()));
    assert_eq!(paths(&read("small.glb", &model.glb())), expected);
}

#[test]
fn sparse_accessors_replace_corners() {
    // All corners are zero but those that the sparse part names: as the room, from no buffer view.
    let sparse = r#""sparse":{"count":7,"indices":{"bufferView":2,"componentType":5121},"values":{"bufferView":0,"byteOffset":12}},"#;
    let mut model = Model::room(SIZE)
        .with(
            r#"[{"bufferView":0,"componentType":5126"#,
            &format!(r#"[{{{sparse}"componentType":5126"#),
        )
        .with(
            r#""byteLength":72}]"#,
            r#""byteLength":72},{"buffer":0,"byteOffset":168,"byteLength":7}]"#,
        );
    model.binary.extend([1, 2, 3, 4, 5, 6, 7]);
    let expected = read("room.glb", &Model::room(SIZE).glb());
    assert_eq!(read("sparse.glb", &model.glb()), expected);
    let text = problem("sparse.glb", &{
        *model.binary.last_mut().unwrap() = 8;
        model.glb()
    });
    assert!(
        text.starts_with(": glTF accessor 0 has a sparse index beyond its items"),
        "{text}"
    );
}

/// The room with a material of these keys.
fn with_material(keys: &str) -> Vec<u8> {
    Model::room(SIZE)
        .with(r#""indices":1"#, r#""indices":1,"material":0"#)
        .with(
            r#""scene":0"#,
            &format!(r#""materials":[{{{keys}}}],"scene":0"#),
        )
        .glb()
}

#[test]
fn materials_and_their_extras_reach_the_scene() {
    let names = |keys: &str| read("room.glb", &with_material(keys)).mesh.material_names;
    assert_eq!(names(r#""name":"Old Wall""#), ["Old Wall"]);
    assert_eq!(names(r#""alphaMode":"OPAQUE""#), ["material_0"]);
    assert_eq!(
        names(r#""name":"Blue","extras":{"acoustic_material":"carpet","x":1}"#),
        ["carpet"]
    );
    let velvet = r#""name":"Velvet","extras":{"acoustic_absorption":[0.05,0.07,0.31,0.49,0.75,0.7,0.6,0.6],"acoustic_scattering":0.3,"acoustic_transmission_loss_db":20}"#;
    let file = read("room.glb", &with_material(velvet));
    let material = &file.materials.get("Velvet").unwrap().material;
    assert_eq!(
        (material.absorption[3], material.scattering[7]),
        (0.49, 0.3)
    );
    assert!((material.transmission[0] - 0.01).abs() < 1e-6);
    // An object's own property counts for all of its mesh.
    let object = Model::room(SIZE)
        .with_node(r#""name":"stage","extras":{"acoustic_material":"wood_floor"}"#);
    assert_eq!(
        read("room.glb", &object.glb()).mesh.material_names,
        ["wood_floor"]
    );
}

#[test]
fn broken_extras_name_their_material() {
    for (extras, expected) in [
        (
            r#""acoustic_absorption":1.5"#,
            "extras of `Wall`: 1.5 is outside 0 to 1; give a number",
        ),
        (
            r#""acoustic_absorption":[1,0]"#,
            "extras of `Wall`: 2 numbers instead of 8; give one",
        ),
        (
            r#""acoustic_absorbtion":1"#,
            "extras of `Wall`: unknown field `acoustic_absorbtion`",
        ),
        (
            r#""acoustic_scattering":1"#,
            "extras of `Wall` have no `acoustic_absorption`",
        ),
        (
            r#""acoustic_absorption":0.1,"acoustic_transmission":0.2"#,
            "material `Wall` transmits 0.200 but absorbs",
        ),
    ] {
        let keys = format!(r#""name":"Wall","extras":{{{extras}}}"#);
        let text = problem("room.glb", &with_material(&keys));
        assert!(text.starts_with(&format!(": {expected}")), "{text}");
    }
}

#[test]
fn what_is_not_read_is_refused_by_name() {
    let requiring = |name: &str| {
        let keys = format!(r#""extensionsRequired":["KHR_materials_unlit","{name}"],"scene":0"#);
        problem(
            "room.glb",
            &Model::room(SIZE).with(r#""scene":0"#, &keys).glb(),
        )
    };
    for (name, advice) in [
        (
            "KHR_draco_mesh_compression",
            "export without Draco compression",
        ),
        (
            "EXT_meshopt_compression",
            "export without meshopt compression",
        ),
        ("KHR_something_new", "export without this extension"),
    ] {
        let expected = format!(": needs the glTF extension {name}, which is not read; {advice}");
        assert!(requiring(name).starts_with(&expected));
    }
    let old = Model::room(SIZE).document("").replace("2.0", "1.0");
    assert!(
        problem("old.gltf", old.as_bytes()).starts_with(": glTF 1.0, which is not read; export")
    );
    let mut old = Model::room(SIZE).glb();
    old[4] = 1;
    assert!(problem("old.glb", &old).starts_with(": glTF 1, which is not read"));
}

#[test]
fn broken_documents_say_what_is_wrong() {
    let room = || Model::room(SIZE);
    for (model, expected) in [
        (
            room().with(r#""mesh":0"#, r#""mesh":7"#),
            "glTF refers to mesh 7 of 1; export",
        ),
        (
            room().with(r#""nodes":[0]"#, r#""nodes":[3]"#),
            "glTF refers to node 3 of 1",
        ),
        (
            room().with(r#""POSITION":0"#, r#""POSITION":9"#),
            "glTF refers to accessor 9 of 2",
        ),
        (
            room().with(r#""bufferView":1"#, r#""bufferView":5"#),
            "glTF refers to buffer view 5 of 2",
        ),
        (
            room().with(r#""count":8"#, r#""count":9"#),
            "glTF data that reaches beyond its buffer view 0",
        ),
        (
            room().with(r#""count":8"#, r#""count":7"#),
            "glTF refers to vertex 7 of 7",
        ),
        (
            room().with("5123", "5126"),
            "glTF accessor 1 has indices that are no whole numbers",
        ),
        (
            room().with("VEC3", "VEC2"),
            "glTF accessor 0 has a type that is not VEC3",
        ),
        (
            room().with("5126", "5130"),
            "glTF accessor 0 has an unknown component type",
        ),
        (
            room().with_node(r#""children":[0]"#),
            "glTF node 0 has two parents or is its own ancestor",
        ),
        (
            room().with(r#""indices":1"#, r#""indices":1,"mode":1"#),
            "empty mesh: no node of the scene has triangles",
        ),
        (
            room().with_node(r#""scale":[1e6,1,1]"#),
            "vertex (8000000 0 0) lies beyond 100000 m",
        ),
        (
            room().with(r#""count":8"#, r#""count":99999999999"#),
            "more than 12582912 vertices",
        ),
    ] {
        let text = problem("room.glb", &model.glb());
        assert!(text.starts_with(&format!(": {expected}")), "{text}");
    }
    let whole = room().glb();
    for end in [15, 40, whole.len() - 60] {
        let text = problem("room.glb", &whole[..end]);
        assert!(
            text.contains("cut off") || text.contains("shorter than it says"),
            "{text}"
        );
    }
    let text = problem("room.gltf", b"{\n\"asset\": }");
    assert!(
        text.starts_with(":2: no glTF document: expected value; export"),
        "{text}"
    );
}

#[test]
fn instances_count_as_triangles() {
    let twice = Model::room(SIZE)
        .with(r#""nodes":[0]"#, r#""nodes":[0,1]"#)
        .with(r#"[{"mesh":0}]"#, r#"[{"mesh":0},{"mesh":0}]"#);
    let options = MeshOptions::default().with_max_triangles(23);
    let error = read_with("rooms.glb", &twice.glb(), &options).unwrap_err();
    assert!(
        error.to_string().contains("more than 23 triangles"),
        "{error}"
    );
}
