//! Concave faces of OBJ files: their triangles cover the outline once.
//!
//! Outlines have small whole coordinates, so areas and turns are exact. The oracle knows no ears: it adds up areas and
//! intersects triangles in pairs.

#![expect(clippy::unwrap_used, reason = "a helper's failure is the test's")]

use std::fmt::Write;

use foresound::scene::{MeshOptions, load_mesh};
use glam::{DMat3, DVec2, DVec3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

type Point = (i64, i64);

/// Triangles of faces after a rotation, face by face, as points of their own plane, and the warnings.
fn triangles(faces: &[Vec<Point>], rotation: DMat3) -> (Vec<Vec<[DVec2; 3]>>, Vec<String>) {
    let (mut text, mut first) = (String::new(), 1);
    for face in faces {
        for &(x, y) in face {
            let p = rotation * DVec3::new(x as f64, y as f64, 3.0);
            writeln!(text, "v {} {} {}", p.x as f32, p.y as f32, p.z as f32).unwrap();
        }
        text.push('f');
        for i in first..first + face.len() {
            write!(text, " {i}").unwrap();
        }
        text.push('\n');
        first += face.len();
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("face.obj");
    std::fs::write(&path, text).unwrap();
    let file = load_mesh(&path, &MeshOptions::default()).unwrap();
    let plane = |i: u32| {
        let p = rotation.transpose() * file.mesh.vertices[i as usize].as_dvec3();
        assert!((p.z - 3.0).abs() < 1e-4);
        p.truncate()
    };
    let mut rest = file.mesh.triangles.iter().map(|t| t.map(plane));
    let of_faces = faces
        .iter()
        .map(|face| rest.by_ref().take(face.len() - 2).collect())
        .collect();
    assert!(rest.next().is_none());
    (of_faces, file.warnings)
}

fn signed_area(corners: &[DVec2]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let sum: f64 = corners.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum();
    sum / 2.0
}

/// Area that two triangles of positive area share: one is clipped by the sides of the other.
fn common_area(a: &[DVec2; 3], b: &[DVec2; 3]) -> f64 {
    let mut left = a.to_vec();
    for i in 0..3 {
        let (from, along) = (b[i], b[(i + 1) % 3] - b[i]);
        let side = |p: DVec2| along.perp_dot(p - from);
        let mut next = Vec::new();
        for (j, &p) in left.iter().enumerate() {
            let q = left[(j + 1) % left.len()];
            if side(p) >= 0.0 {
                next.push(p);
            }
            if (side(p) > 0.0 && side(q) < 0.0) || (side(p) < 0.0 && side(q) > 0.0) {
                next.push(p + (q - p) * (side(p) / (side(p) - side(q))));
            }
        }
        left = next;
        if left.is_empty() {
            return 0.0;
        }
    }
    signed_area(&left)
}

/// Checks a face from every first corner and in both windings.
fn check(outline: &[Point], rotation: DMat3) -> Result<(), TestCaseError> {
    let corners: Vec<DVec2> = outline
        .iter()
        .map(|&(x, y)| DVec2::new(x as f64, y as f64))
        .collect();
    let exact = rotation == DMat3::IDENTITY;
    // Corners of a turned face are rounded to 24 bits at up to 100 m: 4 µm over an outline of less than 400 m.
    let tolerance_m2 = if exact { 1e-9 } else { 2e-3 };
    let area = signed_area(&corners).abs();
    let mut turned = outline.to_vec();
    let mut faces = Vec::new();
    for _ in 0..2 {
        for _ in 0..outline.len() {
            turned.rotate_left(1);
            faces.push(turned.clone());
        }
        turned.reverse();
    }
    let (triangles, warnings) = triangles(&faces, rotation);
    prop_assert!(warnings.is_empty(), "{warnings:?}: {outline:?}");
    for (number, (face, mut triangles)) in faces.iter().zip(triangles).enumerate() {
        let reversed = number >= outline.len();
        if reversed != (signed_area(&corners) < 0.0) {
            triangles.iter_mut().for_each(|t| t.reverse());
        }
        let mut sum = 0.0;
        for triangle in &triangles {
            let area = signed_area(triangle);
            prop_assert!(area > -tolerance_m2, "wound the other way: {face:?}");
            sum += area.abs();
        }
        prop_assert!(
            (sum - area).abs() <= tolerance_m2,
            "{sum} instead of {area} m²: {face:?}"
        );
        for (i, a) in triangles.iter().enumerate() {
            for b in &triangles[..i] {
                let common = common_area(a, b);
                prop_assert!(common.abs() <= tolerance_m2, "{a:?} and {b:?}: {face:?}");
            }
        }
    }
    Ok(())
}

fn cross(o: Point, a: Point, b: Point) -> i64 {
    (a.0 - o.0) * (b.1 - o.1) - (a.1 - o.1) * (b.0 - o.0)
}

/// Whether two closed segments have a point in common.
fn meet(a: Point, b: Point, c: Point, d: Point) -> bool {
    let within = |p: Point, q: Point, r: Point| {
        cross(p, q, r) == 0
            && (p.0.min(q.0)..=p.0.max(q.0)).contains(&r.0)
            && (p.1.min(q.1)..=p.1.max(q.1)).contains(&r.1)
    };
    let sides = |p, q, r, s| cross(p, q, r).signum() * cross(p, q, s).signum() < 0;
    (sides(a, b, c, d) && sides(c, d, a, b))
        || within(a, b, c)
        || within(a, b, d)
        || within(c, d, a)
        || within(c, d, b)
}

/// Whether no two sides meet but neighbours at their common corner.
fn is_simple(outline: &[Point]) -> bool {
    let n = outline.len();
    let side = |i: usize| (outline[i % n], outline[(i + 1) % n]);
    (0..n).all(|i| {
        let (a, b) = side(i);
        let (_, c) = side(i + 1);
        // A fold back along the side before.
        let folded =
            cross(a, b, c) == 0 && (a.0 - b.0) * (c.0 - b.0) + (a.1 - b.1) * (c.1 - b.1) >= 0;
        !folded
            && (i + 2..n).all(|j| {
                let (c, d) = side(j);
                (j + 1) % n == i || !meet(a, b, c, d)
            })
    })
}

/// Turns a closed walk through points into a simple outline by undoing crossings, or none.
fn uncrossed(mut points: Vec<Point>) -> Option<Vec<Point>> {
    points.sort_unstable();
    points.dedup();
    // Any fixed order that is not the sorted one.
    points.sort_by_key(|&(x, y)| (x * 7919 + y * 104_729).rem_euclid(1009));
    let n = points.len();
    for _ in 0..400 {
        let pairs = (0..n).flat_map(|i| (i + 2..n).map(move |j| (i, j)));
        let mut crossing = pairs.filter(|&(i, j)| {
            (j + 1) % n != i && meet(points[i], points[i + 1], points[j], points[(j + 1) % n])
        });
        let Some((i, j)) = crossing.next() else { break };
        points[i + 1..=j].reverse();
    }
    (n >= 4 && is_simple(&points)).then_some(points)
}

/// The outline of the largest piece of a picture whose pieces are edge-connected, its holes filled.
fn traced(cells: &[bool], width: usize) -> Option<Vec<Point>> {
    let filled = |x: i64, y: i64| {
        x >= 0
            && y >= 0
            && (x as usize) < width
            && cells.get(y as usize * width + x as usize) == Some(&true)
    };
    let first = cells.iter().position(|&c| c)?;
    let start = ((first % width) as i64, (first / width) as i64);
    // Along the lower side of the first cell, the piece on the left.
    let (mut at, mut step) = (start, (1, 0));
    let mut outline = Vec::new();
    loop {
        at = (at.0 + step.0, at.1 + step.1);
        let cell = |left: i64, ahead: i64| {
            // Cells around a lattice point, by quadrant seen along the step.
            let (l, f) = ((-step.1, step.0), step);
            let middle = (
                2 * at.0 + left * l.0 + ahead * f.0,
                2 * at.1 + left * l.1 + ahead * f.1,
            );
            filled((middle.0 - 1).div_euclid(2), (middle.1 - 1).div_euclid(2))
        };
        let (left, right) = (cell(1, 1), cell(-1, 1));
        let turned = match (left, right) {
            (false, _) => (-step.1, step.0),
            (true, true) => (step.1, -step.0),
            (true, false) => step,
        };
        if turned != step {
            outline.push(at);
        } else if (at.0 + at.1) % 3 == 0 {
            // A corner that does not turn, as where a neighbour's wall begins.
            outline.push(at);
        }
        step = turned;
        if at == start && step == (1, 0) {
            return Some(outline);
        }
    }
}

/// A wall of 3 m with doors that reach down to the ground, in decimetres: their lefts and widths.
fn wall(doors: &[(i64, i64)]) -> Vec<Point> {
    let (mut outline, mut at) = (vec![(0, 30), (0, 0)], 0);
    for &(gap, width) in doors {
        let left = at + gap;
        outline.extend([(left, 0), (left, 21), (left + width, 21), (left + width, 0)]);
        at = left + width;
    }
    outline.extend([(at + 5, 0), (at + 5, 30)]);
    outline
}

/// Adds windows, bridged one from another: the outline leads over to each and back.
fn with_windows(mut wall: Vec<Point>, windows: &[(i64, i64)], above: i64) -> Vec<Point> {
    let (mut inner, mut at) = (Vec::new(), 0);
    for &(gap, width) in windows {
        let (left, right) = (at + gap, at + gap + width);
        // Clockwise, from the corner that the bridge ends at.
        let ring = [
            (left, above),
            (left, above + 4),
            (right, above + 4),
            (right, above),
        ];
        inner.push(ring);
        at = right;
    }
    // From the upper left corner of the wall to the first window, from each lower right corner to the next window.
    let mut bridged = vec![wall.remove(0)];
    let top = bridged[0];
    let mut back = vec![top];
    for ring in inner {
        bridged.extend(ring);
        back.push(ring[0]);
        back.push(ring[3]);
        // The lower side is walked from right to left on the way back.
    }
    back.reverse();
    back.dedup();
    bridged.extend(back);
    bridged.dedup();
    bridged.extend(wall);
    bridged
}

fn tilt() -> DMat3 {
    DMat3::from_rotation_x(0.7) * DMat3::from_rotation_y(-1.1) * DMat3::from_rotation_z(0.4)
}

/// Moves along a wall and back, as pairs of a gap and a width.
fn openings(most: usize) -> impl Strategy<Value = Vec<(i64, i64)>> {
    prop::collection::vec((1i64..12, 4i64..16), 1..=most)
}

fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        failure_persistence: None,
        cases,
        rng_seed: RngSeed::Fixed(21),
        ..ProptestConfig::default()
    }
}

#[test]
fn an_l_has_its_area_from_every_first_corner() {
    let l_shape = [(2, 0), (0, 0), (0, 1), (1, 1), (1, 2), (2, 2)];
    check(&l_shape, DMat3::IDENTITY).unwrap();
    check(&l_shape, tilt()).unwrap();
}

#[test]
fn a_face_that_crosses_itself_is_reported() {
    let (_, warnings) = triangles(&[vec![(0, 0), (4, 4), (4, 0), (0, 3)]], DMat3::IDENTITY);
    assert!(
        warnings[0].contains("outline of 1 face crosses itself"),
        "{warnings:?}"
    );
}

proptest! {
    #![proptest_config(cases(200))]

    #[test]
    fn simple_polygons_are_covered_once(
        points in prop::collection::vec((0i64..12, 0i64..12), 4..20),
    ) {
        if let Some(outline) = uncrossed(points) {
            check(&outline, DMat3::IDENTITY)?;
        }
    }
}

proptest! {
    #![proptest_config(cases(400))]

    #[test]
    fn rectilinear_outlines_are_covered_once(
        cells in prop::collection::vec(prop::bool::weighted(0.7), 20),
    ) {
        if let Some(outline) = traced(&cells, 5) {
            check(&outline, DMat3::IDENTITY)?;
        }
    }
}

proptest! {
    #![proptest_config(cases(200))]

    #[test]
    fn walls_with_doors_are_covered_once(doors in openings(3), turned in any::<bool>()) {
        check(&wall(&doors), if turned { tilt() } else { DMat3::IDENTITY })?;
    }

    #[test]
    fn walls_with_doors_and_windows_are_covered_once(
        doors in openings(2),
        windows in openings(4),
        turned in any::<bool>(),
    ) {
        let mut outline = wall(&doors);
        // The wall is as wide as its windows need.
        let right = 2 + windows.iter().map(|(gap, width)| gap + width).sum::<i64>();
        let width = outline[outline.len() - 1].0.max(right);
        for corner in outline.iter_mut().rev().take(2) {
            corner.0 = width;
        }
        let outline = with_windows(outline, &windows, 23);
        check(&outline, if turned { tilt() } else { DMat3::IDENTITY })?;
    }
}
