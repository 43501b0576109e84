//! Invalid meshes, materials, layouts and walks.

use std::path::Path;

use foresound::acoustics::BANDS;
use foresound::scene::{DirectivityTable, MaterialTable, MeshOptions, SceneLayout, load_mesh};
use foresound_tools::listener_path::ListenerPath;

use crate::Errors;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

pub(crate) fn make(errors: &mut Errors) {
    meshes(errors);
    materials(errors);
    layouts(errors);
    walks(errors);
}

fn meshes(errors: &mut Errors) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.obj");
    let long = format!("f {}\n", "1 ".repeat(1 << 20));
    let materials: String = (0..40).map(|n| format!("usemtl m{n}\n")).collect();
    for text in [
        "\0",
        &long,
        "v 1 x 2\nf 1 1 1\n",
        "v 1 1 1 0\nf 1 1 1\n",
        &format!("{SQUARE}f 1 2\n"),
        &format!("{SQUARE}f 0 1 2\n"),
        &format!("{SQUARE}f 1 2 3000000000\n"),
        &format!("{SQUARE}f 1 2 7\n"),
        &format!("{SQUARE}f 1 2 x\n"),
        &format!("v 1e9 0 0\n{SQUARE}f 1 2 3\nf 3 4 5\n"),
        &format!("v nan 0 0\n{SQUARE}f 1 2 3\nf 3 4 5\n"),
        &format!("{SQUARE}{}", "f 1 2 3\n".repeat(40)),
        &"v 0 0 0\n".repeat(200),
        &format!("{SQUARE}{materials}f 1 2 3\n"),
        SQUARE,
    ] {
        std::fs::write(&path, text).expect("written");
        let options = MeshOptions::default().with_max_triangles(30);
        errors.of(&text[..text.len().min(200)], load_mesh(&path, &options));
    }
    other_meshes(errors);
    let options = MeshOptions::default().with_scale(0.0);
    errors.of("a scale of zero", load_mesh(&path, &options));
}

/// PLY, glTF and formats that are not read.
fn other_meshes(errors: &mut Errors) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a");
    let ply = |rest: &str| format!("ply\nformat ascii 1.0\n{rest}");
    let square = |rest: &str| {
        let xyz = "property float x\nproperty float y\nproperty float z\n";
        let faces = "element face 1\nproperty list uchar int vertex_index\nend_header\n";
        ply(&format!(
            "element vertex 3\n{xyz}{faces}0 0 0\n1 0 0\n0 0 1\n{rest}"
        ))
    };
    let gltf = |rest: &str| format!("{{\"asset\":{{\"version\":\"2.0\"}},{rest}}}");
    let node = r#""nodes":[{"mesh":0,"name":"n","extras":{EXTRAS}}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],"bufferViews":[{"buffer":0,"byteLength":36}]"#;
    let plain = node.replace("EXTRAS", "");
    let with = |old: &str, new: &str| gltf(&plain.replace(old, new));
    let buffer = |uri: &str| gltf(&format!("{plain},\"buffers\":[{{{uri}\"byteLength\":36}}]"));
    let extras = |extras: &str| {
        let node = node.replace("\"bufferView\":0,", "");
        gltf(&node.replace("EXTRAS", extras))
    };
    let two = r#""nodes":[{"mesh":0,"name":"n","extras":{"acoustic_absorption":0.1}},{"mesh":0,"name":"n","extras":{"acoustic_absorption":0.2}}]"#;
    let zeros = plain.replace("\"bufferView\":0,", "");
    let twice = zeros.replace(r#""nodes":[{"mesh":0,"name":"n","extras":{}}]"#, two);
    let instances = zeros.replace(
        r#""extras":{}"#,
        r#""extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0,"SCALE":1}}}"#,
    );
    let instances = instances.replace(
        r#""accessors":["#,
        r#""accessors":[{"componentType":5126,"count":3,"type":"VEC3"},{"componentType":5126,"count":2,"type":"VEC3"},"#,
    );
    let many_indices = zeros
        .replace("\"POSITION\":0}", "\"POSITION\":0},\"indices\":1")
        .replace(
            "\"VEC3\"}",
            "\"VEC3\"},{\"componentType\":5125,\"count\":99,\"type\":\"SCALAR\"}",
        );
    for text in [
        "Kaydara FBX Binary".to_owned(),
        "PK\x03\x04".into(),
        "RIFF".into(),
        ply(""),
        ply("end\n"),
        "ply\nend_header\n".into(),
        ply("end_header\n"),
        ply("element tristrips 0\nend_header\n"),
        ply("element vertex 1\nend_header\n"),
        square(""),
        square("3 0 1 x"),
        square("3 0 1 7"),
        square("-1"),
        "glTF".into(),
        gltf(r#""nodes":[]"#).replace("2.0", "1.1"),
        gltf(r#""extensionsRequired":["KHR_draco_mesh_compression"]"#),
        gltf(r#""extensionsRequired":["EXT_meshopt_compression"]"#),
        gltf(r#""extensionsRequired":["KHR_new"]"#),
        "{".into(),
        gltf(r#""nodes":[]"#),
        gltf(r#""nodes":[{"mesh":3}]"#),
        gltf(r#""scenes":[{"nodes":[0]}],"nodes":[{"children":[0]}]"#),
        with("VEC3", "VEC2"),
        buffer(r#""uri":"data:x;base64,AAAA","#)
            .replace(r#""byteLength":36}],"b"#, r#""byteLength":3}],"b"#),
        buffer(""),
        buffer(r#""uri":"data:x;base64,?","#),
        buffer(r#""uri":"https://x","#),
        buffer(r#""uri":"data:x;base64,AAAA","#),
        buffer(r#""uri":"gone.bin","#),
        extras(r#""acoustic_absorption":[1,2,3]"#),
        extras(r#""acoustic_scattering":0.1"#),
        extras(r#""acoustic_absorption":0.1,"acoustic_transmission":0.2"#),
        extras(r#""acoustic_thing":0.1"#),
        gltf(&twice),
        gltf(&instances),
        gltf(&zeros.replace("\"count\":3", "\"count\":300")),
        gltf(&many_indices),
    ] {
        std::fs::write(&path, &text).expect("written");
        let options = MeshOptions::default().with_max_triangles(30);
        errors.of(&text, load_mesh(&path, &options));
    }
}

fn materials(errors: &mut Errors) {
    let path = Path::new("m.toml");
    for text in [
        "a = ",
        "[metals.a]\n",
        "materials = 3\n",
        "[materials.a]\nabsorption = nan\n",
        "[materials.a]\nscattering = 0.1\n",
        "[materials.a]\nabsorption = 0.5\ntransmission = 0.1\ntransmission_loss_db = 3\n",
        "[materials.a]\nabsorption = 0.1\ntransmission = 0.2\n",
        "[materials.a]\nabsorption = 2\n",
        "[materials.a]\nabsorption = 0.5\ntransmission_loss_db = -2\n",
        "[materials.a]\nabsorption = [0.1, 0.2]\n",
    ] {
        errors.of(text, MaterialTable::parse(path, text));
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("u.toml");
    std::fs::write(&path, [0xff, 0xfe]).expect("written");
    errors.of("UTF-16", MaterialTable::load(&path));
}

fn layouts(errors: &mut Errors) {
    let path = Path::new("l.toml");
    let source = "[[sources]]\nname = \"a\"\nposition = [1, 2, 3]\n";
    let walk = |rest: &str| format!("[listener]\nfrom = [1, 2, 3]\n{rest}\n");
    let with = |rest: &str| format!("{source}{rest}\n");
    for text in [
        "[[sources]]\nname = \"a\"\n".to_owned(),
        "sources = 3\n".into(),
        "[[sources]]\nname = \"a\"\nposition = [1, 2]\n".into(),
        "[[sources]]\nname = \"a\"\nposition = [1, 2, 1e9]\n".into(),
        with(source),
        with("facing = [0, 0, 0]"),
        with("radius_m = -1"),
        with("without = \"late\""),
        with("without = [\"none\"]"),
        with("directivity = { weight = 2 }"),
        with("directivity = { order = -1 }"),
        with("directivity = { weight = [0, 1] }"),
        with("directivity = { levels_db = 3 }"),
        with("directivity = { levels_db = [[0, 0, 0, 0, 0, 0, 0, 0]] }"),
        walk("to = [1, 2, 3]\nspeed_m_s = 1\nstanding = [1, 1, 1]"),
        walk("to = [1, 2, 4]\nspeed_m_s = 0\nstanding = [1, 1, 1]"),
    ] {
        errors.of(&text, SceneLayout::parse(path, &text));
    }
    let one = DirectivityTable::from_levels_db(&[[0.0; BANDS]]);
    errors.of("one angle", one);
    let loud = DirectivityTable::from_levels_db(&[[0.0; BANDS], [99.0; BANDS]]);
    errors.of("99 dB", loud);
}

fn walks(errors: &mut Errors) {
    for text in [
        &b"t,x,y,z\n"[..],
        b"t,x,y,z\n0,nan,1,1\n",
        b"t,x,y,z\n0,1e9,1,1\n",
        b"t,x,y,z\n1,1,1,1\n0,1,1,1\n",
        b"t,x,y,z,Yaw\n0,1,1,1,0\n",
        b"t,x,y,z\n0,5,1,1,1\n",
        b"t,x,y,z,yaw\n0,1,1,1\n",
        b"t,x,y,z\n0,1,one,1\n",
        b"a,b\n1,2\n",
        b"t,x,y,z\n0,\xff,1,1\n",
    ] {
        let name = String::from_utf8_lossy(text).into_owned();
        errors.of(&name, ListenerPath::from_csv(Path::new("w.csv"), text));
    }
    errors.of("no number", ListenerPath::parse("1,2,x"));
    errors.of("too far", ListenerPath::parse("1,2,1e9"));
}
