//! A limit on the number of paths of an update.

use std::cmp::Ordering;

use crate::propagation::Path;

/// Energy relative to the loudest dropped path below which kept paths are attenuated, against steps when ranks change:
/// 6 dB.
const FADE_RANGE: f32 = 4.0;

/// Drops the quietest paths beyond a limit, keeps paths sorted by id and returns the number dropped.
pub(crate) fn keep_loudest(paths: &mut Vec<Path>, most: usize) -> usize {
    let dropped = paths.len().saturating_sub(most);
    if dropped > 0 {
        paths.select_nth_unstable_by(most, by_energy);
        let silent = energy(&paths[most]).max(f32::MIN_POSITIVE);
        paths.truncate(most);
        for path in paths.iter_mut() {
            let over = energy(path) / silent;
            if over < FADE_RANGE {
                let gain = (over - 1.0) / (FADE_RANGE - 1.0);
                path.amplitude = path.amplitude.map(|a| a * gain.max(0.0));
            }
        }
        paths.sort_unstable_by_key(|path| path.id);
    }
    dropped
}

/// Drops the quietest nearby paths beyond a limit; keeps paths sorted by id. They are silent: none has to fade.
pub(crate) fn keep_loudest_nearby(paths: &mut Vec<Path>, most: usize) {
    if paths.len() > most {
        paths.select_nth_unstable_by(most, by_energy);
        paths.truncate(most);
        paths.sort_unstable_by_key(|path| path.id);
    }
}

fn energy(path: &Path) -> f32 {
    path.amplitude.iter().map(|a| a * a).sum()
}

/// The louder first, then by id.
fn by_energy(a: &Path, b: &Path) -> Ordering {
    let louder = energy(b).total_cmp(&energy(a));
    louder.then_with(|| a.id.cmp(&b.id))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::{MAX_DIFFRACTION_ORDER, MAX_ORDER, PathId};
    use crate::scene::SourceId;
    use glam::Vec3;

    fn path(number: u64, amplitude: f32) -> Path {
        Path {
            id: PathId(number),
            source: SourceId::default(),
            order: 1,
            diffraction_order: 0,
            edges: [0; MAX_DIFFRACTION_ORDER],
            surfaces: [0; MAX_ORDER],
            points: [Vec3::ZERO; MAX_ORDER],
            image: Vec3::ZERO,
            length_m: 1.0,
            amplitude: [amplitude; 8],
        }
    }

    #[test]
    fn a_path_fades_before_it_is_dropped() {
        let heard = |amplitude: f32| {
            let others = (1..6).map(|n| path(n, 0.1 + 0.2 * n as f32));
            let mut paths: Vec<Path> = others.chain([path(9, amplitude)]).collect();
            assert_eq!(keep_loudest(&mut paths, 4), 2);
            assert!(paths.is_sorted_by_key(|path| path.id));
            let found = paths.iter().find(|path| path.id == PathId(9));
            found.map_or(0.0, |path| path.amplitude[0])
        };
        let mut last = heard(0.3);
        assert_eq!(last, 0.0);
        for step in 1..=1000 {
            let next = heard(0.3 + 0.001 * step as f32);
            // 6 dB at the limit: at most three times the slope of the path itself.
            assert!((next - last).abs() < 0.005, "{last} to {next}");
            last = next;
        }
        assert_eq!(last, 1.3);
    }

    #[test]
    fn quality_is_unchanged_within_the_limit() {
        let mut paths: Vec<Path> = (0..4).map(|n| path(n, 0.5)).collect();
        let before = paths.clone();
        assert_eq!(keep_loudest(&mut paths, 4), 0);
        assert_eq!(paths, before);
    }
}
