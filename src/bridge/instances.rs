//! Instances: parts of the scene that move, such as doors, under numbers of their engine.
//!
//! Control side, any thread, one call at a time. A part is a scene of its own, made like any other, in coordinates of its
//! own: a door best with its hinge at the origin.

use super::fault::Fault;
use super::pose::{Pose, instance_id};
use super::scenes::SCENES;
use super::session::{ENGINES, Session};

/// Adds an instance of a part at a pose, from the next tick on; gives its number. The part's handle may be closed
/// afterwards.
///
/// # Errors
/// The handles'; [`super::Status::BadArgument`] for a pose that does more than turn and move, for a part of too many
/// triangles, and when there are too many instances.
pub fn add(engine: u64, part: u64, pose: &Pose) -> Result<u32, Fault> {
    let part = SCENES.with(part, |part| Ok(part.clone()))?;
    ENGINES.with(engine, |session| {
        let pose = pose.instance(0);
        Ok(session.controller().add_instance(part, &pose)?.bits())
    })
}

impl Session {
    /// Moves an instance, from the next tick on.
    ///
    /// # Errors
    /// [`super::Status::StaleInstance`]; [`super::Status::BadArgument`] for a pose that does more than turn and move, and
    /// the last good one is kept.
    pub fn move_instance(&mut self, instance: u32, pose: &Pose) -> Result<(), Fault> {
        let pose = pose.instance(instance);
        Ok(self.controller().set_instance_pose(&pose)?)
    }

    /// Removes an instance, from the next tick on.
    ///
    /// # Errors
    /// [`super::Status::StaleInstance`].
    pub fn remove_instance(&mut self, instance: u32) -> Result<(), Fault> {
        Ok(self.controller().remove_instance(instance_id(instance))?)
    }
}

#[cfg(test)]
mod tests {
    use super::super::fault::Status;
    use super::super::options::Options;
    use super::super::scenes::{self, SceneOptions};
    use super::super::{close, session};
    use super::*;

    fn panel() -> u64 {
        let corners = [
            [-2.0, -2.0, 0.0],
            [2.0, -2.0, 0.0],
            [2.0, 2.0, 0.0],
            [-2.0, 2.0, 0.0],
        ];
        let options = SceneOptions::default();
        scenes::from_mesh(&corners, &[0, 1, 2, 0, 2, 3], &[], &[], None, &options).expect("a panel")
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
            schedule: 1,
            frame_s: 0.01,
            shown_paths: 8,
            ..Options::default()
        };
        let (engine, renderer) = session::create(&options, None).expect("an engine");
        let part = panel();
        let instance = add(engine, part, &at(-2.0)).expect("is added");
        assert_eq!(close(part), Ok(()));
        // The loudest path's level, in ticks with the panel between source and listener, beside them and gone.
        let level = |change: &dyn Fn(&mut Session) -> Result<(), Fault>| {
            ENGINES.with(engine, |session| {
                change(session)?;
                session.tick(at(0.0).listener(), std::iter::empty())?;
                let shown = session.shown_paths();
                Ok(shown.map(|path| path.level_db).fold(f32::MIN, f32::max))
            })
        };
        let heard = level(&|session| session.add_source([0.0, 0.0, -4.0]).map(drop));
        let between = heard.expect("a tick");
        let aside = level(&|session| session.move_instance(instance, &at(-8.0))).expect("a tick");
        let back = level(&|session| session.move_instance(instance, &at(-2.0))).expect("a tick");
        let gone = level(&|session| session.remove_instance(instance)).expect("a tick");
        // The panel weakens what passes it, and gives a reflection when it stands behind both.
        assert!(between < gone - 6.0, "{between} {gone}");
        assert_eq!(between, back);
        assert!((aside - gone).abs() < 0.1, "{aside} {gone}");
        let stale = level(&|session| session.move_instance(instance, &at(0.0)));
        assert_eq!(
            stale.map_err(|fault| fault.status),
            Err(Status::StaleInstance)
        );
        assert_eq!((close(engine), close(renderer)), (Ok(()), Ok(())));
    }
}
