//! Bounding volume hierarchy over triangles: closest hit and any hit.
//!
//! Built on the control side. Queries may come from any thread at once and neither allocate nor block. The answers are
//! those of [`super::triangle`] for every triangle, to the bit, whatever the tree and the instruction set.

mod build;
mod collapse;
mod instruction_set;
pub(super) mod node;
mod observer;
mod saved;
mod split;
mod traverse;
#[cfg(target_arch = "aarch64")]
mod traverse_neon;
mod traverse_scalar;
#[cfg(target_arch = "x86_64")]
mod traverse_x86;

use glam::Vec3;

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use super::intersect::RawRay;
use super::intersect::RayRange;
use super::ray::{Hit, Ray};
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use super::triangle::raw;
use node::{Block, NO_TRIANGLE, Node};
use traverse::PackedHit;

pub use instruction_set::InstructionSet;
pub use observer::RayObserver;
pub(crate) use saved::SavedTree;

/// The group of no triangle: fills unused elements of an ignore list.
pub const NO_GROUP: u32 = u32::MAX;

/// A bounding volume hierarchy over triangles. Immutable; queries neither allocate nor block.
///
/// ```
/// use foresound::geometry::bvh::NO_GROUP;
/// use foresound::geometry::{Bvh, Ray};
/// use glam::Vec3;
///
/// let vertices = [Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::Y];
/// let tree = Bvh::build(&vertices, &[[0, 1, 2]], &[7]);
/// let ray = Ray::new(Vec3::new(0.5, 0.5, 3.0), Vec3::NEG_Z);
/// let hit = tree.closest_hit(&ray, [NO_GROUP; 2]).expect("above the triangle");
/// assert_eq!((hit.t, hit.triangle, hit.group), (3.0, 0, 7));
/// assert!(!tree.any_hit(&ray, [7, NO_GROUP]));
/// ```
#[derive(Debug, Clone, Default)]
pub struct Bvh {
    nodes: Nodes,
    blocks: Vec<Block>,
    triangle_count: usize,
    margin: f32,
    /// Largest coordinate of an origin that the kernels accept. `f64` keeps it apart from the margin: the compiler would
    /// load both `f32` as one value and split it for every ray.
    reach: f64,
    crossed_boxes: f64,
}

/// The nodes, as wide as the kernels, and the proof that the machine has their instruction set.
#[derive(Debug, Clone)]
enum Nodes {
    Scalar(Vec<Node<4>>),
    #[cfg(target_arch = "x86_64")]
    Avx2(Vec<Node<8>>, crate::simd::x86::Avx2),
    #[cfg(target_arch = "aarch64")]
    Neon(Vec<Node<4>>),
    /// Another tree, with an observer of its rays.
    Observed(Box<observer::ObservedTree>),
}

impl Default for Nodes {
    fn default() -> Self {
        Self::Scalar(Vec::new())
    }
}

/// The arguments of a query.
struct Query<'a> {
    ray: &'a Ray,
    ignored: [u32; 2],
    blocks: &'a [Block],
    margin: f32,
    range: RayRange,
}

impl Query<'_> {
    #[inline(always)]
    fn counts(&self, group: u32) -> bool {
        group != self.ignored[0] && group != self.ignored[1]
    }

    /// The ray for kernels; none if its interval is empty.
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    #[inline(always)]
    fn raw(&self) -> Option<RawRay<'_>> {
        let raw = raw(self.ray, self.margin);
        (raw.t_min < self.ray.t_max).then_some(raw)
    }
}

impl Bvh {
    /// Builds a tree for the machine's fastest instruction set. `groups` has one group per triangle, which queries can
    /// ignore.
    ///
    /// Control side; allocates. Triangles with coordinates that are not finite or above 2⁴⁰ are left out: no ray hits them.
    ///
    /// # Panics
    /// If a triangle has an index beyond `vertices`.
    pub fn build(vertices: &[Vec3], triangles: &[[u32; 3]], groups: &[u32]) -> Self {
        build::build(vertices, triangles, groups, InstructionSet::best())
    }

    /// A tree over the same triangles for a given instruction set; none if the machine does not have it. The answers are
    /// the same: for tests and measurements. Control side; allocates.
    pub fn rebuilt_for(&self, instruction_set: InstructionSet) -> Option<Self> {
        instruction_set
            .is_available()
            .then(|| build::rebuild(self, instruction_set))
    }

    /// The closest hit; of equal parameters the triangle with the lowest index.
    ///
    /// Triangles of the two `ignored` groups do not count ([`NO_GROUP`] ignores none): a ray from a plane ignores the
    /// plane's group and needs no offset. A ray without direction or with a NaN hits nothing.
    #[inline(always)]
    pub fn closest_hit(&self, ray: &Ray, ignored: [u32; 2]) -> Option<Hit> {
        self.closest(ray, ignored).hit()
    }

    #[inline(always)]
    fn closest(&self, ray: &Ray, ignored: [u32; 2]) -> PackedHit {
        match &self.nodes {
            Nodes::Scalar(nodes) => {
                traverse_scalar::closest(nodes, &self.query(ray, ignored), |link| link)
            }
            #[cfg(target_arch = "x86_64")]
            Nodes::Avx2(nodes, avx2) => traverse_x86::closest(*avx2, nodes, self, ray, ignored),
            #[cfg(target_arch = "aarch64")]
            Nodes::Neon(nodes) => traverse_neon::closest(nodes, self, ray, ignored),
            Nodes::Observed(observed) => observed.closest(ray, ignored),
        }
    }

    /// Whether a ray hits any triangle; otherwise as [`Self::closest_hit`].
    #[inline]
    pub fn any_hit(&self, ray: &Ray, ignored: [u32; 2]) -> bool {
        self.occluder(ray, ignored).is_some()
    }

    /// A triangle that a ray hits; of several, the tree determines which. Otherwise as [`Self::closest_hit`], and cheaper.
    #[inline(always)]
    pub fn occluder(&self, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
        match &self.nodes {
            Nodes::Scalar(nodes) => {
                traverse_scalar::any(nodes, &self.query(ray, ignored), |link| link)
            }
            #[cfg(target_arch = "x86_64")]
            Nodes::Avx2(nodes, avx2) => traverse_x86::any(*avx2, nodes, self, ray, ignored),
            #[cfg(target_arch = "aarch64")]
            Nodes::Neon(nodes) => traverse_neon::any(nodes, self, ray, ignored),
            Nodes::Observed(observed) => observed.occluder(ray, ignored),
        }
    }

    #[inline(always)]
    fn query<'a>(&'a self, ray: &'a Ray, ignored: [u32; 2]) -> Query<'a> {
        Query {
            ray,
            ignored,
            blocks: &self.blocks,
            margin: self.margin,
            range: RayRange {
                reach: self.reach as f32,
            },
        }
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.triangle_count
    }

    /// Corners, index and group of every triangle, in the order of the tree.
    pub fn triangles(&self) -> impl Iterator<Item = ([Vec3; 3], u32, u32)> + '_ {
        self.blocks.iter().flat_map(|block| {
            (0..4)
                .filter(|&lane| block.triangles[lane] != NO_TRIANGLE)
                .map(|lane| {
                    let corners = block.corners_of(lane);
                    (corners, block.triangles[lane], block.groups[lane])
                })
        })
    }

    /// Estimated number of boxes around triangles and groups of triangles that a line through the scene intersects: the work
    /// of a ray. Some dozens in a scene of rooms, thousands where large triangles overlap.
    pub fn crossed_boxes(&self) -> f64 {
        self.crossed_boxes
    }

    /// Margin of the boxes around triangles, in metres ([`super::triangle::box_margin`]).
    pub fn margin_m(&self) -> f32 {
        self.margin
    }

    /// The instruction set of its traversal.
    pub fn instruction_set(&self) -> InstructionSet {
        match &self.nodes {
            Nodes::Scalar(_) => InstructionSet::Scalar,
            #[cfg(target_arch = "x86_64")]
            Nodes::Avx2(..) => InstructionSet::Avx2,
            #[cfg(target_arch = "aarch64")]
            Nodes::Neon(_) => InstructionSet::Neon,
            Nodes::Observed(observed) => observed.tree().instruction_set(),
        }
    }

    /// Memory of the tree, in bytes.
    pub fn memory_bytes(&self) -> usize {
        let nodes = match &self.nodes {
            Nodes::Scalar(nodes) => size_of_val(nodes.as_slice()),
            #[cfg(target_arch = "x86_64")]
            Nodes::Avx2(nodes, _) => size_of_val(nodes.as_slice()),
            #[cfg(target_arch = "aarch64")]
            Nodes::Neon(nodes) => size_of_val(nodes.as_slice()),
            Nodes::Observed(observed) => return observed.tree().memory_bytes(),
        };
        nodes + size_of_val(self.blocks.as_slice())
    }
}
