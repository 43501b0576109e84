//! Bounding volume hierarchy over triangles: closest hit and any hit.
//!
//! The one interface between rays and the rest. Built on the control side; queries may come from any thread at once,
//! neither allocate nor block, and take as long as the tree is deep. Whatever tree and instruction set stands behind
//! it, the answers are those of [`super::triangle`] on every triangle, to the bit.

#[cfg(target_arch = "aarch64")]
mod aarch64;
mod bounds;
mod build;
mod collapse;
mod instruction_set;
mod node;
mod portable;
#[cfg(feature = "testing")]
pub mod record;
mod split;
mod walk;
#[cfg(target_arch = "x86_64")]
mod x86_64;

use glam::Vec3;

use super::ray::{Hit, Ray};
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use super::triangle::raw;
use crate::simd::tracing::Near;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use crate::simd::tracing::RawRay;
use node::{Block, NO_TRIANGLE, Node};

pub use instruction_set::InstructionSet;

/// Group that no triangle has: fills the places of an ignore list that are not needed.
pub const NO_GROUP: u32 = u32::MAX;

/// A tree over triangles. Immutable; queries take `&self` and neither allocate nor block.
#[derive(Debug, Clone, Default)]
pub struct Bvh {
    nodes: Nodes,
    blocks: Vec<Block>,
    triangle_count: usize,
    margin: f32,
    /// How far out a ray may start and still be walked in lanes. No neighbour of the margin's in memory: the compiler would
    /// make one value of both, and take it apart, for every ray.
    reach: f64,
}

/// Nodes as wide as the instruction set's lanes, and the proof that the machine has it.
#[derive(Debug, Clone)]
enum Nodes {
    Portable(Vec<Node<4>>),
    #[cfg(target_arch = "x86_64")]
    Sse2(Vec<Node<4>>),
    #[cfg(target_arch = "x86_64")]
    Avx2(Vec<Node<8>>, crate::simd::x86::Avx2),
    #[cfg(target_arch = "aarch64")]
    Neon(Vec<Node<4>>),
    /// Another tree, which is asked in this one's place.
    #[cfg(feature = "testing")]
    Recorded(Box<record::Recorder>),
}

impl Default for Nodes {
    fn default() -> Self {
        Self::Portable(Vec::new())
    }
}

/// One ray's question to a tree.
struct Query<'a> {
    ray: &'a Ray,
    ignored: [u32; 2],
    blocks: &'a [Block],
    margin: f32,
    near: Near,
}

impl Query<'_> {
    #[inline(always)]
    fn counts(&self, group: u32) -> bool {
        group != self.ignored[0] && group != self.ignored[1]
    }

    /// The ray for lanes, unless its interval is empty.
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    #[inline(always)]
    fn raw(&self) -> Option<RawRay<'_>> {
        let raw = raw(self.ray, self.margin);
        (raw.t_min < self.ray.t_max).then_some(raw)
    }
}

impl Bvh {
    /// Builds a tree over finite triangles, for the machine's best instruction set. `groups` has one number a triangle,
    /// which queries can ignore.
    ///
    /// Control side; allocates. Triangles with corners that are not finite or beyond 2⁴⁰ are left out, since nothing
    /// can hit them.
    ///
    /// # Panics
    /// If a triangle names a vertex beyond `vertices`.
    pub fn build(vertices: &[Vec3], triangles: &[[u32; 3]], groups: &[u32]) -> Self {
        build::build(vertices, triangles, groups, InstructionSet::best())
    }

    /// The same triangles for an instruction set of one's choice; nothing if the machine does not have it.
    ///
    /// For tests and measurements: answers are the same.
    pub fn rebuilt_for(&self, instruction_set: InstructionSet) -> Option<Self> {
        instruction_set
            .is_available()
            .then(|| build::rebuild(self, instruction_set))
    }

    /// The first triangle a ray meets. Of two at the same parameter the one with the lower index counts, so that the
    /// answer does not depend on the tree.
    ///
    /// Triangles of the two `ignored` groups do not count ([`NO_GROUP`] ignores none): a ray that starts on a plane
    /// names the plane's group and needs no offset. A ray without direction or with numbers that are none meets nothing.
    #[inline(always)]
    pub fn closest_hit(&self, ray: &Ray, ignored: [u32; 2]) -> Option<Hit> {
        let nearest = match &self.nodes {
            Nodes::Portable(nodes) => {
                portable::closest(nodes, &self.query(ray, ignored), |link| link)
            }
            #[cfg(target_arch = "x86_64")]
            Nodes::Sse2(nodes) => x86_64::closest_sse2(nodes, self, ray, ignored),
            #[cfg(target_arch = "x86_64")]
            Nodes::Avx2(nodes, avx2) => x86_64::closest_avx2(*avx2, nodes, self, ray, ignored),
            #[cfg(target_arch = "aarch64")]
            Nodes::Neon(nodes) => aarch64::closest(nodes, self, ray, ignored),
            #[cfg(feature = "testing")]
            Nodes::Recorded(recorder) => recorder.closest_hit(ray, ignored),
        };
        nearest.hit()
    }

    /// Whether any triangle outside two groups lies on a ray; otherwise as [`Self::closest_hit`].
    #[inline]
    pub fn any_hit(&self, ray: &Ray, ignored: [u32; 2]) -> bool {
        self.blocker(ray, ignored).is_some()
    }

    /// A triangle outside two groups that lies on a ray; if several do, which one depends on the tree. Otherwise as
    /// [`Self::closest_hit`], and cheaper.
    #[inline(always)]
    pub fn blocker(&self, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
        match &self.nodes {
            Nodes::Portable(nodes) => portable::any(nodes, &self.query(ray, ignored), |link| link),
            #[cfg(target_arch = "x86_64")]
            Nodes::Sse2(nodes) => x86_64::any_sse2(nodes, self, ray, ignored),
            #[cfg(target_arch = "x86_64")]
            Nodes::Avx2(nodes, avx2) => x86_64::any_avx2(*avx2, nodes, self, ray, ignored),
            #[cfg(target_arch = "aarch64")]
            Nodes::Neon(nodes) => aarch64::any(nodes, self, ray, ignored),
            #[cfg(feature = "testing")]
            Nodes::Recorded(recorder) => recorder.blocker(ray, ignored),
        }
    }

    #[inline(always)]
    fn query<'a>(&'a self, ray: &'a Ray, ignored: [u32; 2]) -> Query<'a> {
        Query {
            ray,
            ignored,
            blocks: &self.blocks,
            margin: self.margin,
            near: Near {
                reach: self.reach as f32,
            },
        }
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.triangle_count
    }

    /// Corners, number and group of every triangle, in the tree's order.
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

    /// How far boxes stand off triangles, in metres ([`super::triangle::box_margin`]).
    pub fn margin_m(&self) -> f32 {
        self.margin
    }

    /// What the tree is walked with.
    pub fn instruction_set(&self) -> InstructionSet {
        match &self.nodes {
            Nodes::Portable(_) => InstructionSet::Scalar,
            #[cfg(target_arch = "x86_64")]
            Nodes::Sse2(_) => InstructionSet::Sse2,
            #[cfg(target_arch = "x86_64")]
            Nodes::Avx2(..) => InstructionSet::Avx2,
            #[cfg(target_arch = "aarch64")]
            Nodes::Neon(_) => InstructionSet::Neon,
            #[cfg(feature = "testing")]
            Nodes::Recorded(recorder) => recorder.tree().instruction_set(),
        }
    }

    /// Memory that the tree occupies, in bytes.
    pub fn memory_bytes(&self) -> usize {
        let nodes = match &self.nodes {
            Nodes::Portable(nodes) => size_of_val(nodes.as_slice()),
            #[cfg(target_arch = "x86_64")]
            Nodes::Sse2(nodes) => size_of_val(nodes.as_slice()),
            #[cfg(target_arch = "x86_64")]
            Nodes::Avx2(nodes, _) => size_of_val(nodes.as_slice()),
            #[cfg(target_arch = "aarch64")]
            Nodes::Neon(nodes) => size_of_val(nodes.as_slice()),
            #[cfg(feature = "testing")]
            Nodes::Recorded(recorder) => return recorder.tree().memory_bytes(),
        };
        nodes + size_of_val(self.blocks.as_slice())
    }
}
