//! What the rays of one rotation met, by ray and bounce. Rays are followed side by side, so that the processor looks for one
//! ray's hit while it still works at another's; sums and lists that depend on an order are made afterwards, ray after ray.

use super::super::sequence::Sequence;
use super::super::sequence_set::SequenceSet;
use super::decay::DecayCurve;
use super::source_rays::{FAR_BOUNCES, TOGETHER};
use crate::acoustics::BandArray;
use crate::geometry::Ray;

/// What a far ray brought to a bounce, and when it was there.
#[derive(Debug, Clone, Copy, Default)]
struct Carried {
    share: BandArray,
    at_s: f64,
}

/// What one ray met.
#[derive(Debug, Clone, Copy, Default)]
struct Course {
    /// Legs that met something.
    legs: u8,
    /// Bounces that are the ends of specular beginnings, all first ones.
    sequences: u8,
    /// Its number among the far rays, if it is one.
    far: Option<u8>,
}

/// See the module.
#[derive(Debug, Clone, Default)]
pub(super) struct RayLog {
    depth: usize,
    courses: Vec<Course>,
    /// Lengths in metres, `depth` a ray, and of far rays beyond.
    legs_m: Vec<f32>,
    far_legs_m: Vec<f32>,
    /// Specular beginnings of the rays at hand, `depth` a ray.
    sequences: Vec<Sequence>,
    /// [`FAR_BOUNCES`] a far ray.
    carried: Vec<Carried>,
    /// What each far ray still had at its end; nothing if it escaped.
    left: Vec<Option<Carried>>,
    /// Legs that were to be kept, and how many of them ended at an instance.
    kept: Vec<Ray>,
    kept_to_instances: usize,
}

impl RayLog {
    /// Makes room for `count` rays of `depth` bounces, `far` of them far ones, of which nothing is known.
    pub(super) fn renew(&mut self, count: usize, depth: usize, far: usize) {
        self.depth = depth;
        self.courses.clear();
        self.courses.resize(count, Course::default());
        self.legs_m.resize(count * depth, 0.0);
        self.sequences.resize(TOGETHER * depth, Sequence::default());
        self.far_legs_m.resize(far * FAR_BOUNCES, 0.0);
        self.carried.resize(far * FAR_BOUNCES, Carried::default());
        self.left.clear();
        self.left.resize(far, None);
        self.kept.clear();
        self.kept_to_instances = 0;
    }

    /// Room for legs to keep.
    pub(super) fn reserve_legs(&mut self, most: usize) {
        self.kept.reserve(most);
    }

    /// Keeps a leg as it is.
    pub(super) fn keep(&mut self, leg: Ray, ends_at_instance: bool) {
        self.kept.push(leg);
        self.kept_to_instances += usize::from(ends_at_instance);
    }

    /// Legs that were kept.
    pub(super) fn legs(&self) -> &[Ray] {
        &self.kept
    }

    /// How many of those ended at an instance.
    pub(super) fn legs_to_instances(&self) -> usize {
        self.kept_to_instances
    }

    /// Ray `index` is far ray number `far`.
    #[inline(always)]
    pub(super) fn begin_far(&mut self, index: usize, far: usize) {
        self.courses[index].far = Some(far as u8);
    }

    /// The next leg of a ray met something; `step` is how many did before.
    #[inline(always)]
    pub(super) fn leg(&mut self, index: usize, step: usize, leg_m: f32) {
        let course = &mut self.courses[index];
        course.legs = step as u8 + 1;
        match (step < self.depth, course.far) {
            (true, _) => self.legs_m[index * self.depth + step] = leg_m,
            (false, Some(far)) => self.far_legs_m[usize::from(far) * FAR_BOUNCES + step] = leg_m,
            (false, None) => {}
        }
    }

    /// A far ray carried `share` there.
    #[inline(always)]
    pub(super) fn carry(&mut self, far: usize, step: usize, share: &BandArray, at_s: f64) {
        self.carried[far * FAR_BOUNCES + step] = Carried {
            share: *share,
            at_s,
        };
    }

    /// What a ray met up to here is a specular beginning.
    #[inline(always)]
    pub(super) fn sequence(&mut self, index: usize, step: usize, sequence: Sequence) {
        self.courses[index].sequences = step as u8 + 1;
        self.sequences[index % TOGETHER * self.depth + step] = sequence;
    }

    /// Gives the specular beginnings of [`TOGETHER`] rays, or of the last ones, in the order of the rays.
    pub(super) fn give_sequences(&self, first: usize, found: &mut SequenceSet) {
        let courses = self.courses[first..].iter().take(TOGETHER);
        for (course, near) in courses.zip(self.sequences.chunks(self.depth)) {
            for sequence in &near[..usize::from(course.sequences)] {
                found.insert(*sequence);
            }
        }
    }

    /// A far ray is followed no further.
    #[inline(always)]
    pub(super) fn leave(&mut self, far: usize, share: &BandArray, at_s: f64) {
        self.left[far] = Some(Carried {
            share: *share,
            at_s,
        });
    }

    /// Sums up all but sequences, in the order of the rays.
    pub(super) fn tell(&self, curve: &mut DecayCurve) {
        for (index, course) in self.courses.iter().enumerate() {
            let (legs, near) = (usize::from(course.legs), index * self.depth);
            for step in 0..legs.min(self.depth) {
                curve.leg(step == 0, f64::from(self.legs_m[near + step]));
            }
            let Some(far) = course.far else { continue };
            let first = usize::from(far) * FAR_BOUNCES;
            curve.begin();
            for step in self.depth..legs {
                curve.leg(step == 0, f64::from(self.far_legs_m[first + step]));
            }
            let mut moment = 0;
            for carried in &self.carried[first..first + legs] {
                moment = curve.carry(&carried.share, moment, carried.at_s);
            }
            if let Some(left) = &self.left[usize::from(far)] {
                curve.leave(&left.share, left.at_s);
            }
        }
    }
}
