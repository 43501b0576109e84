//! Handles and poses of instances.

use glam::{DMat3, DQuat, DVec3, Mat4, Quat};

use crate::error::{Error, Result};

/// Farthest coordinate in metres that a pose may have, as sources and listener.
const FARTHEST_M: f64 = 1e6;

/// Tolerance of rotations: of a quaternion's length and of the products of a matrix's columns. Far above the rounding of
/// single precision, far below an intended scale.
const RIGID: f64 = 1e-3;

/// Handle of an instance: a slot and a generation, which differs for each instance that has the slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct InstanceId(u32);

impl InstanceId {
    /// A handle of a slot and a generation.
    pub const fn new(slot: u16, generation: u16) -> Self {
        Self((generation as u32) << 16 | slot as u32)
    }

    /// Index of the slot, from 0.
    pub const fn slot(self) -> usize {
        (self.0 & 0xffff) as usize
    }

    /// Number of the slot's instance, from 1.
    pub const fn generation(self) -> u16 {
        (self.0 >> 16) as u16
    }

    /// Slot and generation as one number.
    pub const fn bits(self) -> u32 {
        self.0
    }
}

/// Pose of an instance: a rigid transform, rotation before translation.
///
/// # Examples
/// ```
/// use std::sync::Arc;
/// use foresound::{InstanceId, InstancePose, MaterialTable, Scene, SceneSettings, shoebox};
///
/// let commit = |size: [f32; 3]| {
///     let mesh = shoebox(size, "concrete");
///     Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())
/// };
/// let mut hall = commit([20.0, 8.0, 12.0])?;
/// let lift = Arc::new(commit([2.0, 3.0, 2.0])?);
/// let mut pose = InstancePose::at(InstanceId::default(), [4.0, 0.0, 6.0]);
/// pose.id = hall.add_instance(lift, &pose)?;
/// pose.position.y = 1.5;
/// hall.set_instance_pose(&pose)?;
/// # Ok::<(), foresound::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InstancePose {
    /// The instance's handle.
    pub id: InstanceId,
    /// World position of the part's origin in metres, below 1e6.
    pub position: DVec3,
    /// Rotation from the part's coordinates to world coordinates; of length 1 to a thousandth.
    pub rotation: Quat,
}

impl InstancePose {
    /// The part's origin at a position in metres (`[f64; 3]` or a vector of `glam`), not rotated.
    pub fn at(id: InstanceId, position: impl Into<DVec3>) -> Self {
        Self {
            id,
            position: position.into(),
            rotation: Quat::IDENTITY,
        }
    }

    /// From a rigid matrix of four columns of four rows.
    ///
    /// # Errors
    /// [`Error::Setting`] for a matrix that scales, shears, mirrors or is not finite.
    pub fn from_matrix(id: InstanceId, columns: [[f32; 4]; 4]) -> Result<Self> {
        let matrix = Mat4::from_cols_array_2d(&columns);
        let axes = DMat3::from_mat4(matrix.as_dmat4());
        let products = axes.transpose() * axes - DMat3::IDENTITY;
        let off = products.to_cols_array().map(f64::abs);
        let last = matrix.row(3);
        let rigid = off.iter().all(|o| *o <= RIGID)
            && axes.determinant() > 0.0
            && last.abs_diff_eq(glam::Vec4::W, RIGID as f32);
        if !rigid {
            let problem = "the matrix is not a rigid transform";
            return Err(refused(problem));
        }
        let pose = Self {
            id,
            position: matrix.w_axis.truncate().as_dvec3(),
            rotation: DQuat::from_mat3(&axes).normalize().as_quat(),
        };
        pose.check()?;
        Ok(pose)
    }

    /// Checks that the transform is rigid and within 1,000 km.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(&self) -> Result<()> {
        // In this form any NaN fails.
        if !self.position.abs().cmple(DVec3::splat(FARTHEST_M)).all() {
            let problem = format!("{} is not a position", self.position);
            return Err(refused(&problem));
        }
        let length = self.rotation.as_dquat().length();
        let rigid = (length - 1.0).abs() <= RIGID;
        if !rigid {
            let problem = format!(
                "{} is not a rotation, its length is {length}",
                self.rotation
            );
            return Err(refused(&problem));
        }
        Ok(())
    }

    /// The part's axes in world coordinates, orthogonal to double precision.
    pub(super) fn axes(&self) -> DMat3 {
        DMat3::from_quat(self.rotation.as_dquat().normalize())
    }
}

fn refused(problem: &str) -> Error {
    let advice = "give metres below 1e6 and a rotation of length 1; the last good pose is kept";
    Error::setting("instance pose", problem, advice)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn only_rigid_poses_pass() {
        let id = InstanceId::new(3, 7);
        assert_eq!((id.slot(), id.generation()), (3, 7));
        let good = InstancePose::at(id, DVec3::ONE);
        assert!(good.check().is_ok());
        let at = |position| InstancePose { position, ..good };
        assert!(at(DVec3::NAN).check().is_err());
        assert!(at(DVec3::INFINITY).check().is_err());
        assert!(at(DVec3::X * 2e6).check().is_err());
        let rotated = |rotation| InstancePose { rotation, ..good };
        assert!(
            rotated(Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0))
                .check()
                .is_err()
        );
        assert!(
            rotated(Quat::from_xyzw(0.0, 0.0, 0.0, 0.0))
                .check()
                .is_err()
        );
        assert!(
            rotated(Quat::from_xyzw(0.0, 0.0, 0.0, 1.01))
                .check()
                .is_err()
        );
    }

    #[test]
    fn a_matrix_that_turns_and_moves_passes() {
        let id = InstanceId::default();
        let (rotation, translation) = (Quat::from_rotation_y(0.7), Vec3::new(1.0, 2.0, 3.0));
        let good = Mat4::from_rotation_translation(rotation, translation);
        let pose = InstancePose::from_matrix(id, good.to_cols_array_2d()).expect("rigid");
        assert!(
            pose.rotation.abs_diff_eq(rotation, 1e-6) && pose.position == translation.as_dvec3()
        );
        for scale in [
            Vec3::splat(2.0),
            Vec3::new(1.0, 1.0, -1.0),
            Vec3::new(1.0, 1.1, 1.0),
        ] {
            let bad = good * Mat4::from_scale(scale);
            assert!(
                InstancePose::from_matrix(id, bad.to_cols_array_2d()).is_err(),
                "{scale}"
            );
        }
        assert!(InstancePose::from_matrix(id, Mat4::NAN.to_cols_array_2d()).is_err());
    }
}
