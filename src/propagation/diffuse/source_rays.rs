//! The rays of one source and one rotation of the lattice.
//!
//! All rays are traced to the depth of discrete paths; a few far ones carry what is not scattered until then to
//! [`FAR_BOUNCES`]. All are reflected specularly.

use glam::{DVec3, Mat3, Vec3};

use crate::propagation::diffuse::transport::SceneField;
use crate::propagation::rays::directions::{INTERLEAVED_PARTS, interleaved_shift};
use crate::scene::SourcePose;

/// Rays traced beyond the depth of discrete paths.
pub const FAR_RAYS: usize = 16;

/// Last bounce of a far ray, where what is left is scattered: at a scattering coefficient of 0.1 that is 3 %.
pub const FAR_BOUNCES: usize = 32;

/// Origin and directions of source rays, and their other inputs.
#[derive(Debug, Clone, Copy)]
pub struct SourceRays<'a> {
    /// The source, local coordinates.
    pub origin: DVec3,
    /// From the source's position to the point of its extent at which the rays start; zero for a point source.
    pub offset: DVec3,
    /// The scene's late field, whose patches take what scatters.
    pub field: &'a SceneField,
    /// The source's pose and settings; its directivity weights the rays.
    pub pose: SourcePose,
    /// The rotation's lattice ([`crate::propagation::rays::directions::lattice_of`]), one unit vector per ray.
    pub directions: &'a [Vec3],
    /// Turn of the lattices of all rotations.
    pub turn: Mat3,
    /// Index of the rotation, `update % ROTATIONS`.
    pub rotation: u64,
    /// Highest order of discrete paths.
    pub depth: usize,
    /// Revision of the scene: the same revision has the same rays.
    pub scene_state: u64,
    /// While instances move, the first revision since which only their poses have changed; otherwise `scene_state`. Rays of
    /// these revisions stay valid as long as instances touch few of them.
    pub poses_since: u64,
    /// The first revision since which only poses of instances have changed.
    pub fixed_since: u64,
}

impl SourceRays<'_> {
    /// Where the selection of bounces begins, in strides ([`crate::propagation::diffuse::next_event`]). A point's rotations have
    /// bounces at one place in the list, and begin a sixteenth apart.
    pub(crate) fn first_mark(&self) -> f64 {
        match self.offset == DVec3::ZERO {
            true => first_mark_of(self.rotation),
            false => 0.5,
        }
    }

    /// Number of rays.
    pub(crate) fn count(&self) -> usize {
        self.directions.len()
    }

    /// Bounces of every ray.
    pub(crate) fn near_bounces(&self) -> usize {
        self.depth.max(1)
    }

    /// Further bounces of a far ray.
    pub(crate) fn far_bounces(&self) -> usize {
        FAR_BOUNCES.saturating_sub(self.near_bounces())
    }

    /// Most far rays of any rotation.
    pub(crate) fn max_far_rays(&self) -> usize {
        self.count().min(FAR_RAYS)
    }

    /// Most legs of all rays.
    pub(crate) fn max_legs(&self) -> usize {
        self.count() * self.near_bounces() + self.max_far_rays() * self.far_bounces()
    }

    /// Index among all legs of one within the discrete depth.
    #[inline(always)]
    pub(crate) fn near_leg_index(&self, index: u32, step: usize) -> usize {
        index as usize * self.near_bounces() + step
    }

    /// Index among all legs of a far ray's one beyond that depth.
    #[inline(always)]
    pub(crate) fn far_leg_index(&self, far: u8, step: usize) -> usize {
        let beyond = usize::from(far) * self.far_bounces() + step - self.near_bounces();
        self.count() * self.near_bounces() + beyond
    }
}

fn first_mark_of(rotation: u64) -> f64 {
    let [along, around] = interleaved_shift(rotation).map(f64::from);
    let parts = f64::from(INTERLEAVED_PARTS);
    (around + (along + 0.5) / parts) / parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::rays::directions::ROTATIONS;

    #[test]
    fn first_marks_of_rotations_are_evenly_spread() {
        let mut marks: Vec<f64> = (0..ROTATIONS).map(first_mark_of).collect();
        marks.sort_by(f64::total_cmp);
        for (index, mark) in marks.into_iter().enumerate() {
            assert_eq!(mark, (index as f64 + 0.5) / 16.0);
        }
    }
}
