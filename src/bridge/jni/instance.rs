//! Instances: parts of the scene that move.

use ::jni::EnvUnowned;
use ::jni::objects::JClass;
use ::jni::sys::{jfloat, jint, jlong};

use super::{answer, ask_engine};
use crate::bridge::instances;
use crate::bridge::pose::Pose;

pub(super) extern "system" fn add<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    part: jlong,
    x: jfloat,
    y: jfloat,
    z: jfloat,
) -> jint {
    answer(env, |_| {
        let pose = Pose {
            source: 0,
            position_m: [x, y, z],
            orientation: [0.0, 0.0, 0.0, 1.0],
        };
        Ok(instances::add(engine as u64, part as u64, &pose)? as jint)
    })
}

/// To a place, turned by a quaternion.
pub(super) extern "system" fn place<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    instance: jint,
    x: jfloat,
    y: jfloat,
    z: jfloat,
    turn_x: jfloat,
    turn_y: jfloat,
    turn_z: jfloat,
    turn_w: jfloat,
) {
    ask_engine(env, engine, |session| {
        let pose = Pose {
            source: 0,
            position_m: [x, y, z],
            orientation: [turn_x, turn_y, turn_z, turn_w],
        };
        session.move_instance(instance as u32, &pose)
    });
}

pub(super) extern "system" fn remove<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    instance: jint,
) {
    ask_engine(env, engine, |session| {
        session.remove_instance(instance as u32)
    });
}
