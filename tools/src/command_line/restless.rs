//! An app that changes everything about its engine at random, for `soak`.

use std::sync::Arc;

use foresound::Result;
use foresound::extrapolation::PredictorKind;
use foresound::generation::{Hrtf, Layout};
use foresound::propagation::PropagationSettings;
use foresound::propagation::rays::directions::{mix, unit};
use foresound::runtime::Controller;
use foresound::scene::{ListenerPose, Scene, SourceId, SourcePose};
use glam::Vec3;

use crate::inputs::LoadedScene;

/// A kind of change, besides movement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Change {
    /// Adds and removes sources.
    Sources,
    /// Mutes a source.
    Mutes,
    /// Changes a source's gain.
    Gains,
    /// Swaps the scene.
    Scenes,
    /// Changes the numbers of rays.
    Rays,
    /// Changes the predictor.
    Predictors,
}

/// Outputs to choose from, and the changes so far.
pub(crate) struct Outputs {
    pub(crate) hrtfs: Vec<Arc<Hrtf>>,
    pub(crate) layout_changes: u64,
    pub(crate) hrtf_changes: u64,
}

/// Chance of another layout, and of another HRTF set, in a graphics frame.
const OUTPUT_CHANCES: [f32; 2] = [0.1, 0.05];

/// The app.
pub(crate) struct Restless {
    pub(crate) controller: Controller,
    pub(crate) scenes: Vec<LoadedScene>,
    pub(crate) clip: Arc<[f32]>,
    /// Handles of the present sources.
    pub(crate) sources: Vec<SourceId>,
    /// Kinds of changes that are made.
    pub(crate) changes: Vec<Change>,
    /// Most sources at a time.
    pub(crate) most: usize,
    /// The scene in use.
    pub(crate) scene: usize,
    pub(crate) swaps: u64,
    pub(crate) added: u64,
    /// Layouts and HRTF sets to change to; none for the same output all the time.
    pub(crate) outputs: Option<Outputs>,
    /// State of the random numbers.
    pub(crate) state: u64,
}

impl Restless {
    fn random(&mut self) -> f32 {
        self.state = mix(self.state);
        unit(self.state)
    }

    /// A position on a circle around one of the layout's sources.
    fn position(&mut self, slot: usize, time_s: f64) -> Vec3 {
        let middle = |scene: &Scene| (scene.report().bounds_min + scene.report().bounds_max) / 2.0;
        let loaded = &self.scenes[self.scene];
        let sources = loaded.sources();
        let base = match sources.len() {
            0 => middle(&loaded.scene),
            count => sources[slot % count],
        };
        let turn = (time_s + slot as f64) as f32;
        base + 0.5 * Vec3::new(turn.sin(), 0.0, turn.cos())
    }

    /// Draws whether a change happens; one that is not among `changes` never does.
    fn happens(&mut self, change: Change, chance: f32) -> bool {
        let falls = self.random() < chance;
        falls && self.changes.contains(&change)
    }

    /// Changes layout and HRTF set at random, if there are some.
    fn change_outputs(&mut self) -> Result<()> {
        if self.outputs.is_none() {
            return Ok(());
        }
        let [layout, set, which] = std::array::from_fn(|_| self.random());
        let Some(outputs) = &mut self.outputs else {
            return Ok(());
        };
        let index = |count: usize| ((which * count as f32) as usize).min(count - 1);
        if layout < OUTPUT_CHANCES[0] {
            let layout = Layout::ALL[index(Layout::ALL.len())];
            self.controller.set_layout(layout)?;
            outputs.layout_changes += 1;
        }
        if set < OUTPUT_CHANCES[1] {
            let set = &outputs.hrtfs[index(outputs.hrtfs.len())];
            self.controller.set_hrtf(Some(Arc::clone(set)))?;
            outputs.hrtf_changes += 1;
        }
        Ok(())
    }

    /// One graphics frame: random additions, removals and changes; everything moves.
    pub(crate) fn frame(&mut self, time_s: f64) -> Result<()> {
        let is_fixed = !self.changes.contains(&Change::Sources);
        // Without that change all sources are added at the start.
        let comes = self.happens(Change::Sources, 0.3) || is_fixed;
        if comes && self.sources.len() < self.most {
            let position = self.position(self.sources.len(), time_s);
            let id = self.controller.add_source(position)?;
            self.controller.play(id, Arc::clone(&self.clip), true)?;
            self.sources.push(id);
            self.added += 1;
        }
        if self.happens(Change::Sources, 0.1) && self.sources.len() > self.most / 2 {
            let which = (self.random() * self.sources.len() as f32) as usize;
            let id = self.sources.swap_remove(which.min(self.sources.len() - 1));
            self.controller.remove_source(id)?;
        }
        if let Some(&id) = self.sources.first() {
            let muted = self.happens(Change::Mutes, 0.1);
            self.controller.mute_source(id, muted)?;
            let gain = self.random();
            if self.changes.contains(&Change::Gains) {
                self.controller.set_source_gain(id, gain)?;
            }
        }
        if self.happens(Change::Scenes, 0.02) {
            self.scene = (self.scene + 1) % self.scenes.len();
            let scene = Arc::clone(&self.scenes[self.scene].scene);
            self.controller.set_scene(scene)?;
            self.swaps += 1;
        }
        if self.happens(Change::Rays, 0.02) {
            let rays = PropagationSettings {
                guide_rays: 256 << (3.0 * self.random()) as u32,
                source_rays: 32 << (3.0 * self.random()) as u32,
                ..self.controller.settings().propagation
            };
            self.controller.set_propagation(rays)?;
        }
        if self.happens(Change::Predictors, 0.05) {
            let which = (self.random() * PredictorKind::ALL.len() as f32) as usize;
            let last = PredictorKind::ALL.len() - 1;
            self.controller
                .set_predictor(PredictorKind::ALL[which.min(last)]);
        }
        self.change_outputs()?;
        let mut poses = Vec::with_capacity(self.sources.len());
        for n in 0..self.sources.len() {
            let position = self.position(n, time_s);
            let id = self.sources[n];
            poses.push(SourcePose::at(id, position));
        }
        let walk = self.scenes[self.scene].walk();
        let position = walk.map_or(Vec3::ZERO, |walk| walk.position_at(time_s, 0.0));
        self.controller
            .tick(ListenerPose::facing(position, time_s as f32), &poses)
    }
}
