//! The figures of law *late/slopes* in random rooms: what the law's own rooms do not show. `examples/random_rooms.rs` prints them.
//!
//! No bound is asked for here. Paths around edges are left out, as particles have none.

use foresound::error::Result;
use foresound::propagation::PropagationSettings;
use foresound::scene::{SourceId, SourcePose};

use super::late::{BOUNDS, direct_energy, echogram_of, update, worst_errors};
use super::random_rooms::{KINDS, room};

pub use super::late::FIGURES;

/// One room by one seed of the rays.
#[derive(Debug, Clone, Copy)]
pub struct RoomErrors {
    /// Number of the room.
    pub number: u64,
    /// Its kind.
    pub kind: &'static str,
    /// By how much each of [`FIGURES`] is off in its worst octave, with its sign.
    pub worst: [f64; 5],
}

/// Errors of a room by each of so many seeds. Its particles fly for some seconds.
///
/// Errors: what a commit refuses.
pub fn of_room(number: u64, seeds: u64) -> Result<Vec<RoomErrors>> {
    let room = room(number);
    let scene = room.scene()?;
    let speed_m_s = scene.speed_of_sound_m_s();
    let mut exact = room.trace(speed_m_s);
    exact.damp(scene.air_np_per_m(), speed_m_s);
    let of_seed = |seed: u64| {
        let settings = PropagationSettings {
            seed,
            diffraction_order: 0,
            ..PropagationSettings::default()
        };
        let source = SourcePose::at(SourceId::new((seed % 3) as u16, 0), room.source);
        let set = update(&scene, room.listener, &[source], &settings)?;
        Ok(RoomErrors {
            number,
            kind: room.name,
            worst: worst_errors(&echogram_of(&set), &exact, direct_energy(&set)),
        })
    };
    (1..=seeds).map(of_seed).collect()
}

/// Name, root mean squares and numbers of figures out of the law's bounds, of each kind and of all.
pub fn summary(errors: &[RoomErrors]) -> Vec<(&'static str, [(f64, usize); 5])> {
    let kinds = KINDS.into_iter().map(|kind| (kind, Some(kind)));
    let each = kinds.chain([("all", None)]).map(|(name, kind)| {
        let of_kind = || {
            errors
                .iter()
                .filter(move |e| kind.is_none_or(|kind| e.kind == kind))
        };
        let figures = std::array::from_fn(|figure| {
            let squares = of_kind().map(|e| e.worst[figure] * e.worst[figure]);
            let mean = squares.sum::<f64>() / of_kind().count().max(1) as f64;
            let is_out = |e: &&RoomErrors| e.worst[figure].abs() > BOUNDS[figure];
            (mean.sqrt(), of_kind().filter(is_out).count())
        });
        (name, figures)
    });
    each.collect()
}
