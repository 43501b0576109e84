//! Guide rays: candidates for surface sequences, traced from the listener.
//!
//! Rays suggest sequences; validation decides. Source: \[TAYLOR12\], the separation of ray visibility from exact images.

use std::ops::Range;

use glam::{DVec3, Mat3, Vec3};

use crate::geometry::Ray;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::path::MAX_ORDER;
use crate::propagation::rays::packet::{HitPacket, PACKET_SIZE, RayPacket, lanes, put_vector};
use crate::propagation::rays::prefix_set::{EMPTY_PREFIX, PrefixSet};
use crate::scene::Scene;

/// Origin, directions and depth of the guide rays.
#[derive(Debug, Clone, Copy)]
pub struct GuideRays<'a> {
    /// Position of the listener in local coordinates.
    pub origin: DVec3,
    /// Rotation of the directions.
    pub rotation: Mat3,
    /// Unit vectors before rotation.
    pub directions: &'a [Vec3],
    /// Reflections of each ray, at most [`MAX_ORDER`].
    pub depth: usize,
}

impl GuideRays<'_> {
    /// Traces the rays of a range by specular reflection. Calls `found` with every sequence hit and all its
    /// prefixes, from source to listener; a repetition may be left out. Returns the number of rays cast. Allocates.
    pub fn trace(&self, scene: &Scene, range: Range<usize>, found: impl FnMut(Sequence)) -> u64 {
        self.trace_with(&mut PrefixSet::default(), scene, range, found)
    }

    /// [`Self::trace`] with the caller's memory; allocates only if that is too small.
    pub(crate) fn trace_with(
        &self,
        prefixes: &mut PrefixSet,
        scene: &Scene,
        range: Range<usize>,
        mut found: impl FnMut(Sequence),
    ) -> u64 {
        let depth = self.depth.min(MAX_ORDER);
        let origin = self.origin.as_vec3();
        prefixes.reset(range.len() * depth);
        let mut rays = 0;
        let mut hits = [HitPacket::NONE; MAX_ORDER];
        let hits = &mut hits[..depth];
        for directions in self.directions[range].chunks(PACKET_SIZE) {
            let mut packet = RayPacket::NONE;
            for (lane, direction) in directions.iter().enumerate() {
                packet.begin(lane, &Ray::new(origin, self.rotation * *direction));
            }
            for hits in hits.iter_mut() {
                rays += u64::from(packet.active.count_ones());
                packet.cast(scene, hits);
                reflect(scene, &mut packet, hits);
            }
            for lane in 0..directions.len() {
                report_sequences(scene, hits, lane, prefixes, &mut found);
            }
        }
        rays
    }
}

/// Reflects rays at panels. A ray without a hit, or that hit anything else, ends.
#[inline(always)]
fn reflect(scene: &Scene, packet: &mut RayPacket, hits: &mut HitPacket) {
    let mut normal = [[0.0; PACKET_SIZE]; 3];
    for lane in lanes(hits.rays) {
        if scene.is_panel(hits.triangle[lane]) {
            let surface = scene.surface(hits.surface[lane]);
            put_vector(&mut normal, lane, surface.normal.as_vec3());
        } else {
            hits.rays &= !(1 << lane);
        }
    }
    packet.mirror(hits, &mut normal);
    packet.last = hits.surface;
    packet.active = hits.rays;
}

/// Calls `found` with the surfaces that a ray hit and all their prefixes, unless `prefixes` has them.
#[inline(always)]
fn report_sequences(
    scene: &Scene,
    hits: &[HitPacket],
    lane: usize,
    prefixes: &mut PrefixSet,
    found: &mut impl FnMut(Sequence),
) {
    // Filled from the end: the filled part runs from source to listener.
    let mut surfaces = [0; MAX_ORDER];
    let mut prefix = EMPTY_PREFIX;
    for (hits, first) in hits.iter().zip((0..MAX_ORDER).rev()) {
        if hits.rays >> lane & 1 == 0 {
            break;
        }
        let is_new;
        surfaces[first] = hits.surface[lane];
        (prefix, is_new) = prefixes.extend(prefix, surfaces[first]);
        if is_new {
            found(Sequence::canonical(scene, &surfaces[first..]));
        }
    }
}
