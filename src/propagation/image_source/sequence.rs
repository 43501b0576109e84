//! Surface sequences in canonical order, and the identity of paths.
//!
//! Reflections in perpendicular planes commute: both orders have the same image, length, angles and amplitude, and at most
//! one of them is valid for a given listener. A path must keep its identity when the listener crosses the line where the
//! orders swap. A sequence is therefore stored in the lexicographic normal form of its class (\[DIEKERT95\], trace
//! monoids).

use glam::DVec3;

use crate::propagation::path::{MAX_ORDER, PathId};
use crate::propagation::rays::directions::GOLDEN_RATIO_64;
use crate::scene::{Scene, SourceId};

/// Up to [`MAX_ORDER`] surface indices from source to listener.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Sequence {
    surfaces: [u32; MAX_ORDER],
    order: u8,
}

/// Two planes commute if the cosine of their normals is below this: 0.006° from perpendicular, far beyond the error of
/// merged surfaces.
pub(crate) const COMMUTING_COSINE: f64 = 1e-4;

/// Seed of hashes, half of its bits set: a short sequence's hash has two factors of full size.
const HASH_SEED: u64 = 0x6a09_e667_f3bc_c908;

/// Top two bits of an interaction's key.
const REFLECTION: u64 = 0;
const EDGE: u64 = 1;
const CURVED: u64 = 2;

impl Sequence {
    /// The empty sequence: the direct path's.
    pub(crate) const EMPTY: Self = Self {
        surfaces: [0; MAX_ORDER],
        order: 0,
    };

    /// The canonical form of surface indices from source to listener. Indices beyond [`MAX_ORDER`] are dropped.
    #[inline]
    pub fn canonical(scene: &Scene, surfaces: &[u32]) -> Self {
        let mut result = Self::EMPTY;
        for &surface in surfaces.iter().take(MAX_ORDER) {
            result.push_canonical(scene, surface);
        }
        result
    }

    /// The canonical form in the present poses of instances, which decide what commutes.
    #[inline]
    pub(crate) fn renewed(&self, scene: &Scene) -> Self {
        match scene.has_instances() {
            true => Self::canonical(scene, self.surfaces()),
            false => *self,
        }
    }

    /// Appends a surface to a canonical sequence with room for it and restores canonical order: the surface moves in front
    /// of the first one of higher index among those that it may pass. The normal form of the others does not change, since
    /// none of them depends on the last surface.
    #[inline]
    pub(crate) fn push_canonical(&mut self, scene: &Scene, surface: u32) {
        let last = self.len();
        let mut index = last;
        if last > 0 {
            let normal = scene.surface(surface).normal;
            for earlier in (0..last).rev() {
                let other = self.surfaces[earlier];
                if !commute(scene.surface(other).normal, normal) {
                    break;
                }
                if surface < other {
                    index = earlier;
                }
            }
        }
        for index in (index..last).rev() {
            self.surfaces[index + 1] = self.surfaces[index];
        }
        self.surfaces[index] = surface;
        self.order += 1;
    }

    /// The first `count` of these surfaces, without canonical ordering; the others are 0.
    #[inline(always)]
    pub(crate) fn of_first(surfaces: [u32; MAX_ORDER], count: usize) -> Self {
        Self {
            surfaces,
            order: count as u8,
        }
    }

    /// Appends a surface without canonical ordering. The sequence must have room for it.
    #[inline]
    pub(crate) fn push(&mut self, surface: u32) {
        self.surfaces[self.len()] = surface;
        self.order += 1;
    }

    /// Number of reflections, 0 to [`MAX_ORDER`].
    #[inline]
    pub fn len(&self) -> usize {
        usize::from(self.order)
    }

    /// Whether this is the direct path's sequence.
    pub fn is_empty(&self) -> bool {
        self.order == 0
    }

    /// The surface indices from source to listener.
    #[inline]
    pub fn surfaces(&self) -> &[u32] {
        &self.surfaces[..self.len()]
    }

    /// The surface at an index below [`MAX_ORDER`]; meaningless from [`Self::len`] on.
    #[inline(always)]
    pub(crate) fn surface_at(&self, index: usize) -> u32 {
        self.surfaces[index % MAX_ORDER]
    }

    /// Identity of a source's path along this sequence. It depends on the surfaces' stable keys only and thus survives a
    /// reload of the scene.
    pub fn path_id(&self, scene: &Scene, source: SourceId) -> PathId {
        let mut named = *self;
        if scene.has_continued_surfaces() {
            // The canonical order is that of the numbers.
            named = Self::default();
            for &surface in self.surfaces() {
                named.push_canonical(scene, scene.naming_surface(surface));
            }
        }
        let surfaces = named.surfaces().iter().copied();
        interaction_path_id(scene, source, surfaces.map(Interaction::Surface))
    }

    /// 64-bit hash of the surface indices: both halves of one product. Indices beyond the order are 0.
    #[inline(always)]
    pub(crate) fn hash(&self) -> u64 {
        const { assert!(MAX_ORDER == 4) };
        let pair =
            |at: usize| u64::from(self.surfaces[at]) | u64::from(self.surfaces[at + 1]) << 32;
        let first = pair(0) ^ GOLDEN_RATIO_64;
        let last = pair(2) ^ HASH_SEED ^ u64::from(self.order);
        let product = u128::from(first) * u128::from(last);
        product as u64 ^ (product >> 64) as u64
    }
}

/// One interaction of a path with the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interaction {
    /// Reflection at a surface, by index.
    Surface(u32),
    /// Diffraction at an edge, by index.
    Edge(u32),
    /// Reflection at a curved surface, by index.
    Curved(u32),
}

/// Identity of the path along these interactions, from source to listener. The identity of a path without edges is that of
/// its canonical sequence.
pub fn interaction_path_id(
    scene: &Scene,
    source: SourceId,
    interactions: impl Iterator<Item = Interaction>,
) -> PathId {
    let key = |interaction| match interaction {
        Interaction::Surface(surface) => {
            let named = scene.surface(scene.naming_surface(surface));
            REFLECTION << 62 | named.key >> 2
        }
        Interaction::Edge(edge) => EDGE << 62 | scene.edge(edge).key >> 2,
        Interaction::Curved(index) => {
            let curved = scene.curved_surfaces().get(index as usize);
            CURVED << 62 | curved.map_or(0, |curved| curved.key) >> 2
        }
    };
    let seed = u64::from(source.bits()) ^ HASH_SEED;
    let hash = fold(seed, interactions.map(key));
    PathId(hash ^ hash >> 32)
}

/// Hash of symbols in order.
#[inline]
fn fold(seed: u64, symbols: impl Iterator<Item = u64>) -> u64 {
    symbols.fold(seed, |hash, symbol| {
        (hash.rotate_left(5) ^ symbol).wrapping_mul(GOLDEN_RATIO_64)
    })
}

fn commute(a: DVec3, b: DVec3) -> bool {
    a.dot(b).abs() < COMMUTING_COSINE
}

/// Partial order of a sequence's reflections: which ones precede others in every order of the class.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Precedence {
    /// For each reflection, bitmask of the earlier ones that it does not commute with.
    before: [u8; MAX_ORDER],
    count: u8,
}

impl Precedence {
    /// Of `count` reflections. `before` has eight bits per reflection, the first one lowest: the mask of the earlier ones that
    /// it does not commute with.
    #[inline(always)]
    pub(crate) fn from_bits(before: u32, count: usize) -> Self {
        Self {
            before: before.to_le_bytes(),
            count: count as u8,
        }
    }

    /// The masks for [`Self::from_bits`].
    #[inline(always)]
    pub(crate) fn bits(&self) -> u32 {
        u32::from_le_bytes(self.before)
    }

    /// For each reflection, bitmask of those that come before it in one order of the class and after it in another.
    #[inline]
    pub(crate) fn unordered(&self) -> [u8; MAX_ORDER] {
        let (mut before, mut unordered) = (self.before, [0; MAX_ORDER]);
        for index in 1..usize::from(self.count) {
            for earlier in 0..index {
                if self.before[index] >> earlier & 1 == 1 {
                    before[index] |= before[earlier];
                }
            }
            for earlier in 0..index {
                if before[index] >> earlier & 1 == 0 {
                    unordered[index] |= 1 << earlier;
                    unordered[earlier] |= 1 << index;
                }
            }
        }
        unordered
    }
}
