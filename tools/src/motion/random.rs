//! Random numbers from a seed: a counter through SplitMix64's mixer.

use foresound::propagation::rays::directions::{mix, unit};
use glam::Vec3;

/// A sequence of random numbers.
#[derive(Debug, Clone)]
pub struct Random {
    counter: u64,
}

impl Random {
    /// The sequence of a seed.
    pub fn of(seed: u64) -> Self {
        Self { counter: mix(seed) }
    }

    /// A number from `low` to below `high`.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        self.counter = self.counter.wrapping_add(1);
        low + (high - low) * unit(mix(self.counter))
    }

    /// An index below `count`; 0 of none.
    pub fn index(&mut self, count: usize) -> usize {
        let drawn = self.between(0.0, count as f32) as usize;
        drawn.min(count.saturating_sub(1))
    }

    /// A horizontal unit vector.
    pub fn direction(&mut self) -> Vec3 {
        let (sine, cosine) = self.between(0.0, std::f32::consts::TAU).sin_cos();
        Vec3::new(cosine, 0.0, sine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_in_their_range_and_repeat_by_seed() {
        let mut random = Random::of(7);
        let drawn: Vec<f32> = (0..1000).map(|_| random.between(-2.0, 3.0)).collect();
        assert!(drawn.iter().all(|x| (-2.0..3.0).contains(x)));
        let mean = drawn.iter().sum::<f32>() / 1000.0;
        // The mean of 1,000 has a standard deviation of 0.046.
        assert!((mean - 0.5).abs() < 0.2, "{mean}");
        let mut again = Random::of(7);
        assert!(drawn.iter().all(|x| *x == again.between(-2.0, 3.0)));
        assert_ne!(Random::of(8).between(-2.0, 3.0), drawn[0]);
        assert_eq!(random.index(0), 0);
        assert!((0..100).all(|_| random.index(3) < 3));
    }
}
