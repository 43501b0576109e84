//! Instances: moving parts of the scene, such as doors, by ids of their engine.
//!
//! Any control thread. A part is a scene of its own in local coordinates: a door's hinge is best at the origin.

use super::engine::{ENGINES, EngineControl};
use super::error::CallError;
use super::pose::{Pose, instance_id};
use super::scenes::SCENES;

/// Adds an instance of a part at a pose from the next tick on; returns its id. The part's handle may be closed afterwards.
///
/// # Errors
/// Those of the handles; `Status::BadArgument` for a pose that is not a rigid motion, for a part with too many
/// triangles, and for too many instances.
pub fn add(engine: u64, part: u64, pose: &Pose) -> Result<u32, CallError> {
    let part = SCENES.with(part, |part| Ok(part.clone()))?;
    ENGINES.with(engine, |engine| {
        let pose = pose.instance(0);
        Ok(engine.controller().add_instance(part, &pose)?.bits())
    })
}

/// Adds an instance that stays where it is and is joined with the fixed scene and with all such instances that it touches; else as
/// [`add`].
///
/// # Errors
/// As [`add`].
pub fn add_joined(engine: u64, part: u64, pose: &Pose) -> Result<u32, CallError> {
    let part = SCENES.with(part, |part| Ok(part.clone()))?;
    ENGINES.with(engine, |engine| {
        let pose = pose.instance(0);
        let id = engine.controller().add_joined_instance(part, &pose)?;
        Ok(id.bits())
    })
}

impl EngineControl {
    /// Moves an instance, from the next tick on.
    ///
    /// # Errors
    /// `Status::StaleInstance`; `Status::BadArgument` for a pose that is not a rigid motion: the last
    /// valid one stays.
    pub fn move_instance(&mut self, instance: u32, pose: &Pose) -> Result<(), CallError> {
        let pose = pose.instance(instance);
        Ok(self.controller().set_instance_pose(&pose)?)
    }

    /// Removes an instance, from the next tick on.
    ///
    /// # Errors
    /// `Status::StaleInstance`.
    pub fn remove_instance(&mut self, instance: u32) -> Result<(), CallError> {
        Ok(self.controller().remove_instance(instance_id(instance))?)
    }
}

#[cfg(test)]
mod tests {
    use super::super::enumeration::Schedule;
    use super::super::error::Status;
    use super::super::options::Options;
    use super::super::scenes::{self, SceneOptions};
    use super::super::{VERSION, close, engine};
    use super::*;
    use crate::scene::TriangleMesh;

    fn panel() -> u64 {
        let corners = [
            [-2.0, -2.0, 0.0],
            [2.0, -2.0, 0.0],
            [2.0, 2.0, 0.0],
            [-2.0, 2.0, 0.0],
        ];
        let options = SceneOptions::default();
        let mesh = TriangleMesh::from_slices(&corners, &[0, 1, 2, 0, 2, 3], &[], &[]);
        scenes::from_mesh(&mesh.expect("valid"), None, &options, 0).expect("a panel")
    }

    fn at(z_m: f32) -> Pose {
        Pose {
            source: 0,
            position_m: [0.0, 0.0, z_m],
            orientation: [0.0, 0.0, 0.0, 1.0],
        }
    }

    #[test]
    fn a_panel_comes_moves_and_goes() {
        let options = Options {
            guide_rays: 64,
            schedule: Schedule::Synchronous,
            frame_s: 0.01,
            shown_paths: 8,
            ..Options::default()
        };
        let (engine, renderer) = engine::create(VERSION, &options, None).expect("an engine");
        let part = panel();
        let instance = add(engine, part, &at(-2.0)).expect("is added");
        assert_eq!(close(part), Ok(()));
        // The loudest path's level, in ticks with the panel between source and listener, beside them and gone.
        let level = |change: &dyn Fn(&mut EngineControl) -> Result<(), CallError>| {
            ENGINES.with(engine, |engine| {
                change(engine)?;
                engine.tick(at(0.0).listener(), std::iter::empty())?;
                let shown = engine.shown_paths();
                Ok(shown.map(|path| path.level_db).fold(f32::MIN, f32::max))
            })
        };
        let heard = level(&|engine| engine.add_source([0.0, 0.0, -4.0]).map(drop));
        let between = heard.expect("a tick");
        let aside = level(&|engine| engine.move_instance(instance, &at(-8.0))).expect("a tick");
        let back = level(&|engine| engine.move_instance(instance, &at(-2.0))).expect("a tick");
        let gone = level(&|engine| engine.remove_instance(instance)).expect("a tick");
        // The panel attenuates what passes through it; behind both it adds a reflection.
        assert!(between < gone - 6.0, "{between} {gone}");
        assert_eq!(between, back);
        assert!((aside - gone).abs() < 0.1, "{aside} {gone}");
        let stale = level(&|engine| engine.move_instance(instance, &at(0.0)));
        assert_eq!(
            stale.map_err(|error| error.status),
            Err(Status::StaleInstance)
        );
        assert_eq!((close(engine), close(renderer)), (Ok(()), Ok(())));
    }
}
