//! Bounds of memory: at any input a stated number of bytes is not exceeded, excess is refused or counted, and unused
//! memory is freed. Bytes in use are counted by the allocator, of all threads.

#[path = "limits/heaps.rs"]
mod heaps;

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use foresound::Error;
use foresound::bridge::clip;
use foresound::extrapolation::PredictorKind;
use foresound::runtime::{AffinityPolicy, Engine, EngineSettings};
use foresound::scene::mesh::MOST_TRIANGLES;
use foresound::scene::{
    ListenerPose, MaterialTable, MeshOptions, Scene, SceneSettings, load_mesh, procedural,
};
use foresound_tools::clip::{MOST_SAMPLES, load_clip, load_clip_within};
use foresound_tools::listener_path::{LARGEST_FILE, ListenerPath};
use glam::Vec3;

static LIVE: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

/// The system's allocator, with the current and the maximum number of bytes in use.
struct Weighing;

fn came(bytes: usize) {
    let live = LIVE.fetch_add(bytes, Ordering::Relaxed) + bytes;
    MOST.fetch_max(live, Ordering::Relaxed);
}

// SAFETY: every call goes to the system's allocator with the caller's own arguments; counting touches no heap.
unsafe impl GlobalAlloc for Weighing {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        came(layout.size());
        // SAFETY: the caller keeps the contract, which is the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: `pointer` came from `System` through this allocator with this layout, as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Weighing = Weighing;

/// Bytes belong to the whole process: measuring tests take turns.
#[expect(clippy::disallowed_types, reason = "tests that weigh take turns")]
static TURN: std::sync::Mutex<()> = std::sync::Mutex::new(());

/// Runs `act`; returns its result and the maximum of bytes in use beyond those before.
fn peak_bytes_of<T>(act: impl FnOnce() -> T) -> (T, usize) {
    let before = LIVE.load(Ordering::Relaxed);
    MOST.store(before, Ordering::Relaxed);
    let result = act();
    (result, MOST.load(Ordering::Relaxed) - before)
}

/// A mesh file of so many triangles that share a row of vertices.
fn write_obj(path: &Path, triangles: usize) {
    let mut file = BufWriter::new(std::fs::File::create(path).expect("a file"));
    for n in 0..1000 {
        writeln!(file, "v {n} {} {}", n % 7, n % 11).expect("written");
    }
    for n in 0..triangles {
        let a = n % 990 + 1;
        writeln!(file, "f {a} {} {}", a + 1 + n / 990 % 5, a + 7).expect("written");
    }
}

fn refused<T: std::fmt::Debug>(result: Result<T, Error>, words: &str) {
    let text = result.expect_err(words).to_string();
    assert!(text.contains(words), "{text}");
}

#[test]
fn a_mesh_file_beyond_the_limit_is_refused_in_little_memory() {
    let _turn = TURN.lock();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("large.obj");
    write_obj(&path, 100_000);
    let options = MeshOptions::default().with_max_triangles(5000);
    let (result, bytes) = peak_bytes_of(|| load_mesh(&path, &options));
    refused(result, "more than 5000 triangles");
    assert!(bytes < 5000 * 200 + (1 << 20), "{bytes} bytes");
    // Below the limit it is read, within the bytes a triangle that the setting states.
    let options = MeshOptions::default().with_max_triangles(100_000);
    let (result, bytes) = peak_bytes_of(|| load_mesh(&path, &options));
    let mesh = result.expect("is read").mesh;
    assert_eq!(mesh.triangles.len(), 100_000);
    assert!(bytes < 100_000 * 200 + (1 << 20), "{bytes} bytes");
    for (line, words) in [("v 1 2 3\n", "vertices"), ("usemtl m", "materials")] {
        let mut text = String::new();
        for n in 0..200 {
            text.push_str(line);
            if line.starts_with('u') {
                text.push_str(&format!("{n}\n"));
            }
        }
        let path = folder.path().join("many.obj");
        std::fs::write(&path, text).expect("written");
        let options = MeshOptions::default().with_max_triangles(50);
        refused(load_mesh(&path, &options), words);
    }
}

/// The same at full size, in few bytes: faces of a hundred thousand corners make more triangles than the default allows.
#[test]
fn more_triangles_than_the_default_are_refused() {
    const CORNERS: usize = 100_000;
    let _turn = TURN.lock();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("huge.obj");
    let mut file = BufWriter::new(std::fs::File::create(&path).expect("a file"));
    let face = format!("f{}\n", " 1 2 3 4".repeat(CORNERS / 4));
    writeln!(file, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0").expect("written");
    for _ in 0..=MOST_TRIANGLES / (CORNERS - 2) {
        file.write_all(face.as_bytes()).expect("written");
    }
    drop(file);
    let (result, bytes) = peak_bytes_of(|| load_mesh(&path, &MeshOptions::default()));
    refused(result, &format!("more than {MOST_TRIANGLES} triangles"));
    assert!(bytes < MOST_TRIANGLES * 200, "{bytes} bytes");
}

#[test]
fn a_mesh_beyond_the_limit_is_refused_before_anything_is_built() {
    let _turn = TURN.lock();
    let mesh = procedural::by_name("doorway").expect("a scene").mesh;
    let table = MaterialTable::built_in();
    let mut settings = SceneSettings::default();
    settings.max_triangles = mesh.triangles.len() - 1;
    let (result, bytes) = peak_bytes_of(|| Scene::commit(&mesh, &table, &settings));
    refused(result, "max_triangles");
    assert!(bytes < 4096, "{bytes} bytes");
}

/// The header of a mono WAV file of 16 bits and so many bytes of sound.
fn wav_header(bytes: u32) -> Vec<u8> {
    wav_header_at(44_100, bytes)
}

fn wav_header_at(rate_hz: u32, bytes: u32) -> Vec<u8> {
    let mut header = b"RIFF".to_vec();
    header.extend(bytes.saturating_add(36).to_le_bytes());
    header.extend(b"WAVEfmt \x10\0\0\0\x01\0\x01\0");
    header.extend(rate_hz.to_le_bytes());
    header.extend((2 * rate_hz).to_le_bytes());
    header.extend(b"\x02\0\x10\0data");
    header.extend(bytes.to_le_bytes());
    header
}

#[test]
fn four_gigabytes_of_sound_are_refused_by_their_header() {
    let _turn = TURN.lock();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("huge.wav");
    let bytes = 0xffff_ff00;
    std::fs::write(&path, wav_header(bytes)).expect("written");
    // Sparse on the disk, if the file system supports it.
    let file = std::fs::File::options()
        .write(true)
        .open(&path)
        .expect("opens");
    file.set_len(44 + u64::from(bytes)).expect("a sparse file");
    let (result, used) = peak_bytes_of(|| load_clip(&path, 44_100));
    refused(result, &format!("more than {MOST_SAMPLES}"));
    assert!(used < 1 << 16, "{used} bytes");
    std::fs::write(&path, [wav_header(2000), vec![1; 2000]].concat()).expect("written");
    refused(load_clip_within(&path, 44_100, 999), "more than 999");
    assert!(load_clip_within(&path, 44_100, 1000).is_ok());
}

/// Bytes of samples and of their conversion, at four bytes each, besides which a conversion takes a fixed amount.
fn converted_bytes(from_hz: u32, to_hz: u32, count: usize) -> usize {
    4 * count + 4 * (count * to_hz as usize).div_ceil(from_hz as usize)
}

#[test]
fn converting_a_sound_takes_the_memory_of_both_rates() {
    let _turn = TURN.lock();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("sound.wav");
    for (from_hz, to_hz, count) in [
        (48_000, 44_100, 1 << 22),
        (44_100, 48_000, 1 << 22),
        (44_101, 48_000, 1 << 21),
        (1000, 48_000, 200_000),
        (384_000, 44_100, 1 << 22),
    ] {
        let samples = vec![1u8; 2 * count];
        let file = [wav_header_at(from_hz, 2 * count as u32), samples].concat();
        let expected = converted_bytes(from_hz, to_hz, count);
        // The table of the kernel, the handle.
        let (result, used) = peak_bytes_of(|| clip::from_wav(&file, 1, to_hz));
        let handle = result.expect("is a sound");
        assert!(used < expected + (1 << 21), "{used} of {expected} bytes");
        foresound::bridge::close(handle).expect("is open");
        std::fs::write(&path, &file).expect("written");
        // Transforms of up to 2 ^ 18 numbers of 16 bytes, and their tables.
        let (result, used) = peak_bytes_of(|| load_clip(&path, to_hz));
        result.expect("is a sound");
        assert!(used < expected + (1 << 25), "{used} of {expected} bytes");
    }
}

#[test]
fn sound_that_its_conversion_would_blow_up_is_refused() {
    let _turn = TURN.lock();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("slow.wav");
    for bytes in [8 << 20, 32 << 20] {
        let file = [wav_header_at(1000, bytes), vec![1; bytes as usize]].concat();
        std::fs::write(&path, &file).expect("written");
        let (result, used) = peak_bytes_of(|| load_clip(&path, 48_000));
        refused(result, &format!("{} samples at 48000 Hz", 24 * bytes));
        assert!(used < 1 << 16, "{used} bytes");
        let (result, used) = peak_bytes_of(|| clip::from_wav(&file, 1, 48_000));
        let text = result.expect_err("too long").to_string();
        assert!(text.contains(&format!("{} samples", 24 * bytes)), "{text}");
        assert!(used < 1 << 16, "{used} bytes");
    }
}

/// Silence of half a minute in a few kilobytes: what is decoded is counted, not what is read.
#[test]
fn compressed_sound_is_refused_in_the_memory_of_the_limit() {
    let _turn = TURN.lock();
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fuzz/seeds/compressed");
    let path = seeds.join("silence.flac");
    let bytes = std::fs::read(&path).expect("is there");
    assert!(bytes.len() < 1 << 15);
    let (result, used) = peak_bytes_of(|| load_clip_within(&path, 44_100, 1 << 17));
    refused(result, "more than 131072 samples");
    // The samples, the copy while their list grows, and the decoder.
    assert!(used < (1 << 17) * 12 + (1 << 20), "{used} bytes");
    let (result, _) = peak_bytes_of(|| load_clip(&path, 48_000));
    assert_eq!(
        result.expect("is short enough").0.samples.len(),
        30 * 48_000
    );
}

#[cfg(unix)]
#[test]
fn endless_files_are_refused() {
    let _turn = TURN.lock();
    let endless = Path::new("/dev/zero");
    let (result, bytes) = peak_bytes_of(|| ListenerPath::parse("/dev/zero").map(drop));
    refused(result, "64 MiB");
    // A growing list holds the old half while it doubles.
    assert!(
        bytes as u64 <= 3 * LARGEST_FILE + (1 << 20),
        "{bytes} bytes"
    );
    let (result, bytes) = peak_bytes_of(|| MaterialTable::load(endless).map(drop));
    refused(result, "16 MiB");
    assert!(bytes <= 3 << 24, "{bytes} bytes");
    let (result, bytes) = peak_bytes_of(|| load_mesh(endless, &MeshOptions::default()).map(drop));
    refused(result, "binary");
    assert!(bytes <= 4 << 20, "{bytes} bytes");
    refused(load_clip(endless, 44_100).map(drop), "no WAV");
}

/// Threads of this process that build scenes, where the system lists them.
fn builders() -> usize {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else {
        return 0;
    };
    let named = |entry: std::io::Result<std::fs::DirEntry>| {
        let name = std::fs::read_to_string(entry.ok()?.path().join("comm")).ok()?;
        name.starts_with("foresound-scene").then_some(())
    };
    tasks.filter_map(named).count()
}

#[test]
fn abandoned_scenes_are_freed_and_do_not_accumulate() {
    let _turn = TURN.lock();
    let mut settings = EngineSettings::default();
    settings.affinity = AffinityPolicy::System;
    let (mut controller, renderer) = Engine::new(settings).expect("an engine");
    let mesh = procedural::by_name("bootcamp").expect("a scene").mesh;
    let table = MaterialTable::built_in();
    let listener = ListenerPose::facing(Vec3::ONE, 0.0);
    let quiet = |controller: &mut foresound::runtime::Controller| {
        while controller.is_building() || builders() > 0 {
            controller.tick(listener, &[]).expect("builds");
            std::thread::yield_now();
        }
    };
    // A scene at rest, as at the end.
    let small = procedural::shoebox(Vec3::new(4.0, 3.0, 5.0), "concrete");
    let build = |controller: &mut foresound::runtime::Controller, mesh| {
        let built = controller.build_scene(mesh, table.clone(), SceneSettings::default());
        built.expect("a thread");
    };
    let one = {
        let settings = SceneSettings::default();
        let (scene, bytes) = peak_bytes_of(|| Scene::commit(&mesh, &table, &settings));
        drop(scene.expect("a scene"));
        bytes
    };
    build(&mut controller, small.clone());
    quiet(&mut controller);
    let before = LIVE.load(Ordering::Relaxed);
    let ((), most) = peak_bytes_of(|| {
        for _ in 0..40 {
            build(&mut controller, mesh.clone());
            assert!(builders() <= 1, "{} builders", builders());
            controller.tick(listener, &[]).expect("a valid pose");
        }
        build(&mut controller, small.clone());
        quiet(&mut controller);
    });
    // One build and two meshes, plus the engine's other memory.
    assert!(
        most < 2 * one + (8 << 20),
        "{most} bytes; a build takes {one}"
    );
    drop(controller);
    drop(renderer);
    let after = LIVE.load(Ordering::Relaxed);
    assert!(after <= before, "{after} bytes from {before}");
}

/// Every bound of an engine's buffers is a setting with a range, and values beyond are refused by name.
#[test]
fn bounds_are_settings_with_ranges() {
    let _turn = TURN.lock();
    let good = EngineSettings::default();
    let with = |change: &dyn Fn(&mut EngineSettings)| {
        let mut settings = good.clone();
        change(&mut settings);
        Engine::new(settings).map(drop)
    };
    for most in [0, usize::MAX] {
        refused(with(&|s| s.block_frames = most), "block_frames");
        refused(with(&|s| s.max_paths = most), "max_paths");
        refused(with(&|s| s.max_sources = Some(most)), "max_sources");
        refused(with(&|s| s.tracing_threads = most), "tracing_threads");
        refused(with(&|s| s.generation.max_sources = most), "max_sources");
        refused(with(&|s| s.generation.max_voices = most), "max_voices");
    }
    refused(with(&|s| s.trace_spans = usize::MAX), "trace_spans");
    refused(
        with(&|s| s.generation.max_delay_s = f64::NAN),
        "max_delay_s",
    );
    refused(with(&|s| s.generation.max_delay_s = 1e9), "max_delay_s");
    refused(
        with(&|s| s.propagation.cache_capacity = usize::MAX),
        "cache_capacity",
    );
    refused(with(&|s| s.propagation.guide_rays = u32::MAX), "guide_rays");
}

/// An engine's memory is what its settings state before it is made.
#[test]
fn an_engines_memory_is_stated_before_it_is_made() {
    let _turn = TURN.lock();
    let with = |change: &dyn Fn(&mut EngineSettings)| {
        let mut settings = EngineSettings::default();
        settings.affinity = AffinityPolicy::System;
        change(&mut settings);
        settings
    };
    let geometric = PredictorKind::ALL[2];
    for settings in [
        with(&|_| ()),
        with(&|s| s.generation.max_sources = 1),
        with(&|s| {
            s.generation.max_sources = 64;
            s.generation.max_delay_s = 5.0;
        }),
        with(&|s| s.generation.max_voices = 1),
        with(&|s| s.generation.max_voices = 16_384),
        with(&|s| s.max_paths = 16_384),
        with(&|s| {
            s.max_paths = 16_384;
            s.predictor = geometric;
        }),
        with(&|s| s.max_sources = Some(4096)),
        with(&|s| s.trace_spans = 1 << 20),
        with(&|s| s.block_frames = 4096),
        with(&|s| s.max_snapshot_paths = 16_384),
        with(&|s| {
            s.generation.listeners = 4;
            s.max_paths = 16_384;
            s.predictor = geometric;
        }),
    ] {
        // Delay lines begin with 0.15 s.
        let mut first = settings.clone();
        first.generation.max_delay_s = first.generation.max_delay_s.min(0.15);
        let stated = first.memory_bytes();
        let (engine, bytes) = peak_bytes_of(|| Engine::new(settings.clone()));
        drop(engine.expect("an engine"));
        let ratio = bytes as f64 / stated as f64;
        assert!(
            (0.75..1.1).contains(&ratio),
            "{bytes} of {stated}: {settings:?}"
        );
    }
}

/// The largest engine of the ranges is refused in words and in little memory, unless it is asked for.
#[test]
fn an_engine_of_gigabytes_is_refused_in_words() {
    let _turn = TURN.lock();
    let mut settings = EngineSettings::default();
    settings.affinity = AffinityPolicy::System;
    settings.generation.rate_hz = 48_000;
    settings.generation.max_sources = 256;
    settings.generation.max_delay_s = 10.0;
    let (result, bytes) = peak_bytes_of(|| Engine::new(settings.clone()).map(drop));
    refused(result, "max_memory_bytes");
    assert!(bytes < 1 << 16, "{bytes} bytes");
    assert!(settings.memory_bytes() > 3_800_000_000);
    settings.generation.max_delay_s = 1.0;
    settings.max_memory_bytes = 1 << 20;
    refused(Engine::new(settings).map(drop), "max_memory_bytes");
}
