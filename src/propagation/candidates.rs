//! Candidates made ready for all sources: the listener's image of each, and a first look that most do not survive.
//!
//! A path along a sequence begins with a straight flight from the source towards the listener's image, through one of
//! the surfaces that may come first. Whether that flight crosses the surface's plane between source and image, and
//! within the surface's bounds, costs a few products, and the image is the same for every source. Own. Refuses nothing
//! that [`super::image_source::unfold`] accepts.

use glam::DVec3;

use super::image_source::{MARGIN_M, mirror_listener};
use super::sequence::Sequence;
use crate::scene::{Scene, Surface};

/// A surface that may come first on a sequence's path.
#[derive(Debug, Clone, Copy)]
struct Lead {
    candidate: u32,
    normal: DVec3,
    offset_m: f64,
    image: DVec3,
    /// Distance of the image from the plane.
    there: f64,
    low: DVec3,
    high: DVec3,
}

impl Lead {
    fn new(candidate: u32, surface: &Surface, image: DVec3) -> Self {
        let (low, high) = bounds(surface);
        Self {
            candidate,
            normal: surface.normal,
            offset_m: surface.offset_m,
            image,
            there: surface.distance_m(image),
            low,
            high,
        }
    }

    /// Whether a flight from `source` to the image may pass through the surface.
    #[inline]
    fn may_be_met(&self, source: DVec3) -> bool {
        let here = self.normal.dot(source) - self.offset_m;
        if here * self.there >= 0.0 {
            return false;
        }
        let share = here / (here - self.there);
        let point = source + (self.image - source) * share;
        (point.x >= self.low.x)
            & (point.y >= self.low.y)
            & (point.z >= self.low.z)
            & (point.x <= self.high.x)
            & (point.y <= self.high.y)
            & (point.z <= self.high.z)
    }
}

/// Bounds of a surface with a margin, open along the axis that its triangles are seen along.
fn bounds(surface: &Surface) -> (DVec3, DVec3) {
    let mut low = surface.bounds_min.as_dvec3() - MARGIN_M;
    let mut high = surface.bounds_max.as_dvec3() + MARGIN_M;
    let axis = surface.normal.abs().max_position();
    low[axis] = f64::NEG_INFINITY;
    high[axis] = f64::INFINITY;
    (low, high)
}

/// A share of the guide rays' sequences, ready for every source.
#[derive(Debug)]
pub(super) struct Candidates {
    first: usize,
    images: Vec<DVec3>,
    leads: Vec<Lead>,
}

impl Candidates {
    /// Room for `capacity` sequences of at most four leads.
    pub(super) fn with_capacity(capacity: usize) -> Self {
        Self {
            first: 0,
            images: Vec::with_capacity(capacity),
            leads: Vec::with_capacity(super::path::MAX_ORDER * capacity),
        }
    }

    /// Makes sequences ready, the first of which is number `first` of all.
    pub(super) fn prepare(
        &mut self,
        scene: &Scene,
        sequences: &[Sequence],
        first: usize,
        ear: DVec3,
    ) {
        self.first = first;
        self.images.clear();
        self.leads.clear();
        for (number, sequence) in sequences.iter().enumerate() {
            let image = mirror_listener(scene, sequence, ear);
            self.images.push(image);
            for (place, &surface) in sequence.surfaces().iter().enumerate() {
                if place == 0 || sequence.can_lead(scene, place) {
                    let lead = Lead::new(number as u32, scene.surface(surface), image);
                    self.leads.push(lead);
                }
            }
        }
    }

    /// Calls `look` with the number and the listener's image of every sequence that may have a path from `source`.
    #[inline]
    pub(super) fn of_source(&self, source: DVec3, mut look: impl FnMut(usize, DVec3)) {
        let mut last = u32::MAX;
        for lead in &self.leads {
            if lead.candidate != last && lead.may_be_met(source) {
                last = lead.candidate;
                let place = last as usize;
                look(self.first + place, self.images[place]);
            }
        }
    }
}

/// The listener's image of a sequence that only one source tries, if it may have a path from there.
pub(super) fn image_for_one(
    scene: &Scene,
    sequence: &Sequence,
    source: DVec3,
    ear: DVec3,
) -> Option<DVec3> {
    let image = mirror_listener(scene, sequence, ear);
    let surfaces = sequence.surfaces().iter().enumerate();
    let mut leads = surfaces.filter(|(place, _)| *place == 0 || sequence.can_lead(scene, *place));
    leads
        .any(|(_, &surface)| Lead::new(0, scene.surface(surface), image).may_be_met(source))
        .then_some(image)
}
