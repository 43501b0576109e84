//! The audio side of the bridges leaves memory alone, in success and in failure; sources come through as they were meant.
#![cfg(feature = "capi")]

use foresound::bridge::capi::engine::{foresound_engine_create, foresound_engine_tick};
use foresound::bridge::capi::sound::{foresound_render, foresound_stream_write};
use foresound::bridge::capi::source::{
    foresound_clip_from_samples, foresound_source_add, foresound_source_play,
    foresound_source_stream,
};
use foresound::bridge::capi::{foresound_close, foresound_last_error};
use foresound::bridge::session::{ENGINES, SourceOptions};
use foresound::bridge::sound::{RENDERERS, RenderInfo};
use foresound::bridge::{Options, Pose, Status};

#[path = "../tools/src/command_line/counting.rs"]
mod counting;

#[global_allocator]
static ALLOCATOR: counting::Counting = counting::Counting;

const FACING: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

fn pose(source: u32, z_m: f32) -> Pose {
    Pose {
        source,
        position_m: [0.0, 0.0, z_m],
        orientation: FACING,
    }
}

/// An engine and its renderer, synchronous, so that a frame is a frame.
fn engine() -> (u64, u64) {
    let options = Options {
        guide_rays: 1,
        source_rays: 1,
        depth: 0,
        schedule: 1,
        frame_s: 0.01,
        late: 0,
        head: 1,
        ..Options::default()
    };
    let (mut engine, mut renderer) = (0, 0);
    // SAFETY: the addresses are those of variables that live on; no head-related set is none.
    let status = unsafe {
        foresound_engine_create(
            &raw const options,
            std::ptr::null(),
            0,
            &raw mut engine,
            &raw mut renderer,
        )
    };
    assert_eq!(status, Status::Ok);
    (engine, renderer)
}

fn add(engine: u64) -> u32 {
    let mut source = 0;
    // SAFETY: the address is a variable's.
    let status = unsafe { foresound_source_add(engine, 0.0, 0.0, -1.0, &raw mut source) };
    assert_eq!(status, Status::Ok);
    source
}

fn tick(engine: u64, sources: &[Pose]) -> Status {
    let listener = pose(0, 0.0);
    // SAFETY: the addresses are those of a pose and of as many as the slice has.
    unsafe { foresound_engine_tick(engine, &raw const listener, sources.as_ptr(), sources.len()) }
}

fn render(renderer: u64, block: &mut [f32]) -> Status {
    let mut info = RenderInfo::default();
    let frames = block.len() / 2;
    // SAFETY: the block has twice as many floats as frames; the other is a variable.
    unsafe { foresound_render(renderer, block.as_mut_ptr(), frames, &raw mut info) }
}

fn write(stream: u64, samples: &[f32]) -> (Status, usize) {
    let mut written = 0;
    // SAFETY: the slice has as many samples as it has; the other is a variable.
    let status = unsafe {
        foresound_stream_write(stream, samples.as_ptr(), samples.len(), &raw mut written)
    };
    (status, written)
}

#[test]
fn sound_calls_neither_allocate_nor_free_nor_leave_words() {
    let (engine, renderer) = engine();
    let source = add(engine);
    let mut stream = 0;
    // SAFETY: the address is a variable's.
    let made = unsafe { foresound_source_stream(engine, source, 1024, &raw mut stream) };
    assert_eq!(made, Status::Ok);
    let samples: Vec<f32> = (0..256).map(|n| (n as f32 * 0.2).sin()).collect();
    let mut block = vec![0.0; 512];
    let before = foresound_last_error();
    let mut operations = 0;
    for n in 0..50 {
        assert_eq!(
            tick(engine, &[pose(source, -1.0 - 0.01 * n as f32)]),
            Status::Ok
        );
        let started = counting::operations();
        assert_eq!(write(stream, &samples), (Status::Ok, 256));
        assert_eq!(render(renderer, &mut block), Status::Ok);
        operations += counting::operations() - started;
    }
    assert!(block.iter().any(|sample| *sample != 0.0), "silent");
    let started = counting::operations();
    assert_eq!(render(engine, &mut block), Status::WrongKind);
    assert!(block.iter().all(|sample| *sample == 0.0), "old sound");
    assert_eq!(render(renderer ^ 1 << 20, &mut block), Status::Closed);
    assert_eq!(render(7, &mut block), Status::Closed);
    assert_eq!(write(renderer, &samples).0, Status::WrongKind);
    // SAFETY: null is what is tried; nothing is written to it.
    let null = unsafe { foresound_render(renderer, std::ptr::null_mut(), 9, std::ptr::null_mut()) };
    assert_eq!(null, Status::Null);
    operations += counting::operations() - started;
    assert_eq!(operations, 0, "the audio side used the allocator");
    assert_eq!(before, foresound_last_error());
    for handle in [stream, renderer, engine] {
        assert_eq!(foresound_close(handle), Status::Ok);
        assert_eq!(foresound_close(handle), Status::Closed);
    }
}

#[test]
fn a_renderer_in_use_is_busy_and_not_waited_for() {
    let (engine, renderer) = engine();
    let held = RENDERERS.with(renderer, |_| {
        let mut block = [1.0; 64];
        let status = render(renderer, &mut block);
        Ok((status, block[63]))
    });
    assert_eq!(held, Ok((Status::Busy, 0.0)));
    assert_eq!(foresound_close(renderer), Status::Ok);
    assert_eq!(foresound_close(engine), Status::Ok);
}

/// What is said of a source stays said, whoever moves it afterwards and whoever does not.
#[test]
fn a_sources_options_survive_its_poses() {
    let (engine, renderer) = engine();
    let source = add(engine);
    let mut clip = 0;
    let tone: [f32; 64] =
        std::array::from_fn(|n| 0.5 * (n as f32 * std::f32::consts::FRAC_PI_8).sin());
    // SAFETY: the slice has 64 samples; the other is a variable.
    let made =
        unsafe { foresound_clip_from_samples(tone.as_ptr(), 64, 44_100, 44_100, &raw mut clip) };
    assert_eq!(made, Status::Ok);
    assert_eq!(foresound_source_play(engine, source, clip, 1), Status::Ok);
    assert_eq!(foresound_close(clip), Status::Ok);
    let loudest = |sources: &[Pose]| {
        let mut block = vec![0.0; 2 * 441];
        for _ in 0..30 {
            assert_eq!(tick(engine, sources), Status::Ok);
            assert_eq!(render(renderer, &mut block), Status::Ok);
        }
        block
            .iter()
            .fold(0.0f32, |most, sample| most.max(sample.abs()))
    };
    assert!(loudest(&[]) > 0.01);
    let silent = SourceOptions {
        effects: 0,
        ..SourceOptions::default()
    };
    let configured = ENGINES.with(engine, |session| session.configure(source, &silent));
    assert_eq!(configured, Ok(()));
    // A source that does not move, then one that does.
    assert!(loudest(&[]) < 1e-4);
    assert!(loudest(&[pose(source, -1.0)]) < 1e-4);
    let stale = ENGINES.with(engine, |session| session.configure(source + 9, &silent));
    assert_eq!(
        stale.map_err(|fault| fault.status),
        Err(Status::StaleSource)
    );
    let all = SourceOptions::default();
    let configured = ENGINES.with(engine, |session| session.configure(source, &all));
    assert_eq!(configured, Ok(()));
    assert!(loudest(&[pose(source, -1.0)]) > 0.01);
    assert_eq!(foresound_close(engine), Status::Ok);
    assert_eq!(foresound_close(renderer), Status::Ok);
}
