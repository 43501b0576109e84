//! Writes a benchmark scene as files: mesh (OBJ), colours (MTL), sources and walk (TOML).
//!
//! Host side. Files are reproducible to the byte: numbers are written from whole millimetres, in the mesh's order.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use glam::Vec3;

use super::BenchmarkScene;
use crate::error::{Error, Result};

/// Writes `NAME.obj`, `NAME.mtl` and `NAME.toml` into a folder, which is made if it is missing.
///
/// # Errors
/// [`Error::File`] if the folder or a file cannot be written.
pub fn write_files(scene: &BenchmarkScene, folder: &Path) -> Result<()> {
    const ADVICE: &str = "name a folder that may be written to";
    fs::create_dir_all(folder).map_err(|e| Error::file(folder, e, ADVICE))?;
    let texts = [
        ("obj", obj(scene)),
        ("mtl", mtl(scene)),
        ("toml", toml(scene)),
    ];
    for (extension, text) in texts {
        let path = folder.join(scene.name).with_extension(extension);
        fs::write(&path, text).map_err(|e| Error::file(&path, e, ADVICE))?;
    }
    Ok(())
}

/// First line of each file.
fn title(scene: &BenchmarkScene) -> String {
    let name = scene.name;
    format!(
        "# Benchmark scene {name}, made by `foresound scenes --out assets/scenes`; metres, +y up.\n"
    )
}

fn obj(scene: &BenchmarkScene) -> String {
    let (name, mesh) = (scene.name, &scene.mesh);
    let mut text = title(scene) + "mtllib " + name + ".mtl\n";
    for vertex in &mesh.vertices {
        let [x, y, z] = vertex.to_array().map(decimal);
        push(&mut text, format_args!("v {x} {y} {z}\n"));
    }
    for part in &scene.parts {
        push(&mut text, format_args!("o {}\n", part.name));
        let mut material = None;
        for t in part.triangles.clone() {
            let index = mesh.triangle_materials[t];
            if material != Some(index) {
                material = Some(index);
                let name = &mesh.material_names[index as usize];
                push(&mut text, format_args!("usemtl {name}\n"));
            }
            let [a, b, c] = mesh.triangles[t].map(|vertex| vertex + 1);
            push(&mut text, format_args!("f {a} {b} {c}\n"));
        }
    }
    text
}

fn mtl(scene: &BenchmarkScene) -> String {
    let mut text = title(scene);
    for name in &scene.mesh.material_names {
        let [r, g, b] = colour(name);
        push(&mut text, format_args!("newmtl {name}\nKd {r} {g} {b}\n"));
    }
    text
}

fn toml(scene: &BenchmarkScene) -> String {
    let mut text = title(scene);
    push(&mut text, format_args!("name = \"{}\"\n", scene.name));
    for (name, position) in &scene.sources {
        let position = array(*position);
        push(
            &mut text,
            format_args!("\n[[sources]]\nname = \"{name}\"\nposition = {position}\n"),
        );
    }
    let walk = &scene.walk;
    let [from, to, standing] = [walk.from, walk.to, walk.standing].map(array);
    let speed = walk.speed_m_s;
    push(
        &mut text,
        format_args!(
            "\n# A straight line at ear height, turned round at its ends.\n\
             [listener]\nfrom = {from}\nto = {to}\nspeed_m_s = {speed:?}\nstanding = {standing}\n"
        ),
    );
    text
}

/// Writing to a string cannot fail: the result is ignored.
fn push(text: &mut String, piece: std::fmt::Arguments<'_>) {
    let _ = text.write_fmt(piece);
}

/// Metres to the millimetre, without trailing zeros.
fn decimal(metres: f32) -> String {
    let mm = (f64::from(metres) * 1000.0).round() as i64;
    let sign = if mm < 0 { "-" } else { "" };
    let (whole, rest) = (mm.abs() / 1000, mm.abs() % 1000);
    let text = format!("{sign}{whole}.{rest:03}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A position as a TOML array of floats, each with a decimal point.
fn array(position: Vec3) -> String {
    let numbers = position.to_array().map(|metres| {
        let number = decimal(metres);
        if number.contains('.') {
            number
        } else {
            number + ".0"
        }
    });
    format!("[{}]", numbers.join(", "))
}

/// Diffuse colour for viewers; without acoustic meaning.
fn colour(material: &str) -> [f32; 3] {
    match material {
        "concrete" => [0.6, 0.6, 0.58],
        "plaster" => [0.92, 0.9, 0.84],
        "brick" => [0.6, 0.3, 0.22],
        "wood_panel" => [0.62, 0.42, 0.24],
        "wood_floor" => [0.7, 0.5, 0.3],
        "parquet_on_concrete" => [0.55, 0.36, 0.2],
        "glass" => [0.7, 0.85, 0.9],
        "steel" => [0.5, 0.54, 0.58],
        "carpet" => [0.35, 0.2, 0.3],
        "upholstered_seat" => [0.6, 0.1, 0.12],
        "curtain" => [0.45, 0.08, 0.15],
        "acoustic_ceiling" => [0.88, 0.88, 0.9],
        "door_wood" => [0.48, 0.3, 0.16],
        "gypsum_board" => [0.85, 0.85, 0.82],
        "grass" => [0.32, 0.5, 0.2],
        "gravel" => [0.6, 0.56, 0.5],
        "soil" => [0.4, 0.3, 0.2],
        "foliage" => [0.2, 0.42, 0.15],
        "asphalt" => [0.25, 0.25, 0.27],
        "marble" => [0.9, 0.88, 0.86],
        "sandbag" => [0.65, 0.58, 0.42],
        _ => [0.7, 0.7, 0.7],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_short_and_whole_millimetres() {
        let texts = [0.0, 1.0, -0.02, 10.25, 0.1 + 0.2, -3.0].map(decimal);
        assert_eq!(texts, ["0", "1", "-0.02", "10.25", "0.3", "-3"]);
        assert_eq!(array(Vec3::new(7.75, 1.0, -2.0)), "[7.75, 1.0, -2.0]");
    }
}
