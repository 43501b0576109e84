//! Notes on sources and listeners that lie where no sound is: outside the scene's bounds, or beyond a closed surface.

use foresound::scene::Scene;
use glam::{DVec3, Vec3};

/// A place that a command line names.
pub(crate) struct Place {
    pub(crate) what: String,
    pub(crate) position: Vec3,
}

/// Notes on the sources and the listener, a line each.
pub(crate) fn notes(scene: &Scene, sources: &[Place], listener: &Place) -> Vec<String> {
    let report = scene.report();
    let (low, high) = (report.bounds_min, report.bounds_max);
    let outside =
        |place: &&Place| place.position.cmplt(low).any() || place.position.cmpgt(high).any();
    let places = sources.iter().chain([listener]);
    let mut notes: Vec<String> = places
        .filter(outside)
        .map(|place| {
            let Place { what, position } = place;
            format!("{what} at {position} is outside the scene, which extends from {low} to {high}")
        })
        .collect();
    let separated = sources
        .iter()
        .filter(|source| closed_faces_between(scene, source.position, listener.position) % 2 == 1);
    notes.extend(separated.map(|source| {
        format!(
            "{} at {} and {} at {} are on different sides of a closed surface: one of them is inside a wall or a solid, or outside the room",
            source.what, source.position, listener.what, listener.position
        )
    }));
    notes
}

/// Triangles of closed parts of the mesh that a straight line crosses: an odd number separates its ends.
fn closed_faces_between(scene: &Scene, from: Vec3, to: Vec3) -> usize {
    // A line through an edge crosses two faces there; slightly beside it, one.
    let beside = DVec3::new(1.3e-5, 2.1e-5, -1.7e-5);
    let (from, to) = (from.as_dvec3() + beside, to.as_dvec3());
    let triangles = scene.triangles().enumerate();
    triangles
        .filter(|(index, _)| scene.is_in_closed_part(*index as u32))
        .filter(|(_, corners)| crosses(corners.map(|corner| corner.as_dvec3()), from, to))
        .count()
}

/// Whether a line crosses a triangle \[MOELLER97\].
fn crosses([a, b, c]: [DVec3; 3], from: DVec3, to: DVec3) -> bool {
    let (direction, ab, ac) = (to - from, b - a, c - a);
    let across = direction.cross(ac);
    let determinant = ab.dot(across);
    if determinant == 0.0 {
        return false;
    }
    let offset = from - a;
    let u = offset.dot(across) / determinant;
    let along = offset.cross(ab);
    let v = direction.dot(along) / determinant;
    let t = ac.dot(along) / determinant;
    u >= 0.0 && v >= 0.0 && u + v < 1.0 && (0.0..=1.0).contains(&t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use foresound::scene::{MaterialTable, SceneSettings, procedural::shoebox};

    #[test]
    fn a_closed_wall_separates_and_a_room_does_not() {
        let room = shoebox([8.0, 3.0, 5.0], "plaster");
        let scene = Scene::commit(&room, &MaterialTable::built_in(), &SceneSettings::default());
        let scene = scene.expect("a room");
        let place = |what: &str, position: [f32; 3]| Place {
            what: what.to_owned(),
            position: position.into(),
        };
        let listener = place("the listener", [1.0, 1.0, 1.0]);
        let within = place("source 1", [7.0, 2.0, 4.0]);
        assert_eq!(notes(&scene, &[within], &listener), Vec::<String>::new());
        let outside = place("source 1", [9.0, 2.0, 4.0]);
        let told = notes(&scene, &[outside], &listener);
        assert_eq!(told.len(), 2, "{told:?}");
        assert!(told[0].contains("outside the scene") && told[1].contains("closed surface"));
    }
}
