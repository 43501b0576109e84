//! Core and priority of threads: requested, read back, reported; refusals are not fatal.
//!
//! Calls concern the calling thread and make system calls, once per thread, before its first block.
//! Linux and Android; no effect elsewhere. Core capacities come from `/sys/devices/system/cpu/cpuN/cpu_capacity` or the
//! highest clock frequency.

/// Cores of the engine's threads: the propagation thread, and the sound thread of a device of this library or one that calls
/// [`Renderer::place_thread`](crate::Renderer::place_thread). The default pins them to the fastest cores; in C, Kotlin and Unity the
/// system chooses unless the options say otherwise, as Android advises for apps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AffinityPolicy {
    /// The system chooses: no thread is pinned.
    System,
    /// The fastest core for propagation, the next for sound; of equal cores the highest numbers, which systems load
    /// last.
    #[default]
    Fastest,
    /// These cores.
    Chosen {
        /// Core of the propagation thread.
        propagation: usize,
        /// Core of the sound thread.
        sound: usize,
    },
}

/// Role of a thread, which determines core and priority.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ThreadRole {
    /// Propagation. Unchanged priority.
    Propagation,
    /// Sound. Real-time priority (`SCHED_FIFO` 10) or, if refused, nice −16 as Android's audio threads.
    Sound,
}

/// Core and priority that the system granted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Placement {
    /// Bitmask of the first 64 cores that the thread may run on; 0 if unknown.
    pub cores: u64,
    /// Whether that is exactly the requested core; true without a request.
    pub pinned: bool,
    /// Priority of the real-time class, 0 outside it.
    pub realtime_priority: i32,
    /// Niceness from −20 (urgent) to 19.
    pub nice: i32,
}

impl AffinityPolicy {
    /// The core for a role; `None` if the system decides.
    pub fn core(self, role: ThreadRole) -> Option<usize> {
        let rank = match role {
            ThreadRole::Propagation => 0,
            ThreadRole::Sound => 1,
        };
        match self {
            Self::System => None,
            Self::Chosen { propagation, .. } if rank == 0 => Some(propagation),
            Self::Chosen { sound, .. } => Some(sound),
            Self::Fastest => {
                let cores = cores_by_capacity();
                cores.get(rank.min(cores.len().checked_sub(1)?)).copied()
            }
        }
    }
}

/// Sets core and priority of the calling thread; returns what was granted. Makes system calls.
pub fn place_this_thread(policy: AffinityPolicy, role: ThreadRole) -> Placement {
    let core = policy.core(role);
    if let Some(core) = core {
        system::pin(core);
    }
    if role == ThreadRole::Sound {
        system::raise_priority();
    }
    let mut placement = system::read_back();
    placement.pinned = core.is_none_or(|c| c < 64 && placement.cores == 1 << c);
    placement
}

/// Cores of this process, fastest first; of equal cores the highest number first.
pub fn cores_by_capacity() -> Vec<usize> {
    let allowed = system::read_back().cores;
    let mut cores: Vec<usize> = (0..64).filter(|c| allowed >> c & 1 == 1).collect();
    cores.sort_by_key(|&core| std::cmp::Reverse((capacity(core), core)));
    cores
}

/// Capacity of a core in the system's unit; 0 if unknown.
fn capacity(core: usize) -> u64 {
    ["cpu_capacity", "cpufreq/cpuinfo_max_freq"]
        .iter()
        .find_map(|name| {
            let file = format!("/sys/devices/system/cpu/cpu{core}/{name}");
            std::fs::read_to_string(file).ok()?.trim().parse().ok()
        })
        .unwrap_or(0)
}

#[cfg(any(target_os = "linux", target_os = "android"))]
mod system {
    use crate::runtime::Placement;
    use std::mem::{size_of, zeroed};

    /// Low in the real-time class: above every ordinary thread, below the system's own.
    const REALTIME_PRIORITY: i32 = 10;
    /// `ANDROID_PRIORITY_AUDIO`.
    const AUDIO_NICE: i32 = -16;

    fn no_cores() -> libc::cpu_set_t {
        // SAFETY: the type is an array of integers, for which zero is a value.
        unsafe { zeroed() }
    }

    pub(crate) fn pin(core: usize) {
        if core >= 64 {
            return;
        }
        let mut set = no_cores();
        // SAFETY: a set has at least 1024 bits (32-bit Android: 32, and the macro checks bounds), core is below 64.
        unsafe { libc::CPU_SET(core, &mut set) };
        // SAFETY: 0 is the calling thread; the set is initialised and its size is its own. A refusal is read back.
        unsafe { libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const set) };
    }

    pub(crate) fn raise_priority() {
        // SAFETY: plain integers, for which zero is a value.
        let mut parameters: libc::sched_param = unsafe { zeroed() };
        parameters.sched_priority = REALTIME_PRIORITY;
        // SAFETY: 0 is the calling thread; the parameters are initialised. A refusal is answered below.
        let refused =
            unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) };
        if refused != 0 {
            // SAFETY: takes numbers only; on Linux 0 is the calling thread. A refusal is read back.
            unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, AUDIO_NICE) };
        }
    }

    pub(crate) fn read_back() -> Placement {
        let mut set = no_cores();
        // SAFETY: 0 is the calling thread; writes at most the given size into a set of that size.
        let failed =
            unsafe { libc::sched_getaffinity(0, size_of::<libc::cpu_set_t>(), &raw mut set) };
        let mut cores = 0;
        if failed == 0 {
            for core in 0..64.min(8 * size_of::<libc::cpu_set_t>()) {
                // SAFETY: the set is initialised and has this many bits.
                let has = unsafe { libc::CPU_ISSET(core, &set) };
                cores |= u64::from(has) << core;
            }
        }
        // SAFETY: plain integers, for which zero is a value.
        let mut parameters: libc::sched_param = unsafe { zeroed() };
        // SAFETY: 0 is the calling thread; writes one structure of that type.
        unsafe { libc::sched_getparam(0, &raw mut parameters) };
        Placement {
            cores,
            pinned: false,
            realtime_priority: parameters.sched_priority,
            // SAFETY: takes numbers only; on Linux 0 is the calling thread.
            nice: unsafe { libc::getpriority(libc::PRIO_PROCESS, 0) },
        }
    }
}

#[cfg(not(any(target_os = "linux", target_os = "android")))]
mod system {
    use crate::runtime::Placement;

    pub(crate) fn pin(_: usize) {}

    pub(crate) fn raise_priority() {}

    pub(crate) fn read_back() -> Placement {
        Placement::default()
    }
}

#[cfg(all(test, any(target_os = "linux", target_os = "android")))]
mod tests {
    use super::*;

    #[test]
    fn an_exact_core_is_read_back() {
        let Some(&core) = cores_by_capacity().first() else {
            return;
        };
        let policy = AffinityPolicy::Chosen {
            propagation: core,
            sound: core,
        };
        let on_core =
            std::thread::spawn(move || place_this_thread(policy, ThreadRole::Propagation));
        let placement = on_core.join().expect("placed");
        assert!(placement.pinned && placement.cores == 1 << core);
    }

    #[test]
    fn a_missing_core_is_reported_and_not_fatal() {
        let policy = AffinityPolicy::Chosen {
            propagation: 63,
            sound: 4000,
        };
        let lost = std::thread::spawn(move || {
            let first = place_this_thread(policy, ThreadRole::Propagation);
            [first, place_this_thread(policy, ThreadRole::Sound)]
        });
        let placements = lost.join().expect("is not fatal");
        let has_64 = placements[0].cores == 1 << 63;
        assert!(has_64 || !placements[0].pinned);
        assert!(!placements[1].pinned && placements[1].cores != 0);
    }
}
