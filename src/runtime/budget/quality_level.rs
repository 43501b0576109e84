//! Tiers of detail, and what lies between two of them.

use crate::propagation::{MAX_ORDER, PropagationQuality, PropagationSettings};

/// A tier of detail: 0 is everything, higher numbers are less.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct QualityLevel(pub u8);

/// What a tier has of each setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QualityFactors {
    /// Of guide rays.
    pub guide_rays: f32,
    /// Of source rays.
    pub source_rays: f32,
    /// Of the updates for which valid sequences are tried again.
    pub cache_updates: f32,
    /// Of the most paths.
    pub paths: f32,
    /// Orders of reflection below the settings' depth.
    pub skipped_orders: u8,
    /// Updates between two looks at a source's late field.
    pub late_interval: u64,
}

/// The tiers: rays go first, then how often the late field is looked at, orders last. What each costs in a scene the
/// governor learns; `bench speed --tier N` tells.
pub const QUALITY_LEVELS: [QualityFactors; 6] = [
    share(1.0, 1.0, 0, 1),
    share(0.7, 0.7, 0, 1),
    share(0.5, 0.5, 0, 2),
    share(0.35, 0.5, 1, 3),
    share(0.25, 0.35, 2, 4),
    share(0.12, 0.25, 3, 4),
];

/// The number of the last tier.
pub const LAST_QUALITY_LEVEL: u8 = QUALITY_LEVELS.len() as u8 - 1;

const fn share(rays: f32, paths: f32, orders_less: u8, late_interval: u64) -> QualityFactors {
    QualityFactors {
        guide_rays: rays,
        source_rays: rays,
        cache_updates: paths,
        paths,
        skipped_orders: orders_less,
        late_interval,
    }
}

/// How far before a tier's number the orders that it leaves out are silent: they have faded for at least one update when
/// propagation stops looking for them, since no update moves farther than [`super::governor::MAX_LEVEL_STEP`].
const FADE_OUT_MARGIN: f64 = 0.25;

/// What is in force somewhere between two tiers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActiveQuality {
    /// For propagation.
    pub propagation: PropagationQuality,
    /// Most paths of an update.
    pub max_paths: usize,
    /// Gain of each order of reflection, from the direct path on.
    pub order_gain: [f32; MAX_ORDER + 1],
}

impl ActiveQuality {
    /// At a place between tiers: 1.5 lies halfway from tier 1 to tier 2.
    pub fn at(place: f64, settings: &PropagationSettings, max_paths: usize) -> Self {
        let place = place.clamp(0.0, f64::from(LAST_QUALITY_LEVEL));
        let (below, part) = (place as usize, place.fract() as f32);
        let above = (below + 1).min(QUALITY_LEVELS.len() - 1);
        let (from, to) = (&QUALITY_LEVELS[below], &QUALITY_LEVELS[above]);
        // Geometric, so that each step is the same for the ear and for the cost.
        let scaled = |full: f64, share: fn(&QualityFactors) -> f32| {
            let share = share(from) * (share(to) / share(from)).powf(part);
            (full * f64::from(share)).round().max(1.0)
        };
        let guide_rays = scaled(settings.guide_rays.into(), |s| s.guide_rays) as u32;
        let source_rays = scaled(settings.source_rays.into(), |s| s.source_rays) as u32;
        Self {
            propagation: PropagationQuality {
                guide_rays,
                source_rays,
                depth: settings.depth.saturating_sub(usize::from(from.skipped_orders)),
                cache_updates: scaled(settings.cache_updates as f64, |s| s.cache_updates) as u64,
                late_interval: from.late_interval,
            },
            max_paths: scaled(max_paths as f64, |s| s.paths) as usize,
            order_gain: std::array::from_fn(|order| order_gain(place, order, settings.depth)),
        }
    }
}

/// Gain of an order of reflection: it falls from 1 to 0 on the way to the first tier that leaves the order out.
fn order_gain(place: f64, order: usize, depth: usize) -> f32 {
    let leaves_out =
        |share: &QualityFactors| order > depth.saturating_sub(usize::from(share.skipped_orders));
    let reflected = order > 0 && order <= depth;
    match QUALITY_LEVELS
        .iter()
        .position(leaves_out)
        .filter(|_| reflected)
    {
        Some(tier) => ((tier as f64 - FADE_OUT_MARGIN - place) / (1.0 - FADE_OUT_MARGIN))
            .clamp(0.0, 1.0) as f32,
        None => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: fn() -> PropagationSettings = PropagationSettings::default;

    #[test]
    fn the_first_tier_is_everything_and_no_other_has_more_than_its_forerunner() {
        let detail = |place: f64| ActiveQuality::at(place, &SETTINGS(), 2048);
        assert_eq!(detail(0.0).propagation, PropagationQuality::full(&SETTINGS()));
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
            for order in 0..=MAX_ORDER {
                assert!(next.order_gain[order] <= last.order_gain[order]);
                // 0.01 of a tier's way takes 0.0134 of the gain.
                assert!(last.order_gain[order] - next.order_gain[order] < 0.014);
            }
            last = next;
        }
    }

    #[test]
    fn an_order_is_silent_before_it_is_left_out() {
        for step in 0..=500 {
            let detail = ActiveQuality::at(f64::from(step) * 0.01, &SETTINGS(), 2048);
            for order in 1..=MAX_ORDER {
                assert!(detail.propagation.depth >= order || detail.order_gain[order] == 0.0);
            }
            assert_eq!(detail.order_gain[0], 1.0);
        }
        // An update's longest step before it is left out, it is silent already.
        let before = ActiveQuality::at(3.0 - FADE_OUT_MARGIN, &SETTINGS(), 2048);
        assert_eq!((before.propagation.depth, before.order_gain[4]), (4, 0.0));
    }

    #[test]
    fn a_shallow_depth_stays_within_itself() {
        let shallow = PropagationSettings {
            depth: 1,
            ..SETTINGS()
        };
        let least = ActiveQuality::at(5.0, &shallow, 4);
        assert_eq!((least.propagation.depth, least.max_paths), (0, 1));
        assert_eq!(least.order_gain[1], 0.0);
        assert_eq!(ActiveQuality::at(f64::NAN, &shallow, 4).propagation.depth, 1);
    }
}
