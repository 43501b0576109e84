//! Motion that nobody predicts, of the conditions in [`Condition::UNPREDICTED`]: seeded, inside open space, deterministic.
//!
//! Walks start at the position of the scene's own walk. Heights follow the floor.

mod dash;
mod irregular;
mod jumps;
mod random;
mod reachable_floor;
mod restless;
mod track;

use foresound::scene::Scene;
use foresound::scene::layout::Walk;
use glam::Vec3;

use crate::cells::Condition;

pub use self::random::Random;
pub use self::reachable_floor::ReachableFloor;
pub use self::track::Track;

/// Where motion takes place.
#[derive(Clone, Copy)]
pub struct Place<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its floor around the walk.
    pub floor: &'a ReachableFloor,
    /// Its walk.
    pub walk: &'a Walk,
    /// Positions of the sources.
    pub sources: &'a [Vec3],
}

/// Listener and sources over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Moves {
    /// The listener; `None` on the scene's own walk.
    pub listener: Option<Track>,
    /// Sources in order; those beyond the end are at rest.
    pub sources: Vec<Track>,
    /// Times in seconds at which the listener or a source is put elsewhere.
    pub jumps_s: Vec<f64>,
}

impl Moves {
    /// The moves of a condition for at least `duration_s` seconds; `None` for a condition that is predicted. `start_m` is
    /// the start along the scene's walk, in metres.
    pub fn of(
        condition: Condition,
        place: &Place<'_>,
        start_m: f64,
        duration_s: f64,
        seed: u64,
    ) -> Option<Self> {
        let number = Condition::ALL.iter().position(|one| *one == condition)?;
        let mut random = Random::of(seed.wrapping_mul(64) + number as u64);
        let start = place.floor.nearest(place.walk.position_at(0.0, start_m));
        let listener = |track| Self {
            listener: Some(track),
            sources: Vec::new(),
            jumps_s: Vec::new(),
        };
        match condition {
            Condition::Static | Condition::Dynamic | Condition::Stress => None,
            Condition::Restless => Some(listener(restless::walk(
                place,
                start,
                duration_s,
                &mut random,
            ))),
            Condition::Dash => Some(listener(dash::run(place, start, duration_s, &mut random))),
            Condition::Irregular => Some(Self {
                listener: None,
                sources: place
                    .sources
                    .iter()
                    .map(|source| irregular::drift(place.scene, *source, duration_s, &mut random))
                    .collect(),
                jumps_s: Vec::new(),
            }),
            Condition::Teleport => Some(jumps::teleports(place, start, duration_s, &mut random)),
            Condition::Jump => Some(jumps::source_jumps(place, start_m, duration_s, &mut random)),
        }
    }
}

#[cfg(test)]
mod tests;
