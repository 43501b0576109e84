//! PLY files: every encoding, elements that do not count, and what is broken.

use super::{SIZE, WALLS, corners, problem, read};

fn header(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment by hand\nelement vertex 8\nproperty uchar red\nproperty float x\n\
         property double y\nproperty float z\nelement face 6\nproperty list uchar int vertex_indices\n\
         property short flags\nelement edge 1\nproperty list int ushort vertices\nend_header\n"
    )
}

/// The room, four corners a face.
pub(crate) fn text() -> Vec<u8> {
    let mut text = header("ascii");
    for [x, y, z] in corners(SIZE) {
        text.push_str(&format!("255 {x} {y} {z}\r\n"));
    }
    for [a, b, c, d] in WALLS {
        text.push_str(&format!("4 {a} {b} {c} {d} -7\n"));
    }
    (text + "2 0 1\n").into_bytes()
}

/// The same in binary.
pub(crate) fn binary(is_big: bool) -> Vec<u8> {
    let format = if is_big {
        "binary_big_endian"
    } else {
        "binary_little_endian"
    };
    let mut bytes = header(format).into_bytes();
    let mut put = |little: &[u8]| {
        let mut value = little.to_vec();
        if is_big {
            value.reverse();
        }
        bytes.extend(value);
    };
    for [x, y, z] in corners(SIZE) {
        put(&[255]);
        put(&x.to_le_bytes());
        put(&f64::from(y).to_le_bytes());
        put(&z.to_le_bytes());
    }
    for wall in WALLS {
        put(&[4]);
        wall.iter()
            .for_each(|corner| put(&(*corner as i32).to_le_bytes()));
        put(&(-7i16).to_le_bytes());
    }
    put(&2i32.to_le_bytes());
    put(&0u16.to_le_bytes());
    put(&1u16.to_le_bytes());
    bytes
}

const SQUARE: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
     element face 2\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n1 0 1\n0 0 1\n";

#[test]
fn vertices_without_a_face_do_no_harm() {
    let text = format!("{SQUARE}3 0 1 2\n3 0 2 1\n").replace("0 0 1\n3", "nan 0 1\n3");
    let mesh = read("scan.ply", text.as_bytes()).mesh;
    assert_eq!(mesh.vertices.len(), 3);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 1]]);
    assert_eq!(mesh.material_names, ["default"]);
}

#[test]
fn broken_files_say_what_is_wrong() {
    for (text, expected) in [
        (
            format!("{SQUARE}3 0 1 2\n"),
            ":15: the file ends before the last value",
        ),
        (
            format!("{SQUARE}3 0 1 4\n3 0 1 2\n"),
            ": a face with vertex index 4, which no vertex has",
        ),
        (
            format!("{SQUARE}3 0 1 -1\n3 0 1 2\n"),
            ":14: a face with vertex index -1",
        ),
        (
            format!("{SQUARE}2 0 1\n3 0 1 2\n"),
            ":14: a face of 2 corners; give",
        ),
        (format!("{SQUARE}3 0 x 1\n"), ":14: `x` is no number"),
        (
            SQUARE.replace("1 0 1", "1 inf 1") + "3 0 1 2\n3 0 1 3\n",
            ": vertex (1 inf 1) is not finite",
        ),
        (
            SQUARE.replace("1 0 1", "1e9 0 1") + "3 0 1 2\n3 0 1 3\n",
            ": vertex (1000000000 0 1) lies beyond",
        ),
        (
            SQUARE.replace("float x", "float u"),
            ": vertices without a position",
        ),
        (
            SQUARE.replace("face 2", "face 0"),
            ": a cloud of points: the file has no faces",
        ),
        (
            SQUARE.replace("face 2", "tristrips 0"),
            ": the faces are triangle strips",
        ),
        (
            SQUARE.replace("format ascii 1.0", "format utf8 1.0"),
            ":2: a PLY header with `format utf8 1.0`",
        ),
        (
            SQUARE.replace("uchar int", "float int"),
            ":8: a PLY header with",
        ),
        (
            "ply\nend_header\n".into(),
            ":2: a PLY header without `format`",
        ),
        (
            "ply\nformat ascii 1.0\n".into(),
            ":3: a PLY header without `end_header`",
        ),
    ] {
        let text = problem("scan.ply", text.as_bytes());
        assert!(text.starts_with(expected), "{text}");
    }
    let whole = binary(true);
    let text = problem("scan.ply", &whole[..whole.len() - 1]);
    assert!(
        text.starts_with(": the file ends before the last value"),
        "{text}"
    );
}

#[test]
fn more_than_the_limit_is_refused_from_the_header() {
    let text = SQUARE.replace("vertex 4", "vertex 99999999999");
    let text = problem("scan.ply", text.as_bytes());
    assert!(text.contains("more than 12582912 vertices"), "{text}");
}
