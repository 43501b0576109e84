//! A tree of a polygon's corners that finds those in a triangle.

use glam::DVec2;

/// Corners of a leaf.
const LEAF: usize = 8;

/// Boxes that halve the corners by their longer side.
pub(super) struct CornerTree {
    points: Vec<DVec2>,
    /// Corners in the order of leaves.
    order: Vec<u32>,
    /// Bounds of each node; the children of node i are 2 i + 1 and 2 i + 2.
    bounds: Vec<[DVec2; 2]>,
    /// Nodes and corners looked at so far.
    pub(super) visits: usize,
}

impl CornerTree {
    pub(super) fn new(points: &[DVec2]) -> Self {
        let mut tree = Self {
            points: points.to_vec(),
            order: (0..points.len() as u32).collect(),
            bounds: Vec::new(),
            visits: 0,
        };
        tree.build(0, 0..points.len());
        tree
    }

    fn build(&mut self, node: usize, range: std::ops::Range<usize>) {
        let (points, order) = (&self.points, &mut self.order[range.clone()]);
        let mut bounds = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        for &i in order.iter() {
            let point = points[i as usize];
            bounds = [bounds[0].min(point), bounds[1].max(point)];
        }
        if self.bounds.len() <= node {
            self.bounds.resize(node + 1, [DVec2::ZERO; 2]);
        }
        self.bounds[node] = bounds;
        if range.len() <= LEAF {
            return;
        }
        let size = bounds[1] - bounds[0];
        let axis = usize::from(size.y > size.x);
        let half = range.len() / 2;
        order.select_nth_unstable_by(half, |&i, &j| {
            let along = |i: u32| points[i as usize][axis];
            along(i).total_cmp(&along(j)).then(i.cmp(&j))
        });
        self.build(2 * node + 1, range.start..range.start + half);
        self.build(2 * node + 2, range.start + half..range.end);
    }

    /// Whether any corner in the closed counterclockwise triangle meets a condition. Corners near it are tested too.
    pub(super) fn any_within(
        &mut self,
        triangle: [DVec2; 3],
        mut test: impl FnMut(u32) -> bool,
    ) -> bool {
        let [a, b, c] = triangle;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        // Nodes yet to visit: one a level.
        let mut stack = [(0, 0, self.order.len()); 64];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (node, start, end) = stack[depth];
            self.visits += 1;
            let [min, max] = self.bounds[node];
            let apart = min.cmpgt(high).any() || max.cmplt(low).any();
            if apart
                || [(a, b), (b, c), (c, a)]
                    .into_iter()
                    .any(|side| is_right_of(side, min, max))
            {
                continue;
            }
            if end - start <= LEAF {
                self.visits += end - start;
                if self.order[start..end].iter().any(|&corner| test(corner)) {
                    return true;
                }
                continue;
            }
            let middle = start + (end - start) / 2;
            stack[depth] = (2 * node + 1, start, middle);
            stack[depth + 1] = (2 * node + 2, middle, end);
            depth += 2;
        }
        false
    }
}

/// Whether a box lies strictly to the right of a line.
fn is_right_of((from, to): (DVec2, DVec2), min: DVec2, max: DVec2) -> bool {
    let along = to - from;
    let leftmost = DVec2::new(
        if along.y < 0.0 { max.x } else { min.x },
        if along.x > 0.0 { max.y } else { min.y },
    );
    along.perp_dot(leftmost - from) < 0.0
}
