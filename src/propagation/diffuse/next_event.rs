//! From a bounce to the listener: which bounces are looked at, and what arrives.
//!
//! Every bounce sends to the listener by Lambert's law if nothing stands in between. A fixed number of bounces stands for
//! all of a rotation, chosen in proportion to what they may send (systematic sampling, \[COCHRAN77\] 9A.2), so that the
//! sum stays right; shadow rays ask whether something stands in between.
//!
//! What is chosen does not depend on the listener, what a chosen bounce sends is computed anew for wherever the listener
//! is when the sum is asked for, and what stands in between is asked from places that depend on the listener's alone
//! ([`crate::propagation::diffuse::visibility_cells`]). So the sum is a function of the place, and not of how many updates the listener took to get
//! there.

use glam::Vec3;

use crate::acoustics::bands::fading;
use crate::acoustics::{BANDS, BandArray};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::scene::Scene;
use crate::simd::{LaneSet, kernel, prefetch};

use crate::propagation::diffuse::bounce_buffer::{Bounces, Weighed};
use crate::propagation::diffuse::envelope::Spans;
use crate::propagation::diffuse::visibility_cells::VIEWS;

/// Bounces that stand for one source's rays of one rotation: half of them for bounces within the depth of discrete paths,
/// half beyond; all beyond, where those within have nothing for the tail.
pub const SHADOW_RAYS: usize = 64;

/// Room for bounces that are chosen: rounding may put one more mark on each half of the list.
const MOST_CHOSEN: usize = SHADOW_RAYS + 2;

/// Bounces whose arrivals are computed together.
pub(crate) const AT_ONCE: usize = 16;

/// Radius in metres over which a bounce is spread, so that a listener who stands beside one does not hear it alone.
const SPREAD_M: f32 = 0.7;

/// A bounce that stands for others.
#[derive(Debug, Clone, Copy)]
struct Chosen {
    point: Vec3,
    normal: Vec3,
    surface: u32,
    /// Way from the source.
    before_m: f32,
    /// Energy leaving, of all that it stands for, less what the air on the way to it takes.
    energy: BandArray,
    /// Whether nothing stands between it and its group's viewpoint.
    is_seen: bool,
}

/// The bounces that stand for a rotation's, every [`VIEWS`]th one of them a group, and from where the groups were looked at.
#[derive(Debug, Clone, Default)]
pub(crate) struct Arrivals {
    chosen: Vec<Chosen>,
    /// The places of those in sight of their viewpoints.
    seen: Vec<u32>,
    seen_from: [Option<Vec3>; VIEWS],
}

impl Arrivals {
    /// Room for all there can be.
    pub(crate) fn reserve(&mut self) {
        self.chosen
            .reserve(MOST_CHOSEN - self.chosen.len().min(MOST_CHOSEN));
        self.seen
            .reserve(MOST_CHOSEN - self.seen.len().min(MOST_CHOSEN));
    }

    /// Asks for what is known of the bounces.
    #[inline]
    pub(crate) fn prefetch(&self) {
        self.chosen.iter().for_each(prefetch);
    }

    /// Has all of them looked at again.
    pub(crate) fn forget_sight(&mut self) {
        self.seen_from = [None; VIEWS];
    }

    /// Chooses among a rotation's bounces.
    pub(crate) fn choose(&mut self, scene: &Scene, bounces: &mut Bounces) {
        self.chosen.clear();
        self.seen.clear();
        self.seen_from = [None; VIEWS];
        let Bounces {
            near, far, sums, ..
        } = bounces;
        let has_near = near.weights.iter().any(|weight| *weight > 0.0);
        let count = if has_near {
            0.5 * SHADOW_RAYS as f64
        } else {
            0.0
        };
        self.choose_among(scene, near, f64::from, count, sums);
        // The root beyond: what comes last has little energy, but nothing else is heard by then.
        let rest = SHADOW_RAYS as f64 - count;
        self.choose_among(scene, far, |weight| f64::from(weight).sqrt(), rest, sums);
    }

    /// Chooses `count` of them in proportion to what weights are taken for, or fewer that stand for more. `sums` is memory.
    fn choose_among(
        &mut self,
        scene: &Scene,
        bounces: &Weighed,
        taken_for: impl Fn(f32) -> f64,
        count: f64,
        sums: &mut Vec<f64>,
    ) {
        let mut sum = 0.0;
        sums.clear();
        sums.extend(bounces.weights.iter().map(|weight| {
            sum += taken_for(*weight);
            sum
        }));
        let stride = sum / count;
        if !(stride > 0.0 && stride.is_finite()) {
            return;
        }
        // Marks stand at (n + ½) strides along the sum of weights.
        let mut mark = 0.5 * stride;
        let mut place = 0;
        loop {
            // Most have none: as many are passed over at once as may be.
            const PASSED: usize = 8;
            let is_passed = |place| sums.get(place).is_some_and(|sum: &f64| mark >= *sum);
            while is_passed(place + PASSED - 1) {
                place += PASSED;
            }
            while is_passed(place) {
                place += 1;
            }
            let Some(&sum) = sums.get(place) else { break };
            let mut marks = 0.0;
            while mark < sum {
                mark += stride;
                marks += 1.0;
            }
            let bounce = bounces.bounce(place);
            let gain = (marks * stride / taken_for(bounces.weights[place])) as f32;
            let air = fading(&scene.air_np_per_m().map(|m| 2.0 * m * bounce.length_m));
            self.chosen.push(Chosen {
                point: bounce.point,
                normal: bounce.normal,
                surface: bounce.surface,
                before_m: bounce.length_m,
                energy: std::array::from_fn(|b| bounce.energy[b] * gain * air[b]),
                is_seen: false,
            });
            place += 1;
        }
    }

    /// Looks from the chosen bounces to the viewpoints of their groups, unless it has from there. Adds the rays it cast to
    /// `rays`.
    pub(crate) fn look(&mut self, scene: &Scene, viewpoints: &[Vec3], rays: &mut u64) {
        let mut is_new = false;
        for (group, (&place, seen_from)) in viewpoints.iter().zip(&mut self.seen_from).enumerate() {
            if seen_from.replace(place) == Some(place) {
                continue;
            }
            is_new = true;
            for chosen in self.chosen.iter_mut().skip(group).step_by(VIEWS) {
                // A surface sends nothing behind itself, whatever stands there.
                if chosen.normal.dot(place - chosen.point) <= 0.0 {
                    chosen.is_seen = false;
                    continue;
                }
                *rays += 1;
                let leg = Ray::between(chosen.point, place);
                chosen.is_seen = !scene.any_hit(&leg, [chosen.surface, NO_GROUP]);
            }
        }
        if is_new {
            self.seen.clear();
            let places = self.chosen.iter().zip(0..);
            let seen = places.filter(|(chosen, _)| chosen.is_seen);
            self.seen.extend(seen.map(|(_, place)| place));
        }
    }

    /// Adds what arrives at the listener, by a weight.
    pub(crate) fn gather(&self, scene: &Scene, listener: Vec3, weight: f32, spans: &mut Spans) {
        let there = Listening {
            place: listener,
            air: *scene.air_np_per_m(),
            speed_m_s: scene.speed_of_sound_m_s(),
        };
        gather(
            LaneSet::best(),
            &self.chosen,
            &self.seen,
            &there,
            weight,
            spans,
        );
    }
}

/// A listener, and the air around.
struct Listening {
    place: Vec3,
    air: BandArray,
    speed_m_s: f64,
}

kernel! {
    /// Adds what those of the chosen bounces send that are seen, times a weight. Eight bands are eight lanes, and so are
    /// neighbours in the list; every product is rounded, so all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn gather<L>(chosen: &[Chosen], seen: &[u32], there: &Listening, weight: f32, spans: &mut Spans) {
        for places in seen.chunks(AT_ONCE) {
            // What is left of the last lanes has no say.
            let mut ways = Ways::NONE;
            for (lane, place) in places.iter().enumerate() {
                ways.set(lane, &chosen[*place as usize], there);
            }
            let (after_m, kernel, delay_s) = ways.at(there);
            let mut energies = [[0.0; BANDS]; AT_ONCE];
            for (lane, place) in places.iter().enumerate() {
                let mut energy = chosen[*place as usize].energy;
                for b in 0..BANDS {
                    // The fourth power of the exponential's first terms: it takes 0.1 dB too little of 6 dB, 2 dB of 20.
                    let x = 0.5 * there.air[b] * after_m[lane];
                    let root = 1.0 / (1.0 + x + 0.5 * x * x);
                    let square = root * root;
                    energy[b] *= kernel[lane] * square * square;
                }
                for b in 0..BANDS {
                    energies[lane][b] = energy[b] * weight;
                }
            }
            spans.add(&delay_s, &energies, places.len());
        }
    }
}

/// The ways of some bounces to the listener, one a lane.
struct Ways {
    way: [[f32; AT_ONCE]; 3],
    normal: [[f32; AT_ONCE]; 3],
    before_m: [f32; AT_ONCE],
}

impl Ways {
    const NONE: Self = Self {
        way: [[0.0; AT_ONCE]; 3],
        normal: [[0.0; AT_ONCE]; 3],
        before_m: [0.0; AT_ONCE],
    };

    #[inline(always)]
    fn set(&mut self, lane: usize, chosen: &Chosen, there: &Listening) {
        let (way, normal) = (there.place - chosen.point, chosen.normal);
        for axis in 0..3 {
            self.way[axis][lane] = way[axis];
            self.normal[axis][lane] = normal[axis];
        }
        self.before_m[lane] = chosen.before_m;
    }

    /// Lambert's cosine law over the ways: their lengths, the share of energy that arrives without air, and seconds from
    /// emission.
    #[inline(always)]
    fn at(&self, there: &Listening) -> ([f32; AT_ONCE], [f32; AT_ONCE], [f64; AT_ONCE]) {
        let (mut after_m, mut kernel) = ([0.0; AT_ONCE], [0.0; AT_ONCE]);
        let mut delay_s = [0.0; AT_ONCE];
        for l in 0..AT_ONCE {
            let [x, y, z] = [self.way[0][l], self.way[1][l], self.way[2][l]];
            let n = [self.normal[0][l], self.normal[1][l], self.normal[2][l]];
            let length_m = (x * x + y * y + z * z).sqrt();
            let cosine = (n[0] * x + n[1] * y + n[2] * z).max(0.0) / length_m.max(1e-6);
            after_m[l] = length_m;
            kernel[l] =
                cosine / (std::f32::consts::PI * (length_m * length_m + SPREAD_M * SPREAD_M));
        }
        for l in 0..AT_ONCE {
            delay_s[l] = f64::from(self.before_m[l] + after_m[l]) / there.speed_m_s;
        }
        (after_m, kernel, delay_s)
    }
}
