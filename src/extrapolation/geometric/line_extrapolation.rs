//! Linear extrapolation of evaluated paths between the frames that evaluate them.
//!
//! Audio side; arithmetic. Own. Within a few graphics frames the delay, direction and amplitude of a path are nearly linear
//! in time: if a listener walks past an image source at five metres, the path length deviates from its tangent by 0.2 mm in
//! two frames at 60 Hz. With [`crate::extrapolation::geometric::GeometricSettings::exact_every`] above 1 a path is evaluated
//! in some frames and extrapolated linearly from its last two evaluations in the others.

use crate::acoustics::BANDS;
use crate::extrapolation::frame::FramePath;

/// The line through the last evaluations of a path.
#[derive(Debug, Clone, Copy)]
pub struct PathLine {
    frame: u64,
    path: FramePath,
    slope: Option<Slope>,
}

/// Change per graphics frame.
#[derive(Debug, Clone, Copy)]
struct Slope {
    delay_s: f64,
    arrival: glam::Vec3,
    amplitude: [f32; BANDS],
}

impl PathLine {
    /// The line through `path`, evaluated in `frame`, and the last evaluation of `before` if it is at most `every` frames old.
    pub(crate) fn through(path: &FramePath, frame: u64, before: Option<&Self>, every: u64) -> Self {
        let last = before.filter(|last| last.frame < frame && frame - last.frame <= every);
        let slope = last.map(|last| {
            let share = 1.0 / (frame - last.frame) as f32;
            Slope {
                delay_s: (path.delay_s - last.path.delay_s) * f64::from(share),
                arrival: (path.arrival - last.path.arrival) * share,
                amplitude: std::array::from_fn(|b| {
                    (path.amplitude[b] - last.path.amplitude[b]) * share
                }),
            }
        });
        Self {
            frame,
            path: *path,
            slope,
        }
    }

    /// The path in a later frame. `None` if it must be evaluated: in one frame of `every`, after `every` frames, and without
    /// a slope.
    pub(crate) fn at(&self, frame: u64, every: u64) -> Option<FramePath> {
        let ahead = frame.checked_sub(self.frame)?;
        let is_turn = self.path.id.0.wrapping_add(frame).is_multiple_of(every);
        if is_turn || ahead >= every {
            return None;
        }
        let slope = self.slope?;
        let mut path = self.path;
        path.delay_s = (path.delay_s + slope.delay_s * ahead as f64).max(0.0);
        let arrival = path.arrival + slope.arrival * ahead as f32;
        path.arrival = arrival.normalize_or(path.arrival);
        for (value, slope) in path.amplitude.iter_mut().zip(slope.amplitude) {
            let next = *value + slope * ahead as f32;
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
    use crate::scene::SourceId;
    use glam::Vec3;

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

    #[test]
    fn a_walk_past_an_image_source_stays_on_the_line_between_evaluations() {
        for id in 0..7 {
            let ear = |frame: u64| Vec3::X * (frame as f32 * 1.4 / 60.0 - 0.5);
            let image = Vec3::new(0.0, 0.0, -3.0);
            let mut line: Option<PathLine> = None;
            let mut evaluations = 0;
            for frame in 100..160 {
                let exact = path(id, image, ear(frame));
                let Some(found) = line.and_then(|line| line.at(frame, 3)) else {
                    line = Some(PathLine::through(&exact, frame, line.as_ref(), 3));
                    evaluations += 1;
                    continue;
                };
                // v² t² / 2 d with t of two frames, and as much again for the slope, which is 1.5 frames old.
                let off_m = (found.delay_s - exact.delay_s).abs() * 343.4;
                assert!(off_m < 1.2e-3, "{off_m} m in frame {frame}");
                assert!(found.arrival.distance(exact.arrival) < 1e-3);
                assert!((found.amplitude[3] / exact.amplitude[3] - 1.0).abs() < 1e-3);
            }
            // The first two frames, then one in three.
            assert!((20..=22).contains(&evaluations), "{evaluations}");
        }
    }

    #[test]
    fn a_line_needs_two_recent_evaluations() {
        let audible = path(1, Vec3::X, Vec3::ZERO);
        let first = PathLine::through(&audible, 10, None, 3);
        assert!(first.at(11, 3).is_none());
        let second = PathLine::through(&audible, 12, Some(&first), 3);
        assert_eq!(second.at(13, 3), Some(audible));
        assert!(second.at(15, 3).is_none());
        assert!(
            PathLine::through(&audible, 20, Some(&second), 3)
                .at(21, 3)
                .is_none()
        );
    }

    #[test]
    fn a_fading_amplitude_stops_at_zero() {
        let mut audible = path(0, Vec3::X, Vec3::ZERO);
        let first = PathLine::through(&audible, 10, None, 3);
        audible.amplitude = [0.1; BANDS];
        let found = PathLine::through(&audible, 12, Some(&first), 3).at(13, 3);
        assert_eq!(found.map(|path| path.amplitude), Some([0.0; BANDS]));
    }
}
