//! Quality levels, and interpolation between two of them.

use crate::propagation::{MAX_ORDER, PropagationQuality, PropagationSettings};

/// A quality level: 0 is full detail, 5 the least.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct QualityLevel(pub u8);

/// Factors of a quality level, applied to the settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QualityFactors {
    /// Of the number of guide rays.
    pub guide_rays: f32,
    /// Of the number of source rays.
    pub source_rays: f32,
    /// Of the number of updates for which a valid sequence is tried again.
    pub cache_updates: f32,
    /// Of the greatest number of paths.
    pub paths: f32,
    /// Orders of reflection below the settings' depth.
    pub skipped_orders: u8,
    /// Updates between two estimates of a source's late energy.
    pub late_interval: u64,
    /// Steps from the chosen predictor to a cheaper one: from geometric over linear to hold.
    pub predictor_steps: u8,
}

/// All levels: the number of rays falls first, then the rate of late estimates, reflection orders and the predictor last.
/// `bench speed --quality-level N` measures one of them.
pub const QUALITY_LEVELS: [QualityFactors; 6] = [
    factors(1.0, 1.0, 0, 1, 0),
    factors(0.7, 0.7, 0, 1, 0),
    factors(0.5, 0.5, 0, 2, 0),
    factors(0.35, 0.5, 1, 3, 0),
    factors(0.25, 0.35, 2, 4, 1),
    factors(0.12, 0.25, 3, 4, 2),
];

/// Number of the last level.
pub const LAST_QUALITY_LEVEL: u8 = QUALITY_LEVELS.len() as u8 - 1;

const fn factors(
    rays: f32,
    paths: f32,
    orders_less: u8,
    late_interval: u64,
    predictor_steps: u8,
) -> QualityFactors {
    QualityFactors {
        guide_rays: rays,
        source_rays: rays,
        cache_updates: paths,
        paths,
        skipped_orders: orders_less,
        late_interval,
        predictor_steps,
    }
}

/// Distance in levels before a level at which the orders that it skips are silent: an update moves by
/// [`super::governor::MAX_LEVEL_STEP`] at most, so they have faded for at least one update.
const FADE_OUT_MARGIN: f64 = 0.25;

/// Settings in force at a position between two levels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActiveQuality {
    /// Settings of propagation.
    pub propagation: PropagationQuality,
    /// Greatest number of paths of an update.
    pub max_paths: usize,
    /// Gain of each order of reflection, from the direct path on.
    pub order_gain: [f32; MAX_ORDER + 1],
    /// `QualityFactors::predictor_steps`.
    pub predictor_steps: u8,
}

impl ActiveQuality {
    /// At a position between levels: 1.5 lies halfway from level 1 to level 2.
    pub fn at(position: f64, settings: &PropagationSettings, max_paths: usize) -> Self {
        let position = position.clamp(0.0, f64::from(LAST_QUALITY_LEVEL));
        let (below, part) = (position as usize, position.fract() as f32);
        let above = (below + 1).min(QUALITY_LEVELS.len() - 1);
        let (from, to) = (&QUALITY_LEVELS[below], &QUALITY_LEVELS[above]);
        // Geometric interpolation: equal steps change cost by equal factors.
        let scaled = |full: f64, factors: fn(&QualityFactors) -> f32| {
            let factors = factors(from) * (factors(to) / factors(from)).powf(part);
            (full * f64::from(factors)).round().max(1.0)
        };
        let guide_rays = scaled(settings.guide_rays.into(), |s| s.guide_rays) as u32;
        let source_rays = scaled(settings.source_rays.into(), |s| s.source_rays) as u32;
        Self {
            propagation: PropagationQuality {
                guide_rays,
                source_rays,
                depth: settings
                    .depth
                    .saturating_sub(usize::from(from.skipped_orders)),
                cache_updates: scaled(settings.cache_updates as f64, |s| s.cache_updates) as u64,
                late_interval: from.late_interval,
            },
            max_paths: scaled(max_paths as f64, |s| s.paths) as usize,
            order_gain: std::array::from_fn(|order| order_gain(position, order, settings.depth)),
            predictor_steps: from.predictor_steps,
        }
    }
}

/// Gain of a reflection order: falls from 1 to 0 before the first level that skips the order.
fn order_gain(position: f64, order: usize, depth: usize) -> f32 {
    let leaves_out = |factors: &QualityFactors| {
        order > depth.saturating_sub(usize::from(factors.skipped_orders))
    };
    let reflected = order > 0 && order <= depth;
    match QUALITY_LEVELS
        .iter()
        .position(leaves_out)
        .filter(|_| reflected)
    {
        Some(level) => ((level as f64 - FADE_OUT_MARGIN - position) / (1.0 - FADE_OUT_MARGIN))
            .clamp(0.0, 1.0) as f32,
        None => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: fn() -> PropagationSettings = PropagationSettings::default;

    #[test]
    fn the_first_level_is_full_and_levels_only_decrease() {
        let detail = |position: f64| ActiveQuality::at(position, &SETTINGS(), 2048);
        assert_eq!(
            detail(0.0).propagation,
            PropagationQuality::full(&SETTINGS())
        );
        assert_eq!(detail(0.0).order_gain, [1.0; MAX_ORDER + 1]);
        let mut last = detail(0.0);
        for step in 1..=500 {
            let next = detail(f64::from(step) * 0.01);
            assert!(next.propagation.guide_rays <= last.propagation.guide_rays);
            assert!(next.propagation.source_rays <= last.propagation.source_rays);
            assert!(next.propagation.depth <= last.propagation.depth);
            assert!(next.propagation.cache_updates <= last.propagation.cache_updates);
            assert!(next.propagation.late_interval >= last.propagation.late_interval);
            assert!(next.max_paths <= last.max_paths);
            assert!(next.predictor_steps >= last.predictor_steps);
            for order in 0..=MAX_ORDER {
                assert!(next.order_gain[order] <= last.order_gain[order]);
                // 0.01 of a level takes 0.0134 of the gain.
                assert!(last.order_gain[order] - next.order_gain[order] < 0.014);
            }
            last = next;
        }
    }

    #[test]
    fn an_order_is_silent_before_it_is_skipped() {
        for step in 0..=500 {
            let detail = ActiveQuality::at(f64::from(step) * 0.01, &SETTINGS(), 2048);
            for order in 1..=MAX_ORDER {
                assert!(detail.propagation.depth >= order || detail.order_gain[order] == 0.0);
            }
            assert_eq!(detail.order_gain[0], 1.0);
        }
        // It is silent one longest step before the level that skips it.
        let before = ActiveQuality::at(3.0 - FADE_OUT_MARGIN, &SETTINGS(), 2048);
        assert_eq!((before.propagation.depth, before.order_gain[4]), (4, 0.0));
    }

    #[test]
    fn levels_stay_within_a_shallow_depth() {
        let shallow = PropagationSettings {
            depth: 1,
            ..SETTINGS()
        };
        let least = ActiveQuality::at(5.0, &shallow, 4);
        assert_eq!((least.propagation.depth, least.max_paths), (0, 1));
        assert_eq!(least.order_gain[1], 0.0);
        assert_eq!(
            ActiveQuality::at(f64::NAN, &shallow, 4).propagation.depth,
            1
        );
    }
}
