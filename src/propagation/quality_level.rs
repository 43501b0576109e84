//! The part of its settings that a propagator uses. A budget lowers it; caches are kept.

use crate::propagation::settings::PropagationSettings;

/// Cost of the next updates, limited by the propagator's settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PropagationQuality {
    /// Guide rays, at least 1.
    pub guide_rays: u32,
    /// Source rays of each source, at least 1.
    pub source_rays: u32,
    /// Highest reflection order.
    pub depth: usize,
    /// Updates for which a sequence stays a candidate after it was valid.
    pub cache_updates: u64,
    /// Updates between two estimates of a source's late field, at least 1. Source rays, and with them candidates of the
    /// source's own, are due in one update of so many; sources take turns.
    pub late_interval: u64,
}

impl PropagationQuality {
    /// The highest quality that the settings allow.
    pub fn full(settings: &PropagationSettings) -> Self {
        Self {
            guide_rays: settings.guide_rays,
            source_rays: settings.source_rays,
            depth: settings.depth,
            cache_updates: settings.cache_updates,
            late_interval: 1,
        }
    }

    /// Limited by the settings, and at least the minimum of each field.
    pub(crate) fn within(self, settings: &PropagationSettings) -> Self {
        Self {
            guide_rays: self.guide_rays.clamp(1, settings.guide_rays),
            source_rays: self.source_rays.clamp(1, settings.source_rays),
            depth: self.depth.min(settings.depth),
            cache_updates: self.cache_updates.min(settings.cache_updates),
            late_interval: self.late_interval.max(1),
        }
    }

    /// The rotation of a source's rays if they are due in this update. All rotations occur at any interval.
    pub(crate) fn late_turn(&self, update: u64, slot: u64) -> Option<u64> {
        let turn = update + slot % self.late_interval;
        turn.is_multiple_of(self.late_interval)
            .then_some(turn / self.late_interval)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_source_gets_every_rotation_at_any_interval() {
        for late_interval in 1..=4 {
            let quality = PropagationQuality {
                late_interval,
                ..PropagationQuality::full(&PropagationSettings::default())
            };
            for slot in 0..5 {
                let turns: Vec<u64> = (0..16 * late_interval)
                    .filter_map(|update| quality.late_turn(update, slot))
                    .collect();
                assert_eq!(turns.len(), 16);
                assert!(turns.windows(2).all(|pair| pair[1] == pair[0] + 1));
            }
        }
        assert_eq!(
            PropagationQuality::full(&PropagationSettings::default()).late_turn(7, 3),
            Some(7)
        );
    }

    #[test]
    fn quality_stays_within_the_settings() {
        let settings = PropagationSettings::default();
        let wild = PropagationQuality {
            guide_rays: 0,
            source_rays: u32::MAX,
            depth: 99,
            cache_updates: u64::MAX,
            late_interval: 0,
        };
        let tame = wild.within(&settings);
        assert_eq!((tame.guide_rays, tame.late_interval), (1, 1));
        let same = PropagationQuality {
            guide_rays: 1,
            ..PropagationQuality::full(&settings)
        };
        assert_eq!(tame, same);
    }
}
