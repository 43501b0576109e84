//! The mix of each source in a graphics frame: gains, strengths and the distance curve, applied to paths and late energy.
//!
//! Audio side; arithmetic. A change of a mix is smoothed over graphics frames, so a path's amplitude has no step at any graphics
//! rate; the Doppler strength moves delays, which generation glides or cross-fades. Without recorded frames
//! ([`MixSmoother::record`]) a mix applies at once. Own.

use glam::Vec3;

use crate::acoustics::{BANDS, BandArray};
use crate::extrapolation::frame::{FramePath, LateSend, PathKind};
use crate::propagation::amplitude::apply_directivity;
use crate::propagation::endpoints::Endpoints;
use crate::propagation::transmission::unoccluded_path;
use crate::propagation::{LATE_GROUPS, LateGroup};
use crate::scene::{DistanceCurve, ListenerPose, Scene, SourceId, SourceMix, SourcePose};

/// Time constant of gains and strengths in seconds.
const TIME_S: f64 = 0.04;
/// Remainder of a change that counts as none: −80 dB.
const NOTHING: f32 = 1e-4;
/// Duration in seconds of a cross-fade between two distance curves.
const CURVE_FADE_S: f64 = 0.08;
/// Largest compensation of the air's absorption in nepers: beyond it a path is inaudible anyway.
const MAX_AIR_NP: f32 = 40.0;

/// Nepers of energy in 60 dB.
const NEPERS_OF_60_DB: f32 = 13.815_511;
/// Bound for finite single precision, far above audible decays.
const MAX_ENERGY_PER_S: f32 = 1e30;

/// Values that are smoothed alike.
const SMOOTHED: [fn(&mut SourceMix) -> &mut f32; 7] = [
    |mix| &mut mix.direct_gain,
    |mix| &mut mix.reflections_gain,
    |mix| &mut mix.diffraction_gain,
    |mix| &mut mix.late_gain,
    |mix| &mut mix.occlusion,
    |mix| &mut mix.transmission,
    |mix| &mut mix.air_absorption,
];

/// A source's mix on its way to the pose's.
#[derive(Debug, Clone, Copy)]
struct SmoothedMix {
    id: SourceId,
    mix: SourceMix,
    /// The curve before, and its share, 1 to 0.
    previous: DistanceCurve,
    share: f32,
}

impl SmoothedMix {
    fn at(pose: &SourcePose) -> Self {
        Self {
            id: pose.id,
            mix: pose.settings.mix,
            previous: pose.settings.mix.distance,
            share: 0.0,
        }
    }

    fn advance(&mut self, target: &SourceMix, interval_s: f64) {
        let left = (-interval_s.max(0.0) / TIME_S).exp() as f32;
        let mut target = *target;
        for value in SMOOTHED {
            let to = *value(&mut target);
            let from = value(&mut self.mix);
            let change = (*from - to) * left;
            let is_there = change.abs() <= NOTHING * to.abs().max(1.0);
            *from = if is_there { to } else { to + change };
        }
        self.mix.doppler = target.doppler;
        // A further curve waits for the end of the cross-fade.
        if self.share == 0.0 && self.mix.distance != target.distance {
            self.previous = std::mem::replace(&mut self.mix.distance, target.distance);
            self.share = 1.0;
        }
        self.share = (self.share - (interval_s / CURVE_FADE_S) as f32).max(0.0);
    }
}

/// The mixes of all sources over graphics frames.
#[derive(Debug, Clone, Default)]
pub(super) struct MixSmoother {
    sources: Vec<SmoothedMix>,
}

impl MixSmoother {
    /// Reserves capacity for this many sources. Control side.
    pub(super) fn reserve(&mut self, sources: usize) {
        self.sources.reserve(sources);
    }

    /// Moves all mixes towards those of a graphics frame, `interval_s` after the frame before. A new source begins at its own.
    pub(super) fn record(&mut self, sources: &[SourcePose], interval_s: f64) {
        self.sources
            .retain(|own| sources.iter().any(|pose| pose.id == own.id));
        for pose in sources {
            match position(&self.sources, pose.id, |own| own.id) {
                Some(own) => self.sources[own].advance(&pose.settings.mix, interval_s),
                None => self.sources.push(SmoothedMix::at(pose)),
            }
        }
    }

    /// The mix of a source for a listener.
    pub(super) fn frame_mix(
        &self,
        pose: &SourcePose,
        listener: Vec3,
        min_distance_m: f64,
    ) -> FrameMix {
        let own = position(&self.sources, pose.id, |own| own.id);
        let own = own.map_or_else(|| SmoothedMix::at(pose), |own| self.sources[own]);
        let distance_m = pose.position.distance(listener);
        let ratio = |curve: &DistanceCurve| curve.ratio(distance_m, min_distance_m as f32);
        let (to, from) = (ratio(&own.mix.distance), ratio(&own.previous));
        let settings = &pose.settings;
        FrameMix {
            source: pose.id,
            mix: own.mix,
            distance_ratio: to + own.share * (from - to),
            flight_s: 0.0,
            is_physical: own.share == 0.0
                && own.mix == SourceMix::PHYSICAL
                && settings.mix == SourceMix::PHYSICAL,
        }
    }
}

/// Index of an element with this identity, likely that of its slot.
fn position<T>(list: &[T], id: SourceId, id_of: impl Fn(&T) -> SourceId) -> Option<usize> {
    let likely = list.get(id.slot()).filter(|own| id_of(own) == id);
    likely.map_or_else(
        || list.iter().position(|own| id_of(own) == id),
        |_| Some(id.slot()),
    )
}

/// A source's mix in one graphics frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameMix {
    pub(super) source: SourceId,
    pub(super) mix: SourceMix,
    /// Ratio of its distance curve to physics at its distance.
    pub(super) distance_ratio: f32,
    pub(super) is_physical: bool,
    /// Delay of direct sound in seconds; 0 where the Doppler strength is 1.
    pub(super) flight_s: f64,
}

/// The mix of a source in a list.
pub(super) fn find(mixes: &[FrameMix], source: SourceId) -> Option<&FrameMix> {
    position(mixes, source, |own| own.source).map(|own| &mixes[own])
}

impl FrameMix {
    /// Applies the strengths of occlusion and transmission to the direct paths of a source, the last of `paths` from index
    /// `first` on: `o·t·A + (1 − o)·F` with the path's amplitude A and that of the free field F. Given are whether `t` counts,
    /// and F of a wide source.
    pub(super) fn apply_to_direct(
        &self,
        scene: &Scene,
        endpoints: &Endpoints,
        listener: &ListenerPose,
        (is_blocked, wide_free): (bool, Option<&BandArray>),
        paths: &mut Vec<FramePath>,
        first: usize,
    ) {
        let SourceMix {
            occlusion,
            transmission,
            ..
        } = self.mix;
        let pose = &endpoints.source;
        if (occlusion == 1.0 && transmission == 1.0) || !pose.settings.effects.direct {
            return;
        }
        let through = if is_blocked { transmission } else { 1.0 };
        let (from, to) = (endpoints.from, endpoints.to);
        let mut free = unoccluded_path(scene, pose.id, from, to, endpoints.min_distance_m);
        match wide_free {
            Some(amplitude) => free.amplitude = *amplitude,
            None => apply_directivity(&mut free.amplitude, pose, to - from),
        }
        if !paths[first..].iter().any(|path| path.kind.is_straight()) {
            if occlusion == 1.0 {
                return;
            }
            let mut path = FramePath::of(&free, from, listener, scene);
            path.amplitude = [0.0; BANDS];
            path.kind = PathKind::Transmitted;
            paths.push(path);
        }
        let straight = paths[first..].iter_mut();
        let Some(path) = straight.into_iter().find(|path| path.kind.is_straight()) else {
            return;
        };
        for (value, free) in path.amplitude.iter_mut().zip(free.amplitude) {
            *value = occlusion * through * *value + (1.0 - occlusion) * free;
        }
    }

    /// Applies gains, curve, air and Doppler strength to a path.
    pub(super) fn apply(&self, path: &mut FramePath, scene: &Scene) {
        let mix = &self.mix;
        let part = match path.kind {
            PathKind::Direct | PathKind::Transmitted => mix.direct_gain,
            PathKind::Reflected => mix.reflections_gain,
            // Around an edge goes what the direct path lacks.
            PathKind::Diffracted if path.order == 0 => mix.diffraction_gain * mix.occlusion,
            PathKind::Diffracted => mix.diffraction_gain,
        };
        let gain = part * self.distance_ratio;
        for value in &mut path.amplitude {
            *value *= gain;
        }
        if mix.air_absorption < 1.0 {
            let length_m = (path.delay_s * scene.speed_of_sound_m_s()) as f32;
            let missing_m = (1.0 - mix.air_absorption) * length_m;
            for (value, np) in path.amplitude.iter_mut().zip(scene.air_np_per_m()) {
                *value *= (np * missing_m).min(MAX_AIR_NP).exp();
            }
            path.air_delay_s *= f64::from(mix.air_absorption);
        }
        path.delay_s = (path.delay_s + self.later_s()).max(0.0);
    }

    /// Applies gain, curve and Doppler strength to a late send.
    pub(super) fn apply_to_late(&self, send: &mut LateSend, groups: &[LateGroup; LATE_GROUPS]) {
        let gain = self.mix.late_gain * self.distance_ratio;
        let start_s = (send.start_s + self.later_s() as f32).max(0.0);
        let later_s = start_s - send.start_s;
        let decay_time_s = groups.get(usize::from(send.group));
        for (b, energy) in send.energy_per_s.iter_mut().enumerate() {
            *energy *= gain * gain;
            // Extrapolated back to emission: with another start, the energy at the start stays.
            if let Some(group) = decay_time_s.filter(|_| later_s != 0.0) {
                *energy *= (NEPERS_OF_60_DB * later_s / group.decay_time_s[b].max(1e-3)).exp();
                *energy = energy.min(MAX_ENERGY_PER_S);
            }
        }
        send.start_s = start_s;
    }

    /// How much later all sound of the source arrives than by physics.
    fn later_s(&self) -> f64 {
        (f64::from(self.mix.doppler) - 1.0) * self.flight_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::DistanceTable;

    fn pose(mix: SourceMix) -> SourcePose {
        let mut pose = SourcePose::at(SourceId::new(0, 1), Vec3::X * 8.0);
        pose.settings.mix = mix;
        pose
    }

    #[test]
    fn changes_take_many_frames_and_arrive() {
        let table = DistanceTable::new(&[[0.0, 0.0]]).expect("is a table");
        let changed = SourceMix {
            direct_gain: 0.0,
            occlusion: 0.0,
            distance: DistanceCurve::Table(table),
            ..SourceMix::PHYSICAL
        };
        let mut smoother = MixSmoother::default();
        smoother.record(&[pose(SourceMix::PHYSICAL)], 0.0);
        let first = smoother.frame_mix(&pose(SourceMix::PHYSICAL), Vec3::ZERO, 0.3);
        assert!(first.is_physical && first.distance_ratio == 1.0);
        let (mut gain, mut ratio) = (1.0, 1.0);
        let frame_s = 1.0 / 120.0;
        for frame in 0..60 {
            smoother.record(&[pose(changed)], frame_s);
            let now = smoother.frame_mix(&pose(changed), Vec3::ZERO, 0.3);
            // The steepest frame of each: 1 − exp(−Δt / τ), and Δt over the cross-fade.
            assert!(gain - now.mix.direct_gain <= 0.19, "{frame}: {gain}");
            assert!(ratio - now.distance_ratio <= 0.11, "{frame}: {ratio}");
            (gain, ratio) = (now.mix.direct_gain, now.distance_ratio);
        }
        assert_eq!((gain, ratio), (0.0, 0.0));
        assert_eq!(smoother.sources[0].mix, changed);
    }

    #[test]
    fn a_curve_follows_the_distance_at_once() {
        let mix = SourceMix {
            distance: DistanceCurve::Inverse {
                min_m: 1.0,
                max_m: 4.0,
            },
            ..SourceMix::PHYSICAL
        };
        let mut smoother = MixSmoother::default();
        smoother.record(&[pose(mix)], 0.01);
        let ratio = |ear: Vec3| smoother.frame_mix(&pose(mix), ear, 0.3).distance_ratio;
        assert_eq!(ratio(Vec3::ZERO), 2.0);
        assert_eq!(ratio(Vec3::X * 5.0), 1.0);
    }
}
