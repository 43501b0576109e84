//! The Java interface: static natives of `dev.foresound.Native`, made from the tables of [`super::interface`] and registered
//! when the library is loaded.
//!
//! Calls run on Java's threads: the library's own threads are not attached to the virtual machine, whose pauses therefore
//! cannot stop propagation or sound. A failed call throws an exception with the error's message ([`throw`]). Java's memory
//! is copied during a call, because other threads may write it at any time.
//!
//! `unsafe` because the virtual machine passes pointers ([`memory`]) and takes them ([`JNI_OnLoad`]).

mod memory;
mod throw;

use std::ffi::c_void;

use ::jni::objects::JClass;
use ::jni::strings::JNIString;
use ::jni::sys::{JNI_ERR, JNI_VERSION_1_6, jint};
use ::jni::{Env, EnvUnowned, JavaVM, NativeMethod, jni_str};

use super::engine::{self, ENGINES, MaterialOptions, PropagationOptions, SourceOptions};
use super::enumeration::{Layout, Predictor, Schedule};
use super::error::{CallError, catch_panic};
use super::health::{BudgetOptions, EngineHealth};
use super::interface::{
    Buffer, BufferOut, Bytes, Choice, Count, Flag, Handle, HandleOut, Id, In, Indices, List,
    OptionalBuffer, OptionalBytes, OptionalText, Out, PoseIn, Real, Samples, Size, Text, Texts,
    functions, java_functions, result, shared_functions,
};
use super::numbers::{SourceNumbers, SourcePath};
use super::playback::{PlayOptions, Playback};
use super::pose::{POSE_BYTES, Pose, source_id};
use super::record::Field;
use super::scenes::{SceneInfo, SceneOptions};
use super::shown_paths::ShownPath;
use super::sound::OutputInfo;
use super::{
    EngineStatistics, Options, VERSION, clip, instances, playback, progress, scenes, sound,
    source_buses,
};
use crate::scene::TriangleMesh;
use memory::{FromJava, Returned};
use throw::Throw;

/// Registers the natives. Called by the virtual machine, once, on the thread that loads the library.
///
/// # Safety
/// `vm` is null or the virtual machine.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn JNI_OnLoad(vm: *mut ::jni::sys::JavaVM, _: *mut c_void) -> jint {
    if vm.is_null() {
        return JNI_ERR;
    }
    #[cfg(target_os = "android")]
    super::logging::install(Some(Box::new(android_logger::AndroidLogger::new(
        android_logger::Config::default()
            .with_max_level(log::LevelFilter::Info)
            .with_tag("foresound"),
    ))));
    // SAFETY: not null; a virtual machine by the caller's obligation.
    let vm = unsafe { JavaVM::from_raw(vm) };
    match catch_panic(|| vm.attach_current_thread(register)) {
        Ok(()) => JNI_VERSION_1_6,
        Err(error) => {
            log::error!("dev.foresound.Native does not match this library: {error}");
            JNI_ERR
        }
    }
}

fn register(env: &mut Env<'_>) -> Result<(), CallError> {
    memory::look_up_methods(env)?;
    let class = env.find_class(jni_str!("dev/foresound/Native"))?;
    let functions = functions().into_iter().flatten();
    let texts = |f: super::interface::Function| [f.java_name(), f.java_signature()];
    let texts: Vec<[JNIString; 2]> = functions.map(|f| texts(f).map(JNIString::new)).collect();
    let pointers = [shared::pointers(), java::pointers()].concat();
    let methods = texts
        .iter()
        .zip(pointers)
        .map(|([name, signature], pointer)| {
            // SAFETY: signature and function are made from the same entry of the table.
            unsafe { NativeMethod::from_raw_parts(name, signature, pointer) }
        });
    let methods: Vec<NativeMethod<'_>> = methods.collect();
    // SAFETY: every method is static and has its signature, see above.
    Ok(unsafe { env.register_native_methods(&class, &methods) }?)
}

/// Runs a call; an error or a panic becomes an exception, with a default result that Java discards.
fn answer<'local, R: Default>(
    mut env: EnvUnowned<'local>,
    call: impl FnOnce(&mut Env<'local>) -> Result<R, CallError>,
) -> R {
    env.with_env(call).resolve::<Throw>()
}

macro_rules! natives {
    ($($(#[doc = $doc:literal])* $safety:ident fn $name:ident(
        $($parameter:ident $([$count:ident])?: $kind:ty),*
    ) $(-> $result:ident: $result_kind:ty)? $body:block)*) => {
        /// The natives in the table's order.
        pub(super) fn pointers() -> Vec<*mut c_void> {
            vec![$($name as *mut c_void),*]
        }

        $(
            extern "system" fn $name<'l>(
                env: EnvUnowned<'l>,
                _: JClass<'l>,
                $($parameter: <$kind as FromJava>::Raw<'l>,)*
            ) $(-> <$result_kind as Returned>::Java)? {
                answer(env, |env| {
                    let _env: &Env<'_> = env;
                    $(let $parameter = <$kind as FromJava>::from_java(_env, stringify!($parameter), &$parameter)?;)*
                    let value = result($body)?;
                    Ok(native_result!(value $(, $result_kind)?))
                })
            }
        )*
    };
}

macro_rules! native_result {
    ($value:ident) => {{
        let () = $value;
    }};
    ($value:ident, $kind:ty) => {
        <$kind as Returned>::to_java($value)
    };
}

mod shared {
    use super::*;
    shared_functions!(natives);
}

mod java {
    use super::*;
    java_functions!(natives);
}
