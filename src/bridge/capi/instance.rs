//! Instances: parts of the scene that move.

use super::answer;
use super::memory::{give, value};
use crate::bridge::fault::Status;
use crate::bridge::instances;
use crate::bridge::pose::Pose;
use crate::bridge::session::ENGINES;

/// Adds an instance of a part, such as a door, at a pose from the next tick on, and gives its number. A part is a scene
/// of its own in coordinates of its own, the hinge at the origin; its handle may be closed at once, and several instances
/// may share it. Instances stay when the scene is replaced. Any thread but the audio thread.
///
/// # Safety
/// `pose` is the address of a pose, whose source is not looked at, `instance` of a variable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_instance_add(
    engine: u64,
    part: u64,
    pose: *const Pose,
    instance: *mut u32,
) -> Status {
    answer(|| {
        // SAFETY: the caller's word.
        unsafe { give("instance", instance, u32::MAX) }?;
        // SAFETY: the caller's word; any bytes are a pose.
        let pose = unsafe { value("pose", pose) }?;
        let added = instances::add(engine, part, &pose)?;
        // SAFETY: the caller's word.
        unsafe { give("instance", instance, added) }
    })
}

/// Moves an instance from the next tick on. The orientation is a quaternion of length 1; with a pose that cannot be the
/// last good one is kept. Any thread but the audio thread.
///
/// # Safety
/// `pose` is the address of a pose, whose source is not looked at.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_instance_move(
    engine: u64,
    instance: u32,
    pose: *const Pose,
) -> Status {
    answer(|| {
        // SAFETY: the caller's word; any bytes are a pose.
        let pose = unsafe { value("pose", pose) }?;
        ENGINES.with(engine, |session| session.move_instance(instance, &pose))
    })
}

/// Removes an instance from the next tick on. Its number is stale at once. Any thread but the audio thread.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_instance_remove(engine: u64, instance: u32) -> Status {
    answer(|| ENGINES.with(engine, |session| session.remove_instance(instance)))
}
