//! [`RayObserver`]: a callback for every ray of a tree.

use std::sync::Arc;

use super::traverse::PackedHit;
use super::{Bvh, Nodes};
use crate::geometry::ray::Ray;

/// Receives every ray that a tree traces; for measurements. Called by any thread that traces.
pub trait RayObserver: std::fmt::Debug + Send + Sync {
    /// Called before a ray is traced. `any`: for any hit, rather than the closest.
    fn on_ray(&self, ray: &Ray, ignored: [u32; 2], any: bool);
}

/// A tree with its observer. Cold: an ordinary tree pays one comparison a ray for it.
#[derive(Debug, Clone)]
pub(super) struct ObservedTree {
    tree: Bvh,
    observer: Arc<dyn RayObserver>,
}

impl ObservedTree {
    #[cold]
    #[inline(never)]
    pub(super) fn closest(&self, ray: &Ray, ignored: [u32; 2]) -> PackedHit {
        self.observer.on_ray(ray, ignored, false);
        self.tree.closest(ray, ignored)
    }

    #[cold]
    #[inline(never)]
    pub(super) fn occluder(&self, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
        self.observer.on_ray(ray, ignored, true);
        self.tree.occluder(ray, ignored)
    }

    pub(super) fn tree(&self) -> &Bvh {
        &self.tree
    }
}

impl Bvh {
    /// The same tree, which reports every ray to an observer. Control side; allocates.
    pub fn with_observer(&self, observer: Arc<dyn RayObserver>) -> Self {
        let observed = ObservedTree {
            tree: self.clone(),
            observer,
        };
        Self {
            nodes: Nodes::Observed(Box::new(observed)),
            ..self.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::disallowed_types, reason = "the observer of a test locks")]

    use std::sync::Mutex;

    use glam::Vec3;

    use super::*;
    use crate::geometry::bvh::NO_GROUP;

    #[derive(Debug, Default)]
    struct Record(Mutex<Vec<(Ray, [u32; 2], bool)>>);

    impl RayObserver for Record {
        fn on_ray(&self, ray: &Ray, ignored: [u32; 2], any: bool) {
            self.0.lock().expect("sound").push((*ray, ignored, any));
        }
    }

    #[test]
    fn an_observed_tree_answers_alike_and_reports_every_ray() {
        let vertices = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let tree = Bvh::build(&vertices, &[[0, 1, 2], [0, 1, 3]], &[7, 8]);
        let record = Arc::new(Record::default());
        let observed = tree.with_observer(record.clone());
        let ray = Ray::new(Vec3::new(0.2, 0.3, 1.0), Vec3::NEG_Z);
        let away = Ray::new(Vec3::new(0.2, 0.3, 1.0), Vec3::Z);
        let ignored = [8, NO_GROUP];
        let closest = observed.closest_hit(&ray, ignored);
        assert_eq!(closest, tree.closest_hit(&ray, ignored));
        assert!(closest.is_some());
        let triangle = observed.occluder(&ray, ignored);
        assert_eq!(triangle, tree.occluder(&ray, ignored));
        assert!(!observed.any_hit(&away, [NO_GROUP; 2]));
        assert_eq!(observed.memory_bytes(), tree.memory_bytes());
        assert_eq!(observed.instruction_set(), tree.instruction_set());
        let expected = [
            (ray, ignored, false),
            (ray, ignored, true),
            (away, [NO_GROUP; 2], true),
        ];
        assert_eq!(*record.0.lock().expect("sound"), expected);
    }
}
