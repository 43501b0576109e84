//! Law *transmission*: a wall's loss in each band equals its material's, as a sheet and as a solid.

use glam::Vec3;

use super::{Row, rooms};
use foresound::acoustics::bands::CENTRES_HZ;
use foresound::acoustics::{BANDS, Material};
use foresound::error::Result;
use foresound::propagation::transmission::direct_path;
use foresound::scene::{SourceId, TriangleMesh};

/// One sheet, one solid wall of two faces, and two such walls.
pub(super) fn rows() -> Result<Vec<Row>> {
    let wall = Material {
        name: "wall".to_owned(),
        absorption: [0.3; BANDS],
        scattering: [0.0; BANDS],
        transmission: std::array::from_fn(|b| 10f32.powf(-(10.0 + 4.0 * b as f32) / 10.0)),
    };
    let mut rows = Vec::new();
    let cases: [(&str, &[f32], f64); 3] = [
        ("sheet", &[0.0], 1.0),
        ("solid", &[-0.1, 0.1], 1.0),
        ("two solids", &[-1.6, -1.4, 1.4, 1.6], 2.0),
    ];
    for (name, faces, walls) in cases {
        let mesh = parallel_faces(faces);
        let scene = rooms::commit(&mesh, vec![wall.clone()])?;
        let (from, to) = (Vec3::new(-3.0, 0.1, 0.2), Vec3::new(4.0, 0.3, -0.1));
        let heard = direct_path(&scene, SourceId::default(), from, to, 0.3, &mut 0);
        let distance_m = f64::from(from.distance(to));
        for b in 0..BANDS {
            let air = (-f64::from(scene.air_np_per_m()[b]) * distance_m).exp();
            let level = heard.map_or(0.0, |p| f64::from(p.amplitude[b]) * distance_m / air);
            let loss_db = -20.0 * level.log10();
            let expected_db = walls * (10.0 + 4.0 * b as f64);
            let law = format!("transmission: {name} at {:.0} Hz", CENTRES_HZ[b]);
            rows.push(Row::at_most(law, (loss_db - expected_db).abs(), 0.1, "dB"));
        }
    }
    Ok(rows)
}

/// Squares perpendicular to the x axis; they face away from each other in pairs, as the two faces of a wall do.
fn parallel_faces(positions_m: &[f32]) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let material = mesh.material("wall");
    for (i, &x) in positions_m.iter().enumerate() {
        let first = mesh.vertices.len() as u32;
        for (y, z) in [(-5.0, -5.0), (-5.0, 5.0), (5.0, 5.0), (5.0, -5.0)] {
            mesh.vertices.push(Vec3::new(x, y, z));
        }
        let corners = if i % 2 == 0 {
            [0, 1, 2, 3]
        } else {
            [0, 3, 2, 1]
        };
        let [a, b, c, d] = corners.map(|k: u32| first + k);
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
        mesh.triangle_materials.extend([material, material]);
    }
    mesh
}
