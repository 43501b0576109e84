//! The guide rays of an update: which rotations are cast, and what they hit.

use glam::{DVec3, Mat3, Vec3};

use super::guide_origins::GuideOrigins;
use super::share_range;
use crate::propagation::image_source::discovery_history::{DiscoveryHistory, GuideCast, Visit};
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::rays::directions::{ROTATIONS, rotation};
use crate::propagation::rays::guide_rays::GuideRays;
use crate::propagation::rays::prefix_set::PrefixSet;
use crate::scene::Scene;

/// Most rotations that are cast in one update: a walking listener leaves the cells of one or two between two asynchronous
/// updates. After a jump all are due, and eight updates cast them. The first update of all knows nothing else.
const MAX_CASTS: usize = 2;
const MAX_FIRST_CASTS: usize = 4;

/// The rotations that are cast.
#[derive(Debug)]
pub(super) struct GuideCasts<'a> {
    count: usize,
    rotations: [(usize, GuideCast); MAX_FIRST_CASTS],
    rays: [GuideRays<'a>; MAX_FIRST_CASTS],
}

impl<'a> GuideCasts<'a> {
    /// Those that the listener's position asks for, from the one of the round on. `cast` is without its origin.
    pub(super) fn due(
        (history, origins): (&DiscoveryHistory, &GuideOrigins),
        round: u64,
        cast: GuideCast,
        (directions, seed): (&'a [Vec3], u64),
    ) -> Self {
        let nothing = GuideRays {
            origin: DVec3::ZERO,
            rotation: Mat3::IDENTITY,
            directions,
            depth: cast.depth,
        };
        let mut casts = Self {
            count: 0,
            rotations: [(0, cast); MAX_FIRST_CASTS],
            rays: [nothing; MAX_FIRST_CASTS],
        };
        let most = match (cast.rays, history.is_empty()) {
            (0, _) => 0,
            (_, true) => MAX_FIRST_CASTS,
            (_, false) => MAX_CASTS,
        };
        for step in 0..ROTATIONS {
            if casts.count == most {
                break;
            }
            let number = ((round + step) % ROTATIONS) as usize;
            let cast = GuideCast {
                origin: origins.of(number),
                ..cast
            };
            if history.is_due(number, &cast, step == 0) {
                casts.rotations[casts.count] = (number, cast);
                let rays = &mut casts.rays[casts.count];
                rays.origin = cast.origin.as_dvec3();
                rays.rotation = rotation(number as u64, seed);
                casts.count += 1;
            }
        }
        casts
    }

    /// Their rays.
    pub(super) fn rays(&self) -> &[GuideRays<'a>] {
        &self.rays[..self.count]
    }

    /// Puts what all shares have found into the history, in place of what the rotations found before if the rays are whole
    /// rotations.
    pub(super) fn remember(
        &self,
        shares: &[GuideShare],
        is_whole: bool,
        visit: Visit,
        history: &mut DiscoveryHistory,
    ) {
        let rotations = self.rotations[..self.count].iter();
        for (index, (number, cast)) in rotations.enumerate() {
            if is_whole {
                history.begin_rotation(visit, *number, *cast);
            }
            let number = is_whole.then_some(*number);
            for share in shares {
                history.add(visit, number, &share.found[index]);
            }
        }
    }
}

/// One share of the guide rays. Aligned to two cache lines: threads write to neighbouring ones.
#[derive(Debug)]
#[repr(align(128))]
pub(super) struct GuideShare {
    prefixes: PrefixSet,
    /// Sequences of each cast.
    found: [Vec<Sequence>; MAX_FIRST_CASTS],
    pub(super) rays: u64,
}

impl GuideShare {
    /// With memory for so many sequences of each of [`MAX_CASTS`].
    pub(super) fn with_capacity(sequences: usize) -> Self {
        Self {
            prefixes: PrefixSet::with_capacity(sequences),
            found: std::array::from_fn(|cast| match cast {
                ..MAX_CASTS => Vec::with_capacity(sequences),
                _ => Vec::new(),
            }),
            rays: 0,
        }
    }

    /// Traces share `index` of all rays.
    pub(super) fn trace(&mut self, scene: &Scene, casts: &[GuideRays<'_>], index: usize) {
        self.rays = 0;
        self.found.iter_mut().for_each(Vec::clear);
        // Those of the first update alone.
        for found in self.found.iter_mut().skip(casts.len().max(MAX_CASTS)) {
            found.shrink_to(0);
        }
        for (rays, found) in casts.iter().zip(&mut self.found) {
            let range = share_range(index, rays.directions.len());
            let prefixes = &mut self.prefixes;
            self.rays += rays.trace_with(prefixes, scene, range, |sequence| found.push(sequence));
        }
    }
}
