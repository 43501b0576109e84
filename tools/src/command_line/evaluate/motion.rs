//! Positions of listener and sources at a time, under each condition.

use foresound::runtime::Poses;
use foresound::scene::layout::Walk;
use foresound::scene::{ListenerPose, SourceId, SourcePose};
use foresound_tools::cells::Condition;
use foresound_tools::motion::{Moves, Place};

use super::plan::Unit;
use super::stage::Stage;

/// Speed of the running listener of the stress condition, in m/s.
const RUN_M_S: f64 = 5.0;

/// Angular speed of the same listener in rad/s: 180 degrees a second, to and fro between both sides.
const TURN_RAD_S: f64 = std::f64::consts::PI;

/// Highest speed of a swaying source in m/s, and of its phase in rad/s.
const SWAY_M_S: f64 = 2.0;
const SWAY_RAD_S: f64 = std::f64::consts::PI;

/// The motion of a unit.
pub(super) struct Motion<'a> {
    unit: &'a Unit,
    stage: &'a Stage,
    /// Start along the walk in metres.
    start_m: f64,
    /// Motion without prediction.
    moves: Option<Moves>,
}

impl<'a> Motion<'a> {
    /// Repeats start at other distances along the walk, and with other random numbers.
    pub(super) fn of(unit: &'a Unit, stage: &'a Stage) -> Self {
        // A fraction that spreads the starts over the walk there and back.
        let start_m =
            unit.repeat as f64 * 0.382 * 2.0 * f64::from(stage.walk.from.distance(stage.walk.to));
        let sources = &stage.sources[..unit.sources.min(stage.sources.len())];
        let moves = stage.floor.as_ref().and_then(|floor| {
            let place = Place {
                scene: &stage.scene,
                floor,
                walk: &stage.walk,
                sources,
            };
            // The last graphics frame ends after the rendering.
            let duration_s = unit.duration_s + 1.0;
            Moves::of(unit.condition, &place, start_m, duration_s, unit.repeat + 1)
        });
        Self {
            unit,
            stage,
            start_m,
            moves,
        }
    }

    /// Times in seconds at which the listener or a source is put elsewhere, within the rendering.
    pub(super) fn jumps_s(&self) -> Vec<f64> {
        let all = self.moves.iter().flat_map(|moves| &moves.jumps_s);
        all.copied()
            .filter(|at| *at < self.unit.duration_s)
            .collect()
    }

    /// Sets the poses at a time.
    pub(super) fn set_poses(&self, time_s: f64, poses: &mut Poses) {
        let stage = self.stage;
        let walked = || stage.walk.position_at(time_s, self.start_m);
        poses.listener = match self.unit.condition {
            Condition::Static => ListenerPose::facing(stage.walk.standing, 0.0),
            Condition::Stress => {
                let run = Walk {
                    speed_m_s: RUN_M_S,
                    ..stage.walk
                };
                let position = run.position_at(time_s, self.start_m);
                ListenerPose::facing(position, yaw_rad(time_s) as f32)
            }
            _ => {
                let track = self.moves.as_ref().and_then(|m| m.listener.as_ref());
                track.map_or_else(
                    || ListenerPose::facing(walked(), 0.0),
                    |track| track.pose_at(time_s),
                )
            }
        };
        poses.sources.clear();
        let sources = stage.sources.iter().zip(&stage.sways);
        for (slot, (base, sway)) in sources.take(self.unit.sources).enumerate() {
            let mut position = *base;
            if self.unit.condition == Condition::Stress && sway.length() > 0.0 {
                let speed_rad_s = (SWAY_M_S / f64::from(sway.length())).min(SWAY_RAD_S);
                let phase = speed_rad_s * time_s + slot as f64;
                position += *sway * phase.sin() as f32;
            }
            let track = self.moves.as_ref().and_then(|m| m.sources.get(slot));
            if let Some(track) = track {
                position = track.position_at(time_s);
            }
            let id = SourceId::new(slot as u16, 0);
            poses.sources.push(SourcePose::at(id, position));
        }
    }
}

/// The yaw: a quarter turn to one side, half a turn back, and so on, at constant speed.
fn yaw_rad(time_s: f64) -> f64 {
    let half = std::f64::consts::FRAC_PI_2;
    let phase = (TURN_RAD_S * time_s + half).rem_euclid(4.0 * half);
    half - (phase - 2.0 * half).abs()
}

#[cfg(test)]
mod tests {
    use super::yaw_rad;

    #[test]
    fn the_yaw_turns_by_half_a_turn_a_second() {
        for step in 0..4000 {
            let time_s = f64::from(step) / 1000.0;
            assert!(yaw_rad(time_s).abs() <= std::f64::consts::FRAC_PI_2 + 1e-9);
        }
        let turned = yaw_rad(0.6) - yaw_rad(0.7);
        assert!(
            (turned - 0.1 * std::f64::consts::PI).abs() < 1e-9,
            "{turned}"
        );
        assert!(yaw_rad(0.0).abs() < 1e-9 && yaw_rad(2.0).abs() < 1e-9);
    }
}
