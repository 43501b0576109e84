//! Lengths of the delay lines by need, as propagation knows them.

use crate::generation::{GeneratorSettings, LongerLine, first_longest_s};
use crate::propagation::PathSet;
use crate::propagation::diffuse::envelope::LATE_SEGMENT_STARTS;

/// Seconds that a line is longer at least than what an update needs: paths change until the next update.
const RESERVE_S: f64 = 0.01;

/// Reserves that a line which becomes longer has: segments are a little more.
const RESERVES: f64 = 2.0;

/// Lengths of all lines in seconds, as known to propagation.
#[derive(Debug)]
pub(crate) struct LineLengths {
    settings: GeneratorSettings,
    /// By slot: what the line has, and what the update needs.
    lines_s: Vec<[f64; 2]>,
}

impl LineLengths {
    /// Those of a new engine.
    pub(crate) fn new(settings: &GeneratorSettings) -> Self {
        Self {
            lines_s: vec![[first_longest_s(settings), 0.0]; settings.max_sources],
            settings: settings.clone(),
        }
    }

    /// Adds to `longer` what the line of every source lacks that an update has too long a path for, or late energy. An update has a set of
    /// paths for each listener.
    pub(crate) fn grow<'a>(
        &mut self,
        updates: impl Iterator<Item = &'a PathSet>,
        speed_m_s: f64,
        longer: &mut Vec<LongerLine>,
    ) {
        for [_, needed_s] in &mut self.lines_s {
            *needed_s = 0.0;
        }
        for update in updates {
            self.collect_needs(update, speed_m_s);
        }
        let most_s = self.settings.max_delay_s;
        for (slot, [line_s, needed_s]) in self.lines_s.iter_mut().enumerate() {
            let is_short = *needed_s + RESERVE_S > *line_s && *line_s < most_s;
            if is_short {
                let wanted_s = (*needed_s + RESERVES * RESERVE_S).min(most_s);
                longer.push(LongerLine::new(slot, [*line_s, wanted_s], &self.settings));
                *line_s = wanted_s;
            }
        }
    }

    fn collect_needs(&mut self, update: &PathSet, speed_m_s: f64) {
        let paths = update.paths.iter().chain(&update.nearby);
        let paths = paths.map(|path| (path.source, f64::from(path.length_m) / speed_m_s));
        let straight = update.sources.iter().map(|pose| {
            let length_m = pose.position.distance(update.listener.position);
            (pose.id, f64::from(length_m) / speed_m_s)
        });
        let late = update.late.iter().chain(&update.predicted_late);
        let late = late.map(|late| {
            let energies = late.energy.as_flattened().iter();
            let starts = energies.zip(LATE_SEGMENT_STARTS.as_flattened());
            let heard = starts.filter(|(energy, _)| energy.iter().any(|energy| *energy > 0.0));
            let last = heard.fold(0.0f64, |last, (_, start)| last.max(*start));
            let after_s = last * f64::from(late.mean_free_time_s);
            (late.source, f64::from(late.start_s) + after_s)
        });
        for (source, delay_s) in paths.chain(straight).chain(late) {
            if let Some([_, needed_s]) = self.lines_s.get_mut(source.slot())
                && delay_s.is_finite()
            {
                *needed_s = needed_s.max(delay_s);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{SourceId, SourcePose};
    use glam::Vec3;

    /// An update with a source at each distance.
    fn update(distances_m: &[f32]) -> PathSet {
        let pose = |(slot, x): (u16, &f32)| SourcePose::at(SourceId::new(slot, 0), Vec3::X * *x);
        PathSet {
            sources: (0..).zip(distances_m).map(pose).collect(),
            ..PathSet::default()
        }
    }

    fn grown(lengths: &mut LineLengths, distances_m: &[f32]) -> Vec<(usize, f64)> {
        let mut longer = Vec::new();
        lengths.grow([update(distances_m)].iter(), 340.0, &mut longer);
        longer
            .iter()
            .map(|line| (line.slot, line.longest_s))
            .collect()
    }

    #[test]
    fn lines_grow_with_the_paths_and_no_further_than_the_settings_allow() {
        let settings = GeneratorSettings {
            max_delay_s: 1.0,
            ..GeneratorSettings::default()
        };
        let mut lengths = LineLengths::new(&settings);
        assert_eq!(grown(&mut lengths, &[34.0, 47.0]), []);
        let longer = grown(&mut lengths, &[34.0, 170.0]);
        let [(1, longest_s)] = longer[..] else {
            panic!("{longer:?}");
        };
        assert!((0.519..0.521).contains(&longest_s), "{longest_s}");
        // It is known to be longer now, and walks a while without another.
        assert_eq!(grown(&mut lengths, &[34.0, 173.0]), []);
        assert_eq!(grown(&mut lengths, &[34.0, 3400.0]), [(1, 1.0)]);
        assert_eq!(grown(&mut lengths, &[34.0, 6800.0]), []);
        assert_eq!(grown(&mut lengths, &[f32::NAN, 34.0]), []);
    }

    #[test]
    fn an_update_brings_all_that_its_lines_lack() {
        let settings = GeneratorSettings {
            max_sources: 64,
            ..GeneratorSettings::default()
        };
        let mut lengths = LineLengths::new(&settings);
        assert_eq!(grown(&mut lengths, &[170.0; 64]).len(), 64);
        assert_eq!(grown(&mut lengths, &[170.0; 64]), []);
    }
}
