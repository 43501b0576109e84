//! Linear extrapolation of evaluated paths between the frames that evaluate them.
//!
//! Audio side; arithmetic. Own. Within a few graphics frames the delay, direction and amplitude of a path are nearly linear
//! in time: if a listener walks past an image source at five metres, the path length deviates from its tangent by 0.2 mm in
//! two frames at 60 Hz. With [`crate::extrapolation::GeometricSettings::exact_every`] above 1 a path is
//! evaluated in some frames and extrapolated linearly from its last two evaluations in the others. Its delay also follows what
//! source and listener have moved otherwise than between those: at a sudden turn it changes at once.

use glam::Vec3;

use crate::acoustics::BANDS;
use crate::extrapolation::frame::FramePath;
use crate::propagation::PathId;
use crate::propagation::endpoints::Endpoints;
use crate::scene::{Scene, SourceId};

/// Greatest displacement in metres of source and listener together over which a path is extrapolated. Beside an edge or an image
/// source at 5 m its level then deviates by 0.04 %, and its length from the tangent by 1 mm.
const AHEAD_M: f32 = 0.1;

/// Change of an amplitude between two evaluations, relative to the larger value, above which it is a switch without a slope.
const SWITCH_RATIO: f32 = 0.5;

/// Difference of an evaluated amplitude from what its line had for that frame, relative to the loudest band, above which the line has
/// ended: a step lies between the two evaluations, and the next frame evaluates the path again for a slope behind it.
const STEP_RATIO: f32 = 0.1;

/// How far paths are extrapolated between two evaluations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ExtrapolationReach {
    /// One graphics frame of so many evaluates a path.
    pub(crate) every: u32,
    /// Greatest displacement in metres of source and listener together.
    distance_m: f32,
}

impl Default for ExtrapolationReach {
    fn default() -> Self {
        Self::of(1, 1)
    }
}

impl ExtrapolationReach {
    /// For frames of which one in `every` evaluates a path, over so many times the usual distance.
    pub(crate) fn of(every: u32, times: u32) -> Self {
        Self {
            every,
            distance_m: AHEAD_M * times as f32,
        }
    }

    /// Graphics frames, of at most [`Self::every`], in which source and listener move at most so far, as they have moved since
    /// the last frame; at least 1.
    pub(crate) fn frames(self, last: &Endpoints, now: &Endpoints) -> u64 {
        let step_m = last.from.distance(now.from) + last.to.distance(now.to);
        // Without motion the quotient is infinite, or no number.
        let frames = (self.distance_m / step_m).min(self.every as f32);
        (frames as u64).max(1)
    }
}

/// A graphics frame and its time. A renderer whose blocks are longer than graphics frames leaves some out, so that those which it
/// computes are not evenly spaced.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct FrameTime {
    /// Number among the computed frames.
    pub(crate) frame: u64,
    /// In seconds since the first.
    pub(crate) time_s: f64,
}

/// Source and listener of a path in a graphics frame, in world coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PathEnds {
    from: Vec3,
    to: Vec3,
    /// Delay in seconds per metre.
    delay_s_per_m: f32,
}

impl PathEnds {
    /// Those of a graphics frame.
    #[inline]
    pub(crate) fn of(endpoints: &Endpoints, scene: &Scene) -> Self {
        Self {
            from: endpoints.from,
            to: endpoints.to,
            delay_s_per_m: scene.speed_of_sound_m_s().recip() as f32,
        }
    }

    /// Change in seconds of a path's delay since its ends were at `before`, to first order: the points between them change the
    /// length of a shortest path only to second order.
    #[inline]
    fn delay_change_s(&self, before: &Self, path: &FramePath) -> f32 {
        let approach_m =
            path.arrival.dot(self.to - before.to) + path.departure.dot(self.from - before.from);
        -approach_m * self.delay_s_per_m
    }
}

/// The line through the last evaluations of a path.
#[derive(Debug, Clone, Copy)]
pub struct PathLine {
    at: FrameTime,
    ends: PathEnds,
    path: FramePath,
    /// Sides of the boundaries of its waves, 0 without an edge.
    sides: u32,
    slope: Option<Slope>,
}

/// Change per second.
#[derive(Debug, Clone, Copy)]
struct Slope {
    /// Without [`PathEnds::delay_change_s`].
    delay_s: f32,
    arrival: Vec3,
    amplitude: [f32; BANDS],
}

impl PathLine {
    /// The line through `path`, evaluated in a frame, and the last evaluation of `before` if it is at most `every` frames old and on
    /// the same `sides` of all boundaries of its waves.
    pub(crate) fn through(
        (path, sides): (&FramePath, u32),
        (at, ends): (FrameTime, PathEnds),
        before: Option<&Self>,
        every: u64,
    ) -> Self {
        let is_recent = |last: &&Self| {
            let last = last.at;
            last.frame < at.frame && at.frame - last.frame <= every && last.time_s < at.time_s
        };
        let last = before.filter(|last| last.sides == sides && is_recent(last));
        let is_on_line = |last: &&Self| last.leads_to(path, at);
        let slope = last.filter(is_on_line).map(|last| {
            let share = (at.time_s - last.at.time_s).recip() as f32;
            Slope {
                delay_s: share
                    * ((path.delay_s - last.path.delay_s) as f32
                        - ends.delay_change_s(&last.ends, path)),
                arrival: (path.arrival - last.path.arrival) * share,
                amplitude: std::array::from_fn(|b| {
                    let (now, before) = (path.amplitude[b], last.path.amplitude[b]);
                    let largest = now.abs().max(before.abs());
                    match (now - before).abs() <= SWITCH_RATIO * largest {
                        true => (now - before) * share,
                        false => 0.0,
                    }
                }),
            }
        });
        Self {
            at,
            ends,
            path: *path,
            sides,
            slope,
        }
    }

    /// Whether the line has about the amplitude of `path`, evaluated later; without a slope it tells nothing.
    fn leads_to(&self, path: &FramePath, at: FrameTime) -> bool {
        let Some(slope) = &self.slope else {
            return true;
        };
        let ahead_s = (at.time_s - self.at.time_s) as f32;
        let (mut largest, mut off) = (0.0f32, 0.0f32);
        for (b, now) in path.amplitude.iter().enumerate() {
            let before = self.path.amplitude[b];
            largest = largest.max(now.abs()).max(before.abs());
            off = off.max((now - before - slope.amplitude[b] * ahead_s).abs());
        }
        off <= STEP_RATIO * largest
    }

    /// Sides of the boundaries of the path's waves in its last evaluation.
    #[inline]
    pub(crate) fn sides(&self) -> u32 {
        self.sides
    }

    /// The path's identity.
    pub(crate) fn id(&self) -> PathId {
        self.path.id
    }

    /// The path's source.
    #[inline]
    pub(crate) fn source(&self) -> SourceId {
        self.path.source
    }

    /// Whether [`Self::ahead`] has the path of a later frame that need not evaluate it, as one frame of `every` does.
    #[inline]
    pub(crate) fn spans(&self, frame: u64, every: u64, reach: u64) -> bool {
        let is_turn = self.path.id.0.wrapping_add(frame).is_multiple_of(every);
        !is_turn && self.slope.is_some() && frame.wrapping_sub(self.at.frame) < reach
    }

    /// The path in a later frame; `None` after `reach` frames and without a slope.
    pub(crate) fn ahead(
        &self,
        (now, ends): (FrameTime, PathEnds),
        reach: u64,
    ) -> Option<FramePath> {
        if now.frame.checked_sub(self.at.frame)? >= reach {
            return None;
        }
        let ahead_s = now.time_s - self.at.time_s;
        let slope = self.slope?;
        let mut path = self.path;
        let motion_s = ends.delay_change_s(&self.ends, &path);
        let change_s = f64::from(slope.delay_s) * ahead_s + f64::from(motion_s);
        path.delay_s = (path.delay_s + change_s).max(0.0);
        // A path at rest keeps its bits.
        if slope.arrival != Vec3::ZERO {
            let arrival = path.arrival + slope.arrival * ahead_s as f32;
            path.arrival = arrival.normalize_or(path.arrival);
        }
        for (value, slope) in path.amplitude.iter_mut().zip(slope.amplitude) {
            let next = *value + slope * ahead_s as f32;
            // A fading amplitude stops at zero.
            *value = if next * *value > 0.0 { next } else { 0.0 };
        }
        Some(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extrapolation::frame::PathKind;
    use crate::propagation::PathId;
    use crate::scene::SourcePose;

    /// A path from an image source.
    fn path(id: u64, image: Vec3, ear: Vec3) -> FramePath {
        let ray = image - ear;
        FramePath {
            id: PathId(id),
            source: SourceId::default(),
            kind: PathKind::Reflected,
            order: 1,
            amplitude: [1.0 / ray.length(); BANDS],
            delay_s: f64::from(ray.length()) / 343.4,
            air_delay_s: f64::from(ray.length()) / 343.4,
            arrival: ray.normalize(),
            departure: Vec3::ZERO,
        }
    }

    /// Evenly spaced graphics frames.
    fn time(frame: u64) -> FrameTime {
        let time_s = frame as f64 / 60.0;
        FrameTime { frame, time_s }
    }

    /// A source in the origin and this listener.
    fn ends(ear: Vec3) -> PathEnds {
        PathEnds {
            from: Vec3::ZERO,
            to: ear,
            delay_s_per_m: 343.4f32.recip(),
        }
    }

    /// Nothing moves.
    fn rest(frame: u64) -> (FrameTime, PathEnds) {
        (time(frame), ends(Vec3::ZERO))
    }

    /// The extrapolated path if nothing moves; `None` in a frame that must evaluate it.
    fn at(line: &PathLine, frame: u64, every: u64, reach: u64) -> Option<FramePath> {
        let is_extrapolated = line.spans(frame, every, reach);
        is_extrapolated
            .then(|| line.ahead(rest(frame), reach))
            .flatten()
    }

    /// Follows an image source for a listener who moves, in 60 frames of which one in three evaluates the path; passes each
    /// extrapolated path and the exact one to `each` and returns the number of evaluations.
    fn walk(
        id: u64,
        ear: impl Fn(u64) -> Vec3,
        mut each: impl FnMut(&FramePath, &FramePath),
    ) -> u32 {
        let image = Vec3::new(0.0, 0.0, -3.0);
        let mut line: Option<PathLine> = None;
        let mut evaluations = 0;
        for frame in 100..160 {
            let exact = path(id, image, ear(frame));
            let now = (time(frame), ends(ear(frame)));
            let spanning = line.filter(|line| line.spans(frame, 3, 3));
            let Some(found) = spanning.and_then(|line| line.ahead(now, 3)) else {
                line = Some(PathLine::through((&exact, 0), now, line.as_ref(), 3));
                evaluations += 1;
                continue;
            };
            each(&found, &exact);
        }
        evaluations
    }

    #[test]
    fn a_walk_past_an_image_source_stays_on_the_line_between_evaluations() {
        for id in 0..7 {
            let ear = |frame: u64| Vec3::X * (frame as f32 * 1.4 / 60.0 - 0.5);
            let evaluations = walk(id, ear, |found, exact| {
                // v² t² / 2 d with t of two frames, and as much again for the slope, which is 1.5 frames old.
                let off_m = (found.delay_s - exact.delay_s).abs() * 343.4;
                assert!(off_m < 1.2e-3, "{off_m} m");
                assert!(found.arrival.distance(exact.arrival) < 1e-3);
                assert!((found.amplitude[3] / exact.amplitude[3] - 1.0).abs() < 1e-3);
            });
            // The first two frames, then one in three.
            assert!((20..=22).contains(&evaluations), "{evaluations}");
        }
    }

    #[test]
    fn a_delay_follows_a_sudden_turn_at_once() {
        for id in 0..7 {
            // Towards the image source and back, 83 mm in a frame, at an angle of 18 degrees.
            let ear = |frame: u64| Vec3::new(1.0, 0.0, (frame as f32 - 130.0).abs() * 5.0 / 60.0);
            walk(id, ear, |found, exact| {
                // As in the walk: 52 mm across the line of sight within two frames.
                let off_m = (found.delay_s - exact.delay_s).abs() * 343.4;
                assert!(off_m < 1.2e-3, "{off_m} m");
            });
        }
    }

    #[test]
    fn a_line_needs_two_recent_evaluations() {
        let audible = path(1, Vec3::X, Vec3::ZERO);
        let first = PathLine::through((&audible, 0), rest(10), None, 3);
        assert!(at(&first, 11, 3, 3).is_none());
        let second = PathLine::through((&audible, 0), rest(12), Some(&first), 3);
        assert_eq!(at(&second, 13, 3, 3), Some(audible));
        assert!(at(&second, 15, 3, 3).is_none());
        let late = PathLine::through((&audible, 0), rest(20), Some(&second), 3);
        assert!(at(&late, 21, 3, 3).is_none());
    }

    #[test]
    fn a_line_does_not_cross_a_boundary_of_its_waves() {
        let mut audible = path(1, Vec3::X, Vec3::ZERO);
        let lit = PathLine::through((&audible, 0), rest(10), None, 3);
        audible.amplitude = [-1.0; BANDS];
        let dark = PathLine::through((&audible, 1), rest(12), Some(&lit), 3);
        assert!(at(&dark, 13, 3, 3).is_none());
        let darker = PathLine::through((&audible, 1), rest(13), Some(&dark), 3);
        assert_eq!(at(&darker, 15, 3, 3), Some(audible));
    }

    #[test]
    fn left_out_frames_pass_too() {
        let at = |frame, time_s| (FrameTime { frame, time_s }, ends(Vec3::ZERO));
        let of_level = |level| {
            let mut audible = path(1, Vec3::X, Vec3::ZERO);
            audible.amplitude = [level; BANDS];
            audible
        };
        let first = PathLine::through((&of_level(0.5), 0), at(7, 1.00), None, 4);
        let line = PathLine::through((&of_level(0.6), 0), at(8, 1.02), Some(&first), 4);
        let level = |now| line.ahead(now, 4).map(|path| path.amplitude[0]);
        assert!(level(at(9, 1.03)).is_some_and(|level| (level - 0.65).abs() < 1e-5));
        assert!(level(at(9, 1.04)).is_some_and(|level| (level - 0.7).abs() < 1e-5));
    }

    #[test]
    fn a_fading_amplitude_stops_at_zero() {
        let mut audible = path(0, Vec3::X, Vec3::ZERO);
        audible.amplitude = [0.1; BANDS];
        let first = PathLine::through((&audible, 0), rest(10), None, 8);
        audible.amplitude = [0.06; BANDS];
        let line = PathLine::through((&audible, 0), rest(12), Some(&first), 8);
        let level = |frame| line.ahead(rest(frame), 8).map(|path| path.amplitude[0]);
        assert!(level(13).is_some_and(|level| (level - 0.04).abs() < 1e-6));
        assert_eq!(level(16), Some(0.0));
    }

    #[test]
    fn a_switched_amplitude_is_held() {
        let mut audible = path(0, Vec3::X, Vec3::ZERO);
        audible.amplitude = [0.2; BANDS];
        let first = PathLine::through((&audible, 0), rest(10), None, 4);
        audible.amplitude = [0.8; BANDS];
        let line = PathLine::through((&audible, 0), rest(12), Some(&first), 4);
        assert_eq!(
            line.ahead(rest(14), 4).map(|path| path.amplitude),
            Some([0.8; BANDS])
        );
    }

    #[test]
    fn a_line_ends_at_a_step() {
        let mut audible = path(0, Vec3::X, Vec3::ZERO);
        let mut evaluate = |level: f32, frame, before: Option<&PathLine>| {
            audible.amplitude = [level; BANDS];
            PathLine::through((&audible, 0), rest(frame), before, 4)
        };
        let first = evaluate(0.20, 10, None);
        let line = evaluate(0.21, 11, Some(&first));
        // On the line the amplitude would be 0.25, at most 10 % of the larger one off.
        let on_line = evaluate(0.26, 15, Some(&line));
        assert!(at(&on_line, 17, 4, 4).is_some());
        let behind = evaluate(0.32, 15, Some(&line));
        assert!(at(&behind, 17, 4, 4).is_none());
        let further = evaluate(0.33, 16, Some(&behind));
        let level = at(&further, 17, 4, 4).map(|path| path.amplitude[0]);
        assert!(level.is_some_and(|level| (level - 0.34).abs() < 1e-5));
    }

    #[test]
    fn fast_motion_is_extrapolated_over_fewer_frames() {
        let at = |x: f32| {
            let pose = SourcePose::at(SourceId::new(0, 0), Vec3::ZERO);
            Endpoints::of(&pose, Vec3::X * x, 0.3)
        };
        let ahead = |divisor: u32, step_m: f32| {
            ExtrapolationReach::of(4, divisor).frames(&at(1.0), &at(1.0 + step_m))
        };
        let steps_m = [0.0, 0.02, 0.04, 0.3, f32::NAN];
        assert_eq!(steps_m.map(|step_m| ahead(1, step_m)), [4, 4, 2, 1, 4]);
        assert_eq!(steps_m.map(|step_m| ahead(2, step_m)), [4, 4, 4, 1, 4]);
    }
}
