//! Random sequences of C calls with closed, foreign and invented handles, invalid poses and sizes. Every call returns a
//! status, never that of a caught panic, and rendered sound is finite.

use std::ffi::{CStr, CString};
use std::ptr;
use std::sync::atomic::{AtomicU64, Ordering};

use foresound::bridge::capi::*;
use foresound::bridge::engine::{PropagationOptions, SourceOptions};
use foresound::bridge::enumeration::{Affinity, Hrtf, Layout, Predictor, Schedule};
use foresound::bridge::scenes::{SceneInfo, SceneOptions};
use foresound::bridge::sound::RenderInfo;
use foresound::bridge::{EngineStatistics, Options, Pose, Status, VERSION};

use super::bytes::Bytes;
use super::c_playback::{apart, mix, play};

/// The input, and the handles and ids of earlier calls.
pub(super) struct World<'a> {
    pub(super) bytes: Bytes<'a>,
    handles: Vec<u64>,
    engines: Vec<u64>,
    pub(super) renderers: Vec<u64>,
    pub(super) sources: Vec<u32>,
    instances: Vec<u32>,
    /// Handles of all threads that make calls, open or closed.
    shared: &'a [AtomicU64],
}

impl World<'_> {
    /// Keeps a new handle, and shows it to other threads.
    pub(super) fn made(&mut self, handle: u64) {
        self.handles.push(handle);
        let at = self.bytes.below(self.shared.len());
        if let Some(shown) = self.shared.get(at) {
            shown.store(handle, Ordering::Relaxed);
        }
    }

    /// Mostly the newest handle of its kind, sometimes any, or one of another thread, rarely an invented one.
    pub(super) fn handle(&mut self, of: fn(&Self) -> &Vec<u64>) -> u64 {
        match self.bytes.byte() {
            255 => self.bytes.long(),
            kind @ 200..=254 => {
                let count = self.handles.len().max(1);
                let at = usize::from(kind) % count;
                self.handles.get(at).copied().unwrap_or(0)
            }
            kind @ 80..=199 if !self.shared.is_empty() => {
                let at = usize::from(kind) % self.shared.len();
                self.shared[at].load(Ordering::Relaxed)
            }
            _ => of(self).last().copied().unwrap_or(0),
        }
    }

    pub(super) fn engine(&mut self) -> u64 {
        self.handle(|world| &world.engines)
    }

    pub(super) fn any(&mut self) -> u64 {
        self.handle(|world| &world.handles)
    }

    pub(super) fn source(&mut self) -> u32 {
        match self.bytes.byte() {
            255 => self.bytes.word(),
            tame => {
                let at = usize::from(tame) % self.sources.len().max(1);
                self.sources.get(at).copied().unwrap_or(0)
            }
        }
    }

    fn instance(&mut self) -> u32 {
        let newest = self.instances.last().copied().unwrap_or(0);
        match self.bytes.byte() {
            255 => self.bytes.word(),
            tame => newest.wrapping_sub(u32::from(tame) % 2),
        }
    }

    pub(super) fn pose(&mut self) -> Pose {
        let orientation = match self.bytes.byte() {
            200.. => self.bytes.numbers(),
            _ => [0.0, 0.0, 0.0, 1.0],
        };
        Pose {
            source: self.source(),
            position_m: self.bytes.numbers(),
            orientation,
        }
    }
}

/// Whether the call succeeded. No call may end in a caught panic; every error has a message of one line.
pub(super) fn succeeds(status: Status) -> bool {
    assert_ne!(status, Status::Panic);
    // SAFETY: the text lives until this thread's next failure.
    let text = unsafe { CStr::from_ptr(foresound_last_error()) };
    assert!(status == Status::Ok || text.to_str().is_ok_and(|t| t.lines().count() <= 1));
    status == Status::Ok
}

fn options(bytes: &mut Bytes) -> Options {
    let mut options = Options {
        rate_hz: 16_000,
        block_frames: 64,
        max_sources: 4,
        max_voices: 16,
        fine_voices: 4,
        max_paths: 64,
        guide_rays: 16,
        source_rays: 8,
        schedule: Schedule::Synchronous,
        hrtf: Hrtf::None,
        frame_s: 0.01,
        max_delay_s: 0.05,
        ..Options::default()
    };
    // One option is arbitrary, within bounds on time and memory.
    let word = [0, 1, 3, 33, u32::MAX, 7][bytes.below(6)];
    let number = bytes.number();
    match bytes.byte() {
        0 => options.rate_hz = word,
        1 => options.block_frames = word,
        2 => options.max_sources = word,
        3 => options.max_voices = word,
        4 => options.fine_voices = word,
        5 => options.max_paths = word,
        6 => options.guide_rays = word,
        7 => options.source_rays = word,
        8 => options.depth = word,
        9 => options.schedule = Schedule(word),
        10 => options.predictor = Predictor(word),
        11 => options.affinity = Affinity(word),
        12 => options.hrtf = Hrtf(word),
        13 => options.late_reverb = word,
        14 => options.limiter = word,
        15 => options.min_distance_m = number,
        16 => options.ceiling_db = number,
        17 => options.frame_s = number.into(),
        18 => options.max_delay_s = f64::from(number).min(0.5),
        19 => options.size = word,
        20 => options.predictor = Predictor::Geometric,
        21 => options.source_slots = word,
        22 => options.tracing_threads = word,
        23 => options.diffraction_order = word,
        24 => options.even_blocks = word,
        25 => options.layout = Layout(word),
        26 => options.output_channels = word,
        27 => options.output_channels = 16,
        28 => options.source_buses = word,
        29 => options.listeners = word,
        30..=120 => options.source_buses = 1,
        121..=160 => (options.listeners, options.source_buses) = (2, 1),
        _ => {}
    }
    options
}

fn scene(world: &mut World) -> Option<u64> {
    let vertices = world.bytes.below(12);
    let positions: Vec<f32> = (0..3 * vertices).map(|_| world.bytes.number()).collect();
    let indices: Vec<u32> = (0..world.bytes.below(40))
        .map(|_| world.bytes.word() % (vertices as u32 + 1))
        .collect();
    let length = world.bytes.below(60);
    let text = CString::new(world.bytes.take(length)).unwrap_or_default();
    let materials = match world.bytes.byte() {
        200.. => text.as_ptr(),
        _ => ptr::null(),
    };
    let options = SceneOptions {
        temperature_c: match world.bytes.byte() {
            200.. => world.bytes.number(),
            _ => 20.0,
        },
        ..SceneOptions::default()
    };
    let mut scene = 0;
    // SAFETY: addresses of the stated numbers of values, of a terminated text, and of variables.
    let status = unsafe {
        foresound_scene_from_mesh(
            positions.as_ptr(),
            vertices,
            indices.as_ptr(),
            indices.len(),
            ptr::null(),
            ptr::null(),
            0,
            materials,
            &raw const options,
            0,
            &raw mut scene,
        )
    };
    succeeds(status).then_some(scene)
}

fn render(world: &mut World) {
    let renderer = world.handle(|world| &world.renderers);
    let frames = [0usize, 1, 63, 64, 160][world.bytes.below(5)];
    let mut channels = 0;
    // SAFETY: the address of a variable.
    if !succeeds(unsafe { foresound_renderer_channels(renderer, &raw mut channels) }) {
        channels = 2;
    }
    let mut block = vec![f32::NAN; channels as usize * frames];
    let mut info = RenderInfo::default();
    let (output, info) = (block.as_mut_ptr(), &raw mut info);
    // SAFETY: the block has as many floats as channels times frames; the other is a variable.
    let status = unsafe { foresound_render_channels(renderer, output, channels, frames, info) };
    assert_ne!(status, Status::Panic);
    if status == Status::Ok {
        assert!(block.iter().all(|s| s.is_finite()), "{block:?}");
    }
}

fn sound(world: &mut World) {
    let (engine, source) = (world.engine(), world.source());
    let mut handle = 0;
    match world.bytes.below(5) {
        3 => {
            let samples = [world.bytes.number(); 24];
            let count = [24, 8, 23, 0][world.bytes.below(4)];
            // SAFETY: addresses of 24 samples, at least as many as stated, and of a variable.
            let status = unsafe {
                foresound_clip_from_ambix(samples.as_ptr(), count, 16_000, 16_000, &raw mut handle)
            };
            if succeeds(status) {
                world.made(handle);
            }
            succeeds(foresound_source_play(engine, source, handle, 1));
        }
        4 => {
            let begin: &[u8] =
                [&b"fLaC\0\0\0\x22"[..], b"OggS\0\x02", b"RIFF"][world.bytes.below(3)];
            let channels = world.bytes.byte().into();
            let bytes = [begin, world.bytes.take(64)].concat();
            // SAFETY: the address of as many bytes and of a variable.
            let status = unsafe {
                foresound_clip_from_file(
                    bytes.as_ptr(),
                    bytes.len(),
                    channels,
                    16_000,
                    &raw mut handle,
                )
            };
            if succeeds(status) {
                world.made(handle);
            }
        }
        0 => {
            let samples = [world.bytes.number(); 24];
            let rate_hz = [16_000, 44_100, 0, 1][world.bytes.below(4)];
            // SAFETY: addresses of 24 samples and of a variable.
            let status = unsafe {
                foresound_clip_from_samples(samples.as_ptr(), 24, rate_hz, 16_000, &raw mut handle)
            };
            if succeeds(status) {
                world.made(handle);
            }
            let looped = world.bytes.byte().into();
            let clip = match world.bytes.byte() {
                200.. => world.any(),
                _ => handle,
            };
            succeeds(foresound_source_play(engine, source, clip, looped));
        }
        1 => {
            let capacity = [0, 1, 100, usize::MAX][world.bytes.below(4)];
            // SAFETY: the address of a variable.
            let status =
                unsafe { foresound_source_stream(engine, source, capacity, &raw mut handle) };
            if succeeds(status) {
                world.made(handle);
            }
        }
        _ => {
            let (stream, mut written) = (world.any(), 0);
            let samples = [world.bytes.number(); 50];
            // SAFETY: addresses of 50 samples and of a variable.
            let status =
                unsafe { foresound_stream_write(stream, samples.as_ptr(), 50, &raw mut written) };
            assert!(status != Status::Panic && written <= 50);
        }
    }
}

fn change(world: &mut World) {
    let (engine, source) = (world.engine(), world.source());
    let status = match world.bytes.below(16) {
        0 => foresound_source_remove(engine, source),
        1 => foresound_source_set_gain(engine, source, world.bytes.number()),
        2 => foresound_source_mute(engine, source, world.bytes.byte().into()),
        3 => foresound_source_stop(engine, source),
        4 => foresound_engine_pause(engine),
        5 => foresound_engine_resume(engine),
        6 => foresound_engine_restart(engine),
        8 => {
            let (part, pose, mut instance) = (world.any(), world.pose(), 0);
            let add = match world.instances.len() % 2 {
                0 => foresound_instance_add,
                _ => foresound_instance_add_joined,
            };
            // SAFETY: the addresses are a pose's and a variable's.
            let status = unsafe {
                add(
                    engine,
                    part,
                    &raw const pose,
                    size_of::<Pose>(),
                    &raw mut instance,
                )
            };
            if status == Status::Ok {
                world.instances.push(instance);
            }
            status
        }
        9 => {
            let (instance, pose) = (world.instance(), world.pose());
            // SAFETY: the address of a pose.
            unsafe { foresound_instance_move(engine, instance, &raw const pose, size_of::<Pose>()) }
        }
        10 => foresound_instance_remove(engine, world.instance()),
        11 => foresound_engine_set_predictor(engine, Predictor(world.bytes.below(4) as u32)),
        12 => foresound_engine_set_schedule(engine, Schedule(world.bytes.below(3) as u32)),
        14 => foresound_engine_set_layout(engine, Layout(world.bytes.below(10) as u32)),
        15 => {
            let length = world.bytes.below(60);
            let set = world.bytes.take(length).to_vec();
            // SAFETY: the address of as many bytes.
            unsafe { foresound_engine_set_hrtf(engine, set.as_ptr(), set.len()) }
        }
        13 => {
            let levels = [world.bytes.number(); 24];
            let count = [0, 8, 16, 17, 24][world.bytes.below(5)];
            // SAFETY: the address of as many levels or more.
            unsafe {
                foresound_source_set_directivity_table(engine, source, levels.as_ptr(), count)
            }
        }
        _ => {
            let options = SourceOptions {
                effects: world.bytes.byte().into(),
                radius_m: world.bytes.number(),
                order: world.bytes.number(),
                directivity: [world.bytes.number(); 8],
                extent_m: world.bytes.numbers(),
                extent_points: world.bytes.byte().into(),
                ..SourceOptions::default()
            };
            // SAFETY: the address of a structure.
            unsafe { foresound_source_configure(engine, source, &raw const options) }
        }
    };
    succeeds(status);
}

fn step(world: &mut World) {
    match world.bytes.below(15) {
        0 if world.engines.len() < 3 => {
            let options = options(&mut world.bytes);
            let (mut engine, mut renderer) = (0, 0);
            // SAFETY: addresses of a structure and of variables; a null pointer for no HRTF set.
            let status = unsafe {
                foresound_engine_create(
                    VERSION,
                    &raw const options,
                    ptr::null(),
                    0,
                    &raw mut engine,
                    &raw mut renderer,
                )
            };
            if succeeds(status) {
                world.made(engine);
                world.made(renderer);
                world.engines.push(engine);
                world.renderers.push(renderer);
            }
        }
        1 => {
            if let Some(scene) = scene(world) {
                world.made(scene);
                let mut info = SceneInfo::default();
                // SAFETY: the address of a variable.
                let is_told = succeeds(unsafe { foresound_scene_info(scene, &raw mut info) });
                // Another thread may have closed it.
                assert!(is_told || !world.shared.is_empty());
                let engine = world.engine();
                succeeds(foresound_engine_set_scene(engine, scene));
            }
        }
        2 => {
            let (engine, position) = (world.engine(), world.bytes.numbers::<3>());
            let mut source = 0;
            // SAFETY: the address of a variable.
            let status = unsafe {
                foresound_source_add(
                    engine,
                    position[0],
                    position[1],
                    position[2],
                    &raw mut source,
                )
            };
            if succeeds(status) {
                world.sources.push(source);
            }
        }
        3 | 4 => {
            let (engine, listener) = (world.engine(), world.pose());
            let poses: Vec<Pose> = (0..world.bytes.below(6)).map(|_| world.pose()).collect();
            // SAFETY: addresses of a pose and of as many as the list has.
            succeeds(unsafe {
                foresound_engine_tick(
                    engine,
                    &raw const listener,
                    poses.as_ptr(),
                    poses.len(),
                    size_of::<Pose>(),
                )
            });
        }
        5 | 6 => render(world),
        7 => sound(world),
        8 => change(world),
        9 => {
            let engine = world.engine();
            let rays = [0, 1, 16, u32::MAX][world.bytes.below(4)];
            let options = PropagationOptions {
                guide_rays: rays,
                source_rays: 8,
                depth: world.bytes.below(6) as u32,
                ..PropagationOptions::default()
            };
            // SAFETY: the address of a structure.
            succeeds(unsafe { foresound_engine_set_propagation(engine, &raw const options) });
        }
        10 => {
            let (engine, mut statistics) = (world.engine(), EngineStatistics::default());
            // SAFETY: the address of a variable.
            succeeds(unsafe { foresound_engine_statistics(engine, &raw mut statistics) });
        }
        11 => play(world),
        12 => mix(world),
        13 => apart(world),
        _ => {
            let handle = world.any();
            succeeds(foresound_close(handle));
        }
    }
}

/// Any sequence of calls.
pub(crate) fn c_calls(data: &[u8]) {
    c_calls_beside(data, &[]);
}

/// Any sequence of calls, beside those of other threads with the same handles.
pub(crate) fn c_calls_beside(data: &[u8], shared: &[AtomicU64]) {
    let mut world = World {
        shared,
        bytes: Bytes(data),
        handles: Vec::new(),
        engines: Vec::new(),
        renderers: Vec::new(),
        sources: Vec::new(),
        instances: Vec::new(),
    };
    for _ in 0..64 {
        if world.bytes.is_empty() {
            break;
        }
        step(&mut world);
    }
    for handle in world.handles {
        let status = foresound_close(handle);
        assert!(matches!(status, Status::Ok | Status::Closed), "{status:?}");
    }
}
