//! Matches the paths of two updates.

use crate::propagation::Path;

/// Writes to `matches` the index in `previous` of each path of `current`, both sorted by identity (the paper's section
/// III-D). Allocates only if `matches` lacks capacity.
pub fn match_by_id(current: &[Path], previous: &[Path], matches: &mut Vec<Option<u32>>) {
    matches.clear();
    let mut index = 0;
    for path in current {
        while index < previous.len() && previous[index].id < path.id {
            index += 1;
        }
        let is_match = previous.get(index).is_some_and(|p| p.id == path.id);
        matches.push(is_match.then_some(index as u32));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acoustics::BANDS;
    use crate::propagation::{MAX_DIFFRACTION_ORDER, MAX_ORDER, PathId};
    use crate::scene::SourceId;
    use glam::Vec3;

    fn path(id: u64) -> Path {
        Path {
            id: PathId(id),
            source: SourceId::default(),
            order: 1,
            diffraction_order: 0,
            surfaces: [0; MAX_ORDER],
            edges: [0; MAX_DIFFRACTION_ORDER],
            points: [Vec3::ZERO; MAX_ORDER],
            image: Vec3::ZERO,
            length_m: 1.0,
            amplitude: [0.0; BANDS],
        }
    }

    #[test]
    fn new_and_removed_paths_are_not_matched() {
        let current = [path(1), path(4), path(7)];
        let previous = [path(2), path(4), path(5), path(7), path(9)];
        let mut matches = Vec::new();
        match_by_id(&current, &previous, &mut matches);
        assert_eq!(matches, [None, Some(1), Some(3)]);
        match_by_id(&current, &[], &mut matches);
        assert_eq!(matches, [None, None, None]);
    }
}
