//! Sources, clips and streams.

use ::jni::EnvUnowned;
use ::jni::objects::{JByteArray, JClass, JDoubleArray, JFloatArray};
use ::jni::sys::{jboolean, jfloat, jint, jlong};

use super::memory::array;
use super::{answer, ask_engine, count};
use crate::bridge::clip as clips;
use crate::bridge::numbers::Numbers;
use crate::bridge::pose::source_id;
use crate::bridge::session::{self, ENGINES, SourceOptions};

pub(super) extern "system" fn add<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    x: jfloat,
    y: jfloat,
    z: jfloat,
) -> jint {
    ask_engine(env, engine, |session| {
        Ok(session.add_source([x, y, z])? as jint)
    })
}

pub(super) extern "system" fn remove<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    source: jint,
) {
    ask_engine(env, engine, |session| session.remove_source(source as u32));
}

/// Options as numbers: effects, radius, order, then eight of directivity.
pub(super) extern "system" fn configure<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    source: jint,
    numbers: JDoubleArray<'l>,
) {
    answer(env, |env| {
        let numbers = array(env, "options", &numbers)?;
        let mut next = Numbers::new("options", &numbers, 11)?;
        let mut options = SourceOptions {
            effects: next.count()?,
            radius_m: next.number()? as f32,
            order: next.number()? as f32,
            ..SourceOptions::default()
        };
        for weight in &mut options.directivity {
            *weight = next.number()? as f32;
        }
        ENGINES.with(engine as u64, |session| {
            session.configure(source as u32, &options)
        })
    });
}

pub(super) extern "system" fn set_gain<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    source: jint,
    gain: jfloat,
) {
    ask_engine(env, engine, |session| {
        let controller = session.controller();
        Ok(controller.set_source_gain(source_id(source as u32), gain)?)
    });
}

pub(super) extern "system" fn mute<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    source: jint,
    muted: jboolean,
) {
    ask_engine(env, engine, |session| {
        let controller = session.controller();
        Ok(controller.mute_source(source_id(source as u32), muted)?)
    });
}

pub(super) extern "system" fn play<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    source: jint,
    clip: jlong,
    looped: jboolean,
) {
    answer(env, |_| {
        session::play(engine as u64, source as u32, clip as u64, looped)
    });
}

pub(super) extern "system" fn stop<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    source: jint,
) {
    ask_engine(env, engine, |session| {
        Ok(session.controller().stop(source_id(source as u32))?)
    });
}

pub(super) extern "system" fn stream<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    engine: jlong,
    source: jint,
    capacity: jint,
) -> jlong {
    answer(env, |_| {
        let capacity = count("capacity", capacity)? as usize;
        Ok(session::stream(engine as u64, source as u32, capacity)? as jlong)
    })
}

pub(super) extern "system" fn clip_from_samples<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    samples: JFloatArray<'l>,
    rate_hz: jint,
    engine_rate_hz: jint,
) -> jlong {
    answer(env, |env| {
        let samples = array(env, "samples", &samples)?;
        let rate_hz = count("rate", rate_hz)?;
        let engine_rate_hz = count("rate", engine_rate_hz)?;
        Ok(clips::from_samples(&samples, rate_hz, engine_rate_hz)? as jlong)
    })
}

pub(super) extern "system" fn clip_from_wav<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    bytes: JByteArray<'l>,
    engine_rate_hz: jint,
) -> jlong {
    answer(env, |env| {
        let signed = array(env, "bytes", &bytes)?;
        let bytes: Vec<u8> = signed.into_iter().map(|b| b as u8).collect();
        let engine_rate_hz = count("rate", engine_rate_hz)?;
        Ok(clips::from_wav(&bytes, engine_rate_hz)? as jlong)
    })
}
