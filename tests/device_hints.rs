//! Device hints through the whole engine, on a scripted phone: heat lowers quality in both schedules, the propagation thread
//! reports updates and blocks, and all system objects are released.
#![expect(
    clippy::disallowed_methods,
    reason = "the engine runs in real time; waiting for it is what this is about"
)]

use std::ffi::{CStr, c_int};
use std::ptr::{null_mut, without_provenance_mut};
use std::sync::Arc;
use std::sync::atomic::{AtomicI32, AtomicI64, AtomicU32, Ordering};

use foresound::runtime::phone::{Handle, Symbols, this_thread};
use foresound::runtime::{
    AffinityPolicy, Controller, Engine, EngineSchedule, EngineSettings, QualityLevel, Renderer,
    Statistics,
};
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, procedural};
use glam::Vec3;

static HEADROOM: AtomicU32 = AtomicU32::new(0);
static MANAGERS: AtomicI32 = AtomicI32::new(0);
static SESSIONS: AtomicI32 = AtomicI32::new(0);
static BEGUN: AtomicI32 = AtomicI32::new(0);
static REPORTS: AtomicU32 = AtomicU32::new(0);
static LONGEST_NS: AtomicI64 = AtomicI64::new(0);
static FROM_SOUND: AtomicU32 = AtomicU32::new(0);
static SOUND_THREAD: AtomicI32 = AtomicI32::new(0);

const HANDLE: Handle = without_provenance_mut(8);

/// System calls may block, so the sound thread must not make them.
fn note_caller() {
    if this_thread() == SOUND_THREAD.load(Ordering::SeqCst) {
        FROM_SOUND.fetch_add(1, Ordering::SeqCst);
    }
}

unsafe extern "C" fn acquire() -> Handle {
    MANAGERS.fetch_add(1, Ordering::SeqCst);
    HANDLE
}

unsafe extern "C" fn release(_: Handle) {
    MANAGERS.fetch_sub(1, Ordering::SeqCst);
}

unsafe extern "C" fn status(_: Handle) -> c_int {
    note_caller();
    0
}

unsafe extern "C" fn headroom(_: Handle, _: c_int) -> f32 {
    note_caller();
    f32::from_bits(HEADROOM.load(Ordering::SeqCst))
}

unsafe extern "C" fn manager() -> Handle {
    HANDLE
}

unsafe extern "C" fn create(_: Handle, _: *const i32, count: usize, _: i64) -> Handle {
    note_caller();
    assert_eq!(count, 1);
    BEGUN.fetch_add(1, Ordering::SeqCst);
    SESSIONS.fetch_add(1, Ordering::SeqCst);
    HANDLE
}

unsafe extern "C" fn target(_: Handle, _: i64) -> c_int {
    note_caller();
    0
}

unsafe extern "C" fn report(_: Handle, took_ns: i64) -> c_int {
    note_caller();
    REPORTS.fetch_add(1, Ordering::SeqCst);
    LONGEST_NS.fetch_max(took_ns, Ordering::SeqCst);
    0
}

unsafe extern "C" fn close(_: Handle) {
    SESSIONS.fetch_sub(1, Ordering::SeqCst);
}

fn address(name: &CStr) -> Handle {
    match name.to_bytes() {
        b"AThermal_acquireManager" => acquire as *mut _,
        b"AThermal_releaseManager" => release as *mut _,
        b"AThermal_getCurrentThermalStatus" => status as *mut _,
        b"AThermal_getThermalHeadroom" => headroom as *mut _,
        b"APerformanceHint_getManager" => manager as *mut _,
        b"APerformanceHint_createSession" => create as *mut _,
        b"APerformanceHint_updateTargetWorkDuration" => target as *mut _,
        b"APerformanceHint_reportActualWorkDuration" => report as *mut _,
        b"APerformanceHint_closeSession" => close as *mut _,
        _ => null_mut(),
    }
}

struct Playing {
    controller: Controller,
    renderer: Renderer,
}

impl Playing {
    fn new(schedule: EngineSchedule) -> Self {
        // SAFETY: the functions above have the types of Android's headers.
        let symbols = unsafe { Symbols::found_by(&mut |name| address(name)) };
        let mut settings = EngineSettings::default();
        settings.schedule = schedule;
        settings.affinity = AffinityPolicy::System;
        settings.propagation.guide_rays = 64;
        settings.propagation.source_rays = 16;
        settings.device_hints.symbols = Box::leak(Box::new(symbols));
        settings.max_snapshot_paths = 12;
        let (mut controller, mut renderer) = Engine::new(settings).expect("can be");
        let mesh = procedural::shoebox(Vec3::new(8.0, 3.0, 6.0), "concrete");
        let table = MaterialTable::built_in();
        let scene = Scene::commit(&mesh, &table, &SceneSettings::default()).expect("is a room");
        controller.set_scene(Arc::new(scene)).expect("accepted");
        let position = Vec3::new(2.0, 1.5, 1.0);
        controller.add_source(position).expect("a slot");
        SOUND_THREAD.store(this_thread(), Ordering::SeqCst);
        renderer.place_thread();
        Self {
            controller,
            renderer,
        }
    }

    /// Ticks and renders until a condition holds; returns whether it did.
    fn until(&mut self, holds: impl Fn(&Statistics) -> bool) -> bool {
        let listener = ListenerPose::facing(Vec3::new(5.0, 1.7, 3.0), 0.0);
        let mut block = [0.0; 512];
        // Bounded by work, not by time: two minutes of graphics frames.
        for _ in 0..60_000 {
            self.controller.tick(listener, &[]).expect("a valid pose");
            self.renderer.render(&mut block);
            if holds(&self.controller.statistics()) {
                return true;
            }
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        false
    }
}

/// One test, because the phone is global.
#[test]
fn heat_lowers_quality_and_hints_come_from_the_propagation_thread() {
    HEADROOM.store(0.98f32.to_bits(), Ordering::SeqCst);
    let mut playing = Playing::new(EngineSchedule::Asynchronous);
    assert!(playing.until(|now| now.quality_level == QualityLevel(3)));
    assert!(
        playing.until(|now| now.device_hints.hints_propagation && now.device_hints.hints_sound)
    );
    let hints = playing.controller.statistics().device_hints;
    assert_eq!(
        (hints.reading.headroom, hints.reading.status),
        (Some(0.98), Some(0))
    );
    // The path snapshot: twelve of more than a hundred paths, the direct one among them.
    let shown = playing.controller.path_snapshot();
    assert_eq!(shown.len(), 12);
    let direct = shown
        .iter()
        .find(|path| path.order == 0 && path.diffraction_order == 0);
    let corners = direct.expect("is the loudest").corners();
    assert_eq!(
        corners,
        [Vec3::new(2.0, 1.5, 1.0), Vec3::new(5.0, 1.7, 3.0)]
    );
    assert!(REPORTS.load(Ordering::SeqCst) > 0 && LONGEST_NS.load(Ordering::SeqCst) > 1_000);
    assert_eq!(SESSIONS.load(Ordering::SeqCst), 2);
    // No call came from this thread, which renders.
    assert_eq!(FROM_SOUND.load(Ordering::SeqCst), 0);
    drop(playing);
    let left = [
        MANAGERS.load(Ordering::SeqCst),
        SESSIONS.load(Ordering::SeqCst),
    ];
    assert_eq!(left, [0, 0]);

    // Synchronous updates run on the app's thread: thermal state applies, hints of updates do not.
    let begun = BEGUN.load(Ordering::SeqCst);
    let mut playing = Playing::new(EngineSchedule::Synchronous);
    assert!(playing.until(|now| now.quality_level == QualityLevel(3)));
    assert!(playing.until(|now| now.device_hints.hints_sound));
    assert!(
        !playing
            .controller
            .statistics()
            .device_hints
            .hints_propagation
    );
    assert_eq!(BEGUN.load(Ordering::SeqCst), begun + 1);
    drop(playing);
    let left = [
        MANAGERS.load(Ordering::SeqCst),
        SESSIONS.load(Ordering::SeqCst),
    ];
    assert_eq!(left, [0, 0]);
}
