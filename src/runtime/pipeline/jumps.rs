//! Jumps of listener and sources, and the updates that follow them.
//!
//! Control side. Nobody predicts where a teleport leads: what is under way for the old position is dropped. An urgent update
//! has what is found soonest at the new one, a plain update the rest, and whole updates go on from there.

use crate::extrapolation::PredictorKind;
use crate::propagation::UpdateScope;
use crate::runtime::pipeline::motion_model::has_jumped;
use crate::runtime::pipeline::pose_history::{PoseFrame, PoseHistory};
use crate::scene::{SourceId, SourcePose};

/// Highest reflection order and number of guide rays of an urgent update for another listener position.
const URGENT_ORDER: usize = 2;
const URGENT_GUIDE_RAYS: u32 = 256;

/// What an update searches for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum UpdateKind {
    /// Everything.
    #[default]
    Whole,
    /// After a jump: edges, low orders and late energy; for a source alone what is remembered around the listener.
    Urgent,
    /// After an urgent one: everything without nearby paths and late energy along the way.
    Plain,
}

impl UpdateKind {
    /// The kind of the update after this one.
    pub(crate) fn next(self) -> Self {
        match self {
            Self::Urgent => Self::Plain,
            Self::Plain | Self::Whole => Self::Whole,
        }
    }

    /// Time of an update relative to a whole one for the same predictor; measured in the concert hall.
    pub(crate) fn share(self, predictor: PredictorKind) -> f64 {
        match (self, predictor) {
            (Self::Whole, _) | (Self::Plain, PredictorKind::Hold | PredictorKind::Linear) => 1.0,
            (Self::Plain, PredictorKind::Geometric(_)) => 0.38,
            (Self::Urgent, PredictorKind::Hold | PredictorKind::Linear) => 0.5,
            (Self::Urgent, PredictorKind::Geometric(_)) => 0.15,
        }
    }
}

/// Who has jumped.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Jumps {
    pub(crate) listener: bool,
    pub(crate) sources: Vec<SourceId>,
}

impl Jumps {
    /// Jumps in the graphics frames after a time in seconds, of the listener and the sources of the newest frame.
    pub(crate) fn after(time_s: f64, history: &PoseHistory, sources: &[SourcePose]) -> Self {
        let frames = || (0..).map_while(|age| history.get(age));
        let new = frames().take_while(|frame| frame.time_s > time_s).count();
        let any = |position: &dyn Fn(&PoseFrame) -> Option<glam::Vec3>| {
            (0..new).any(|age| has_jumped(history, age, position))
        };
        let each = sources.iter().enumerate();
        let jumped = each.filter(|(index, pose)| any(&|frame| frame.source(pose.id, *index)));
        Self {
            listener: any(&|frame| Some(frame.listener)),
            sources: jumped.map(|(_, pose)| pose.id).collect(),
        }
    }

    /// Whether nothing has jumped.
    pub(crate) fn is_empty(&self) -> bool {
        !self.listener && self.sources.is_empty()
    }

    /// The scope of an update of a kind after these jumps.
    pub(crate) fn scope(self, kind: UpdateKind) -> UpdateScope {
        let whole = UpdateScope::default();
        match (kind, self.listener) {
            (UpdateKind::Urgent, true) => UpdateScope {
                max_order: Some(URGENT_ORDER),
                guide_rays: Some(URGENT_GUIDE_RAYS),
                jumped: self.sources,
                ..whole
            },
            (UpdateKind::Urgent, false) => UpdateScope {
                sources: Some(self.sources.clone()),
                guide_rays: Some(0),
                jumped: self.sources,
                ..whole
            },
            (UpdateKind::Plain | UpdateKind::Whole, _) => UpdateScope {
                jumped: self.sources,
                ..whole
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::ListenerPose;
    use glam::Vec3;

    const IDS: [SourceId; 2] = [SourceId::new(0, 1), SourceId::new(1, 1)];

    /// Ten graphics frames in which the listener and the second source are put elsewhere, if at all.
    fn poses(listener: Option<u32>, source: Option<u32>) -> (PoseHistory, Vec<SourcePose>) {
        let mut history = PoseHistory::default();
        let mut sources = Vec::new();
        for frame in 0..10 {
            let put = |when: Option<u32>| {
                Vec3::X
                    * if when.is_some_and(|at| frame >= at) {
                        5.0
                    } else {
                        0.0
                    }
            };
            let listener = ListenerPose::facing(put(listener) + Vec3::Z * 0.02 * frame as f32, 0.0);
            sources = vec![
                SourcePose::at(IDS[0], Vec3::Y),
                SourcePose::at(IDS[1], put(source)),
            ];
            history.push(f64::from(frame) / 75.0, &listener, &sources);
        }
        (history, sources)
    }

    fn found(listener: Option<u32>, source: Option<u32>, since: u32) -> Jumps {
        let (history, sources) = poses(listener, source);
        Jumps::after(f64::from(since) / 75.0, &history, &sources)
    }

    #[test]
    fn jumps_since_the_last_update_count_each_alone() {
        assert!(found(None, None, 3).is_empty());
        let listener = found(Some(7), None, 6);
        assert!(listener.listener && listener.sources.is_empty());
        assert!(
            found(Some(7), None, 7).is_empty(),
            "it began after the jump"
        );
        let source = found(None, Some(9), 2);
        assert_eq!((source.listener, &source.sources[..]), (false, &IDS[1..]));
    }

    #[test]
    fn an_urgent_update_after_a_source_jump_is_for_that_source_alone() {
        let scope = found(None, Some(9), 2).scope(UpdateKind::Urgent);
        assert!(scope.has_source(IDS[1]) && !scope.has_source(IDS[0]));
        let whole = found(None, Some(9), 2).scope(UpdateKind::Plain);
        assert!(whole.is_whole() && whole.jumped == IDS[1..]);
    }
}
