//! Oracle: every sequence of planes up to an order, by backtracking, in `f64`. Uses neither rays nor canonical forms: of
//! all orders of a sequence at most one has its points inside the polygons of its planes.

use glam::{DVec3, Vec3};

/// All triangles of one plane.
pub struct Plane {
    normal: DVec3,
    offset: f64,
    low: DVec3,
    high: DVec3,
    triangles: Vec<[DVec3; 3]>,
}

/// A path that exists if nothing obstructs it.
pub struct Reflected {
    /// Planes from source to listener.
    pub planes: Vec<usize>,
    /// Source, reflection points, listener.
    pub stops: Vec<DVec3>,
    pub length: f64,
}

/// Planes of triangles whose corners lie on them within a tenth of a millimetre.
pub fn planes(triangles: &[[Vec3; 3]]) -> Vec<Plane> {
    let mut planes: Vec<Plane> = Vec::new();
    for triangle in triangles {
        let corners = triangle.map(|p| p.as_dvec3());
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize();
        let fits = |plane: &&mut Plane| {
            let off = |p: &DVec3| (plane.normal.dot(*p) - plane.offset).abs();
            corners.iter().all(|p| off(p) < 1e-4)
        };
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        match planes.iter_mut().find(fits) {
            Some(plane) => {
                plane.low = plane.low.min(low);
                plane.high = plane.high.max(high);
                plane.triangles.push(corners);
            }
            None => planes.push(Plane {
                normal,
                offset: normal.dot(a),
                low,
                high,
                triangles: vec![corners],
            }),
        }
    }
    planes
}

impl Plane {
    /// Distance from a point that may be anywhere to the plane.
    pub fn distance(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    fn holds(&self, point: DVec3) -> bool {
        let margin = DVec3::splat(1e-9);
        if point.cmplt(self.low - margin).any() || point.cmpgt(self.high + margin).any() {
            return false;
        }
        self.triangles.iter().any(|[a, b, c]| {
            let side = |p: DVec3, q: DVec3| (q - p).cross(point - p).dot(self.normal);
            let sides = [side(*a, *b), side(*b, *c), side(*c, *a)];
            sides.iter().all(|s| *s >= -1e-9) || sides.iter().all(|s| *s <= 1e-9)
        })
    }
}

/// All unobstructed paths of orders 1 to `order` between two points; `is_free` tests each leg.
pub fn paths(
    planes: &[Plane],
    source: DVec3,
    listener: DVec3,
    order: usize,
    is_free: impl Fn(DVec3, DVec3) -> bool,
) -> Vec<Reflected> {
    let mut search = Search {
        planes,
        listener,
        order,
        sequence: Vec::new(),
        images: vec![source],
        found: Vec::new(),
    };
    search.deepen();
    search.found.retain(|path| {
        // Short of the planes that the leg joins.
        path.stops.windows(2).all(|leg| {
            let inward = (leg[1] - leg[0]).normalize_or_zero() * 1e-6;
            is_free(leg[0] + inward, leg[1] - inward)
        })
    });
    search.found
}

struct Search<'a> {
    planes: &'a [Plane],
    listener: DVec3,
    order: usize,
    sequence: Vec<usize>,
    /// The source, and its image after each plane of the sequence.
    images: Vec<DVec3>,
    found: Vec<Reflected>,
}

impl Search<'_> {
    fn deepen(&mut self) {
        for number in 0..self.planes.len() {
            if self.sequence.last() == Some(&number) {
                continue;
            }
            let plane = &self.planes[number];
            let image = self.images[self.images.len() - 1];
            self.sequence.push(number);
            self.images
                .push(image - 2.0 * plane.distance(image) * plane.normal);
            self.found.extend(self.backtrack());
            if self.sequence.len() < self.order {
                self.deepen();
            }
            self.sequence.pop();
            self.images.pop();
        }
    }

    /// From the listener back to the source, plane by plane.
    fn backtrack(&self) -> Option<Reflected> {
        let order = self.sequence.len();
        let mut points = [DVec3::ZERO; 8];
        let mut from = self.listener;
        for step in (0..order).rev() {
            let plane = &self.planes[self.sequence[step]];
            let image = self.images[step + 1];
            let (here, there) = (plane.distance(from), plane.distance(image));
            if here * there >= 0.0 {
                return None;
            }
            from += (image - from) * (here / (here - there));
            if !plane.holds(from) {
                return None;
            }
            points[step] = from;
        }
        let ends = [self.images[0], self.listener];
        let mut stops = vec![ends[0]];
        stops.extend_from_slice(&points[..order]);
        stops.push(ends[1]);
        Some(Reflected {
            planes: self.sequence.clone(),
            length: self.images[order].distance(self.listener),
            stops,
        })
    }
}

#[test]
fn a_box_has_as_many_images_as_the_closed_form() {
    let size = Vec3::new(5.0, 3.0, 4.0);
    let mesh = foresound_box(size);
    let planes = planes(&mesh);
    assert_eq!(planes.len(), 6);
    let (source, listener) = (DVec3::new(1.1, 1.3, 0.7), DVec3::new(3.9, 1.7, 2.9));
    let found = paths(&planes, source, listener, 4, |_, _| true);
    let of = |order| found.iter().filter(|p| p.planes.len() == order).count();
    // Each image of order 1 to 4 of a rectangular room is visible.
    assert_eq!([1, 2, 3, 4].map(of), [6, 18, 38, 66]);
}

#[cfg(test)]
fn foresound_box(size: Vec3) -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for far in [0.0, size[axis]] {
            let corner = |x: f32, y: f32| {
                let mut p = Vec3::ZERO;
                p[axis] = far;
                p[u] = x * size[u];
                p[v] = y * size[v];
                p
            };
            let [a, b, c, d] = [
                corner(0.0, 0.0),
                corner(1.0, 0.0),
                corner(1.0, 1.0),
                corner(0.0, 1.0),
            ];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles
}
