//! A benchmark scene with any number of sources and a listener that walks to and fro at 1.4 m/s, with 20 updates a second.

use std::sync::Arc;

use foresound::runtime::engine::MAX_SOURCES;
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourcePose, layout, procedural,
};
use foresound::{Error, Result};

use super::sources::sources;
use crate::inputs::within;

/// Metres between two updates.
pub(super) const STEP_M: f32 = 0.07;

/// Updates a second.
const UPDATES_A_SECOND: f64 = 20.0;

/// Time of an update in seconds.
pub(super) fn time_s(step: usize) -> f64 {
    step as f64 / UPDATES_A_SECOND
}

/// Name of the scene with a million triangles.
const MILLION: &str = "million";

/// A benchmark scene, ready to be walked through.
pub(super) struct Walk {
    pub(super) scene: Arc<Scene>,
    pub(super) benchmark: procedural::BenchmarkScene,
}

impl Walk {
    /// Through the scene of a name: the benchmark scenes and `million`.
    pub(super) fn through(name: &str) -> Result<Self> {
        let benchmark = match name {
            MILLION => procedural::million(),
            _ => procedural::by_name(name).ok_or_else(|| {
                let known = procedural::NAMES.join(", ");
                let problem = format!("no benchmark scene is called {name:?}");
                Error::setting(
                    "--scene",
                    problem,
                    &format!("choose of: {known}, {MILLION}"),
                )
            })?,
        };
        let table = MaterialTable::built_in();
        let scene = Scene::commit(&benchmark.mesh, &table, &SceneSettings::default())?;
        Ok(Self {
            scene: Arc::new(scene),
            benchmark,
        })
    }

    /// A number of sources in the scene's open space, at most [`MAX_SOURCES`].
    pub(super) fn sources(&self, count: usize) -> Result<Vec<SourcePose>> {
        within("--sources", count as f64, 0.0..=MAX_SOURCES as f64, "")?;
        let own: Vec<_> = self
            .benchmark
            .sources
            .iter()
            .map(|source| source.1)
            .collect();
        let sources = sources(&self.scene, &own, count);
        if sources.len() < count {
            let problem = format!("{count} do not fit into the scene's open space");
            return Err(Error::setting("--sources", problem, "choose fewer"));
        }
        Ok(sources)
    }

    /// The listener's walk.
    pub(super) fn listener(&self) -> layout::Walk {
        let walk = &self.benchmark.walk;
        layout::Walk {
            from: walk.from,
            to: walk.to,
            speed_m_s: walk.speed_m_s.into(),
            standing: walk.standing,
        }
    }

    /// The listener at an update; at 0 in the middle of the walk.
    pub(super) fn ear(&self, step: usize) -> ListenerPose {
        let walk = &self.benchmark.walk;
        let length_m = walk.from.distance(walk.to);
        let walked_m = (0.5 * length_m + STEP_M * step as f32).rem_euclid(2.0 * length_m);
        let share = 1.0 - (walked_m / length_m - 1.0).abs();
        ListenerPose {
            position: walk.from.lerp(walk.to, share),
            ..ListenerPose::default()
        }
    }
}
