//! The predictor `best`: exact geometry in every graphics frame, visibility by a few rays.
//!
//! Runs on the sound thread. Takes updates as they arrive, gives the reflected and bent paths of each graphics frame
//! (less the direct field's, which every predictor has anew). Bounded by
//! the number of candidates and by [`BestSettings::rays_per_source`]; allocates only while there are more candidates
//! than ever before, and not at all once bounded. Own work, after the measurements that ARCHITECTURE.md tells of: between two updates the stale delay
//! of a path does the most harm, its stale visibility comes second, its amplitude last.
//!
//! - [`candidate`]: one path as it stands now, from its surfaces and today's poses;
//! - [`groundwork`]: what can be worked out about an update before it is taken;
//! - [`memory`]: candidates from update to update, and whose word on visibility counts;
//! - [`history`]: where the listener was, so that an update's word can be dated;
//! - [`rays`]: which candidates are asked whether something blocks them;
//! - `tail`: the late field between two updates.

pub mod candidate;
pub mod groundwork;
pub mod history;
pub mod memory;
pub mod rays;
pub mod settings;
mod tail;

use super::extrapolator::is_wanted;
use super::frame::FramePath;
use super::posed::has_moved;
use crate::propagation::PathSet;
use crate::propagation::diffraction::{MOST_DOUBLE, MOST_MIRRORED, Spot};
use crate::scene::{ListenerPose, Scene, SourceId, SourcePose};

pub use groundwork::Groundwork;
pub use settings::{BestSettings, Lead};
pub(super) use tail::late_now;

use candidate::{Course, Standing};
use history::History;
use memory::Memory;
use rays::Inspection;

/// What one graphics frame is asked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Now<'a> {
    pub(super) scene: &'a Scene,
    /// The scene as it stood for the newest update.
    pub(super) then: &'a Scene,
    pub(super) listener: &'a ListenerPose,
    pub(super) sources: &'a [SourcePose],
    /// Of each source whether the listener does not see it.
    pub(super) shadowed: &'a [bool],
    pub(super) nearest_m: f64,
}

impl Now<'_> {
    /// A source and the listener as they are, if the source is still there and both are somewhere.
    fn spot(&self, source: SourceId) -> Option<Spot> {
        let pose = self.sources.iter().find(|pose| pose.id == source)?;
        let are_places = pose.position.is_finite() && self.listener.position.is_finite();
        are_places.then(|| Spot::of(pose, self.listener.position, self.nearest_m))
    }

    fn is_shadowed(&self, source: SourceId) -> bool {
        let mut each = self.sources.iter().zip(self.shadowed);
        each.any(|(pose, shadowed)| pose.id == source && *shadowed)
    }
}

/// State of the predictor.
#[derive(Debug)]
pub(super) struct Best {
    settings: BestSettings,
    memory: Memory,
    history: History,
    inspection: Inspection,
    standings: Vec<Standing>,
    /// Bent paths that may be heard in this frame, and whether they bend twice.
    bent: Vec<(bool, FramePath)>,
    frame: u64,
}

impl Best {
    pub(super) fn new(settings: BestSettings) -> Self {
        Self {
            settings,
            memory: Memory::default(),
            history: History::default(),
            inspection: Inspection::default(),
            standings: Vec::new(),
            bent: Vec::new(),
            frame: 0,
        }
    }

    /// Makes room for this many candidates and keeps to it, so that [`Self::frame`] allocates nothing.
    pub(super) fn bound(&mut self, candidates: usize) {
        self.memory.bound(candidates);
        self.inspection.reserve(candidates);
        self.standings.reserve(candidates);
        self.bent.reserve(candidates);
    }

    /// Adds the paths of a graphics frame to `paths` that are not part of the direct field; `arrived` is the update
    /// that is used from this frame on, if there is one, with what has been worked out of it. Gives the number of rays cast.
    pub(super) fn frame(
        &mut self,
        arrived: Option<(&PathSet, &Groundwork)>,
        now: &Now<'_>,
        paths: &mut Vec<FramePath>,
    ) -> u64 {
        self.history.push(now.listener.position);
        if let Some((update, groundwork)) = arrived {
            let mut word = self.history.date(update.listener.position, self.frame);
            // The listener's place does not date an update of a scene that has moved since.
            word.binding &= !has_moved(now.scene, now.then);
            self.memory
                .take(update, groundwork, now, word, &self.settings);
        }
        let candidates = &mut self.memory.candidates;
        self.standings.clear();
        // Of what is closed only what rays are cast for has to be known.
        let stands = candidates.iter().map(|candidate| match candidate.open {
            true => candidate.stand(now, &self.settings),
            false => Standing::Unasked,
        });
        self.standings.extend(stands);
        for (candidate, standing) in candidates.iter_mut().zip(&self.standings) {
            // What comes back onto its surfaces is asked soon.
            if let (Standing::Out, Course::Mirrors(_)) = (standing, candidate.course) {
                candidate.tested = None;
            }
        }
        let budget = self.settings.rays(now.sources.len());
        let updates = self.memory.updates;
        let rays = self.inspection.spend(
            budget,
            self.frame,
            updates,
            candidates,
            &mut self.standings,
            (now, &self.settings),
        );
        let open = candidates.iter().zip(&self.standings);
        let open =
            open.filter(|(candidate, _)| candidate.open && is_wanted(now.sources, &candidate.path));
        self.bent.clear();
        for (candidate, standing) in open {
            let Some(path) = candidate.heard(standing, now) else {
                continue;
            };
            match candidate.course {
                Course::Bends(course) => self.bent.push((course.is_double(), path)),
                Course::Mirrors(_) | Course::Unknown => paths.push(path),
            }
        }
        self.keep_loudest_bent(paths);
        self.frame += 1;
        rays
    }

    /// Adds as many bent paths of each source as an update has at most, the loudest.
    fn keep_loudest_bent(&mut self, paths: &mut Vec<FramePath>) {
        let energy = |path: &FramePath| path.amplitude.iter().map(|a| a * a).sum::<f32>();
        let group = |(double, path): &(bool, FramePath)| (path.source.bits(), *double);
        self.bent.sort_unstable_by(|a, b| {
            let louder = energy(&b.1).total_cmp(&energy(&a.1));
            group(a)
                .cmp(&group(b))
                .then(louder)
                .then(a.1.id.cmp(&b.1.id))
        });
        for same in self.bent.chunk_by(|a, b| group(a) == group(b)) {
            let most = if same[0].0 {
                MOST_DOUBLE
            } else {
                MOST_MIRRORED
            };
            paths.extend(same.iter().take(most).map(|(_, path)| *path));
        }
    }
}
