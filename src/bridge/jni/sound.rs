//! Sound: for apps whose own thread plays it, and devices.

use ::jni::EnvUnowned;
use ::jni::objects::{JByteBuffer, JClass, JDoubleArray};
use ::jni::sys::{jint, jlong};

use super::memory::{Direct, fill};
use super::{answer, count};
use crate::bridge::sound;

/// Samples that are copied at once on their way into a stream.
const PIECE: usize = 256;

/// Renders interleaved stereo into a direct buffer of floats in the machine's order; gives the number of voices.
pub(super) extern "system" fn render<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    renderer: jlong,
    output: JByteBuffer<'l>,
    frames: jint,
) -> jint {
    answer(env, |env| {
        let frames = count("frames", frames)? as usize;
        let output = Direct::of(env, "output", &output, frames * 2 * size_of::<f32>())?;
        let made = sound::render_blocks(renderer as u64, frames, |from, block| {
            output.write(from, block);
            Ok(())
        })?;
        Ok(made.voices as jint)
    })
}

/// Appends floats from a direct buffer to a stream; gives the number that fitted.
pub(super) extern "system" fn write_stream<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    stream: jlong,
    samples: JByteBuffer<'l>,
    wanted: jint,
) -> jint {
    answer(env, |env| {
        let wanted = count("count", wanted)? as usize;
        let samples = Direct::of(env, "samples", &samples, wanted * size_of::<f32>())?;
        let mut done = 0;
        let mut piece = [0.0f32; PIECE];
        loop {
            let length = (wanted - done).min(PIECE);
            for (i, sample) in piece[..length].iter_mut().enumerate() {
                let mut bytes = [0; 4];
                samples.read(4 * (done + i), &mut bytes);
                *sample = f32::from_ne_bytes(bytes);
            }
            let fitted = sound::write_stream(stream as u64, &piece[..length])?;
            done += fitted;
            if fitted < length || done == wanted {
                return Ok(done as jint);
            }
        }
    })
}

pub(super) extern "system" fn latency<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    renderer: jlong,
) -> jint {
    answer(env, |_| Ok(sound::latency_frames(renderer as u64)? as jint))
}

pub(super) extern "system" fn start_output<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    renderer: jlong,
    blocks_ahead: jint,
) -> jlong {
    answer(env, |_| {
        let blocks_ahead = count("blocksAhead", blocks_ahead)? as usize;
        Ok(sound::start_output(renderer as u64, blocks_ahead)? as jlong)
    })
}

pub(super) extern "system" fn output_info<'l>(
    env: EnvUnowned<'l>,
    _: JClass<'l>,
    output: jlong,
    numbers: JDoubleArray<'l>,
) {
    answer(env, |env| {
        let info = sound::report_output(output as u64)?;
        fill(env, "info", &numbers, &info.numbers())
    });
}
