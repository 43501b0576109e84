//! `inspect`, `commit` and `materials`: what is said about scenes.

use std::path::Path;

use std::fs;

use crate::harness::{Folder, foresound, printed, refused, text};

#[test]
fn bounds_have_no_rounding_dust() {
    let folder = Folder::new();
    let mesh = folder.write(
        "dust.obj",
        "v -2.1191e-15 0 -0.0\nv 6 0 0\nv 0 6 -1e-12\nv 0 0 6\nf 1 2 3\nf 1 3 4\n",
    );
    for more in [&[][..], &["--json"]] {
        let output = foresound(&[&["inspect", text(&mesh)], more].concat());
        let printed = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(
            !printed.contains("-0") && !printed.contains("e-"),
            "{printed}"
        );
    }
    let output = foresound(&["inspect", text(&mesh)]);
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(printed.contains("[0, 0, 0] to [6, 6, 6] m"), "{printed}");
}

#[test]
fn unknown_materials_are_reported() {
    let folder = Folder::new();
    let room = folder.write(
        "odd.obj",
        "usemtl unobtainium\nv 0 0 0\nv 6 0 0\nv 0 6 0\nv 0 0 6\nf 1 2 3\nf 1 3 4\n",
    );
    let output = foresound(&["inspect", text(&room), "--json"]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("unobtainium"));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(json["defaulted_materials"][0], "unobtainium");
    assert_eq!(
        (json["triangles"].as_u64(), json["surfaces"].as_u64()),
        (Some(2), Some(2))
    );
    assert_eq!(
        (json["edges"].as_u64(), json["closed"].as_bool()),
        (Some(5), Some(false))
    );
}

#[test]
fn a_saved_scene_is_read_like_its_mesh() {
    let folder = Folder::new();
    let room = folder.room();
    let saved = folder.path("saved.fscene");
    let output = foresound(&["commit", text(&room), "--out", text(&saved), "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(json["triangles"], 4);
    assert_eq!(json["bytes"], fs::metadata(&saved).expect("a file").len());
    let inspected = |file: &Path| {
        let output = foresound(&["inspect", text(file), "--json"]);
        assert!(output.status.success());
        output.stdout
    };
    assert_eq!(inspected(&saved), inspected(&room));
    let own = [": is a saved scene, whose scale, axis and materials are settled;"];
    refused(&["inspect", text(&saved), "--scale", "2"], &own);
    refused(
        &["commit", text(&room), "--out", text(&room)],
        &["is an input of this command"],
    );
    let half = folder.path("half.fscene");
    let bytes = fs::read(&saved).expect("read");
    fs::write(&half, &bytes[..bytes.len() / 2]).expect("written");
    refused(
        &["inspect", text(&half)],
        &["half.fscene: the saved scene is damaged or cut off;"],
    );
    let other = folder.write("model.fbx", "Kaydara FBX Binary  ");
    refused(
        &["inspect", text(&other)],
        &["model.fbx: is an FBX file, which is not read;"],
    );
}

#[test]
fn a_wall_with_two_doors_has_the_area_of_its_outline() {
    let folder = Folder::new();
    // 6 by 3 m without two doors of 0.9 by 2.1 m.
    let outline = "v 1 0 0\nv 1 2.1 0\nv 1.9 2.1 0\nv 1.9 0 0\nv 4 0 0\nv 4 2.1 0\nv 4.9 2.1 0\nv 4.9 0 0\n\
                   v 6 0 0\nv 6 3 0\nv 0 3 0\nv 0 0 0\n";
    let corners: Vec<usize> = (1..=12).collect();
    for first in 0..12 {
        let mut face = corners.clone();
        face.rotate_left(first);
        let face: Vec<String> = face.iter().map(usize::to_string).collect();
        let path = folder.write("wall.obj", &format!("{outline}f {}\n", face.join(" ")));
        let output = foresound(&["inspect", text(&path), "--json"]);
        let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let area_m2 = value["area_m2"].as_f64().expect("an area");
        let expected_m2 = 6.0 * 3.0 - 2.0 * 0.9 * 2.1;
        assert!(
            (area_m2 - expected_m2).abs() < 1e-5,
            "{area_m2} m²: {face:?}"
        );
    }
}

#[test]
fn materials_are_listed_and_near_names_suggested() {
    assert!(printed(&["materials"]).contains("wood_panel"));
    let json = printed(&["materials", "concrete", "--json"]);
    let value: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(
        value["materials"][0]["absorption"]
            .as_array()
            .expect("a list")
            .len(),
        8
    );
    refused(
        &["materials", "WoodPanel"],
        &["WoodPanel", "wood_panel is near"],
    );
    refused(&["materials", "xyzzy"], &["foresound materials"]);
    let folder = Folder::new();
    let mesh = folder.write(
        "panels.obj",
        "usemtl WoodPanel\nv 0 0 0\nv 6 0 0\nv 0 6 0\nv 0 0 6\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n",
    );
    let output = foresound(&["inspect", text(&mesh)]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("wood_panel is near"), "{said}");
    let quiet = foresound(&["inspect", text(&mesh), "--quiet"]);
    assert!(quiet.stderr.is_empty() && quiet.stdout == output.stdout);
    let verbose = foresound(&["--verbose", "inspect", text(&mesh)]);
    let said = String::from_utf8_lossy(&verbose.stderr);
    assert!(said.contains("4 triangles"), "{said}");
    let shown = String::from_utf8_lossy(&output.stdout);
    assert!(shown.contains("kB") && !shown.contains("0.0 MB"), "{shown}");
}
