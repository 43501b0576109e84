//! Surface sequences in canonical order, their identity, and sets of them.
//!
//! Reflections in perpendicular planes commute: both orders have the same image, length, angles and amplitude, and at
//! most one of them is valid for a given listener, so a listener who crosses the line where they swap must not see one
//! path die and another be born. A sequence is therefore kept in the lexicographic normal form of its class
//! ([DIEKERT95], trace monoids).

use crate::propagation::path::{MAX_ORDER, PathId};
use crate::scene::{Scene, SourceId};

/// Up to [`MAX_ORDER`] surface indices from source to listener.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Sequence {
    surfaces: [u32; MAX_ORDER],
    order: u8,
}

/// Planes whose normals' cosine is below this commute: 0.006°, far beyond what merging of surfaces leaves.
const COMMUTING_COSINE: f64 = 1e-4;

/// What a symbol of a path's identity stands for.
const REFLECTION: u64 = 0;
const EDGE: u64 = 1;

impl Sequence {
    /// The canonical form of surfaces given from source to listener; at most [`MAX_ORDER`] count.
    pub fn canonical(scene: &Scene, surfaces: &[u32]) -> Self {
        let mut rest = Self::default();
        for &surface in surfaces.iter().take(MAX_ORDER) {
            rest.push(surface);
        }
        let mut result = Self::default();
        // The smallest surface that can move to the front goes first; repeat with what is left.
        while rest.order > 0 {
            let mut best = 0;
            for i in 1..rest.len() {
                if rest.surfaces[i] < rest.surfaces[best] && rest.can_lead(scene, i) {
                    best = i;
                }
            }
            result.push(rest.surfaces[best]);
            rest = rest.without(best);
        }
        result
    }

    fn push(&mut self, surface: u32) {
        self.surfaces[self.len()] = surface;
        self.order += 1;
    }

    /// Number of reflections.
    pub fn len(&self) -> usize {
        usize::from(self.order)
    }

    /// Whether this is the direct path's sequence.
    pub fn is_empty(&self) -> bool {
        self.order == 0
    }

    /// The surfaces from source to listener.
    pub fn surfaces(&self) -> &[u32] {
        &self.surfaces[..self.len()]
    }

    /// Whether the surface at `place` commutes with all before it, so that some order of the class begins with it.
    pub fn can_lead(&self, scene: &Scene, place: usize) -> bool {
        let normal = scene.surface(self.surfaces[place]).normal;
        self.surfaces[..place]
            .iter()
            .all(|&s| scene.surface(s).normal.dot(normal).abs() < COMMUTING_COSINE)
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

    fn hash(&self) -> u64 {
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
        Stop::Edge(edge) => EDGE << 62 | scene.edges().get(edge).key >> 2,
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

/// A set of sequences that remembers the order of insertion. Its memory is fixed at creation: a full set refuses and
/// counts.
#[derive(Debug, Clone)]
pub struct SequenceSet {
    entries: Vec<Sequence>,
    table: Vec<u32>,
    capacity: usize,
    refused: u64,
}

impl SequenceSet {
    /// Room for `capacity` sequences.
    pub fn with_capacity(capacity: usize) -> Self {
        let slots = (2 * capacity.max(1)).next_power_of_two();
        Self {
            entries: Vec::with_capacity(capacity),
            table: vec![0; slots],
            capacity,
            refused: 0,
        }
    }

    /// Empties the set; the memory stays.
    pub fn clear(&mut self) {
        self.entries.clear();
        self.table.fill(0);
    }

    /// The sequences in the order of insertion.
    pub fn entries(&self) -> &[Sequence] {
        &self.entries
    }

    /// How many insertions a full set has refused since it was made.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Whether the set has a sequence.
    pub fn contains(&self, sequence: &Sequence) -> bool {
        self.find(sequence).is_ok()
    }

    /// Adds a sequence; gives whether it is new.
    pub fn insert(&mut self, sequence: Sequence) -> bool {
        match self.find(&sequence) {
            Ok(_) => false,
            Err(_) if self.entries.len() == self.capacity => {
                self.refused += 1;
                false
            }
            Err(slot) => {
                self.entries.push(sequence);
                self.table[slot] = self.entries.len() as u32;
                true
            }
        }
    }

    /// The entry's index, or the free slot where it would go. The table is at most half full, so the probe ends.
    fn find(&self, sequence: &Sequence) -> Result<usize, usize> {
        let mask = self.table.len() - 1;
        let mut slot = sequence.hash() as usize & mask;
        loop {
            match self.table[slot] {
                0 => return Err(slot),
                found if self.entries[found as usize - 1] == *sequence => {
                    return Ok(found as usize - 1);
                }
                _ => slot = (slot + 1) & mask,
            }
        }
    }
}
