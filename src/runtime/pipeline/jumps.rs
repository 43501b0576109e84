//! Jumps of listener and sources, and the updates that follow them.
//!
//! Control side. Nobody predicts where a teleport leads: what is under way for the old position is dropped. A first update has
//! what is found soonest at the new one, late energy and first reflections at planes, an urgent one edges and second order, a
//! plain update the other reflections at planes, and whole updates go on from there. Where sources alone have jumped, what is
//! remembered around the listener has nearly all of their reflections, and the rest of their late energy comes instead.

use crate::extrapolation::PredictorKind;
use crate::propagation::UpdateScope;
use crate::runtime::pipeline::motion_model::has_jumped;
use crate::runtime::pipeline::pose_history::{PoseFrame, PoseHistory};
use crate::scene::{SourceId, SourcePose};

/// Highest reflection order of the first update after a jump. All come from rays that are remembered.
const FIRST_ORDER: usize = 1;

/// Highest reflection order, number of guide rays and of sequences of an urgent update for another listener position.
const URGENT_ORDER: usize = 2;
const URGENT_GUIDE_RAYS: u32 = 128;
const URGENT_CANDIDATES: usize = 512;

/// Least distance in metres of a jump. Positions that come in smaller steps, by a network, are motion.
pub(crate) const MIN_JUMP_M: f32 = 1.0;

/// What an update searches for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum UpdateKind {
    /// Everything.
    #[default]
    Whole,
    /// After a jump: late energy, and first reflections at planes that remembered rays have hit.
    First,
    /// Then, at another listener position: edges and low orders.
    Urgent,
    /// Then: late energy and all reflections at planes, without nearby paths and late energy along the way.
    Plain,
    /// After a first update for sources alone: their edges, and reflections that are remembered around the listener.
    UrgentSources,
    /// Then: their late energy by all ray rotations.
    LateSources,
}

impl UpdateKind {
    /// The kind of the update after this one, without another jump.
    pub(crate) fn next(self) -> Self {
        match self {
            Self::First => Self::Urgent,
            Self::Urgent => Self::Plain,
            Self::UrgentSources => Self::LateSources,
            Self::Plain | Self::LateSources | Self::Whole => Self::Whole,
        }
    }

    /// The kind of the update after this one and a jump. All reflections take their turn, however often something jumps.
    pub(crate) fn next_after_jump(self) -> Self {
        match self {
            Self::First => Self::Urgent,
            Self::Urgent | Self::UrgentSources => Self::Plain,
            Self::Plain | Self::LateSources | Self::Whole => Self::First,
        }
    }

    /// Time of an update relative to a whole one for the same predictor, from instructions in the concert hall with 4 and with 16
    /// sources: for another listener position first 0.13 and 0.15, urgent 0.29 and 0.39, plain 0.65 and 0.51; for a source
    /// urgent 0.19 and 0.07, its late energy 0.92 and 0.40. Among few sources that takes longer than a whole update.
    pub(crate) fn share(self, predictor: PredictorKind, sources: usize) -> f64 {
        let share = match self {
            Self::Whole => return 1.0,
            Self::First => 0.12 + 0.0016 * sources as f64,
            Self::Urgent => 0.25 + 0.0092 * sources as f64,
            Self::Plain => 0.66,
            Self::UrgentSources => 7.9 / (20.0 + 5.6 * sources as f64),
            Self::LateSources => (37.0 + 0.4 * sources as f64) / (20.0 + 5.6 * sources as f64),
        };
        let most = match self {
            Self::LateSources => f64::INFINITY,
            _ => 1.0,
        };
        // Whole updates for the others have no nearby paths: counted, they take 0.63 of the time with one source, 0.75 with 16.
        match predictor {
            PredictorKind::Geometric(_) => share.min(most),
            PredictorKind::Hold | PredictorKind::Linear => (1.4 * share).min(most),
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
            (0..new).any(|age| {
                let ends = history.get(age).zip(history.get(age + 1));
                let ends = ends.and_then(|(now, before)| position(now).zip(position(before)));
                let is_far = ends.is_some_and(|(now, before)| now.distance(before) >= MIN_JUMP_M);
                is_far && has_jumped(history, age, position)
            })
        };
        let each = sources.iter().enumerate();
        let jumped =
            each.filter(|(index, pose)| any(&|frame: &PoseFrame| frame.source(pose.id, *index)));
        Self {
            listener: any(&|frame: &PoseFrame| Some(frame.listener)),
            sources: jumped.map(|(_, pose)| pose.id).collect(),
        }
    }

    /// Whether nothing has jumped.
    pub(crate) fn is_empty(&self) -> bool {
        !self.listener && self.sources.is_empty()
    }

    /// The scope of an update of a kind after these jumps, and those `before` that only smaller ones have followed yet.
    pub(crate) fn scope(self, kind: UpdateKind, before: &Self) -> UpdateScope {
        let whole = UpdateScope::default();
        match kind {
            UpdateKind::Urgent => UpdateScope {
                max_order: Some(URGENT_ORDER),
                guide_rays: Some(URGENT_GUIDE_RAYS),
                max_candidates: Some(URGENT_CANDIDATES),
                skips_late: true,
                jumped: self.sources,
                ..whole
            },
            UpdateKind::UrgentSources => UpdateScope {
                sources: Some([&self.sources[..], &before.sources].concat()),
                guide_rays: Some(0),
                skips_late: true,
                jumped: self.sources,
                ..whole
            },
            UpdateKind::First => UpdateScope {
                sources: (!self.listener).then(|| self.sources.clone()),
                max_order: Some(FIRST_ORDER),
                guide_rays: Some(0),
                only_planes: true,
                jumped: self.sources,
                ..whole
            },
            UpdateKind::LateSources => UpdateScope {
                sources: Some(Vec::new()),
                guide_rays: Some(0),
                max_candidates: Some(0),
                late_sources: before.sources.len().max(1),
                jumped: self.sources,
                ..whole
            },
            UpdateKind::Plain => UpdateScope {
                only_planes: true,
                jumped: self.sources,
                ..whole
            },
            UpdateKind::Whole => UpdateScope {
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
    fn steps_of_a_network_are_motion() {
        let mut history = PoseHistory::default();
        let mut sources = Vec::new();
        for frame in 0..20 {
            // 2 m/s, ten positions a second.
            let at = Vec3::X * 0.2 * (frame / 8) as f32;
            sources = vec![SourcePose::at(IDS[0], at)];
            history.push(f64::from(frame) / 75.0, &ListenerPose::default(), &sources);
        }
        assert!(Jumps::after(0.0, &history, &sources).is_empty());
    }

    #[test]
    fn every_kind_follows_in_turn_and_none_is_free() {
        let after = |mut kind: UpdateKind| {
            let mut kinds = Vec::new();
            while kind != UpdateKind::Whole {
                for predictor in PredictorKind::ALL {
                    for sources in [1, 4, 64] {
                        let share = kind.share(predictor, sources);
                        let is_late = kind == UpdateKind::LateSources;
                        assert!(share > 0.0 && (share <= 1.0 || is_late), "{kind:?} {share}");
                    }
                }
                kinds.push(kind);
                kind = kind.next();
            }
            kinds
        };
        assert_eq!(
            after(UpdateKind::Whole.next_after_jump()),
            [UpdateKind::First, UpdateKind::Urgent, UpdateKind::Plain]
        );
        assert_eq!(
            after(UpdateKind::UrgentSources),
            [UpdateKind::UrgentSources, UpdateKind::LateSources]
        );
        assert_eq!(
            UpdateKind::UrgentSources.next_after_jump(),
            UpdateKind::Plain
        );
        assert_eq!(UpdateKind::First.next_after_jump(), UpdateKind::Urgent);
        assert_eq!(UpdateKind::Urgent.next_after_jump(), UpdateKind::Plain);
    }

    #[test]
    fn an_urgent_update_after_a_source_jump_is_for_that_source_alone() {
        let jumps = found(None, Some(9), 2);
        let none = Jumps::default();
        // A first update has followed the jump.
        assert_eq!(
            jumps.clone().scope(UpdateKind::First, &none).jumped,
            IDS[1..]
        );
        let scope = none.clone().scope(UpdateKind::UrgentSources, &jumps);
        assert!(scope.jumped.is_empty());
        assert!(scope.has_source(IDS[1]) && !scope.has_source(IDS[0]));
        // Two that have jumped share the rotations.
        let scope = none.clone().scope(UpdateKind::LateSources, &jumps);
        assert_eq!(scope.late_sources, 1);
        let both = Jumps {
            sources: IDS.to_vec(),
            ..none.clone()
        };
        let scope = none.clone().scope(UpdateKind::LateSources, &both);
        assert_eq!(scope.late_sources, 2);
        assert!(IDS.iter().all(|id| !scope.has_source(*id)) && !scope.skips_late);
        let plain = jumps.clone().scope(UpdateKind::Plain, &none);
        assert!(plain.only_planes && IDS.iter().all(|id| plain.has_source(*id)));
        let whole = jumps.scope(UpdateKind::Whole, &none);
        assert!(whole.is_whole() && whole.jumped == IDS[1..]);
    }

    #[test]
    fn a_first_update_searches_for_what_has_jumped() {
        let none = Jumps::default();
        let source = found(None, Some(9), 2).scope(UpdateKind::First, &none);
        assert!(source.has_source(IDS[1]) && !source.has_source(IDS[0]));
        let listener = found(Some(7), None, 6).scope(UpdateKind::First, &none);
        assert!(IDS.iter().all(|id| listener.has_source(*id)));
        for scope in [source, listener] {
            assert_eq!((scope.max_order, scope.guide_rays), (Some(1), Some(0)));
            assert!(scope.only_planes && !scope.skips_late && !scope.is_whole());
        }
    }
}
