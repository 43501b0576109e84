//! Godot's coordinates and Foresound's; nothing else in this crate converts.
//!
//! Both are right-handed with +x right, +y up and −z ahead, in metres (Godot's unit), so numbers stay. What differs: a transform
//! of Godot has a scale, which a pose of Foresound has not.

use foresound::glam::{DAffine3, DMat3, DQuat, DVec3, Quat, Vec3};
use godot::builtin::{Transform3D, Vector3};

/// A transform without its scale, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Position in metres.
    pub position: Vec3,
    /// Orientation of length 1.
    pub orientation: Quat,
}

/// A point in metres.
pub fn point(godot: Vector3) -> Vec3 {
    Vec3::new(godot.x, godot.y, godot.z)
}

/// A point for Godot.
pub fn to_godot(foresound: Vec3) -> Vector3 {
    Vector3::new(foresound.x, foresound.y, foresound.z)
}

/// A whole transform in double precision: rotation, scale, shear and translation.
pub fn affine(transform: &Transform3D) -> DAffine3 {
    let column = |vector: Vector3| point(vector).as_dvec3();
    let basis = &transform.basis;
    DAffine3 {
        matrix3: DMat3::from_cols(
            column(basis.col_a()),
            column(basis.col_b()),
            column(basis.col_c()),
        ),
        translation: column(transform.origin),
    }
}

/// Position and orientation of a transform. `None` for one without volume or with a NaN: it has no orientation.
pub fn pose(transform: &Transform3D) -> Option<Pose> {
    let affine = affine(transform);
    let determinant = affine.matrix3.determinant();
    if !(affine.is_finite() && determinant.abs() > 1e-12) {
        return None;
    }
    let (_, rotation, translation) = affine.to_scale_rotation_translation();
    Some(Pose {
        position: translation.as_vec3(),
        orientation: rotation.as_quat().normalize(),
    })
}

/// The transform of `member` in the coordinates of a rigid body at `body`: the scale goes into the corners.
pub fn in_body(body: &Pose, member: &Transform3D) -> DAffine3 {
    let rotation = DQuat::from_array(body.orientation.to_array().map(f64::from)).normalize();
    let position: DVec3 = body.position.as_dvec3();
    DAffine3::from_rotation_translation(rotation, position).inverse() * affine(member)
}

#[cfg(test)]
mod tests {
    use std::f32::consts::FRAC_PI_2;

    use foresound::ListenerPose;
    use godot::builtin::{Basis, Quaternion};

    use super::*;

    /// Largest difference by rounding of a few products of numbers below 10.
    const ROUNDING: f32 = 1e-5;

    fn turned() -> Transform3D {
        // A turn to the left by a quarter, then up by an eighth.
        let left = Quaternion::new(0.0, (FRAC_PI_2 / 2.0).sin(), 0.0, (FRAC_PI_2 / 2.0).cos());
        let up = Quaternion::new((FRAC_PI_2 / 4.0).sin(), 0.0, 0.0, (FRAC_PI_2 / 4.0).cos());
        let basis = Basis::from_quaternion(left * up);
        Transform3D::new(basis, Vector3::new(1.0, 2.0, -3.0))
    }

    #[test]
    fn ahead_up_and_right_are_the_same() {
        let transform = turned();
        let pose = pose(&transform).expect("an orientation");
        let listener = ListenerPose {
            position: pose.position,
            orientation: pose.orientation,
        };
        for (godot, head) in [
            (Vector3::FORWARD, Vec3::NEG_Z),
            (Vector3::UP, Vec3::Y),
            (Vector3::RIGHT, Vec3::X),
        ] {
            let direction = point(transform.basis * godot);
            assert!((listener.to_head(direction) - head).length() < ROUNDING);
        }
        assert!((pose.position - Vec3::new(1.0, 2.0, -3.0)).length() < ROUNDING);
    }

    #[test]
    fn yaw_turns_left_in_both() {
        let half = FRAC_PI_2 / 2.0;
        let yaw = Basis::from_quaternion(Quaternion::new(0.0, half.sin(), 0.0, half.cos()));
        let pose = pose(&Transform3D::new(yaw, Vector3::ZERO)).expect("an orientation");
        let facing = ListenerPose::facing([0.0; 3], FRAC_PI_2).orientation;
        assert!(pose.orientation.angle_between(facing) < 1e-3);
    }

    #[test]
    fn a_body_and_its_pose_give_back_the_world() {
        let mut body = turned();
        body.basis = body.basis.scaled(Vector3::new(2.0, 0.5, 3.0));
        let corner = Vector3::new(0.25, 1.0, -1.5);
        let at = pose(&body).expect("an orientation");
        let local = in_body(&at, &body).transform_point3(point(corner).as_dvec3());
        let world = at.position + at.orientation * local.as_vec3();
        let drawn = point(body * corner);
        assert!((world - drawn).length() < ROUNDING, "{world} {drawn}");
    }

    #[test]
    fn what_has_no_orientation_is_told() {
        let flat = Basis::from_scale(Vector3::new(1.0, 0.0, 1.0));
        assert_eq!(pose(&Transform3D::new(flat, Vector3::ZERO)), None);
        let nan = Vector3::new(f32::NAN, 0.0, 0.0);
        assert_eq!(pose(&Transform3D::new(Basis::IDENTITY, nan)), None);
    }
}
