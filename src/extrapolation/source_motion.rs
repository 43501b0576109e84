//! Delays by the time of emission: a path starts where its source was when it emitted the sound that arrives now.
//!
//! Audio side; arithmetic. Input: the positions of each graphics frame's sources; output: delay and amplitude of paths whose
//! sources move. A delay by the source's present position would give a moving source the Doppler shift of a moving
//! listener, 1 + v/c instead of 1 / (1 − v/c) \[MORSE68, section 11.2\]. The unfolded path is a straight line from the source to
//! an image of the listener, which is held while the source moves back along its track. This is exact for the direct path
//! and for reflections, and of first order in the source's displacement for diffracted paths.

use glam::{DVec3, Vec3};

use crate::acoustics::bands::exp_neg;
use crate::extrapolation::frame::FramePath;
use crate::scene::{Scene, SourceId, SourcePose};

/// Graphics frames kept: one second at 128 frames a second. Earlier positions count as the oldest one.
const KEPT: usize = 128;

/// Fastest motion as a fraction of the speed of sound. A faster one is a jump: the source was always where it is now.
const MAX_MACH: f64 = 0.9;

/// Iterations of the emission time. One is exact at constant velocity.
const ITERATIONS: usize = 4;

/// Change of the emission time, in seconds, below which the iteration ends.
const TOLERANCE_S: f64 = 1e-9;

/// Least cosine between the ends of a path that is straight.
const STRAIGHT_COSINE: f32 = 0.999_999;

/// Where one source was.
#[derive(Debug, Clone)]
struct Track {
    id: SourceId,
    /// First frame since the source exists or jumped.
    first: u64,
    /// Last frame whose position differs from that of the frame before.
    moved: u64,
    positions: [Vec3; KEPT],
}

/// The tracks of all sources.
#[derive(Debug, Clone)]
pub(super) struct SourceMotion {
    tracks: Vec<Track>,
    frame: u64,
    times_s: [f64; KEPT],
}

impl Default for SourceMotion {
    fn default() -> Self {
        Self {
            tracks: Vec::new(),
            frame: 0,
            times_s: [0.0; KEPT],
        }
    }
}

impl SourceMotion {
    /// Reserves capacity for this many sources. Control side.
    pub(super) fn reserve(&mut self, sources: usize) {
        self.tracks.reserve(sources);
    }

    /// Records the sources of a graphics frame, `interval_s` after the frame before.
    pub(super) fn record(&mut self, sources: &[SourcePose], interval_s: f64, speed_m_s: f64) {
        let before_s = self.time_s(self.frame);
        self.frame += 1;
        self.times_s[index(self.frame)] = before_s + interval_s.max(0.0);
        let farthest_m = MAX_MACH * speed_m_s * interval_s.max(0.0);
        self.tracks
            .retain(|track| sources.iter().any(|pose| pose.id == track.id));
        for pose in sources.iter().filter(|pose| pose.position.is_finite()) {
            let own = match self.find(pose.id) {
                Some(own) => own,
                None => {
                    self.tracks.push(Track {
                        id: pose.id,
                        first: self.frame,
                        moved: self.frame,
                        positions: [pose.position; KEPT],
                    });
                    continue;
                }
            };
            let track = &mut self.tracks[own];
            let before = track.positions[index(self.frame - 1)];
            track.positions[index(self.frame)] = pose.position;
            if before != pose.position {
                track.moved = self.frame;
            }
            if f64::from(before.distance(pose.position)) > farthest_m {
                track.first = self.frame;
            }
        }
    }

    /// Whether all sources rest since they were first recorded.
    pub(super) fn is_at_rest(&self) -> bool {
        self.tracks.iter().all(|track| track.moved == track.first)
    }

    /// Moves the start of a path to where its source was at the time of emission.
    pub(super) fn apply(&self, path: &mut FramePath, scene: &Scene, min_distance_m: f64) {
        let Some(track) = self.find(path.source).map(|own| &self.tracks[own]) else {
            return;
        };
        // Bounds of the window that any emission time lies in.
        let since_move_s = self.time_s(self.frame) - self.time_s(track.moved);
        if track.moved == track.first || since_move_s * (1.0 - MAX_MACH) > path.delay_s {
            return;
        }
        let speed_m_s = scene.speed_of_sound_m_s();
        let distance_m = path.delay_s * speed_m_s;
        let to_listener = path.departure.as_dvec3() * distance_m;
        let mut delay_s = path.delay_s;
        let mut moved = DVec3::ZERO;
        for _ in 0..ITERATIONS {
            moved = self.displacement(track, delay_s);
            let velocity = moved / delay_s.max(1e-9);
            let Some(next_s) = emission_delay_s(to_listener, velocity, speed_m_s) else {
                return;
            };
            let change_s = next_s - delay_s;
            delay_s = next_s;
            if change_s.abs() < TOLERANCE_S {
                break;
            }
        }
        let emitted_m = delay_s * speed_m_s;
        let spreading = distance_m.max(min_distance_m) / emitted_m.max(min_distance_m);
        let farther_m = (emitted_m - distance_m) as f32;
        let air = exp_neg(&scene.air_np_per_m().map(|np| np * farther_m.abs()));
        for (value, air) in path.amplitude.iter_mut().zip(air) {
            let air = if farther_m > 0.0 { air } else { 1.0 / air };
            *value *= air * spreading as f32;
        }
        path.air_delay_s += delay_s - path.delay_s;
        path.delay_s = delay_s;
        if path.order == 0 && path.departure.dot(-path.arrival) > STRAIGHT_COSINE {
            let towards = -(to_listener + moved).as_vec3();
            path.arrival = towards.try_normalize().unwrap_or(path.arrival);
        }
    }

    /// How far a source moved in the last `delay_s` seconds.
    fn displacement(&self, track: &Track, delay_s: f64) -> DVec3 {
        let oldest = track
            .first
            .max((self.frame + 1).saturating_sub(KEPT as u64));
        let present = track.positions[index(self.frame)].as_dvec3();
        let then_s = self.time_s(self.frame) - delay_s;
        // The newest interval tells about where to look.
        let interval_s = self.time_s(self.frame) - self.time_s(self.frame.saturating_sub(1));
        let back = (delay_s / interval_s.max(1e-9)) as u64;
        let mut frame = self.frame.saturating_sub(back).max(oldest);
        while frame > oldest && self.time_s(frame) > then_s {
            frame -= 1;
        }
        while frame < self.frame && self.time_s(frame + 1) <= then_s {
            frame += 1;
        }
        let [from, to] = [frame, (frame + 1).min(self.frame)];
        let [from_s, to_s] = [from, to].map(|frame| self.time_s(frame));
        let share = ((then_s - from_s) / (to_s - from_s).max(1e-9)).clamp(0.0, 1.0);
        let [from, to] = [from, to].map(|frame| track.positions[index(frame)].as_dvec3());
        present - from.lerp(to, share)
    }

    /// Tracks are mostly in the order of their slots: the slot is tested first.
    fn find(&self, id: SourceId) -> Option<usize> {
        let is_own = |track: &Track| track.id == id;
        let likely = self.tracks.get(id.slot()).filter(|track| is_own(track));
        likely.map_or_else(|| self.tracks.iter().position(is_own), |_| Some(id.slot()))
    }

    fn time_s(&self, frame: u64) -> f64 {
        self.times_s[index(frame)]
    }
}

/// Index of a frame in a ring.
fn index(frame: u64) -> usize {
    (frame % KEPT as u64) as usize
}

/// Time from emission to arrival of a source of constant velocity, now `to_listener` from the listener; `None` near and above
/// the speed of sound.
fn emission_delay_s(to_listener: DVec3, velocity: DVec3, speed_m_s: f64) -> Option<f64> {
    let squared = speed_m_s.powi(2) - velocity.length_squared();
    if squared < (1.0 - MAX_MACH.powi(2)) * speed_m_s.powi(2) {
        return None;
    }
    let along = to_listener.dot(velocity);
    let root = (along * along + squared * to_listener.length_squared()).sqrt();
    Some((along + root) / squared)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sound_travels_at_its_speed_from_where_it_was_emitted() {
        let (speed_m_s, velocity) = (343.4, DVec3::new(60.0, -20.0, 70.0));
        let to_listener = DVec3::new(30.0, 4.0, -50.0);
        let delay_s = emission_delay_s(to_listener, velocity, speed_m_s).expect("subsonic");
        let travelled_m = (to_listener + velocity * delay_s).length();
        assert!((travelled_m - speed_m_s * delay_s).abs() < 1e-9);
        assert_eq!(
            emission_delay_s(to_listener, 4.0 * velocity, speed_m_s),
            None
        );
    }

    #[test]
    fn the_track_is_followed_back_and_a_jump_ends_it() {
        let mut motion = SourceMotion::default();
        let id = SourceId::new(3, 1);
        let at = |x: f32| [SourcePose::at(id, Vec3::X * x)];
        for step in 0..300u16 {
            motion.record(&at(0.2 * f32::from(step)), 0.01, 340.0);
        }
        let moved =
            |motion: &SourceMotion, delay_s| motion.displacement(&motion.tracks[0], delay_s);
        assert!((moved(&motion, 0.333).x - 6.66).abs() < 1e-4);
        // Older than the ring: the oldest position.
        assert!((moved(&motion, 9.0).x - 0.2 * 127.0).abs() < 1e-4);
        motion.record(&at(-50.0), 0.01, 340.0);
        assert_eq!(moved(&motion, 0.333), DVec3::ZERO);
        motion.record(&[], 0.01, 340.0);
        assert!(motion.tracks.is_empty());
    }
}
