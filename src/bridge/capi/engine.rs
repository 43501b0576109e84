//! Engines.

use super::answer;
use super::memory::{give, read_options, slice, slice_mut, value};
use crate::bridge::fault::{Fault, Status};
use crate::bridge::health::{BudgetOptions, EngineHealth};
use crate::bridge::options::Options;
use crate::bridge::picture::ShownPath;
use crate::bridge::pose::Pose;
use crate::bridge::session::{self, ENGINES};
use crate::bridge::statistics::EngineStatistics;

/// The default options. Call it before changing any.
///
/// # Safety
/// `options` is the address of such a structure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_options_default(options: *mut Options) -> Status {
    // SAFETY: the caller's word.
    answer(|| unsafe { give("options", options, Options::default()) })
}

/// Makes an engine in open air without sources, and gives the handles of its two halves: `engine` for the app,
/// `renderer` for the thread that makes sound. Takes some ten milliseconds. Any thread but the audio thread.
///
/// `options` may be null for the defaults. `hrtf` are the bytes of a baked head-related set, or null for the one that is
/// built in.
///
/// # Safety
/// `options` is null or the address of such a structure, `hrtf` of `hrtf_bytes` bytes, the others of variables.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_engine_create(
    options: *const Options,
    hrtf: *const u8,
    hrtf_bytes: usize,
    engine: *mut u64,
    renderer: *mut u64,
) -> Status {
    answer(|| {
        // SAFETY: the caller's word.
        unsafe { give("engine", engine, 0) }?;
        // SAFETY: the caller's word.
        unsafe { give("renderer", renderer, 0) }?;
        // SAFETY: the caller's word; options are plain numbers behind their size.
        let wanted = unsafe { read_options("options", options) }?;
        let hrtf = if hrtf.is_null() && hrtf_bytes == 0 {
            None
        } else {
            // SAFETY: the caller's word.
            Some(unsafe { slice("hrtf", hrtf, hrtf_bytes) }?)
        };
        let handles = session::create(&wanted, hrtf)?;
        // SAFETY: the caller's word.
        unsafe { give("engine", engine, handles.0) }?;
        // SAFETY: the caller's word.
        unsafe { give("renderer", renderer, handles.1) }
    })
}

/// Hands over one graphics frame: where the listener is, and where those sources are that have moved.
/// Call it once a frame. Never waits for propagation or sound, but in the synchronous schedule it is the propagation.
/// With a pose that cannot be or a source that is gone it fails, and the frame goes out with the last good poses.
/// Any thread but the audio thread; calls on one engine wait for each other.
///
/// # Safety
/// `listener` is the address of a pose, `sources` of `source_count` poses or null for none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_engine_tick(
    engine: u64,
    listener: *const Pose,
    sources: *const Pose,
    source_count: usize,
) -> Status {
    answer(|| {
        // SAFETY: the caller's word; any bytes are a pose.
        let listener = unsafe { value("listener", listener) }?;
        // SAFETY: the caller's word.
        let sources = unsafe { slice("sources", sources, source_count) }?;
        let poses = sources.iter().copied();
        ENGINES.with(engine, |session| session.tick(listener.listener(), poses))
    })
}

/// Replaces the scene. The old one is heard until the new one's first update is there. The scene's handle may be closed
/// at once. Any thread but the audio thread.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_engine_set_scene(engine: u64, scene: u64) -> Status {
    answer(|| session::set_scene(engine, scene))
}

/// Sets rays and depth of propagation. Any thread but the audio thread.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_engine_set_propagation(
    engine: u64,
    guide_rays: u32,
    source_rays: u32,
    depth: u32,
) -> Status {
    answer(|| {
        ENGINES.with(engine, |session| {
            session.set_propagation(guide_rays, source_rays, depth)
        })
    })
}

/// Fades to silence within milliseconds; sounds stand still. Any thread but the audio thread.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_engine_pause(engine: u64) -> Status {
    answer(|| {
        ENGINES.with(engine, |session| {
            session.controller().pause();
            Ok(())
        })
    })
}

/// Goes on where foresound_engine_pause stopped. Any thread but the audio thread.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_engine_resume(engine: u64) -> Status {
    answer(|| {
        ENGINES.with(engine, |session| {
            session.controller().resume();
            Ok(())
        })
    })
}

/// Starts propagation anew after it has failed (state 2). Waits for the update under way. Any thread but the audio
/// thread.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_engine_restart(engine: u64) -> Status {
    answer(|| ENGINES.with(engine, |session| Ok(session.controller().restart()?)))
}

/// What the engine tells about itself. Some microseconds: ten times a second are plenty. Any thread but the audio thread.
///
/// # Safety
/// `statistics` is the address of such a structure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_engine_statistics(
    engine: u64,
    statistics: *mut EngineStatistics,
) -> Status {
    answer(|| {
        let now = ENGINES.with(engine, |session| Ok(session.statistics()))?;
        // SAFETY: the caller's word.
        unsafe { give("statistics", statistics, now) }
    })
}

/// The default budget: no limit. Call it before changing any.
///
/// # Safety
/// `options` is the address of such a structure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_budget_options_default(options: *mut BudgetOptions) -> Status {
    // SAFETY: the caller's word.
    answer(|| unsafe { give("options", options, BudgetOptions::default()) })
}

/// Says what the engine may spend, from the next update on: it gives up rays, orders and paths to keep to it. Heat may
/// lower the detail further, unless the tier is fixed. Any thread but the audio thread.
///
/// # Safety
/// `options` is the address of such a structure, or null for no limit.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_engine_set_budget(
    engine: u64,
    options: *const BudgetOptions,
) -> Status {
    answer(|| {
        // SAFETY: the caller's word; options are plain numbers behind their size.
        let wanted = unsafe { read_options("options", options) }?;
        ENGINES.with(engine, |session| session.set_budget(&wanted))
    })
}

/// How the engine bears its load, and the phone its heat. Some microseconds: ten times a second are plenty. Any thread
/// but the audio thread.
///
/// # Safety
/// `health` is the address of such a structure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_engine_health(engine: u64, health: *mut EngineHealth) -> Status {
    answer(|| {
        let now = ENGINES.with(engine, |session| Ok(session.health()))?;
        // SAFETY: the caller's word.
        unsafe { give("health", health, now) }
    })
}

/// The loudest paths of the newest update for a picture, in no order: as many as there are and fit, and their number. The
/// option `shown_paths` says how many are kept; none are unless it is set. Any thread but the audio thread.
///
/// # Safety
/// `paths` is the address of `capacity` such structures, `count` of a variable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_engine_paths(
    engine: u64,
    paths: *mut ShownPath,
    capacity: usize,
    count: *mut usize,
) -> Status {
    answer(|| {
        // SAFETY: the caller's word.
        unsafe { give("count", count, 0) }?;
        if capacity > 16_384 {
            let text = format!("capacity: {capacity} is beyond 16384; give fewer");
            return Err(Fault::new(Status::BadArgument, text));
        }
        // SAFETY: the caller's word; the structures are plain numbers.
        let places = unsafe { slice_mut("paths", paths, capacity) }?;
        let filled = ENGINES.with(engine, |session| {
            let mut filled = 0;
            for (place, path) in places.iter_mut().zip(session.shown_paths()) {
                *place = path;
                filled += 1;
            }
            Ok(filled)
        })?;
        // SAFETY: the caller's word.
        unsafe { give("count", count, filled) }
    })
}
