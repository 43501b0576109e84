//! Source rays: how a source's energy spreads over the surfaces of a scene.
//!
//! All rays go as deep as discrete paths do; a few of them go on for [`FAR_BOUNCES`], since what a tail is like is not to
//! be seen from four bounces about the source. Whether a bounce is diffuse is drawn once for all bands.
//!
//! None of it depends on the listener, so what a rotation's rays have found stays true until the source or the scene is
//! another one, and is kept (`Found`).

use glam::{DVec3, Mat3, Quat, Vec3};

use crate::geometry::Ray;
use crate::propagation::diffuse::bounce_buffer::Bounces;
use crate::propagation::diffuse::decay_fit::DecayCurve;
use crate::propagation::diffuse::static_hit_cache::FixedWay;
use crate::propagation::diffuse::trace::follow;
use crate::propagation::diffuse::visibility_cells::VisibilityCells;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::rays::directions::{mix, unit};
use crate::scene::{Directivity, Scene, SourcePose};
use crate::simd::LaneSet;

/// Rays that go on beyond the depth of discrete paths.
pub const FAR_RAYS: usize = 8;

/// Bounces after which those end too: in a diffuse field of absorption 0.1 they have lost 15 dB by then, and the decay
/// of what is left is known.
pub const FAR_BOUNCES: usize = 32;

/// Of so many legs one may be another by now while instances move. Other bounces may be chosen then: a door that swings in a
/// hall brought up to 0.6 dB of a tail's energy and 5 % of its decay (`tests/remembered_rays.rs`).
const FEW_LEGS: usize = 64;

/// Where source rays start and how many there are.
#[derive(Debug, Clone, Copy)]
pub struct SourceRays<'a> {
    /// The source, local coordinates.
    pub origin: DVec3,
    /// The listener, local coordinates.
    pub listener: DVec3,
    /// From where it is looked for what reaches the listener.
    pub viewpoints: &'a VisibilityCells,
    /// The source as it is: rays carry what its directivity sends along them.
    pub pose: SourcePose,
    /// The lattice ([`crate::propagation::rays::directions::lattice`]), one direction a ray.
    pub directions: &'a [Vec3],
    /// Rotation of the lattice.
    pub turn: Mat3,
    /// Number of the rotation, `update % ROTATIONS`.
    pub rotation: u64,
    /// Highest order of discrete paths.
    pub depth: usize,
    /// Seed of the diffuse bounces.
    pub seed: u64,
    /// A number that is another one whenever the scene is: rays find the same in a scene of the same number.
    pub scene_state: u64,
    /// The first state from which on nothing but poses of instances has changed, while they move, and `scene_state` else:
    /// what was found from then on stays for as long as instances touch few rays.
    pub poses_since: u64,
    /// The first state from which on nothing but poses of instances has changed.
    pub fixed_since: u64,
}

/// Rays that one far ray of `count` stands for.
pub(crate) fn far_stands_for(count: usize) -> usize {
    (count / FAR_RAYS).max(1)
}

/// Whether ray `index` of `count` goes on for [`FAR_BOUNCES`] in a rotation: another residue in each, so that far rays see
/// all heights of the lattice.
pub fn is_far(index: usize, count: usize, rotation: u64) -> bool {
    let every = far_stands_for(count);
    index % every == (7 * rotation % every as u64) as usize
}

impl SourceRays<'_> {
    /// A number from 0 to below 1 for a ray's bounce.
    #[inline(always)]
    pub(crate) fn draw(&self, index: u32, step: usize, k: u64) -> f32 {
        let place = self.rotation << 32 | u64::from(index) << 8 | (step as u64) << 2;
        unit(mix(self.seed ^ mix(place | k)))
    }

    /// Most legs of all rays.
    fn legs(&self) -> usize {
        let (count, depth) = (self.directions.len(), self.depth.max(1));
        let far = count.div_ceil(far_stands_for(count));
        count * depth + far * FAR_BOUNCES.saturating_sub(depth)
    }

    /// The place among all of a leg of the rays of discrete depth.
    #[inline(always)]
    pub(crate) fn near_leg(&self, index: u32, step: usize) -> usize {
        index as usize * self.depth.max(1) + step
    }

    /// The same of a far ray's, beyond that depth.
    #[inline(always)]
    pub(crate) fn far_leg(&self, far: u8, step: usize) -> usize {
        let (count, depth) = (self.directions.len(), self.depth.max(1));
        let beyond = FAR_BOUNCES.saturating_sub(depth);
        count * depth + usize::from(far) * beyond + step - depth
    }
}

/// All that rays depend on beside the listener's own things; the lattice is known by its length.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cast {
    origin: DVec3,
    orientation: Quat,
    directivity: Directivity,
    count: usize,
    turn: Mat3,
    rotation: u64,
    depth: usize,
    seed: u64,
    scene_state: u64,
}

impl Cast {
    fn of(from: &SourceRays<'_>) -> Self {
        Self {
            origin: from.origin,
            orientation: from.pose.orientation,
            directivity: from.pose.settings.directivity,
            count: from.directions.len(),
            turn: from.turn,
            rotation: from.rotation,
            depth: from.depth,
            seed: from.seed,
            scene_state: from.scene_state,
        }
    }
}

/// How much of what rays found they would find again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Known {
    /// All of it.
    Wholly,
    /// All but what instances on their way have to do with, which is little.
    Nearly,
    /// Nothing is known.
    Not,
}

/// What the rays of one rotation have found.
#[derive(Debug, Clone, Default)]
pub(crate) struct Found {
    cast: Option<Cast>,
    /// The legs of their discrete depth, and how many of them ended at an instance; none in a scene without instances.
    legs: Vec<Ray>,
    legs_to_instances: usize,
    /// Where they went in the fixed scene, and whose rays those were; nothing in a scene without instances.
    way: FixedWay,
    way_of: Option<Cast>,
    /// Specular beginnings, each once, in the order of the rays.
    sequences: Vec<Sequence>,
}

impl Found {
    /// Room for all that `from` can find.
    pub(crate) fn reserve(&mut self, scene: &Scene, from: &SourceRays<'_>) {
        let most = from.directions.len() * from.depth.max(1);
        self.sequences
            .reserve(most - self.sequences.len().min(most));
        if scene.has_instances() {
            self.legs.reserve(most - self.legs.len().min(most));
            self.way.reserve(from.directions.len(), from.legs());
        }
    }

    /// How much of it `from` would find again.
    pub(crate) fn known(&self, scene: &Scene, from: &SourceRays<'_>) -> Known {
        let now = Cast::of(from);
        let Some(cast) = self.cast else {
            return Known::Not;
        };
        if cast == now {
            return Known::Wholly;
        }
        let scene_state = now.scene_state;
        let but_for_scene = Cast {
            scene_state,
            ..cast
        };
        if but_for_scene != now || cast.scene_state < from.poses_since {
            return Known::Not;
        }
        let most = self.legs.len() / FEW_LEGS;
        let mut touched = self.legs_to_instances;
        for leg in &self.legs {
            if touched > most {
                return Known::Not;
            }
            touched += usize::from(scene.enters_box_of_instance(leg));
        }
        match touched > most {
            true => Known::Not,
            false => Known::Nearly,
        }
    }

    /// Forgets it.
    pub(crate) fn forget(&mut self) {
        self.cast = None;
        self.way_of = None;
    }

    /// Specular beginnings, each once, in the order of the rays.
    pub(crate) fn sequences(&self) -> &[Sequence] {
        &self.sequences
    }

    /// Casts the rays. `set` is empty and becomes what they begin with.
    pub(crate) fn renew(
        &mut self,
        scene: &Scene,
        from: &SourceRays<'_>,
        set: &mut SequenceSet,
        curve: &mut DecayCurve,
        bounces: &mut Bounces,
        rays: &mut u64,
    ) {
        let (count, depth) = (from.directions.len(), from.depth.max(1));
        bounces.near.renew(count, depth);
        let far_rays = count.div_ceil(far_stands_for(count));
        let beyond = FAR_BOUNCES.saturating_sub(depth);
        bounces.far.renew(far_rays, beyond);
        bounces.log.renew(count, depth, far_rays);
        if scene.has_instances() {
            bounces.log.reserve_legs(count * depth);
            let way_of = Some(Cast {
                scene_state: from.fixed_since,
                ..Cast::of(from)
            });
            let is_known = std::mem::replace(&mut self.way_of, way_of) == way_of;
            self.way.begin(count, from.legs(), is_known);
        }
        std::mem::swap(&mut self.way, &mut bounces.way);
        follow(LaneSet::best(), scene, from, set, bounces, rays);
        std::mem::swap(&mut self.way, &mut bounces.way);
        let Bounces { near, far, log, .. } = bounces;
        log.tell(count, near, far, curve);
        self.legs.clear();
        self.legs.extend_from_slice(bounces.log.legs());
        self.legs_to_instances = bounces.log.legs_to_instances();
        self.sequences.clear();
        self.sequences.extend_from_slice(set.entries());
        self.cast = Some(Cast::of(from));
    }
}
