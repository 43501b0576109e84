//! Walking the tree with one ray: the scalar specification.
//!
//! Boxes are conservative: the far plane is moved out by more than rounding can move it in ([IZE13]), and a zero
//! direction component stands for a tiny one, so that no product of zero and infinity decides. Together with the
//! watertight triangles no ray slips through a shared edge.

use glam::Vec3;

use super::{Bvh, LeafTriangle, MAX_DEPTH, Node};
use crate::geometry::ray::{Hit, Ray};
use crate::geometry::triangle::ShearedRay;

/// 1 + 2 γ(3) rounded up, γ(n) = n ε / (1 − n ε) with ε half a unit in the last place ([IZE13]).
const FAR_WIDENING: f32 = 1.000_000_5;

/// Smallest direction component that boxes see.
const SMALLEST_COMPONENT: f32 = 1e-18;

struct BoxRay {
    origin: Vec3,
    inverse: Vec3,
}

impl BoxRay {
    fn of(ray: &Ray) -> Self {
        let inverse = |d: f32| {
            let size = d.abs().max(SMALLEST_COMPONENT);
            1.0 / size.copysign(d)
        };
        let d = ray.direction;
        Self {
            origin: ray.origin,
            inverse: Vec3::new(inverse(d.x), inverse(d.y), inverse(d.z)),
        }
    }

    /// Parameter at which the ray enters the box, if it does so before `t_max`.
    #[inline]
    fn enter(&self, node: &Node, t_min: f32, t_max: f32) -> Option<f32> {
        let a = (node.min - self.origin) * self.inverse;
        let b = (node.max - self.origin) * self.inverse;
        let near = a.min(b).max_element().max(t_min);
        let far = (a.max(b).min_element() * FAR_WIDENING).min(t_max);
        (near <= far).then_some(near)
    }
}

/// A ray that cannot hit anything: no direction, or numbers that are none.
fn is_void(ray: &Ray) -> bool {
    !ray.origin.is_finite() || !ray.direction.is_finite() || ray.direction == Vec3::ZERO
}

impl Bvh {
    /// The first triangle a ray meets. Of two at the same parameter the one with the lower index counts, so that the
    /// answer does not depend on the tree.
    ///
    /// Triangles of the two `ignored` groups do not count ([`NO_GROUP`](super::NO_GROUP) ignores none): a ray that
    /// starts on a plane names the plane's group and needs no offset.
    pub fn closest_hit(&self, ray: &Ray, ignored: [u32; 2]) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.walk(ray, |leaf, t| {
            let counts = leaf.group != ignored[0] && leaf.group != ignored[1];
            let nearer =
                counts && best.is_none_or(|b| t < b.t || (t == b.t && leaf.triangle < b.triangle));
            if nearer {
                best = Some(Hit {
                    t,
                    triangle: leaf.triangle,
                    group: leaf.group,
                });
            }
            // One step beyond the best, so that an equal parameter still counts.
            best.map_or(ray.t_max, |b| b.t.next_up().min(ray.t_max))
        });
        best
    }

    /// Whether any triangle outside two groups lies on a ray.
    pub fn any_hit(&self, ray: &Ray, ignored: [u32; 2]) -> bool {
        let mut hit = false;
        self.walk(ray, |leaf, _| {
            if leaf.group == ignored[0] || leaf.group == ignored[1] {
                return ray.t_max;
            }
            hit = true;
            f32::NEG_INFINITY
        });
        hit
    }

    /// Calls `found` for hits, nearer boxes first; it returns the new far bound.
    #[inline]
    fn walk(&self, ray: &Ray, mut found: impl FnMut(&LeafTriangle, f32) -> f32) {
        if self.nodes.is_empty() || is_void(ray) {
            return;
        }
        let boxes = BoxRay::of(ray);
        let sheared = ShearedRay::of(ray);
        let mut t_max = ray.t_max;
        let mut stack = [(0u32, 0f32); MAX_DEPTH];
        let mut height = 0;
        let Some(_) = boxes.enter(&self.nodes[0], ray.t_min, t_max) else {
            return;
        };
        let mut index = 0u32;
        loop {
            let node = &self.nodes[index as usize];
            if node.count > 0 {
                let first = node.first as usize;
                for leaf in &self.leaves[first..first + node.count as usize] {
                    if let Some(t) = sheared.intersect(&leaf.corners, ray.t_min, t_max) {
                        t_max = found(leaf, t);
                        if t_max == f32::NEG_INFINITY {
                            return;
                        }
                    }
                }
            } else {
                let [left, right] = [node.first, node.first + 1];
                let to_left = boxes.enter(&self.nodes[left as usize], ray.t_min, t_max);
                let to_right = boxes.enter(&self.nodes[right as usize], ray.t_min, t_max);
                match (to_left, to_right) {
                    (Some(l), Some(r)) => {
                        let (near, far) = if l <= r {
                            (left, (right, r))
                        } else {
                            (right, (left, l))
                        };
                        stack[height] = far;
                        height += 1;
                        index = near;
                        continue;
                    }
                    (Some(_), None) => {
                        index = left;
                        continue;
                    }
                    (None, Some(_)) => {
                        index = right;
                        continue;
                    }
                    (None, None) => {}
                }
            }
            loop {
                if height == 0 {
                    return;
                }
                height -= 1;
                let (next, enters) = stack[height];
                if enters <= t_max {
                    index = next;
                    break;
                }
            }
        }
    }
}
