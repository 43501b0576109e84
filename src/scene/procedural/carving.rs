//! Buildings of axis-aligned blocks: filled and carved, with faces between solid and air.
//!
//! The skin is watertight and has no T-junctions: all faces end at the same cutting planes. A wall with a door is a
//! filled block with a carved one; a room shell is a carved block in a solid world.

use glam::{DVec3, dvec3};

use super::builder::MeshBuilder;

/// Cutting planes closer than this are merged, in metres: half of the builder's grid.
const SAME_PLANE_M: f64 = 0.0005;

/// Filled and carved blocks; of overlapping blocks the last one counts.
pub(super) struct Carving {
    outside_is_solid: bool,
    steps: Vec<Step>,
    planes: [Vec<f64>; 3],
}

struct Step {
    min: DVec3,
    max: DVec3,
    solid: bool,
}

/// One face of the skin, without a material.
pub(super) struct Face {
    /// Centre, in metres.
    pub(super) middle: DVec3,
    /// Unit normal, towards the air.
    pub(super) normal: DVec3,
    /// Centre of the air cell in front; outside of all blocks a point just in front of the face.
    pub(super) air: DVec3,
}

impl Carving {
    /// No blocks, in a world of air.
    pub(super) fn in_air() -> Self {
        Self::new(false)
    }

    /// No blocks, in a solid world.
    pub(super) fn in_rock() -> Self {
        Self::new(true)
    }

    fn new(outside_is_solid: bool) -> Self {
        Self {
            outside_is_solid,
            steps: Vec::new(),
            planes: Default::default(),
        }
    }

    /// Makes a block solid.
    pub(super) fn fill(&mut self, min: DVec3, max: DVec3) {
        self.step(min, max, true);
    }

    /// Makes a block air.
    pub(super) fn carve(&mut self, min: DVec3, max: DVec3) {
        self.step(min, max, false);
    }

    fn step(&mut self, min: DVec3, max: DVec3, solid: bool) {
        for axis in 0..3 {
            self.cut(axis, min[axis]);
            self.cut(axis, max[axis]);
        }
        self.steps.push(Step { min, max, solid });
    }

    /// Cuts faces at a plane square to axis 0, 1 or 2.
    pub(super) fn cut(&mut self, axis: usize, position: f64) {
        let planes = &mut self.planes[axis];
        if planes.iter().all(|&p| (p - position).abs() > SAME_PLANE_M) {
            planes.push(position);
            planes.sort_by(f64::total_cmp);
        }
    }

    /// Adds the skin; `paint` returns each face's material, or `None` to omit the face.
    pub(super) fn skin(
        &self,
        builder: &mut MeshBuilder,
        paint: impl Fn(&Face) -> Option<&'static str>,
    ) {
        for axis in 0..3 {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            for edges_u in self.planes[u].windows(2) {
                for edges_v in self.planes[v].windows(2) {
                    for (i, &position) in self.planes[axis].iter().enumerate() {
                        let corner = |cu: usize, cv: usize| {
                            let mut point = DVec3::ZERO;
                            point[axis] = position;
                            point[u] = edges_u[cu];
                            point[v] = edges_v[cv];
                            point
                        };
                        let middle = (corner(0, 0) + corner(1, 1)) * 0.5;
                        let (below, below_solid) = self.cell(axis, i.checked_sub(1), middle, -1.0);
                        let (above, above_solid) = self.cell(axis, Some(i), middle, 1.0);
                        if below_solid == above_solid {
                            continue;
                        }
                        let mut normal = DVec3::ZERO;
                        normal[axis] = if below_solid { 1.0 } else { -1.0 };
                        let air = if below_solid { above } else { below };
                        let face = Face {
                            middle,
                            normal,
                            air,
                        };
                        if let Some(material) = paint(&face) {
                            builder.paint(material);
                            let mut corners =
                                [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(a, b)| corner(a, b));
                            if above_solid {
                                corners.reverse();
                            }
                            builder.polygon(&corners);
                        }
                    }
                }
            }
        }
    }

    /// Centre of the cell between plane `i` and the next, over a face's centre, and whether it is solid.
    fn cell(&self, axis: usize, i: Option<usize>, face: DVec3, outwards: f64) -> (DVec3, bool) {
        let planes = &self.planes[axis];
        let mut middle = face;
        let Some((low, high)) = i.and_then(|i| planes.get(i).zip(planes.get(i + 1))) else {
            middle[axis] += outwards * SAME_PLANE_M;
            return (middle, self.outside_is_solid);
        };
        middle[axis] = 0.5 * (low + high);
        let last = self
            .steps
            .iter()
            .rev()
            .find(|step| middle.cmpgt(step.min).all() && middle.cmplt(step.max).all());
        (
            middle,
            last.map_or(self.outside_is_solid, |step| step.solid),
        )
    }
}

/// A block by its least and greatest corner, for lists of rooms and openings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Block {
    /// Least corner, in metres.
    pub(super) min: DVec3,
    /// Greatest corner, in metres.
    pub(super) max: DVec3,
}

impl Block {
    /// From ranges along x, y and z, in metres.
    pub(super) fn new(x: [f64; 2], y: [f64; 2], z: [f64; 2]) -> Self {
        Self {
            min: dvec3(x[0], y[0], z[0]),
            max: dvec3(x[1], y[1], z[1]),
        }
    }

    /// Whether a point lies inside.
    pub(super) fn contains(&self, point: DVec3) -> bool {
        point.cmpgt(self.min).all() && point.cmplt(self.max).all()
    }
}
