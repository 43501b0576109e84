//! Random C calls from four threads on the same handles: no call ends in a caught panic, sound is finite, and nothing stays
//! open. `.ci/asan` and `.ci/tsan` run it under their sanitizers.
#![cfg(feature = "capi")]

#[path = "fuzz/drivers/bytes.rs"]
mod bytes;
#[path = "fuzz/drivers/c_calls.rs"]
#[allow(dead_code, reason = "the fuzz target calls from one thread")]
mod c_calls;
#[path = "fuzz/drivers/c_playback.rs"]
mod c_playback;

use std::sync::atomic::AtomicU64;
use std::thread;

/// Threads that make calls.
const THREADS: u64 = 4;
/// Sequences of calls of each.
const ROUNDS: u64 = 100;
/// Bytes that a sequence is made from: more than its 64 calls need.
const BYTES: usize = 4096;

/// Pseudo-random bytes (SplitMix64).
fn bytes_of(seed: u64) -> Vec<u8> {
    let mut state = seed;
    let mut long = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    (0..BYTES / 8).flat_map(|_| long().to_le_bytes()).collect()
}

#[test]
fn random_calls_from_four_threads_are_harmless() {
    let shared: [AtomicU64; 16] = Default::default();
    thread::scope(|scope| {
        for number in 0..THREADS {
            let shared = &shared;
            scope.spawn(move || {
                for round in 0..ROUNDS {
                    let seed = round << 8 | number;
                    c_calls::c_calls_beside(&bytes_of(seed), shared);
                }
            });
        }
    });
    assert_eq!(foresound::bridge::open_handles(), 0);
}
