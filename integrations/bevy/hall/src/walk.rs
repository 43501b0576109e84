//! The listener walks: by itself on the line of `concert_hall.toml`, or by the arrow keys.

use bevy::prelude::*;
use foresound_bevy::ForesoundListener;

/// Ends of the line, at ear height in metres.
const ENDS: [Vec3; 2] = [Vec3::new(7.75, 1.65, 3.0), Vec3::new(7.75, 1.65, 17.0)];
const SPEED_M_S: f32 = 1.4;
const TURN_RAD_S: f32 = 1.6;

/// What walks.
#[derive(Component, Default)]
pub(crate) struct Walker {
    /// Metres on the line, there and back.
    walked_m: f32,
    /// Whether a key was pressed.
    is_led: bool,
}

/// A head of a listener, which looks at the stage.
pub(crate) fn enter(mut commands: Commands) {
    let at = Transform::from_translation(ENDS[0]).looking_to(Vec3::NEG_X, Vec3::Y);
    commands.spawn((Walker::default(), ForesoundListener, at));
}

/// A step of one frame. The head is drawn as a sphere with a line ahead.
pub(crate) fn walk(
    time: Res<Time>,
    keys: Res<ButtonInput<KeyCode>>,
    walker: Single<(&mut Walker, &mut Transform)>,
    mut gizmos: Gizmos,
) {
    let (mut walker, mut at) = walker.into_inner();
    let pressed = |key| f32::from(u8::from(keys.pressed(key)));
    let ahead = pressed(KeyCode::ArrowUp) - pressed(KeyCode::ArrowDown);
    let left = pressed(KeyCode::ArrowLeft) - pressed(KeyCode::ArrowRight);
    walker.is_led |= ahead != 0.0 || left != 0.0;
    let step_m = SPEED_M_S * time.delta_secs();
    if walker.is_led {
        at.rotate_y(left * TURN_RAD_S * time.delta_secs());
        let forward = at.forward();
        at.translation += forward * (ahead * step_m);
    } else {
        walker.walked_m += step_m;
        at.translation = on_line(walker.walked_m);
    }
    let colour = Color::srgb(0.4, 0.8, 1.0);
    gizmos.sphere(at.translation, 0.2, colour);
    gizmos.line(
        at.translation,
        at.translation + 0.6 * at.forward().as_vec3(),
        colour,
    );
}

/// Where one is after some metres.
fn on_line(walked_m: f32) -> Vec3 {
    let length_m = ENDS[0].distance(ENDS[1]);
    let there = walked_m.rem_euclid(2.0 * length_m);
    let share = there.min(2.0 * length_m - there) / length_m;
    ENDS[0].lerp(ENDS[1], share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_is_walked_there_and_back() {
        let length_m = ENDS[0].distance(ENDS[1]);
        for (walked_m, place) in [
            (0.0, ENDS[0]),
            (length_m, ENDS[1]),
            (2.0 * length_m, ENDS[0]),
        ] {
            assert!(on_line(walked_m).distance(place) < 1e-3);
        }
        let there = on_line(0.25 * length_m);
        assert!(there.distance(on_line(1.75 * length_m)) < 1e-3);
        assert!((there.z - 6.5).abs() < 1e-3);
    }
}
