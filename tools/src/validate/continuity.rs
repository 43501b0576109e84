//! Law *continuity*: among upright stones in the open, the sound of the direct path and of the paths around edges steps by
//! little between two listeners 5 mm apart.

use std::f32::consts::TAU;

use foresound::error::Result;
use foresound::propagation::{Path, PathSet, Propagator};
use foresound::scene::{ListenerPose, SourceId, SourcePose};
use glam::{Quat, Vec2, Vec3};

use super::Row;
use super::solids::{self, Solids};

/// Stones of the ring, and its radius in metres.
const STONES: usize = 14;
const RADIUS_M: f32 = 7.0;

/// Walks across the ring's shadows, their distance from its middle and their step in metres, and steps of each.
const WALKS: usize = 24;
const DISTANCE_M: f32 = 20.0;
const STEP_M: f32 = 0.005;
const STEPS: i32 = 60;

/// Bands that are compared: up to 500 Hz, where the phase of a path changes by 0.05 in a step.
const COMPARED: usize = 4;

/// Where sources are. From the second an edge with a detour of 4 m begins behind another one: the step was 2.05 dB while it began whole.
const SOURCES: [Vec3; 2] = [Vec3::new(1.3, 1.4, 0.6), Vec3::new(-2.0, 1.4, 1.0)];

/// Largest step in dB.
const STEP_BOUND_DB: f64 = 1.0;

pub(super) fn rows() -> Result<Vec<Row>> {
    let rows = SOURCES.map(rows_of);
    Ok(rows.into_iter().collect::<Result<Vec<_>>>()?.concat())
}

fn rows_of(place: Vec3) -> Result<Vec<Row>> {
    let mut propagator = Propagator::new(ring().commit()?, solids::settings())?;
    let mut source = SourcePose::at(SourceId::new(0, 0), place);
    source.settings.effects.reflections = false;
    source.settings.effects.late = false;
    let mut steps_db = Vec::new();
    let mut set = PathSet::default();
    for walk in 0..WALKS {
        let turn = TAU * (walk as f32 + 0.3) / WALKS as f32;
        let ahead = Vec3::new(turn.cos(), 0.0, -turn.sin());
        let middle = Vec3::new(DISTANCE_M * turn.sin(), 1.6, DISTANCE_M * turn.cos());
        let mut before: Option<Vec<Path>> = None;
        for step in -STEPS..STEPS {
            let at = middle + ahead * (STEP_M * step as f32);
            let listener = ListenerPose::facing(at, 0.0);
            propagator.update(&listener, &[source], 0.0, &mut set);
            if let Some(before) = before.replace(set.paths.clone()) {
                steps_db.push(step_db(&before, &set.paths));
            }
        }
    }
    steps_db.sort_by(f64::total_cmp);
    let index = steps_db.len() * 99 / 100;
    let name = format!("continuity: ring of stones, source at {place}");
    Ok(vec![
        Row::at_most(
            format!("{name}, largest step in 5 mm"),
            steps_db.last().copied().unwrap_or(f64::NAN),
            STEP_BOUND_DB,
            "dB",
        ),
        Row::at_most(
            format!("{name}, 99 of 100 steps"),
            steps_db.get(index).copied().unwrap_or(f64::NAN),
            STEP_BOUND_DB,
            "dB",
        ),
    ])
}

/// Upright stones on the ground around the source, no two alike.
fn ring() -> Solids {
    let mut solids = Solids::new(1e-3);
    solids.solid(Vec3::new(-40.0, -0.2, -40.0), Vec3::new(40.0, 0.0, 40.0));
    for stone in 0..STONES {
        let number = stone as f32;
        let turn = TAU * number / STONES as f32;
        let half = Vec3::new(0.5 + 0.03 * number, 0.0, 0.35 - 0.01 * number);
        let height = Vec3::Y * (2.2 + 0.05 * number);
        let first = solids.mesh.vertices.len();
        solids.solid(-half, half + height);
        let rotation = Quat::from_rotation_y(turn + 0.07 * number);
        let place = RADIUS_M * Vec3::new(turn.sin(), 0.0, turn.cos());
        for vertex in &mut solids.mesh.vertices[first..] {
            *vertex = rotation * *vertex + place;
        }
    }
    solids
}

/// Level in dB by which a band's sound pressure steps between two listeners, relative to all their paths.
fn step_db(before: &[Path], after: &[Path]) -> f64 {
    let steps = (0..COMPARED).map(|band| {
        let wavenumber = TAU * 62.5 * 2f32.powi(band as i32) / 343.0;
        let wave = |p: &Path| p.amplitude[band] * Vec2::from_angle(-wavenumber * p.length_m);
        let pressure = |paths: &[Path]| paths.iter().map(wave).sum::<Vec2>();
        let root = |paths: &[Path]| {
            let squares = paths.iter().map(|p| p.amplitude[band].powi(2));
            squares.sum::<f32>().sqrt()
        };
        let whole = root(before).max(root(after)).max(1e-9);
        f64::from(pressure(before).distance(pressure(after)) / whole)
    });
    20.0 * (1.0 + steps.fold(0.0, f64::max)).log10()
}
