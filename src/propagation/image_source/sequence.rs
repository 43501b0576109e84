//! Surface sequences in canonical order, their identity, and sets of them.
//!
//! Reflections in perpendicular planes commute: both orders have the same image, length, angles and amplitude, and at
//! most one of them is valid for a given listener, so a listener who crosses the line where they swap must not see one
//! path die and another be born. A sequence is therefore kept in the lexicographic normal form of its class
//! (\[DIEKERT95\], trace monoids).

use glam::DVec3;

use crate::propagation::path::{MAX_ORDER, PathId};
use crate::scene::{Scene, SourceId};

/// Up to [`MAX_ORDER`] surface indices from source to listener.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Sequence {
    surfaces: [u32; MAX_ORDER],
    order: u8,
}

/// Planes whose normals' cosine is below this commute: 0.006°, far beyond what merging of surfaces leaves.
pub(crate) const COMMUTING_COSINE: f64 = 1e-4;

/// What a symbol of a path's identity stands for.
const REFLECTION: u64 = 0;
const EDGE: u64 = 1;

impl Sequence {
    /// No surface.
    pub(crate) const NONE: Self = Self {
        surfaces: [0; MAX_ORDER],
        order: 0,
    };

    /// The canonical form of surfaces given from source to listener; at most [`MAX_ORDER`] count.
    #[inline]
    pub fn canonical(scene: &Scene, surfaces: &[u32]) -> Self {
        let mut result = Self::NONE;
        for &surface in surfaces.iter().take(MAX_ORDER) {
            result.put_last(scene, surface);
        }
        result
    }

    /// Puts a surface behind all others of a canonical sequence that has room for it, which stays canonical: of what it may
    /// pass it passes all from the first one on that has a higher number. What comes out before it in the lexicographic
    /// normal form is what would come out without it, since nothing waits for the last surface.
    #[inline]
    pub(crate) fn put_last(&mut self, scene: &Scene, surface: u32) {
        let last = self.len();
        let mut place = last;
        if last > 0 {
            let normal = scene.surface(surface).normal;
            for earlier in (0..last).rev() {
                let other = self.surfaces[earlier];
                if !commute(scene.surface(other).normal, normal) {
                    break;
                }
                if surface < other {
                    place = earlier;
                }
            }
        }
        for place in (place..last).rev() {
            self.surfaces[place + 1] = self.surfaces[place];
        }
        self.surfaces[place] = surface;
        self.order += 1;
    }

    /// Puts a surface behind all others as it comes.
    #[inline]
    pub(crate) fn push(&mut self, surface: u32) {
        self.surfaces[self.len()] = surface;
        self.order += 1;
    }

    /// Number of reflections.
    #[inline]
    pub fn len(&self) -> usize {
        usize::from(self.order)
    }

    /// Whether this is the direct path's sequence.
    pub fn is_empty(&self) -> bool {
        self.order == 0
    }

    /// The surfaces from source to listener.
    #[inline]
    pub fn surfaces(&self) -> &[u32] {
        &self.surfaces[..self.len()]
    }

    /// The surface at a place below [`MAX_ORDER`]; of no meaning from [`Self::len`] on.
    #[inline(always)]
    pub(crate) fn surface_at(&self, place: usize) -> u32 {
        self.surfaces[place % MAX_ORDER]
    }

    /// Whether the surface at `place` commutes with all before it, so that some order of the class begins with it.
    #[inline]
    pub fn can_lead(&self, scene: &Scene, place: usize) -> bool {
        let normal = scene.surface(self.surfaces[place]).normal;
        self.surfaces[..place]
            .iter()
            .all(|&s| commute(scene.surface(s).normal, normal))
    }

    /// The sequence without the surface at `place`.
    pub fn without(&self, place: usize) -> Self {
        let mut rest = Self::default();
        for (i, &surface) in self.surfaces().iter().enumerate() {
            if i != place {
                rest.push(surface);
            }
        }
        rest
    }

    /// Identity of the path that a source's sound takes along this sequence. Made of the surfaces' stable keys, so that
    /// it outlives a scene's reload.
    pub fn path_id(&self, scene: &Scene, source: SourceId) -> PathId {
        let key = |&surface: &u32| REFLECTION << 62 | scene.surface(surface).key >> 2;
        fold(source, self.surfaces().iter().map(key))
    }

    /// A well-spread number of the surfaces' indices.
    #[inline]
    pub(crate) fn hash(&self) -> u64 {
        let mut hash = u64::from(self.order);
        for &surface in self.surfaces() {
            hash = (hash.rotate_left(5) ^ u64::from(surface)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        }
        hash ^ hash >> 29
    }
}

/// One thing that a path meets on its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// Reflection in a surface.
    Surface(u32),
    /// Bend around an edge.
    Edge(u32),
}

/// Identity of the path along these stops, from source to listener. One without edges has the identity that its
/// canonical sequence gives it.
pub fn bent_path_id(scene: &Scene, source: SourceId, stops: impl Iterator<Item = Stop>) -> PathId {
    let key = |stop| match stop {
        Stop::Surface(surface) => REFLECTION << 62 | scene.surface(surface).key >> 2,
        Stop::Edge(edge) => EDGE << 62 | scene.edge(edge).key >> 2,
    };
    fold(source, stops.map(key))
}

fn fold(source: SourceId, symbols: impl Iterator<Item = u64>) -> PathId {
    let mut hash = u64::from(source.bits()) ^ 0x6a09_e667_f3bc_c908;
    for symbol in symbols {
        hash = (hash.rotate_left(5) ^ symbol).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
    PathId(hash ^ hash >> 32)
}

fn commute(a: DVec3, b: DVec3) -> bool {
    a.dot(b).abs() < COMMUTING_COSINE
}

/// Which surfaces of a sequence come before others in every order that commuting allows.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Order {
    /// Of each place the earlier ones that it cannot pass, one a bit.
    behind: [u8; MAX_ORDER],
    count: u8,
}

impl Order {
    #[inline]
    pub(crate) fn of(scene: &Scene, sequence: &Sequence) -> Self {
        let mut order = Self {
            count: sequence.order,
            ..Self::default()
        };
        let mut normals = [DVec3::ZERO; MAX_ORDER];
        for (place, &surface) in sequence.surfaces().iter().enumerate() {
            let normal = scene.surface(surface).normal;
            normals[place] = normal;
            for (earlier, other) in normals[..place].iter().enumerate() {
                if !commute(*other, normal) {
                    order.behind[place] |= 1 << earlier;
                }
            }
        }
        order
    }

    /// Of `count` surfaces; `behind` has of each place the earlier ones that it cannot pass, one a bit and eight bits a place,
    /// the first place lowest.
    #[inline(always)]
    pub(crate) fn of_bits(behind: u32, count: usize) -> Self {
        Self {
            behind: behind.to_le_bytes(),
            count: count as u8,
        }
    }

    /// The places of all surfaces, one a bit.
    #[inline]
    pub(crate) fn all(&self) -> u8 {
        (1 << self.count) - 1
    }

    /// Whether the surface at `place` can move to the front of those of `rest`, one a bit.
    #[inline]
    pub(crate) fn leads(&self, place: usize, rest: u8) -> bool {
        self.behind[place] & rest == 0
    }

    /// Of each place those that may come before it or after it, one a bit.
    #[inline]
    pub(crate) fn aside(&self) -> [u8; MAX_ORDER] {
        let (mut before, mut aside) = (self.behind, [0; MAX_ORDER]);
        for place in 1..usize::from(self.count) {
            for earlier in 0..place {
                if self.behind[place] >> earlier & 1 == 1 {
                    before[place] |= before[earlier];
                }
            }
            for earlier in 0..place {
                if before[place] >> earlier & 1 == 0 {
                    aside[place] |= 1 << earlier;
                    aside[earlier] |= 1 << place;
                }
            }
        }
        aside
    }
}
