//! Rooms, moving parts, and the comparison of the paths of two scenes.

use std::sync::Arc;

use foresound::acoustics::BANDS;
use foresound::propagation::Path;
use foresound::scene::{
    InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings, SourceId,
    SourcePose, TriangleMesh, procedural,
};
use glam::{DQuat, DVec3, Quat, Vec3};

/// Two rooms, 8 × 6 × 3 m each, whose door is between (8, 3.1) and (8.2, 4.05).
pub(crate) fn rooms() -> TriangleMesh {
    procedural::doorway().mesh
}

pub(crate) fn commit(mesh: &TriangleMesh) -> Arc<Scene> {
    let settings = SceneSettings::default();
    Arc::new(Scene::commit(mesh, &MaterialTable::built_in(), &settings).expect("commits"))
}

/// A box from one corner to the other, in its own coordinates.
pub(crate) fn block(low: Vec3, high: Vec3) -> TriangleMesh {
    let mut mesh = procedural::shoebox(high - low, "wood_panel");
    for vertex in &mut mesh.vertices {
        *vertex += low;
    }
    // A shoebox faces inward.
    for triangle in &mut mesh.triangles {
        triangle.swap(1, 2);
    }
    mesh
}

/// A door of 0.89 × 2.02 × 0.05 m, hinged on the y axis. Its edges end 4 cm before floor, wall and lintel: a commit takes an
/// edge that ends within 3 cm of a surface as one that ends there, and parts are not joined with the scene.
pub(crate) fn door() -> TriangleMesh {
    block(Vec3::new(0.04, 0.04, -0.08), Vec3::new(0.93, 2.06, -0.03))
}

/// The door in the second room: wide open at 0, closed at 90°.
pub(crate) fn swung(id: InstanceId, degrees: f32) -> InstancePose {
    InstancePose {
        id,
        position: DVec3::new(8.2, 0.0, 3.1),
        rotation: Quat::from_rotation_y(-degrees.to_radians()),
    }
}

/// A mesh with another one added, rotated and translated.
pub(crate) fn joined(
    fixed: &TriangleMesh,
    part: &TriangleMesh,
    pose: &InstancePose,
) -> TriangleMesh {
    let mut mesh = fixed.clone();
    let first = mesh.vertices.len() as u32;
    let turn: DQuat = pose.rotation.as_dquat().normalize();
    let there = |v: &Vec3| (turn * v.as_dvec3() + pose.position).as_vec3();
    mesh.vertices.extend(part.vertices.iter().map(there));
    for (triangle, &material) in part.triangles.iter().zip(&part.triangle_materials) {
        let name = &part.material_names[material as usize];
        let found = mesh.material_names.iter().position(|n| n == name);
        let number = found.unwrap_or_else(|| {
            mesh.material_names.push(name.clone());
            mesh.material_names.len() - 1
        });
        mesh.triangles.push(triangle.map(|v| first + v));
        mesh.triangle_materials.push(number as u32);
    }
    mesh
}

pub(crate) fn source(slot: u16, position: Vec3) -> SourcePose {
    SourcePose::at(SourceId::new(slot, 0), position)
}

pub(crate) fn ear(position: Vec3) -> ListenerPose {
    ListenerPose {
        position,
        ..ListenerPose::default()
    }
}

/// Whether two paths are one, computed twice: lengths to a tenth of a millimetre, points and images to a millimetre
/// (`f32` corners 16 m from the centre, mirrored twice), amplitudes to a thousandth plus a margin of the loudest band's.
pub(crate) fn same(a: &Path, b: &Path) -> bool {
    let near = |(p, q): (&Vec3, &Vec3)| p.distance(*q) < 1e-3;
    let loudest = a.amplitude.iter().fold(0.0f32, |most, a| most.max(a.abs()));
    a.source == b.source
        && (a.order, a.diffraction_order) == (b.order, b.diffraction_order)
        && (a.length_m - b.length_m).abs() < 1e-4
        && near((&a.image, &b.image))
        && a.points().iter().zip(b.points()).all(near)
        && (0..BANDS).all(|k| {
            // Where a diffracted wave changes sign a band is the small difference of larger parts: the rounding of corners
            // (1e-6 m) moves an angle half a metre from its edge by some 2e-6, its wave by four times that, the share of
            // it that fades by six times that, and its sign by four times that: 2e-4 of the wave.
            let bound = 1e-3 * a.amplitude[k].abs() + 2e-4 * loudest + 1e-6;
            (a.amplitude[k] - b.amplitude[k]).abs() < bound
        })
}

pub(crate) fn without(paths: &[Path], others: &[Path]) -> Vec<Path> {
    let new = paths.iter().filter(|p| !others.iter().any(|o| same(p, o)));
    new.copied().collect()
}

/// Whether an edge or surface belongs to an instance.
pub(crate) fn moves(number: &u32) -> bool {
    number >> 31 == 1
}
