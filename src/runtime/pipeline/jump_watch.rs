//! Notices on the app's thread that a listener or a source was put elsewhere.
//!
//! Control side. Only what [`super::jumps`] takes for a jump in any case counts: an update that is interrupted for nothing would
//! have to begin again.

use glam::Vec3;

use crate::runtime::pipeline::jumps::MIN_JUMP_M;
use crate::runtime::pipeline::motion_model::MAX_SPEED_M_S;
use crate::scene::{SourceId, SourcePose};

/// Positions in the last graphics frame.
#[derive(Debug, Default)]
pub(crate) struct JumpWatch {
    time_s: f64,
    ears: Vec<Vec3>,
    sources: Vec<(SourceId, Vec3)>,
}

impl JumpWatch {
    /// Takes a graphics frame; returns whether a listener or a source was put elsewhere since the one before.
    pub(crate) fn observe(
        &mut self,
        time_s: f64,
        ears: impl Iterator<Item = Vec3>,
        sources: &[SourcePose],
    ) -> bool {
        let least_m = MIN_JUMP_M.max((MAX_SPEED_M_S * (time_s - self.time_s)) as f32);
        self.time_s = time_s;
        let mut has_jumped = false;
        for (index, ear) in ears.enumerate() {
            match self.ears.get_mut(index) {
                Some(before) => {
                    has_jumped |= std::mem::replace(before, ear).distance(ear) > least_m
                }
                None => self.ears.push(ear),
            }
        }
        for (index, pose) in sources.iter().enumerate() {
            let likely = self.sources.get(index).filter(|(id, _)| *id == pose.id);
            let found = likely.or_else(|| self.sources.iter().find(|(id, _)| *id == pose.id));
            has_jumped |= found.is_some_and(|(_, before)| before.distance(pose.position) > least_m);
        }
        self.sources.clear();
        self.sources
            .extend(sources.iter().map(|pose| (pose.id, pose.position)));
        has_jumped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ID: SourceId = SourceId::new(0, 1);

    #[test]
    fn only_what_no_motion_reaches_is_a_jump() {
        let mut watch = JumpWatch::default();
        let mut after_s = 0.0;
        let mut observe = |ear: f32, source: f32, frame_s: f64| {
            after_s += frame_s;
            let sources = [SourcePose::at(ID, Vec3::X * source)];
            watch.observe(after_s, [Vec3::Y * ear].into_iter(), &sources)
        };
        assert!(!observe(0.0, 500.0, 1.0 / 60.0), "the first frame");
        assert!(!observe(0.9, 500.0, 1.0 / 60.0), "less than a metre");
        assert!(!observe(0.9, 507.0, 0.2), "35 m/s");
        assert!(observe(0.9, 510.0, 1.0 / 60.0), "the source");
        assert!(observe(4.0, 510.0, 1.0 / 60.0), "the listener");
        assert!(!observe(4.0, 510.0, 1.0 / 60.0), "at rest");
    }
}
