//! Positions of listener and sources at a time, under each condition.

use foresound::runtime::Poses;
use foresound::scene::layout::Walk;
use foresound::scene::{ListenerPose, SourceId, SourcePose};
use foresound_tools::cells::Condition;

use super::plan::Unit;
use super::stage::Stage;

/// Speed of the running listener of the stress condition, in m/s.
const RUN_M_S: f64 = 5.0;

/// Angular speed of the same listener in rad/s: 180 degrees a second, to and fro between both sides.
const TURN_RAD_S: f64 = std::f64::consts::PI;

/// Highest speed of a swaying source in m/s, and of its phase in rad/s.
const SWAY_M_S: f64 = 2.0;
const SWAY_RAD_S: f64 = std::f64::consts::PI;

/// Sets the poses at a time. `start_m` is the start along the walk.
pub(super) fn set_poses(unit: &Unit, stage: &Stage, time_s: f64, start_m: f64, poses: &mut Poses) {
    poses.listener = match unit.condition {
        Condition::Static => ListenerPose::facing(stage.walk.standing, 0.0),
        Condition::Dynamic => ListenerPose::facing(stage.walk.position_at(time_s, start_m), 0.0),
        Condition::Stress => {
            let run = Walk {
                speed_m_s: RUN_M_S,
                ..stage.walk
            };
            ListenerPose::facing(run.position_at(time_s, start_m), yaw_rad(time_s) as f32)
        }
    };
    poses.sources.clear();
    let sources = stage.sources.iter().zip(&stage.sways);
    for (slot, (base, sway)) in sources.take(unit.sources).enumerate() {
        let mut position = *base;
        if unit.condition == Condition::Stress && sway.length() > 0.0 {
            let speed_rad_s = (SWAY_M_S / f64::from(sway.length())).min(SWAY_RAD_S);
            let phase = speed_rad_s * time_s + slot as f64;
            position += *sway * phase.sin() as f32;
        }
        let id = SourceId::new(slot as u16, 0);
        poses.sources.push(SourcePose::at(id, position));
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
