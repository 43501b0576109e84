//! Bevy's coordinates and Foresound's; nothing else in this crate converts.
//!
//! Both are right-handed with +x right, +y up and −z ahead, in metres, so numbers stay. What differs: Bevy's `Vec3` and `Quat`
//! are of another version of `glam`, and a transform of Bevy has a scale, which a pose of Foresound has not.

use bevy_transform::components::GlobalTransform;
use foresound::glam::{DAffine3, DMat3, DQuat, DVec3, Quat, Vec3};

/// A transform without its scale, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Position in metres.
    pub position: Vec3,
    /// Orientation of length 1.
    pub orientation: Quat,
}

/// Position and orientation of a transform. A mirrored transform has the orientation of its rotation part.
pub fn pose(transform: &GlobalTransform) -> Pose {
    let (_, rotation, translation) = transform.to_scale_rotation_translation();
    Pose {
        position: Vec3::from_array(translation.to_array()),
        orientation: Quat::from_array(rotation.to_array()).normalize(),
    }
}

/// A whole transform in double precision: rotation, scale, shear and translation.
pub fn affine(transform: &GlobalTransform) -> DAffine3 {
    let affine = transform.affine();
    let column = |column: [f32; 3]| DVec3::from_array(column.map(f64::from));
    DAffine3 {
        matrix3: DMat3::from_cols(
            column(affine.matrix3.x_axis.to_array()),
            column(affine.matrix3.y_axis.to_array()),
            column(affine.matrix3.z_axis.to_array()),
        ),
        translation: column(affine.translation.to_array()),
    }
}

/// The transform of `member` in the coordinates of a rigid body whose transform is `body`, without the scale of `body`'s pose:
/// the scale goes into the corners.
pub fn in_body(body: &GlobalTransform, member: &GlobalTransform) -> DAffine3 {
    let pose = pose(body);
    let rotation = DQuat::from_array(pose.orientation.to_array().map(f64::from));
    let rigid = DAffine3::from_rotation_translation(rotation.normalize(), pose.position.as_dvec3());
    rigid.inverse() * affine(member)
}

/// A point of Foresound for Bevy's drawing, in metres.
pub fn to_bevy(point: Vec3) -> [f32; 3] {
    point.to_array()
}

#[cfg(test)]
mod tests {
    use bevy_transform::components::Transform;
    use foresound::ListenerPose;

    use super::*;

    /// Largest difference by rounding of a few products of numbers below 10.
    const ROUNDING: f64 = 1e-5;

    fn turned() -> GlobalTransform {
        let mut transform = Transform::from_xyz(1.0, 2.0, -3.0);
        transform.rotate_y(0.7);
        transform.rotate_local_x(-0.4);
        GlobalTransform::from(transform)
    }

    #[test]
    fn ahead_up_and_right_are_the_same() {
        let transform = turned();
        let pose = pose(&transform);
        let listener = ListenerPose {
            position: pose.position,
            orientation: pose.orientation,
        };
        for (bevy, foresound) in [
            (transform.forward(), Vec3::NEG_Z),
            (transform.up(), Vec3::Y),
            (transform.right(), Vec3::X),
        ] {
            let direction = Vec3::from_array(bevy.to_array());
            let in_head = listener.to_head(direction);
            assert!((in_head - foresound).length() < 1e-6, "{in_head}");
        }
    }

    #[test]
    fn yaw_turns_left_in_both() {
        let mut transform = Transform::IDENTITY;
        transform.rotate_y(0.5);
        let facing = ListenerPose::facing([0.0; 3], 0.5).orientation;
        let pose = pose(&GlobalTransform::from(transform));
        assert!(pose.orientation.angle_between(facing) < 1e-3);
    }

    #[test]
    fn a_point_of_a_mesh_is_where_bevy_draws_it() {
        let mut transform = turned().compute_transform();
        transform.scale = [0.5, 3.0, -2.0].into();
        let transform = GlobalTransform::from(transform);
        let point = [1.5f32, -0.25, 4.0];
        let drawn = transform.transform_point(point.into()).to_array();
        let heard = affine(&transform).transform_point3(DVec3::from_array(point.map(f64::from)));
        let drawn = DVec3::from_array(drawn.map(f64::from));
        assert!((heard - drawn).length() < ROUNDING, "{heard} {drawn}");
    }

    #[test]
    fn a_body_and_its_pose_give_back_the_world() {
        let mut body = turned().compute_transform();
        body.scale = [2.0, 2.0, 2.0].into();
        let body = GlobalTransform::from(body);
        let member = body.mul_transform(Transform::from_xyz(0.0, 1.0, 0.5));
        let local = in_body(&body, &member).transform_point3(DVec3::ONE);
        let pose = pose(&body);
        let rotation = DQuat::from_array(pose.orientation.to_array().map(f64::from));
        let world = pose.position.as_dvec3() + rotation * local;
        let drawn = member.transform_point([1.0, 1.0, 1.0].into()).to_array();
        let drawn = DVec3::from_array(drawn.map(f64::from));
        assert!((world - drawn).length() < ROUNDING, "{world} {drawn}");
    }
}
