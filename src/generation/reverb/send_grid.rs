//! The grid of times at which sends read the delay lines of their sources.
//!
//! Audio side; arithmetic. A continuously moving read position would shift the pitch; on the grid a send changes over from
//! one point to the next. Points are not earlier than what is asked for: nothing is heard before its time.

/// Distance of two points in seconds.
const GRID_S: f32 = 0.0025;

/// Share of a step over which a send changes over.
const CHANGE: f32 = 0.25;

/// Steps from a time to the middle of its points: the earlier one may be half a step and half a change before that.
const AHEAD: f32 = 0.5 + 0.5 * CHANGE;

/// Sources after which the grids repeat.
const GRIDS: usize = 16;

/// Mean lateness of the points in seconds.
pub(crate) const MEAN_LATENESS_S: f32 = AHEAD * GRID_S;

/// A point of a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GridPoint {
    /// Number of the point.
    pub(crate) index: i64,
    /// Its time in seconds, at least 0.
    pub(crate) time_s: f32,
    /// Amplitude of what is read there.
    pub(crate) gain: f32,
}

/// The two points after a time of at least 0 s, on the grid of a source slot. The squares of their gains sum to one: their
/// responses are uncorrelated.
pub(crate) fn points(time_s: f32, slot: usize) -> [GridPoint; 2] {
    let shift = (slot % GRIDS) as f32 / GRIDS as f32;
    let steps = time_s / GRID_S + shift + AHEAD;
    let below = steps.floor();
    let share = ((steps - below - 0.5) / CHANGE + 0.5).clamp(0.0, 1.0);
    let (sin, cos) = (share * std::f32::consts::FRAC_PI_2).sin_cos();
    let gains = match share {
        // Exactly zero: a silent point is not read.
        0.0 => [1.0, 0.0],
        1.0 => [0.0, 1.0],
        _ => [cos, sin],
    };
    [(below, gains[0]), (below + 1.0, gains[1])].map(|(point, gain)| GridPoint {
        index: point as i64,
        time_s: (point - shift).max(0.0) * GRID_S,
        gain,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_never_early_and_late_by_less_than_two_steps() {
        for slot in 0..20 {
            for n in 0..4000 {
                let time_s = 1e-5 * n as f32;
                let audible = points(time_s, slot).into_iter().filter(|p| p.gain > 0.0);
                let mut energy = 0.0;
                for point in audible {
                    let late_s = point.time_s - time_s;
                    assert!((-1e-6..2.0 * GRID_S).contains(&late_s), "{slot} {time_s}");
                    energy += point.gain * point.gain;
                }
                assert!((energy - 1.0).abs() < 1e-5);
            }
        }
    }
}
