//! Rays and triangles as raw little-endian `f32`, for another tracer.

use std::fs;
use std::path::Path;

use foresound::geometry::Bvh;
use foresound::{Error, Result};

use super::ray_sets::RaySet;

/// Writes `SCENE-triangles.f32` (nine values a triangle, in the order of their numbers) and `SCENE-SET.f32` (origin,
/// direction, farthest parameter: seven values a ray).
pub(super) fn dump(folder: &Path, scene: &str, bvh: &Bvh, sets: &[RaySet]) -> Result<()> {
    fs::create_dir_all(folder).map_err(|error| failed(folder, &error))?;
    let mut triangles: Vec<_> = bvh.triangles().collect();
    triangles.sort_by_key(|(_, number, _)| *number);
    let corners = triangles
        .iter()
        .flat_map(|(corners, ..)| corners.iter().flat_map(|corner| corner.to_array()));
    write(&folder.join(format!("{scene}-triangles.f32")), corners)?;
    for set in sets {
        let values = set.rays.iter().flat_map(|ray| {
            let [ox, oy, oz] = ray.origin.to_array();
            let [dx, dy, dz] = ray.direction.to_array();
            [ox, oy, oz, dx, dy, dz, ray.t_max]
        });
        write(&folder.join(format!("{scene}-{}.f32", set.name)), values)?;
    }
    Ok(())
}

fn write(file: &Path, values: impl Iterator<Item = f32>) -> Result<()> {
    let bytes: Vec<u8> = values.flat_map(f32::to_le_bytes).collect();
    fs::write(file, bytes).map_err(|error| failed(file, &error))
}

fn failed(path: &Path, error: &std::io::Error) -> Error {
    Error::file(
        path.to_owned(),
        error.to_string(),
        "give --dump a folder that can be written",
    )
}
