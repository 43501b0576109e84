//! The audio functions do not allocate, in success and in failure; options of sources persist.

use foresound::bridge::capi::{
    foresound_clip_from_samples, foresound_close, foresound_engine_create,
    foresound_engine_set_hrtf, foresound_engine_set_layout, foresound_engine_tick,
    foresound_last_error, foresound_output_start, foresound_render, foresound_render_channels,
    foresound_renderer_channels, foresound_source_add, foresound_source_play,
    foresound_source_stream, foresound_stream_write,
};
use foresound::bridge::engine::{ENGINES, SourceOptions};
use foresound::bridge::enumeration::{Hrtf, Layout, Schedule};
use foresound::bridge::sound::{RENDERERS, RenderInfo};
use foresound::bridge::{Options, Pose, Status, VERSION};

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

/// Options of a synchronous engine.
fn small() -> Options {
    Options {
        guide_rays: 1,
        source_rays: 1,
        depth: 0,
        schedule: Schedule::Synchronous,
        frame_s: 0.01,
        late_reverb: 0,
        hrtf: Hrtf::None,
        ..Options::default()
    }
}

/// A synchronous engine and its renderer.
fn engine() -> (u64, u64) {
    engine_of(small())
}

fn engine_of(options: Options) -> (u64, u64) {
    let (mut engine, mut renderer) = (0, 0);
    // SAFETY: the addresses of variables; a null pointer for no HRTF set.
    let status = unsafe {
        foresound_engine_create(
            VERSION,
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
    unsafe {
        foresound_engine_tick(
            engine,
            &raw const listener,
            sources.as_ptr(),
            sources.len(),
            size_of::<Pose>(),
        )
    }
}

fn render(renderer: u64, block: &mut [f32]) -> Status {
    let mut info = RenderInfo::default();
    let frames = block.len() / 2;
    // SAFETY: the block has twice as many floats as frames; the other is a variable.
    unsafe { foresound_render(renderer, block.as_mut_ptr(), frames, &raw mut info) }
}

fn write(stream: u64, samples: &[f32]) -> (Status, usize) {
    let mut written = 0;
    // SAFETY: the address and length of a slice; the other is a variable.
    let status = unsafe {
        foresound_stream_write(stream, samples.as_ptr(), samples.len(), &raw mut written)
    };
    (status, written)
}

#[test]
fn audio_functions_neither_allocate_nor_set_an_error_message() {
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
    // SAFETY: null pointers are valid arguments that cause an error.
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

/// Another number of channels than the engine's, and a layout that does not fit, have a status and leave sound as it is.
#[test]
fn channels_are_those_of_the_engine() {
    let (engine, renderer) = engine_of(Options {
        layout: Layout::Surround51,
        ..small()
    });
    let mut channels = 0;
    // SAFETY: the address of a variable.
    let status = unsafe { foresound_renderer_channels(renderer, &raw mut channels) };
    assert_eq!((status, channels), (Status::Ok, 6));
    let mut block = vec![1.0; 6 * 64];
    let info = std::ptr::null_mut();
    for (channels, wanted) in [
        (6, Status::Ok),
        (2, Status::BadArgument),
        (0, Status::BadArgument),
        (17, Status::BadArgument),
    ] {
        let frames = if channels == 6 { 64 } else { 20 };
        // SAFETY: the block has at least as many floats.
        let status = unsafe {
            foresound_render_channels(renderer, block.as_mut_ptr(), channels, frames, info)
        };
        assert_eq!(status, wanted, "{channels}");
    }
    // SAFETY: the block has more floats.
    let stereo = unsafe { foresound_render(renderer, block.as_mut_ptr(), 64, info) };
    assert_eq!(stereo, Status::BadArgument);
    assert_eq!(
        foresound_engine_set_layout(engine, Layout::Stereo),
        Status::Ok
    );
    for layout in [Layout::Ambisonics3, Layout(9)] {
        let refused = foresound_engine_set_layout(engine, layout);
        assert_eq!(refused, Status::BadArgument);
    }
    let mut output = 0;
    // SAFETY: the address of a variable.
    let started = unsafe { foresound_output_start(renderer, 2, &raw mut output) };
    assert_eq!(started, Status::BadArgument);
    // SAFETY: null for the built-in set.
    let set = unsafe { foresound_engine_set_hrtf(engine, std::ptr::null(), 0) };
    assert_eq!(set, Status::Ok);
    for handle in [renderer, engine] {
        assert_eq!(foresound_close(handle), Status::Ok);
    }
}

#[test]
fn a_renderer_in_use_is_busy() {
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

/// Options persist for sources with and without new poses.
#[test]
fn options_of_a_source_persist() {
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
    let configured = ENGINES.with(engine, |engine| engine.configure(source, &silent));
    assert_eq!(configured, Ok(()));
    // A source that does not move, then one that does.
    assert!(loudest(&[]) < 1e-4);
    assert!(loudest(&[pose(source, -1.0)]) < 1e-4);
    let stale = ENGINES.with(engine, |engine| engine.configure(source + 9, &silent));
    assert_eq!(
        stale.map_err(|error| error.status),
        Err(Status::StaleSource)
    );
    let all = SourceOptions::default();
    let configured = ENGINES.with(engine, |engine| engine.configure(source, &all));
    assert_eq!(configured, Ok(()));
    assert!(loudest(&[pose(source, -1.0)]) > 0.01);
    assert_eq!(foresound_close(engine), Status::Ok);
    assert_eq!(foresound_close(renderer), Status::Ok);
}
