//! A tree that writes down what it is asked, so that a measurement can ask the same again.
//!
//! For measurements on a desktop; a question takes a lock and may allocate.

#![expect(
    clippy::disallowed_types,
    reason = "no scene that sound is made in has such a tree"
)]

use std::sync::{Arc, Mutex, PoisonError};

use super::walk::Nearest;
use super::{Bvh, Nodes};
use crate::geometry::ray::Ray;

/// A ray that a tree was asked about.
#[derive(Debug, Clone, Copy)]
pub struct Asked {
    /// The ray.
    pub ray: Ray,
    /// The groups that did not count.
    pub ignored: [u32; 2],
    /// Whether any triangle would do, rather than the first.
    pub any: bool,
}

impl Asked {
    /// Asks a tree the same; gives whether the ray meets something.
    #[inline(always)]
    pub fn again(&self, tree: &Bvh) -> bool {
        match self.any {
            true => tree.any_hit(&self.ray, self.ignored),
            false => tree.closest_hit(&self.ray, self.ignored).is_some(),
        }
    }
}

/// What a tree was asked, in order, in its coordinates. Any thread but the audio side's: it locks and allocates.
#[derive(Debug, Clone, Default)]
pub struct Record(Arc<Mutex<Vec<Asked>>>);

impl Record {
    /// What was asked since this was called last.
    pub fn take(&self) -> Vec<Asked> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn keep(&self, asked: Asked) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.push(asked);
    }
}

/// A tree and where it is written down what is asked of it.
#[derive(Debug, Clone)]
pub(super) struct Recorder {
    tree: Bvh,
    record: Record,
}

impl Recorder {
    #[cold]
    #[inline(never)]
    pub(super) fn closest_hit(&self, ray: &Ray, ignored: [u32; 2]) -> Nearest {
        self.keep(ray, ignored, false);
        Nearest::of_hit(self.tree.closest_hit(ray, ignored))
    }

    #[cold]
    #[inline(never)]
    pub(super) fn blocker(&self, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
        self.keep(ray, ignored, true);
        self.tree.blocker(ray, ignored)
    }

    /// The tree itself.
    pub(super) fn tree(&self) -> &Bvh {
        &self.tree
    }

    fn keep(&self, ray: &Ray, ignored: [u32; 2], any: bool) {
        self.record.keep(Asked {
            ray: *ray,
            ignored,
            any,
        });
    }
}

impl Bvh {
    /// The same tree, and a record of all that is asked of it from now on. Control side; allocates.
    pub fn recorded(&self) -> (Self, Record) {
        let record = Record::default();
        let recorder = Recorder {
            tree: self.clone(),
            record: record.clone(),
        };
        let recorded = Self {
            nodes: Nodes::Recorded(Box::new(recorder)),
            ..self.clone()
        };
        (recorded, record)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::bvh::NO_GROUP;

    #[test]
    fn what_is_asked_is_answered_and_written_down() {
        let vertices = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let tree = Bvh::build(&vertices, &[[0, 1, 2], [0, 1, 3]], &[7, 8]);
        let (recorded, record) = tree.recorded();
        let ray = Ray::new(Vec3::new(0.2, 0.3, 1.0), Vec3::NEG_Z);
        let away = Ray::new(Vec3::new(0.2, 0.3, 1.0), Vec3::Z);
        let ignored = [8, NO_GROUP];
        assert_eq!(
            recorded.closest_hit(&ray, ignored),
            tree.closest_hit(&ray, ignored)
        );
        assert_eq!(recorded.blocker(&ray, ignored), tree.blocker(&ray, ignored));
        assert!(!recorded.any_hit(&away, [NO_GROUP; 2]));
        assert_eq!(recorded.memory_bytes(), tree.memory_bytes());
        assert_eq!(recorded.instruction_set(), tree.instruction_set());
        let asked = record.take();
        let told: Vec<_> = asked.iter().map(|a| (a.ray, a.ignored, a.any)).collect();
        assert_eq!(
            told,
            [
                (ray, ignored, false),
                (ray, ignored, true),
                (away, [NO_GROUP; 2], true)
            ]
        );
        let again: Vec<bool> = asked.iter().map(|asked| asked.again(&tree)).collect();
        assert_eq!(again, [true, true, false]);
        assert!(record.take().is_empty());
    }
}
