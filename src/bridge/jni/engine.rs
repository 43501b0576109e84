//! Engines.

use ::jni::EnvUnowned;
use ::jni::objects::{JByteArray, JByteBuffer, JClass, JDoubleArray, JFloatArray, JLongArray};
use ::jni::sys::{jint, jlong};

use super::memory::{Direct, array, fill, present};
use super::{answer, ask_engine, count};
use crate::bridge::fault::{Fault, Status};
use crate::bridge::health::BudgetOptions;
use crate::bridge::options::Options;
use crate::bridge::picture::PATH_FLOATS;
use crate::bridge::pose::{POSE_BYTES, Pose};
use crate::bridge::session::{self, ENGINES};

pub(super) extern "system" fn option_defaults<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    numbers: JDoubleArray<'l>,
) {
    answer(env, |env| {
        fill(env, "options", &numbers, &Options::default().numbers())
    });
}

pub(super) extern "system" fn create<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    options: JDoubleArray<'l>,
    hrtf: JByteArray<'l>,
    handles: JLongArray<'l>,
) {
    answer(env, |env| {
        let options = Options::from_numbers(&array(env, "options", &options)?)?;
        // The place for the handles is tried before there are any.
        fill(env, "handles", &handles, &[0, 0])?;
        let hrtf = if hrtf.is_null() {
            None
        } else {
            let signed = array(env, "hrtf", &hrtf)?;
            Some(signed.into_iter().map(|b| b as u8).collect::<Vec<u8>>())
        };
        let (engine, renderer) = session::create(&options, hrtf.as_deref())?;
        fill(
            env,
            "handles",
            &handles,
            &[engine as jlong, renderer as jlong],
        )
    });
}

/// The frame begins with the listener's pose, followed by those of `sources` sources: 32 bytes each in the machine's order.
pub(super) extern "system" fn tick<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    frame: JByteBuffer<'l>,
    sources: jint,
) {
    answer(env, |env| {
        let sources = count("sources", sources)? as usize;
        let Some(bytes) = (sources + 1).checked_mul(POSE_BYTES) else {
            const MANY: &str = "sources: more than memory has";
            return Err(Fault::fixed(Status::BadArgument, MANY));
        };
        let frame = Direct::of(env, "frame", &frame, bytes)?;
        let pose = |place: usize| {
            let mut bytes = [0; POSE_BYTES];
            frame.read(place * POSE_BYTES, &mut bytes);
            Pose::from_bytes(&bytes)
        };
        ENGINES.with(engine as u64, |session| {
            session.tick(pose(0).listener(), (1..=sources).map(pose))
        })
    });
}

pub(super) extern "system" fn set_scene<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    scene: jlong,
) {
    answer(env, |_| session::set_scene(engine as u64, scene as u64));
}

pub(super) extern "system" fn set_propagation<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    guide_rays: jint,
    source_rays: jint,
    depth: jint,
) {
    ask_engine(env, engine, |session| {
        let guide_rays = count("guideRays", guide_rays)?;
        let source_rays = count("sourceRays", source_rays)?;
        let depth = count("depth", depth)?;
        session.set_propagation(guide_rays, source_rays, depth)
    });
}

pub(super) extern "system" fn pause<'l>(env: EnvUnowned<'l>, _: JClass<'l>, engine: jlong) {
    ask_engine(env, engine, |session| {
        session.controller().pause();
        Ok(())
    });
}

pub(super) extern "system" fn resume<'l>(env: EnvUnowned<'l>, _: JClass<'l>, engine: jlong) {
    ask_engine(env, engine, |session| {
        session.controller().resume();
        Ok(())
    });
}

pub(super) extern "system" fn restart<'l>(env: EnvUnowned<'l>, _: JClass<'l>, engine: jlong) {
    ask_engine(env, engine, |session| Ok(session.controller().restart()?));
}

pub(super) extern "system" fn statistics<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    numbers: JDoubleArray<'l>,
) {
    answer(env, |env| {
        let now = ENGINES.with(engine as u64, |session| Ok(session.statistics()))?;
        fill(env, "statistics", &numbers, &now.numbers())
    });
}

pub(super) extern "system" fn set_budget<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    numbers: JDoubleArray<'l>,
) {
    answer(env, |env| {
        let options = BudgetOptions::from_numbers(&array(env, "budget", &numbers)?)?;
        ENGINES.with(engine as u64, |session| session.set_budget(&options))
    });
}

pub(super) extern "system" fn health<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    numbers: JDoubleArray<'l>,
) {
    answer(env, |env| {
        let now = ENGINES.with(engine as u64, |session| Ok(session.health()))?;
        fill(env, "health", &numbers, &now.numbers())
    });
}

/// Paths for a picture, one after the other, as many as fit whole; gives their number.
pub(super) extern "system" fn paths<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    floats: JFloatArray<'l>,
) -> jint {
    answer(env, |env| {
        present("paths", &floats)?;
        let places = floats.len(env)? / PATH_FLOATS;
        let mut values = Vec::new();
        ENGINES.with(engine as u64, |session| {
            for path in session.shown_paths().take(places) {
                values.extend(path.floats());
            }
            Ok(())
        })?;
        floats.set_region(env, 0, &values)?;
        Ok((values.len() / PATH_FLOATS) as jint)
    })
}
