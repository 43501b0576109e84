//! A scripted phone for tests: the functions of [`super::Symbols`]. One per thread.

use std::cell::RefCell;
use std::ffi::{CStr, c_int};
use std::ptr::{null_mut, without_provenance_mut};

use super::symbols::{Handle, Symbols};

/// Answers and record of the phone.
#[derive(Debug, Clone, Default)]
pub(super) struct Phone {
    pub(super) headroom: f32,
    pub(super) status: c_int,
    pub(super) refuses: bool,
    pub(super) has_no_manager: bool,
    pub(super) reads: u32,
    pub(super) managers: i32,
    pub(super) sessions: i32,
    pub(super) threads: Vec<i32>,
    pub(super) targets_ns: Vec<i64>,
    pub(super) reports_ns: Vec<i64>,
}

thread_local! {
    static PHONE: RefCell<Phone> = RefCell::default();
}

/// Changes or reads this thread's phone.
pub(super) fn phone<T>(change: impl FnOnce(&mut Phone) -> T) -> T {
    PHONE.with(|phone| change(&mut phone.borrow_mut()))
}

const THERMAL: Handle = without_provenance_mut(8);
const HINTS: Handle = without_provenance_mut(16);
const SESSION: Handle = without_provenance_mut(24);

unsafe extern "C" fn acquire() -> Handle {
    phone(|p| {
        if p.has_no_manager {
            return null_mut();
        }
        p.managers += 1;
        THERMAL
    })
}

unsafe extern "C" fn release(manager: Handle) {
    assert_eq!(manager, THERMAL);
    phone(|p| p.managers -= 1);
}

unsafe extern "C" fn status(manager: Handle) -> c_int {
    assert_eq!(manager, THERMAL);
    phone(|p| p.status)
}

unsafe extern "C" fn headroom(manager: Handle, forecast_s: c_int) -> f32 {
    assert_eq!((manager, forecast_s), (THERMAL, 10));
    phone(|p| {
        p.reads += 1;
        p.headroom
    })
}

unsafe extern "C" fn manager() -> Handle {
    match phone(|p| p.has_no_manager) {
        true => null_mut(),
        false => HINTS,
    }
}

unsafe extern "C" fn create(
    manager: Handle,
    threads: *const i32,
    count: usize,
    target_ns: i64,
) -> Handle {
    assert_eq!(manager, HINTS);
    // SAFETY: the caller passes a pointer to `count` numbers.
    let threads = unsafe { std::slice::from_raw_parts(threads, count) };
    phone(|p| {
        p.sessions += 1;
        p.threads.extend_from_slice(threads);
        p.targets_ns.push(target_ns);
    });
    SESSION
}

unsafe extern "C" fn target(session: Handle, target_ns: i64) -> c_int {
    assert_eq!(session, SESSION);
    phone(|p| p.targets_ns.push(target_ns));
    0
}

unsafe extern "C" fn report(session: Handle, took_ns: i64) -> c_int {
    assert_eq!(session, SESSION);
    phone(|p| {
        p.reports_ns.push(took_ns);
        if p.refuses { -32 } else { 0 }
    })
}

unsafe extern "C" fn close(session: Handle) {
    assert_eq!(session, SESSION);
    phone(|p| p.sessions -= 1);
}

/// The address of a function, null below its API level.
fn address(name: &CStr, level: u32) -> Handle {
    let (since, address): (u32, Handle) = match name.to_str().unwrap_or_default() {
        "AThermal_acquireManager" => (30, acquire as *mut _),
        "AThermal_releaseManager" => (30, release as *mut _),
        "AThermal_getCurrentThermalStatus" => (30, status as *mut _),
        "AThermal_getThermalHeadroom" => (31, headroom as *mut _),
        "APerformanceHint_getManager" => (33, manager as *mut _),
        "APerformanceHint_createSession" => (33, create as *mut _),
        "APerformanceHint_updateTargetWorkDuration" => (33, target as *mut _),
        "APerformanceHint_reportActualWorkDuration" => (33, report as *mut _),
        "APerformanceHint_closeSession" => (33, close as *mut _),
        name => panic!("unexpected name {name}"),
    };
    if level >= since { address } else { null_mut() }
}

/// The functions of an Android of this API level.
pub(super) fn symbols(level: u32) -> &'static Symbols {
    // SAFETY: the functions above have the types of Android's headers.
    let found = unsafe { Symbols::found_by(&mut |name| address(name, level)) };
    Box::leak(Box::new(found))
}
