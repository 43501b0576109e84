//! How a path has been changing, so that not every graphics frame has to work it out anew.
//!
//! Audio side; arithmetic. Own. Within a few graphics frames a path's delay, direction and level lie on a line: a listener
//! who walks past a mirror image at five metres leaves it by a fifth of a millimetre in two of sixty frames a second. Where
//! frames are dear ([`crate::extrapolation::geometric::GeometricSettings::exact_every`]) a path is worked out in its turn and goes on along that line in
//! between.

use crate::acoustics::BANDS;
use crate::extrapolation::frame::FramePath;

/// What was heard of a path when it was worked out last.
#[derive(Debug, Clone, Copy)]
pub struct Trend {
    frame: u64,
    path: FramePath,
    growth: Option<Growth>,
}

/// Change a graphics frame.
#[derive(Debug, Clone, Copy)]
struct Growth {
    delay_s: f64,
    arrival: glam::Vec3,
    amplitude: [f32; BANDS],
}

impl Trend {
    /// Of a path that has just been worked out, and of the trend that it had, if that is no older than `every` frames.
    pub(crate) fn of(path: &FramePath, frame: u64, before: Option<&Self>, every: u64) -> Self {
        let last = before.filter(|last| last.frame < frame && frame - last.frame <= every);
        let growth = last.map(|last| {
            let share = 1.0 / (frame - last.frame) as f32;
            Growth {
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
            growth,
        }
    }

    /// The path in a later frame, unless it is its turn to be worked out, one frame in `every`, or that was too long ago.
    pub(crate) fn at(&self, frame: u64, every: u64) -> Option<FramePath> {
        let ahead = frame.checked_sub(self.frame)?;
        let is_turn = self.path.id.0.wrapping_add(frame).is_multiple_of(every);
        if is_turn || ahead >= every {
            return None;
        }
        let growth = self.growth?;
        let mut path = self.path;
        path.delay_s = (path.delay_s + growth.delay_s * ahead as f64).max(0.0);
        let arrival = path.arrival + growth.arrival * ahead as f32;
        path.arrival = arrival.normalize_or(path.arrival);
        for (value, growth) in path.amplitude.iter_mut().zip(growth.amplitude) {
            let next = *value + growth * ahead as f32;
            // What fades does not come back with the other sign.
            *value = if next * *value > 0.0 { next } else { 0.0 };
        }
        Some(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::PathId;
    use crate::scene::SourceId;
    use glam::Vec3;

    /// An image at a place, heard from another.
    fn path(id: u64, image: Vec3, ear: Vec3) -> FramePath {
        let way = image - ear;
        FramePath {
            id: PathId(id),
            source: SourceId::default(),
            order: 1,
            amplitude: [1.0 / way.length(); BANDS],
            delay_s: f64::from(way.length()) / 343.4,
            arrival: way.normalize(),
        }
    }

    #[test]
    fn a_walk_past_an_image_is_followed_and_every_path_has_its_turn() {
        for id in 0..7 {
            let ear = |frame: u64| Vec3::X * (frame as f32 * 1.4 / 60.0 - 0.5);
            let image = Vec3::new(0.0, 0.0, -3.0);
            let mut trend: Option<Trend> = None;
            let mut looks = 0;
            for frame in 100..160 {
                let exact = path(id, image, ear(frame));
                let Some(found) = trend.and_then(|trend| trend.at(frame, 3)) else {
                    trend = Some(Trend::of(&exact, frame, trend.as_ref(), 3));
                    looks += 1;
                    continue;
                };
                // v² t² / 2 d with t of two frames, and as much again for the slope, which is of a frame and a half before.
                let off_m = (found.delay_s - exact.delay_s).abs() * 343.4;
                assert!(off_m < 1.2e-3, "{off_m} m in frame {frame}");
                assert!(found.arrival.distance(exact.arrival) < 1e-3);
                assert!((found.amplitude[3] / exact.amplitude[3] - 1.0).abs() < 1e-3);
            }
            // The first two, and one in three from then on.
            assert!((20..=22).contains(&looks), "{looks}");
        }
    }

    #[test]
    fn what_was_worked_out_long_ago_or_once_only_is_worked_out_anew() {
        let heard = path(1, Vec3::X, Vec3::ZERO);
        let first = Trend::of(&heard, 10, None, 3);
        assert!(first.at(11, 3).is_none());
        let second = Trend::of(&heard, 12, Some(&first), 3);
        assert_eq!(second.at(13, 3), Some(heard));
        assert!(second.at(15, 3).is_none());
        assert!(Trend::of(&heard, 20, Some(&second), 3).at(21, 3).is_none());
    }

    #[test]
    fn what_fades_ends_at_nothing() {
        let mut heard = path(0, Vec3::X, Vec3::ZERO);
        let first = Trend::of(&heard, 10, None, 3);
        heard.amplitude = [0.1; BANDS];
        let found = Trend::of(&heard, 12, Some(&first), 3).at(13, 3);
        assert_eq!(found.map(|path| path.amplitude), Some([0.0; BANDS]));
    }
}
