//! The audio side of the generation stage neither allocates nor frees.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

use foresound::extrapolation::{FramePath, FramePaths, LATE_GROUPS, LateGroup, LateSend, PathKind};
use foresound::generation::{Generator, GeneratorSettings, Hrtf};
use foresound::propagation::PathId;
use foresound::scene::SourceId;
use glam::{Quat, Vec3};

mod reference;
use reference::synthetic_hrtf;

/// Counts this thread's calls only, not those of the test harness's threads.
struct Counting;

thread_local! {
    static CALLS: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    // A thread in destruction has no counter any more, and no calls to count.
    let _ = CALLS.try_with(|calls| calls.set(calls.get() + 1));
}

// SAFETY: every call is handed to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise is the system allocator's condition.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count();
        // SAFETY: the caller's promise is the system allocator's condition.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller's promise is the system allocator's condition.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn calls() -> u64 {
    CALLS.with(Cell::get)
}

/// Paths that come, go and jump, more of them than there are voices.
fn frames() -> Vec<FramePaths> {
    (0..40u64)
        .map(|k| FramePaths {
            orientation: Quat::from_rotation_y(k as f32),
            paths: (0..60 + k % 30)
                .map(|i| FramePath {
                    id: PathId(i * 7 + k / 4 % 3),
                    source: SourceId::new((i % 5) as u16, (k / 13) as u32),
                    kind: PathKind::Reflected,
                    order: 0,
                    amplitude: [0.01 + 0.001 * i as f32; 8],
                    delay_s: 0.001 + 0.004 * ((i * i + k / 5 * 17) % 91) as f64,
                    air_delay_s: 0.001 + 0.004 * ((i * i + k / 5 * 17) % 91) as f64,
                    arrival: Vec3::new((i as f32).sin(), 0.1, (k as f32).cos()),
                    departure: Vec3::ZERO,
                })
                .collect(),
            late: (0..4)
                .map(|slot| LateSend {
                    source: SourceId::new(slot, 0),
                    group: 0,
                    energy_per_s: [0.5; 8],
                    start_s: 0.02 * (1 + k % 7) as f32,
                })
                .collect(),
            late_groups: [LateGroup::isotropic([0.4 + 0.1 * (k % 5) as f32; 8]); LATE_GROUPS],
            wide: Vec::new(),
            obstructions: Vec::new(),
            high_air_np_per_s: [5.0, 8.7, 11.5, 14.4],
        })
        .collect()
}

#[test]
fn counter_counts() {
    let before = calls();
    drop(std::hint::black_box(vec![0u8; 100]));
    assert_eq!(calls() - before, 2);
}

#[test]
fn audio_side_neither_allocates_nor_frees() {
    let hrtf = Hrtf::parse(&synthetic_hrtf::bytes(48_000), "synthetic").unwrap();
    let settings = GeneratorSettings {
        rate_hz: 48_000,
        max_sources: 4,
        max_voices: 64,
        fine_voices: 16,
        max_delay_s: 0.3,
        ..GeneratorSettings::default()
    };
    let mut generator = Generator::new(settings, Arc::new(hrtf)).unwrap();
    let frames = frames();
    let noise: Vec<f32> = (0..4096).map(|n| ((n * n) as f32).sin()).collect();
    let mut output = vec![0.0; 2 * 4096];
    let mut sums = [0u32; 3];

    let before = calls();
    for (k, frame) in frames.iter().enumerate() {
        generator.set_frame(frame, 640);
        let count = [640, 32, 4096, 257, 1][k % 5];
        // Source 2 has no input, source 3 falls silent halfway.
        let inputs: [&[f32]; 4] = [
            &noise[..count],
            &noise[..count],
            &[],
            if k < 20 { &noise[..count] } else { &[] },
        ];
        let report = generator.render(&inputs, &mut output[..2 * count]);
        sums[0] += report.dropped_paths;
        sums[1] += report.dropped_delays;
        sums[2] += report.late_starts;
    }
    let after = calls();

    assert_eq!(after - before, 0);
    // The situations were there.
    assert!(sums.iter().all(|&sum| sum > 0), "{sums:?}");
}
