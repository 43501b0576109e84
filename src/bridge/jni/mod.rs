//! The Java interface: static methods of `dev.foresound.Native`, registered when the library is loaded.
//!
//! Calls come on Java's threads and end there: no thread of ours ever meets the virtual machine, so propagation and sound
//! cannot be stopped by it. What a call fails with becomes a Java exception with its text ([`throw`]). Java's memory is
//! copied and never kept: a direct buffer may be written by others at any time.
//!
//! `unsafe` because the virtual machine gives pointers ([`memory`]) and takes them ([`JNI_OnLoad`]).

mod engine;
mod instance;
mod memory;
mod scene;
mod sound;
mod source;
mod throw;

use std::ffi::c_void;

use ::jni::objects::JClass;
use ::jni::sys::{JNI_ERR, JNI_VERSION_1_6, jint, jlong};
use ::jni::{Env, EnvUnowned, JavaVM, NativeMethod, jni_str};

use super::fault::{Fault, guarded};
use super::session::{ENGINES, Session};
use throw::Throw;

/// A method of `Native`: name, signature, function.
macro_rules! native {
    ($name:literal, $signature:literal, $function:path) => {
        // SAFETY: the function is static to Java, takes environment and class first, then what the signature says; that
        // it does is kept by the tests of android/jvm, which call every one.
        unsafe {
            NativeMethod::from_raw_parts(
                jni_str!($name),
                jni_str!($signature),
                $function as *mut c_void,
            )
        }
    };
}

/// Registers the natives. The virtual machine calls it, once, on the thread that loads the library.
///
/// # Safety
/// `vm` is the virtual machine's.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn JNI_OnLoad(vm: *mut ::jni::sys::JavaVM, _: *mut c_void) -> jint {
    if vm.is_null() {
        return JNI_ERR;
    }
    #[cfg(target_os = "android")]
    android_logger::init_once(
        android_logger::Config::default()
            .with_max_level(log::LevelFilter::Info)
            .with_tag("foresound"),
    );
    // SAFETY: not null, and a virtual machine by the caller's word.
    let vm = unsafe { JavaVM::from_raw(vm) };
    match guarded(|| vm.attach_current_thread(register)) {
        Ok(()) => JNI_VERSION_1_6,
        Err(fault) => {
            log::error!("dev.foresound.Native does not fit this library: {fault}");
            JNI_ERR
        }
    }
}

fn register(env: &mut Env<'_>) -> Result<(), Fault> {
    let class = env.find_class(jni_str!("dev/foresound/Native"))?;
    let methods = [
        native!("version", "()I", version),
        native!("openHandles", "()I", open_handles),
        native!("close", "(J)V", close),
        native!("optionDefaults", "([D)V", engine::option_defaults),
        native!("create", "([D[B[J)V", engine::create),
        native!("tick", "(JLjava/nio/ByteBuffer;I)V", engine::tick),
        native!("setScene", "(JJ)V", engine::set_scene),
        native!("setPropagation", "(JIII)V", engine::set_propagation),
        native!("pause", "(J)V", engine::pause),
        native!("resume", "(J)V", engine::resume),
        native!("restart", "(J)V", engine::restart),
        native!("statistics", "(J[D)V", engine::statistics),
        native!("setBudget", "(J[D)V", engine::set_budget),
        native!("health", "(J[D)V", engine::health),
        native!("paths", "(J[F)I", engine::paths),
        native!(
            "sceneFromMesh",
            "([F[I[I[Ljava/lang/String;Ljava/lang/String;[D)J",
            scene::from_mesh
        ),
        native!(
            "sceneFromFile",
            "(Ljava/lang/String;Ljava/lang/String;[D)J",
            scene::from_file
        ),
        native!("sceneInfo", "(J[D)V", scene::info),
        native!("addSource", "(JFFF)I", source::add),
        native!("removeSource", "(JI)V", source::remove),
        native!("configureSource", "(JI[D)V", source::configure),
        native!("addInstance", "(JJFFF)I", instance::add),
        native!("moveInstance", "(JIFFFFFFF)V", instance::place),
        native!("removeInstance", "(JI)V", instance::remove),
        native!("setGain", "(JIF)V", source::set_gain),
        native!("mute", "(JIZ)V", source::mute),
        native!("play", "(JIJZ)V", source::play),
        native!("stop", "(JI)V", source::stop),
        native!("stream", "(JII)J", source::stream),
        native!("clipFromSamples", "([FII)J", source::clip_from_samples),
        native!("clipFromWav", "([BI)J", source::clip_from_wav),
        native!(
            "writeStream",
            "(JLjava/nio/ByteBuffer;I)I",
            sound::write_stream
        ),
        native!("render", "(JLjava/nio/ByteBuffer;I)I", sound::render),
        native!("latency", "(J)I", sound::latency),
        native!("startOutput", "(JI)J", sound::start_output),
        native!("outputInfo", "(J[D)V", sound::output_info),
    ];
    // SAFETY: every method is static and fits its signature, see `native`.
    Ok(unsafe { env.register_native_methods(&class, &methods) }?)
}

/// Runs a call; a fault or a panic becomes an exception, and the result a default that nobody sees.
fn answer<'local, R: Default>(
    mut env: EnvUnowned<'local>,
    call: impl FnOnce(&mut Env<'local>) -> Result<R, Fault>,
) -> R {
    env.with_env(call).resolve::<Throw>()
}

/// Runs a call that is about one engine.
fn ask_engine<'local, R: Default>(
    env: EnvUnowned<'local>,
    engine: jlong,
    call: impl FnOnce(&mut Session) -> Result<R, Fault>,
) -> R {
    answer(env, |_| ENGINES.with(engine as u64, call))
}

/// Java has no unsigned numbers; below zero nothing here makes sense.
fn count(name: &str, value: jint) -> Result<u32, Fault> {
    u32::try_from(value).map_err(|_| {
        let text = format!("{name}: {value} is below zero");
        Fault::new(super::fault::Status::BadArgument, text)
    })
}

extern "system" fn version<'l>(_: EnvUnowned<'l>, _: JClass<'l>) -> jint {
    super::VERSION as jint
}

extern "system" fn open_handles<'l>(_: EnvUnowned<'l>, _: JClass<'l>) -> jint {
    super::open_handles() as jint
}

extern "system" fn close<'l>(env: EnvUnowned<'l>, _: JClass<'l>, handle: jlong) {
    answer(env, |_| super::close(handle as u64));
}
