//! Invalid meshes, materials, layouts and walks.

use std::path::Path;

use foresound::acoustics::BANDS;
use foresound::scene::{DirectivityTable, MaterialTable, ObjOptions, SceneLayout, load_obj};
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
        let options = ObjOptions::default().with_most_triangles(30);
        errors.of(&text[..text.len().min(200)], load_obj(&path, &options));
    }
    let options = ObjOptions::default().with_scale(0.0);
    errors.of("a scale of zero", load_obj(&path, &options));
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
