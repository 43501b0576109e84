//! Control calls through C: a refused pose, identities of sources, a stream that cannot be had, a renderer's latency during
//! its use.

use foresound::bridge::capi::{
    foresound_clip_from_samples, foresound_clip_from_wav, foresound_close, foresound_engine_create,
    foresound_engine_tick, foresound_output_start, foresound_render, foresound_renderer_latency,
    foresound_scene_from_bytes, foresound_scene_from_file, foresound_scene_save,
    foresound_source_add, foresound_source_configure, foresound_source_play,
    foresound_source_remove, foresound_source_stream,
};
use foresound::bridge::engine::SourceOptions;
use foresound::bridge::enumeration::{Hrtf, Schedule};
use foresound::bridge::sound::{RENDERERS, RenderInfo};
use foresound::bridge::{Options, Pose, Status, VERSION};

/// Tests that fill the tables of handles and tests that use them take turns.
#[expect(
    clippy::disallowed_types,
    reason = "tests that share tables take turns"
)]
static TURN: std::sync::Mutex<()> = std::sync::Mutex::new(());

/// Most handles of a kind.
const HANDLES: usize = 4096;

fn pose(source: u32, z_m: f32) -> Pose {
    Pose {
        source,
        position_m: [0.0, 0.0, z_m],
        orientation: [0.0, 0.0, 0.0, 1.0],
    }
}

/// A synchronous engine and its renderer.
fn engine(max_sources: u32) -> (u64, u64) {
    let options = Options {
        max_sources,
        guide_rays: 1,
        source_rays: 1,
        depth: 0,
        schedule: Schedule::Synchronous,
        frame_s: 0.01,
        max_delay_s: 0.1,
        late_reverb: 0,
        hrtf: Hrtf::None,
        ..Options::default()
    };
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

fn stream(engine: u64, source: u32) -> (Status, u64) {
    let mut stream = 0;
    // SAFETY: the address is a variable's.
    let status = unsafe { foresound_source_stream(engine, source, 256, &raw mut stream) };
    (status, stream)
}

fn hum(engine: u64, source: u32) {
    let mut clip = 0;
    let tone: [f32; 64] =
        std::array::from_fn(|n| 0.5 * (n as f32 * std::f32::consts::FRAC_PI_8).sin());
    // SAFETY: the slice has 64 samples; the other is a variable.
    let made =
        unsafe { foresound_clip_from_samples(tone.as_ptr(), 64, 44_100, 44_100, &raw mut clip) };
    assert_eq!(made, Status::Ok);
    assert_eq!(foresound_source_play(engine, source, clip, 1), Status::Ok);
    assert_eq!(foresound_close(clip), Status::Ok);
}

/// The loudest sample of the last of thirty graphics frames.
fn loudest([engine, renderer]: [u64; 2], sources: &[Pose], expected: Status) -> f32 {
    let mut block = vec![0.0; 2 * 441];
    for _ in 0..30 {
        assert_eq!(tick(engine, sources), expected);
        let mut info = RenderInfo::default();
        // SAFETY: the block has twice as many floats as frames; the other is a variable.
        let status = unsafe { foresound_render(renderer, block.as_mut_ptr(), 441, &raw mut info) };
        assert_eq!(status, Status::Ok);
    }
    let peak = |most: f32, sample: &f32| most.max(sample.abs());
    block.iter().fold(0.0, peak)
}

fn close(handles: [u64; 2]) {
    for handle in handles {
        assert_eq!(foresound_close(handle), Status::Ok);
    }
}

/// Settings apply whatever poses are refused before and after.
#[test]
fn settings_apply_while_poses_are_refused() {
    let _turn = TURN.lock();
    let handles = engine(1);
    let handles = [handles.0, handles.1];
    let source = add(handles[0]);
    hum(handles[0], source);
    // No number, and beyond 1,000 km.
    for refused in [f32::NAN, -1e7] {
        assert!(loudest(handles, &[pose(source, -1.0)], Status::Ok) > 0.01);
        let bad = [pose(source, refused)];
        for (effects, quiet) in [(0, true), (31, false), (0, true)] {
            let options = SourceOptions {
                effects,
                ..SourceOptions::default()
            };
            // SAFETY: the address is a variable's.
            let configured =
                unsafe { foresound_source_configure(handles[0], source, &raw const options) };
            assert_eq!(configured, Status::Ok);
            let peak = loudest(handles, &bad, Status::BadArgument);
            assert_eq!(peak < 1e-4, quiet, "{peak} with effects {effects}");
            let peak = loudest(handles, &[], Status::Ok);
            assert_eq!(peak < 1e-4, quiet, "{peak} with effects {effects}");
        }
        // SAFETY: null for the defaults.
        let configured =
            unsafe { foresound_source_configure(handles[0], source, std::ptr::null()) };
        assert_eq!(configured, Status::Ok);
    }
    close(handles);
}

/// The header: an id is not reused.
#[test]
fn the_number_of_a_source_is_not_given_again() {
    let _turn = TURN.lock();
    let (engine, renderer) = engine(2);
    let first = add(engine);
    assert_eq!(foresound_source_remove(engine, first), Status::Ok);
    // More uses than sixteen bits count, of either slot.
    for n in 0..2 * (1 << 16) + 9 {
        let next = add(engine);
        assert_ne!(next, first, "after {n} others");
        assert_eq!(foresound_source_remove(engine, next), Status::Ok);
        assert_eq!(foresound_source_remove(engine, first), Status::StaleSource);
    }
    close([engine, renderer]);
}

#[test]
fn a_source_plays_on_if_its_stream_cannot_be_had() {
    let _turn = TURN.lock();
    let handles = engine(1);
    let handles = [handles.0, handles.1];
    let source = add(handles[0]);
    let mut streams = Vec::new();
    for _ in 0..HANDLES {
        let (status, handle) = stream(handles[0], source);
        assert_eq!(status, Status::Ok);
        streams.push(handle);
    }
    hum(handles[0], source);
    assert!(loudest(handles, &[], Status::Ok) > 0.01);
    assert_eq!(stream(handles[0], source), (Status::Full, 0));
    assert!(loudest(handles, &[], Status::Ok) > 0.01, "silenced");
    for handle in streams {
        assert_eq!(foresound_close(handle), Status::Ok);
    }
    close(handles);
}

#[test]
fn a_renderers_latency_is_told_while_it_renders() {
    let _turn = TURN.lock();
    let (engine, renderer) = engine(1);
    let latency = move || {
        let mut frames = 0;
        // SAFETY: the address is a variable's.
        let status = unsafe { foresound_renderer_latency(renderer, &raw mut frames) };
        (status, frames)
    };
    let told = latency();
    assert!(told.0 == Status::Ok && told.1 > 0, "{told:?}");
    // A render in progress has the renderer; the call neither waits for it nor takes the renderer from the next one.
    let (to, answer) = std::sync::mpsc::channel();
    let asking = std::thread::spawn(move || to.send(latency()));
    let during = RENDERERS.with(renderer, |_| {
        let wait = std::time::Duration::from_secs(5);
        Ok(answer.recv_timeout(wait).ok())
    });
    assert!(asking.join().is_ok());
    assert_eq!(during, Ok(Some(told)));
    close([engine, renderer]);
    assert_eq!(latency().0, Status::Closed);
}

/// RIFF pads a chunk of odd length by a byte.
#[test]
fn a_wav_file_with_a_chunk_of_odd_length_is_a_clip() {
    let _turn = TURN.lock();
    let mut bytes = b"RIFF\x36\0\0\0WAVELIST\x05\0\0\0INFOx\0fmt \x10\0\0\0\x01\0\x01\0".to_vec();
    bytes.extend(44_100u32.to_le_bytes());
    bytes.extend(88_200u32.to_le_bytes());
    bytes.extend(b"\x02\0\x10\0data\x04\0\0\0\x01\0\x02\0");
    let mut clip = 0;
    // SAFETY: the address and length of a list; the other is a variable.
    let status =
        unsafe { foresound_clip_from_wav(bytes.as_ptr(), bytes.len(), 44_100, &raw mut clip) };
    assert_eq!(status, Status::Ok);
    assert_eq!(foresound_close(clip), Status::Ok);
}

/// A scene is saved and comes back from the file and from its bytes; other bytes are refused.
#[test]
fn a_saved_scene_is_loaded_from_a_file_and_from_bytes() {
    let _turn = TURN.lock();
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("room.fscene");
    let path = std::ffi::CString::new(file.to_string_lossy().as_bytes()).expect("no zero");
    let room = foresound::scene::procedural::shoebox(glam::Vec3::new(4.0, 3.0, 5.0), "concrete");
    let options = foresound::bridge::scenes::SceneOptions::default();
    let scene = foresound::bridge::scenes::from_mesh(&room, None, &options, 0).expect("a scene");
    let info = |scene: u64| format!("{:?}", foresound::bridge::scenes::info(scene));
    // SAFETY: a text that ends in zero.
    let status = unsafe { foresound_scene_save(scene, path.as_ptr()) };
    assert_eq!(status, Status::Ok);
    let mut loaded = 0;
    let (no_text, no_options) = (std::ptr::null(), std::ptr::null());
    // SAFETY: a text, null pointers and the address of a variable.
    let status = unsafe {
        foresound_scene_from_file(path.as_ptr(), no_text, no_options, 0, &raw mut loaded)
    };
    assert_eq!((status, info(loaded)), (Status::Ok, info(scene)));
    let bytes = std::fs::read(&file).expect("the file");
    let mut other = 0;
    // SAFETY: the address and length of a list, and the address of a variable.
    let status = unsafe { foresound_scene_from_bytes(bytes.as_ptr(), bytes.len(), &raw mut other) };
    assert_eq!((status, info(other)), (Status::Ok, info(scene)));
    let mut none = 0;
    // SAFETY: the same, of fewer bytes.
    let status =
        unsafe { foresound_scene_from_bytes(bytes.as_ptr(), bytes.len() - 1, &raw mut none) };
    assert_eq!(status, Status::Format);
    close([scene, loaded]);
    assert_eq!(foresound_close(other), Status::Ok);
}

/// An output that cannot be had leaves the renderer open.
#[test]
fn a_renderer_stays_open_if_its_output_cannot_be_had() {
    let _turn = TURN.lock();
    let (engine, renderer) = engine(1);
    let mut output = 0;
    // SAFETY: the address is a variable's.
    let status = unsafe { foresound_output_start(renderer, 0, &raw mut output) };
    assert_eq!(status, Status::BadArgument);
    close([engine, renderer]);
}
