//! The rays of an update, recorded in order, for tracing the same rays again.

#![expect(clippy::disallowed_types, reason = "a record of rays locks")]

use std::sync::{Mutex, PoisonError};

use foresound::geometry::bvh::RayObserver;
use foresound::geometry::{Bvh, Ray};

/// A ray that a tree has traced.
#[derive(Debug)]
pub(super) struct TracedRay {
    ray: Ray,
    ignored: [u32; 2],
    any: bool,
}

impl TracedRay {
    /// Traces the ray again; returns whether it hits.
    #[inline(always)]
    pub(super) fn repeat(&self, tree: &Bvh) -> bool {
        match self.any {
            true => tree.any_hit(&self.ray, self.ignored),
            false => tree.closest_hit(&self.ray, self.ignored).is_some(),
        }
    }
}

/// The rays that a tree has traced, in order.
#[derive(Debug, Default)]
pub(super) struct Record(Mutex<Vec<TracedRay>>);

impl Record {
    /// The rays since the last call.
    pub(super) fn take(&self) -> Vec<TracedRay> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl RayObserver for Record {
    fn on_ray(&self, ray: &Ray, ignored: [u32; 2], any: bool) {
        let ray = *ray;
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.push(TracedRay { ray, ignored, any });
    }
}
