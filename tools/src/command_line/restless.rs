//! An app that leaves nothing about its engine alone, for `soak`.

use std::sync::Arc;

use foresound::Result;
use foresound::extrapolation::PredictorKind;
use foresound::propagation::PropagationSettings;
use foresound::propagation::rays::directions::{mix, unit};
use foresound::runtime::Controller;
use foresound::scene::{ListenerPose, Scene, SourceId, SourcePose};
use glam::Vec3;

use crate::inputs::LoadedScene;

/// What changes besides the listener's place and the sources'.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Change {
    /// Sources come and go.
    Sources,
    /// One is muted now and then.
    Mutes,
    /// One has another gain.
    Gains,
    /// Another scene.
    Scenes,
    /// Other numbers of rays.
    Rays,
    /// Another predictor.
    Predictors,
}

/// The app that cannot leave anything alone.
pub(crate) struct Restless {
    pub(crate) controller: Controller,
    pub(crate) scenes: Vec<LoadedScene>,
    pub(crate) clip: Arc<[f32]>,
    /// Sources that are there.
    pub(crate) here: Vec<SourceId>,
    /// What it changes.
    pub(crate) changes: Vec<Change>,
    /// Most of them at a time.
    pub(crate) most: usize,
    /// The scene in use.
    pub(crate) scene: usize,
    pub(crate) swaps: u64,
    pub(crate) added: u64,
    /// Of the dice.
    pub(crate) state: u64,
}

impl Restless {
    fn dice(&mut self) -> f32 {
        self.state = mix(self.state);
        unit(self.state)
    }

    /// Somewhere near a place where the scene has a source.
    fn place(&mut self, slot: usize, time_s: f64) -> Vec3 {
        let middle = |scene: &Scene| (scene.report().bounds_min + scene.report().bounds_max) / 2.0;
        let loaded = &self.scenes[self.scene];
        let sources = loaded.layout.as_ref().map(|layout| &layout.sources);
        let base = sources
            .filter(|sources| !sources.is_empty())
            .map_or_else(|| middle(&loaded.scene), |s| s[slot % s.len()].position);
        let turn = (time_s + slot as f64) as f32;
        base + 0.5 * Vec3::new(turn.sin(), 0.0, turn.cos())
    }

    /// Throws the dice for a change, whether or not it is one of those to make.
    fn happens(&mut self, change: Change, chance: f32) -> bool {
        let falls = self.dice() < chance;
        falls && self.changes.contains(&change)
    }

    /// One graphics frame: something may come, go, change; everything moves.
    pub(crate) fn frame(&mut self, time_s: f64) -> Result<()> {
        let is_fixed = !self.changes.contains(&Change::Sources);
        // Where sources do not come and go, all are there from the beginning.
        let comes = self.happens(Change::Sources, 0.3) || is_fixed;
        if comes && self.here.len() < self.most {
            let place = self.place(self.here.len(), time_s);
            let id = self.controller.add_source(place)?;
            self.controller.play(id, Arc::clone(&self.clip), true)?;
            self.here.push(id);
            self.added += 1;
        }
        if self.happens(Change::Sources, 0.1) && self.here.len() > self.most / 2 {
            let which = (self.dice() * self.here.len() as f32) as usize;
            let id = self.here.swap_remove(which.min(self.here.len() - 1));
            self.controller.remove_source(id)?;
        }
        if let Some(&id) = self.here.first() {
            let muted = self.happens(Change::Mutes, 0.1);
            self.controller.mute_source(id, muted)?;
            let gain = self.dice();
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
                guide_rays: 256 << (3.0 * self.dice()) as u32,
                source_rays: 32 << (3.0 * self.dice()) as u32,
                ..self.controller.settings().propagation
            };
            self.controller.set_propagation(rays)?;
        }
        if self.happens(Change::Predictors, 0.05) {
            let which = (self.dice() * PredictorKind::ALL.len() as f32) as usize;
            let last = PredictorKind::ALL.len() - 1;
            self.controller
                .set_predictor(PredictorKind::ALL[which.min(last)]);
        }
        let mut poses = Vec::with_capacity(self.here.len());
        for n in 0..self.here.len() {
            let position = self.place(n, time_s);
            let id = self.here[n];
            poses.push(SourcePose::at(id, position));
        }
        let walk = self.scenes[self.scene]
            .layout
            .as_ref()
            .and_then(|layout| layout.listener);
        let position = walk.map_or(Vec3::ZERO, |walk| walk.position_at(time_s, 0.0));
        self.controller
            .tick(ListenerPose::facing(position, time_s as f32), &poses)
    }
}
