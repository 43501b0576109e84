//! Invalid files: errors name the line and the remedy.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a helper's failure is the test's"
)]

use std::path::Path;

use foresound::Error;
use foresound::scene::{MaterialTable, MeshOptions, SceneLayout, commit_mesh, load_mesh};
use proptest::prelude::*;

/// Error text of a file's content: one line that names the file.
fn obj_error(content: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.obj");
    std::fs::write(&path, content).unwrap();
    let text = load_mesh(&path, &MeshOptions::default())
        .unwrap_err()
        .to_string();
    assert_eq!(text.lines().count(), 1, "{text}");
    let name = path.display().to_string();
    text.strip_prefix(&name)
        .unwrap_or_else(|| panic!("{text}"))
        .to_owned()
}

#[test]
fn broken_obj_files_name_their_line_and_the_remedy() {
    let start = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let with = |rest: &str| format!("{start}{rest}").into_bytes();
    for (content, expected) in [
        (
            with("v 1 x 0\nf 1 2 3"),
            ":4: a broken `v` statement; write three numbers",
        ),
        (with("v 1 2\nf 1 2 3"), ":4: a broken `v`"),
        (with("v\nf 1 2 3"), ":4: a broken `v`"),
        (
            with("v 1 2 3 0\nf 1 2 3"),
            ":4: a `v` statement of weight 0; leave",
        ),
        (
            with("f 1 2 4"),
            ":4: a face with vertex index 4, out of range (3 vertices); refer",
        ),
        (
            with("f 1 2 3\nf 1 2 -4"),
            ":5: a face with vertex index -4, out of range",
        ),
        (
            with("f 1 2 99999999999"),
            ":4: a face with vertex index 99999999999, out of range",
        ),
        (with("f 0 1 2"), ":4: a face with vertex index 0; count"),
        (with("f 1 2"), ":4: a face of 2 corners; give"),
        (
            with("f 1 b 3"),
            ":4: a face corner `b` that is not a number; write",
        ),
        (with("\n# c\nf 1 2 1e1"), ":6: a face corner `1e1`"),
        (
            with("v nan 0 0\nf 1 2 4"),
            ":4: vertex (nan 0 0) is not finite and a face uses it; export",
        ),
        (
            with("v 0 inf 0\nf 1 2 -1"),
            ":4: vertex (0 inf 0) is not finite",
        ),
        (
            with("v 0 1e9 0\nf 1 2 4"),
            ":4: vertex (0 1e9 0) lies beyond 100000 m; check the units",
        ),
        (
            with("v 0 1e39 0\nf 1 2 4"),
            ":4: vertex (0 1e39 0) lies beyond",
        ),
        (start.into(), ": empty mesh: the file has no faces; export"),
        (with("l 1 2"), ": empty mesh"),
        (Vec::new(), ": empty mesh"),
        (
            b"GEOM\x02\0\0\0binary".to_vec(),
            ":1: binary data, not OBJ text; give",
        ),
        (
            vec![0xff; 3 << 20],
            ":1: a line longer than 1048576 bytes; give",
        ),
    ] {
        let text = obj_error(&content);
        assert!(text.starts_with(expected), "{text} instead of {expected}");
    }
}

#[test]
fn a_bad_vertex_that_no_face_uses_does_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stray.obj");
    std::fs::write(
        &path,
        "v 0 0 0\nv nan 0 0\nv 1 0 0\nv 1e9 0 0\nv 0 1 0\nf 1 3 5\n",
    )
    .unwrap();
    let file = load_mesh(&path, &MeshOptions::default()).unwrap();
    assert_eq!(
        commit_mesh(&file.mesh, &MaterialTable::built_in(), 0.0)
            .unwrap()
            .triangles
            .len(),
        1
    );
}

#[test]
fn paths_that_are_no_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for path in [folder.path().to_owned(), folder.path().join("none.obj")] {
        let name = path.display().to_string();
        for error in [
            load_mesh(&path, &MeshOptions::default()).unwrap_err(),
            MaterialTable::load(&path).unwrap_err(),
            SceneLayout::load(&path).unwrap_err(),
        ] {
            assert!(matches!(error, Error::File { .. }));
            let text = error.to_string();
            assert!(
                text.starts_with(&name) && text.contains("; give the path"),
                "{text}"
            );
        }
    }
}

#[test]
fn toml_that_is_not_text_names_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.toml");
    std::fs::write(&path, b"# one\n# two\n\xff\xfe").unwrap();
    let text = MaterialTable::load(&path).unwrap_err().to_string();
    assert!(text.contains("bad.toml:3: not UTF-8 text; save"), "{text}");
}

/// Tokens of random OBJ-like files.
fn obj_words() -> impl Strategy<Value = String> {
    let word = prop_oneof![
        Just("v ".to_owned()),
        Just("f ".to_owned()),
        Just("\nf 1 2 3".to_owned()),
        Just("\nv 0 1 2".to_owned()),
        Just("\n".to_owned()),
        Just("\\\n".to_owned()),
        Just("usemtl ".to_owned()),
        Just("mtllib ".to_owned()),
        Just("/".to_owned()),
        Just("nan ".to_owned()),
        Just("-9223372036854775808 ".to_owned()),
        (-5i32..9).prop_map(|n| format!("{n} ")),
        any::<f32>().prop_map(|x| format!("{x:e} ")),
        "\\PC{0,4}",
    ];
    prop::collection::vec(word, 0..60).prop_map(|words| words.concat())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 256, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_as_obj_give_a_mesh_or_an_error(
        bytes in prop_oneof![
            prop::collection::vec(any::<u8>(), 0..300),
            obj_words().prop_map(String::into_bytes),
        ],
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("any.obj");
        std::fs::write(&path, bytes).unwrap();
        match load_mesh(&path, &MeshOptions::default()) {
            Ok(file) => {
                prop_assert!(!file.mesh.triangles.is_empty());
                prop_assert!(file.mesh.check_indices().is_ok());
                prop_assert!(file.mesh.vertices.iter().all(|v| v.is_finite()));
            }
            Err(error) => prop_assert_eq!(error.to_string().lines().count(), 1),
        }
    }

    #[test]
    fn any_text_as_toml_gives_a_table_or_an_error(
        text in prop_oneof![
            "\\PC{0,80}",
            "(\\[\\[?(materials|sources|listener)(\\.a)?\\]?\\]|\n|(name|position|from|to|absorption|scattering) = |[0-9.,\\[\\]]{1,6}|nan|\"a\"|\\{|\\}){0,20}",
        ],
    ) {
        for error in [
            MaterialTable::parse(Path::new("any.toml"), &text).err(),
            SceneLayout::parse(Path::new("any.toml"), &text).err(),
        ].into_iter().flatten() {
            prop_assert_eq!(error.to_string().lines().count(), 1);
        }
    }
}
