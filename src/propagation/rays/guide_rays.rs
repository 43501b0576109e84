//! Which surfaces might make a path: guide rays from the listener.
//!
//! Rays only suggest; validation decides. Source: \[TAYLOR12\], the separation of visibility by rays from exact images.

use std::ops::Range;

use glam::{DVec3, Mat3, Vec3};

use crate::geometry::Ray;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::path::MAX_ORDER;
use crate::propagation::rays::packet::{Met, Rays, TOGETHER, lanes, put_vector};
use crate::propagation::rays::prefix_set::{Beginnings, NONE_YET};
use crate::scene::Scene;

/// Where guide rays start, where they go and how far they are followed.
#[derive(Debug, Clone, Copy)]
pub struct GuideRays<'a> {
    /// The listener, local coordinates.
    pub origin: DVec3,
    /// Rotation of the lattice.
    pub turn: Mat3,
    /// The lattice.
    pub directions: &'a [Vec3],
    /// Bounces of each, at most [`MAX_ORDER`].
    pub depth: usize,
}

impl GuideRays<'_> {
    /// Traces some of the rays by specular reflection and gives `found` every sequence they meet, and each of its
    /// beginnings, turned round so that it runs from source to listener; what is met again need not be told again. Gives the
    /// number of rays cast. Allocates.
    pub fn trace(&self, scene: &Scene, range: Range<usize>, found: impl FnMut(Sequence)) -> u64 {
        self.trace_with(&mut Beginnings::default(), scene, range, found)
    }

    /// The same in memory that is there.
    pub(crate) fn trace_with(
        &self,
        met_before: &mut Beginnings,
        scene: &Scene,
        range: Range<usize>,
        mut found: impl FnMut(Sequence),
    ) -> u64 {
        let depth = self.depth.min(MAX_ORDER);
        let origin = self.origin.as_vec3();
        met_before.renew(range.len() * depth);
        let mut rays = 0;
        let mut mets = [Met::NONE; MAX_ORDER];
        let mets = &mut mets[..depth];
        for directions in self.directions[range].chunks(TOGETHER) {
            let mut together = Rays::NONE;
            for (lane, direction) in directions.iter().enumerate() {
                together.begin(lane, &Ray::new(origin, self.turn * *direction));
            }
            for met in mets.iter_mut() {
                rays += u64::from(together.under_way.count_ones());
                together.cast(scene, met);
                mirror(scene, &mut together, met);
            }
            for lane in 0..directions.len() {
                give_sequences(scene, mets, lane, met_before, &mut found);
            }
        }
        rays
    }
}

/// Away from panels; where a ray has met something else, or nothing, it ends.
#[inline(always)]
fn mirror(scene: &Scene, together: &mut Rays, met: &mut Met) {
    let mut normal = [[0.0; TOGETHER]; 3];
    for lane in lanes(met.rays) {
        if scene.is_panel(met.triangle[lane]) {
            let surface = scene.surface(met.surface[lane]);
            put_vector(&mut normal, lane, surface.normal.as_vec3());
        } else {
            met.rays &= !(1 << lane);
        }
    }
    together.mirror(met, &mut normal);
    together.last = met.surface;
    together.under_way = met.rays;
}

/// Gives what a ray has met, and each of its beginnings, unless rays have met them before.
#[inline(always)]
fn give_sequences(
    scene: &Scene,
    mets: &[Met],
    lane: usize,
    met_before: &mut Beginnings,
    found: &mut impl FnMut(Sequence),
) {
    // Filled from the end, so that what is there always runs from source to listener.
    let mut surfaces = [0; MAX_ORDER];
    let mut list = NONE_YET;
    for (met, first) in mets.iter().zip((0..MAX_ORDER).rev()) {
        if met.rays >> lane & 1 == 0 {
            break;
        }
        let is_new;
        surfaces[first] = met.surface[lane];
        (list, is_new) = met_before.go_on(list, surfaces[first]);
        if is_new {
            found(Sequence::canonical(scene, &surfaces[first..]));
        }
    }
}
