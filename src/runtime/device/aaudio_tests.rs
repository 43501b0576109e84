//! The AAudio output and the crate `ndk`, unchanged, against a made-up libaaudio: the scenario of `tests/device_output.rs`.
//!
//! The functions below have the names of Android's library, so the linker gives them to `ndk`. The requested sample rate
//! selects a test's behaviour, as the functions are shared by all tests of this program.
//!
//! Unsafe: names without mangling; calls of `ndk`'s callbacks; an allocator that counts.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use glam::Vec3;

use super::aaudio::{AaudioDevice, SharedCallback};
use super::output::{DeviceOutput, DeviceReport};
use crate::output::{Device, DeviceCallback, DeviceInterface};
use crate::runtime::{AffinityPolicy, Engine, EngineSettings};
use crate::scene::ListenerPose;

/// The system's allocator, which counts the operations of each thread.
struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

thread_local! {
    static OPERATIONS: Cell<u64> = const { Cell::new(0) };
}

/// Counts an operation; a thread in destruction has no count any more.
fn count() {
    let _ = OPERATIONS.try_with(|operations| operations.set(operations.get() + 1));
}

// SAFETY: every call goes to the system's allocator with the caller's own arguments; counting touches no heap. The other
// functions of the trait call these two.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller keeps the contract, which is the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count();
        // SAFETY: `pointer` came from `System` with this layout, as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Plays by [`SCRIPT`].
const SCRIPTED_HZ: i32 = 44_100;
/// Plays until it is stopped.
const PLAYING_HZ: i32 = 48_000;
/// Is granted another rate.
const OTHER_HZ: i32 = 22_050;
/// Fails to close.
const UNCLOSABLE_HZ: i32 = 16_000;
/// Is lost after one block, by a thread that closing does not wait for.
const LATE_HZ: i32 = 8_000;

const UNAVAILABLE: i32 = -889;
const DISCONNECTED: i32 = -899;
const INVALID_STATE: i32 = -895;

#[derive(Clone, Copy, PartialEq)]
enum Behaviour {
    FailsToOpen,
    /// Plays some blocks, then another thread reports the loss while the blocks go on until the callback asks to stop.
    IsLost,
    /// Plays one block, then stops calling back.
    Stalls,
    Plays,
    /// As `IsLost`, after one block; nothing waits for the thread that reports.
    IsLostLate,
}

const SCRIPT: [Behaviour; 5] = [
    Behaviour::FailsToOpen,
    Behaviour::IsLost,
    Behaviour::FailsToOpen,
    Behaviour::Stalls,
    Behaviour::Plays,
];

/// Counts of one rate.
struct Seen {
    openings: AtomicU32,
    open: AtomicU32,
    most_open: AtomicU32,
    /// Nonzero samples.
    heard: AtomicU64,
    /// Operations of the allocator inside of callbacks.
    allocations: AtomicU64,
    /// Blocks after which the callback asked to stop.
    stopped: AtomicU32,
    /// Streams closed without a stop before.
    closed_playing: AtomicU32,
}

static SEEN: [Seen; 5] = [const { Seen::new() }; 5];

impl Seen {
    const fn new() -> Self {
        Self {
            openings: AtomicU32::new(0),
            open: AtomicU32::new(0),
            most_open: AtomicU32::new(0),
            heard: AtomicU64::new(0),
            allocations: AtomicU64::new(0),
            stopped: AtomicU32::new(0),
            closed_playing: AtomicU32::new(0),
        }
    }

    fn of(rate_hz: i32) -> &'static Self {
        let rates = [SCRIPTED_HZ, PLAYING_HZ, OTHER_HZ, UNCLOSABLE_HZ, LATE_HZ];
        let place = rates.iter().position(|rate| *rate == rate_hz);
        &SEEN[place.expect("a test's rate")]
    }
}

type DataFunction = unsafe extern "C" fn(usize, usize, *mut c_void, i32) -> i32;
type ErrorFunction = unsafe extern "C" fn(usize, usize, i32);

/// `AAudioStreamBuilder`.
#[derive(Clone, Default)]
struct Builder {
    rate_hz: i32,
    channels: i32,
    format: i32,
    performance: i32,
    exclusive: bool,
    data: Option<(DataFunction, usize)>,
    error: Option<(ErrorFunction, usize)>,
}

/// `AAudioStream`.
struct Stream {
    settings: Builder,
    behaviour: Behaviour,
    buffer_frames: i32,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

mod library {
    use super::*;

    #[unsafe(no_mangle)]
    extern "C" fn __android_log_write(_: i32, _: usize, _: usize) -> i32 {
        0
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudio_createStreamBuilder(builder: &mut *mut Builder) -> i32 {
        *builder = Box::into_raw(Box::default());
        0
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStreamBuilder_delete(_: Box<Builder>) -> i32 {
        0
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStreamBuilder_setDirection(_: &mut Builder, direction: i32) {
        assert_eq!(direction, 0, "not an output");
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStreamBuilder_setPerformanceMode(builder: &mut Builder, mode: i32) {
        builder.performance = mode;
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStreamBuilder_setSharingMode(builder: &mut Builder, mode: i32) {
        builder.exclusive = mode == 0;
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStreamBuilder_setSampleRate(builder: &mut Builder, rate_hz: i32) {
        builder.rate_hz = rate_hz;
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStreamBuilder_setChannelCount(builder: &mut Builder, channels: i32) {
        builder.channels = channels;
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStreamBuilder_setFormat(builder: &mut Builder, format: i32) {
        builder.format = format;
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStreamBuilder_setDataCallback(
        builder: &mut Builder,
        function: DataFunction,
        user: usize,
    ) {
        builder.data = Some((function, user));
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStreamBuilder_setErrorCallback(
        builder: &mut Builder,
        function: ErrorFunction,
        user: usize,
    ) {
        builder.error = Some((function, user));
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStreamBuilder_openStream(
        builder: &Builder,
        stream: &mut *mut Stream,
    ) -> i32 {
        let seen = Seen::of(builder.rate_hz);
        let opening = seen.openings.fetch_add(1, Ordering::Relaxed) as usize;
        let behaviour = match builder.rate_hz {
            SCRIPTED_HZ => SCRIPT.get(opening).copied(),
            LATE_HZ => Some(Behaviour::IsLostLate),
            _ => None,
        };
        let behaviour = behaviour.unwrap_or(Behaviour::Plays);
        if behaviour == Behaviour::FailsToOpen {
            return UNAVAILABLE;
        }
        let open = 1 + seen.open.fetch_add(1, Ordering::Relaxed);
        seen.most_open.fetch_max(open, Ordering::Relaxed);
        *stream = Box::into_raw(Box::new(Stream {
            settings: builder.clone(),
            behaviour,
            buffer_frames: 1024,
            stop: Arc::new(AtomicBool::new(false)),
            thread: None,
        }));
        0
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStream_requestStart(stream: &mut Stream) -> i32 {
        let (settings, behaviour) = (stream.settings.clone(), stream.behaviour);
        let stop = Arc::clone(&stream.stop);
        stream.thread = Some(thread::spawn(move || play(&settings, behaviour, &stop)));
        0
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStream_requestStop(stream: &mut Stream) -> i32 {
        stream.stop.store(true, Ordering::Release);
        match stream.behaviour {
            Behaviour::IsLost => DISCONNECTED,
            _ => 0,
        }
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStream_close(mut stream: Box<Stream>) -> i32 {
        let seen = Seen::of(stream.settings.rate_hz);
        if !stream.stop.swap(true, Ordering::AcqRel) && stream.thread.is_some() {
            seen.closed_playing.fetch_add(1, Ordering::Relaxed);
        }
        if let Some(thread) = stream.thread.take() {
            assert_ne!(thread.thread().id(), thread::current().id());
            thread.join().expect("plays without a panic");
        }
        seen.open.fetch_sub(1, Ordering::Relaxed);
        match stream.settings.rate_hz {
            UNCLOSABLE_HZ => INVALID_STATE,
            _ => 0,
        }
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStream_setBufferSizeInFrames(stream: &mut Stream, frames: i32) -> i32 {
        stream.buffer_frames = frames;
        frames
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStream_getBufferSizeInFrames(stream: &Stream) -> i32 {
        stream.buffer_frames
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStream_getFramesPerBurst(_: &Stream) -> i32 {
        192
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStream_getSampleRate(stream: &Stream) -> i32 {
        match stream.settings.rate_hz {
            OTHER_HZ => 2 * OTHER_HZ,
            rate_hz => rate_hz,
        }
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStream_getChannelCount(stream: &Stream) -> i32 {
        stream.settings.channels
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStream_getFormat(stream: &Stream) -> i32 {
        stream.settings.format
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStream_getPerformanceMode(stream: &Stream) -> i32 {
        stream.settings.performance
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStream_getSharingMode(stream: &Stream) -> i32 {
        i32::from(!stream.settings.exclusive)
    }

    #[unsafe(no_mangle)]
    extern "C" fn AAudioStream_getXRunCount(_: &Stream) -> i32 {
        3
    }
}

/// The device's thread. The stream's own pointer is a made-up number, as the callbacks only pass it on.
fn play(settings: &Builder, behaviour: Behaviour, stop: &AtomicBool) {
    let seen = Seen::of(settings.rate_hz);
    let (data, user) = settings.data.expect("a data callback");
    let (error, error_user) = settings.error.expect("an error callback");
    let sizes = [192, 96, 480, 1, 33];
    let mut block = [f32::NAN; 2 * 480];
    let mut loss = None;
    for n in 0.. {
        if stop.load(Ordering::Acquire) || (behaviour == Behaviour::Stalls && n == 1) {
            break;
        }
        let frames = sizes[n % sizes.len()];
        block.fill(f32::NAN);
        let before = OPERATIONS.get();
        // SAFETY: the block has so many frames, and the stream, which owns the callback, is closed after this thread.
        let result = unsafe { data(8, user, block.as_mut_ptr().cast(), frames as i32) };
        let operations = OPERATIONS.get() - before;
        seen.allocations.fetch_add(operations, Ordering::Relaxed);
        let (filled, rest) = block.split_at(2 * frames);
        assert!(filled.iter().all(|sample| sample.is_finite()));
        assert!(rest.iter().all(|sample| sample.is_nan()));
        let heard = filled.iter().filter(|sample| **sample != 0.0).count();
        seen.heard.fetch_add(heard as u64, Ordering::Relaxed);
        if result != 0 {
            seen.stopped.fetch_add(1, Ordering::Relaxed);
            break;
        }
        // SAFETY: as for the data callback; `IsLostLate` is what `report_loss` has to survive.
        let report = move || unsafe { error(8, error_user, DISCONNECTED) };
        match behaviour {
            Behaviour::IsLost if n == 20 => loss = Some(thread::spawn(report)),
            Behaviour::IsLostLate if n == 1 => drop(thread::spawn(report)),
            _ => {}
        }
        thread::park_timeout(Duration::from_millis(2));
    }
    if let Some(loss) = loss {
        loss.join().expect("reports without a panic");
    }
}

/// Waits until the report meets a condition, without a time limit.
fn wait_for(output: &DeviceOutput, condition: impl Fn(&DeviceReport) -> bool) -> DeviceReport {
    loop {
        let report = output.report();
        if condition(&report) {
            return report;
        }
        thread::park_timeout(Duration::from_millis(10));
    }
}

#[test]
fn sound_continues_when_an_aaudio_stream_fails() {
    let settings = EngineSettings {
        affinity: AffinityPolicy::System,
        ..EngineSettings::default()
    };
    let (mut controller, renderer) = Engine::new(settings).expect("can be");
    let ahead = Vec3::new(0.0, 0.0, -1.0);
    let source = controller.add_source(ahead).expect("has room");
    let tone: Vec<f32> = (0..441).map(|n| (n as f32 * 0.1).sin()).collect();
    let played = controller.play(source, tone.into(), true);
    played.expect("is there");
    let ticked = controller.tick(ListenerPose::default(), &[]);
    ticked.expect("a valid pose");

    let output = DeviceOutput::start(renderer, 4, Box::new(AaudioDevice)).expect("starts");
    // Refused once, lost once, refused again, stalled once, and then it plays.
    let report = wait_for(&output, |report| {
        report.opened >= 3 && report.grant.is_some()
    });
    assert!(
        report.refused >= 2 && report.lost >= 1 && report.stalled >= 1,
        "{report:?}"
    );
    let before = report.callbacks;
    let report = wait_for(&output, |report| {
        report.callbacks >= before + 20 && report.xruns == 3
    });
    let grant = report.grant.expect("open");
    assert_eq!((grant.rate_hz, grant.burst_frames), (44_100, 192));
    assert_eq!(grant.buffer_frames, 2 * 192);
    assert!(grant.exclusive && grant.low_latency);
    assert_eq!(grant.interface, DeviceInterface::AAudio);
    assert_eq!(
        (report.min_callback_frames, report.max_callback_frames),
        (1, 480)
    );
    let seen = Seen::of(SCRIPTED_HZ);
    assert!(seen.heard.load(Ordering::Relaxed) > 0, "all was silent");
    assert_eq!(seen.most_open.load(Ordering::Relaxed), 1);

    // The renderer is returned and plays on another device.
    let mut renderer = output.stop().expect("no thread panicked");
    assert_eq!(seen.open.load(Ordering::Relaxed), 0);
    assert_eq!(seen.closed_playing.load(Ordering::Relaxed), 0);
    assert_eq!(seen.allocations.load(Ordering::Relaxed), 0);
    let mut block = vec![0.0; 2 * 4096];
    renderer.render(&mut block);
    assert!(block.iter().any(|sample| *sample != 0.0));
}

/// Fills with ones and panics in the third block; counts losses.
struct Panicking {
    blocks: u32,
    losses: Arc<AtomicU32>,
}

impl DeviceCallback for Panicking {
    fn fill(&mut self, output: &mut [f32]) {
        output.fill(1.0);
        self.blocks += 1;
        assert!(self.blocks < 3, "the third block");
    }

    fn lost(&mut self) {
        self.losses.fetch_add(1, Ordering::Release);
    }
}

#[test]
fn a_panic_in_a_block_is_silence_and_a_lost_device() {
    let losses = Arc::new(AtomicU32::new(0));
    let callback = Panicking {
        blocks: 0,
        losses: Arc::clone(&losses),
    };
    let open = AaudioDevice.open(PLAYING_HZ as u32, Box::new(callback));
    let open = open.expect("opens");
    let seen = Seen::of(PLAYING_HZ);
    while seen.stopped.load(Ordering::Relaxed) == 0 {
        thread::park_timeout(Duration::from_millis(2));
    }
    drop(open);
    assert_eq!(losses.load(Ordering::Acquire), 1);
    assert_eq!(seen.heard.load(Ordering::Relaxed), 2 * (192 + 96));
    assert_eq!(Arc::strong_count(&losses), 1);
}

/// Fills with zeros.
struct Silent;

impl DeviceCallback for Silent {
    fn fill(&mut self, output: &mut [f32]) {
        output.fill(0.0);
    }

    fn lost(&mut self) {}
}

#[test]
fn another_rate_than_the_engines_is_refused() {
    let refused = AaudioDevice.open(OTHER_HZ as u32, Box::new(Silent));
    let text = refused.err().expect("refused").to_string();
    let rates = [2 * OTHER_HZ, OTHER_HZ].map(|rate_hz| format!("at {rate_hz} Hz"));
    assert!(rates.iter().all(|rate| text.contains(rate)), "{text}");
    assert!(text.contains("device's sample rate"), "{text}");
    let seen = Seen::of(OTHER_HZ);
    assert_eq!(seen.most_open.load(Ordering::Relaxed), 1);
    assert_eq!(seen.open.load(Ordering::Relaxed), 0);
}

#[test]
fn a_stream_that_fails_to_close_is_no_panic() {
    let open = AaudioDevice.open(UNCLOSABLE_HZ as u32, Box::new(Silent));
    drop(open.expect("opens"));
    assert_eq!(Seen::of(UNCLOSABLE_HZ).open.load(Ordering::Relaxed), 0);
}

/// Finds a block that starts after the loss, and a second loss.
struct Once {
    lost: Arc<AtomicI32>,
    late_blocks: Arc<AtomicI32>,
}

impl DeviceCallback for Once {
    fn fill(&mut self, output: &mut [f32]) {
        self.late_blocks
            .fetch_add(self.lost.load(Ordering::Acquire), Ordering::AcqRel);
        output.fill(1.0);
    }

    fn lost(&mut self) {
        self.lost.fetch_add(1, Ordering::AcqRel);
    }
}

#[test]
fn a_loss_during_a_block_is_reported_once_and_no_block_follows() {
    for round in 0..1000 {
        let lost = Arc::new(AtomicI32::new(0));
        let late_blocks = Arc::new(AtomicI32::new(0));
        let shared = Arc::new(SharedCallback::new(Box::new(Once {
            lost: Arc::clone(&lost),
            late_blocks: Arc::clone(&late_blocks),
        })));
        thread::scope(|scope| {
            let errors = scope.spawn(|| {
                for _ in 0..round % 50 {
                    std::hint::spin_loop();
                }
                shared.lose();
            });
            let mut block = [0.0; 64];
            while shared.fill(&mut block) {}
            errors.join().expect("no panic");
            assert!(!shared.fill(&mut block));
            assert_eq!(block, [0.0; 64]);
        });
        assert_eq!(lost.load(Ordering::Acquire), 1, "round {round}");
        assert_eq!(late_blocks.load(Ordering::Acquire), 0, "round {round}");
    }
}

/// Reports its loss until the stream is closed.
struct Lingering {
    reporting: Arc<AtomicBool>,
    closed: Arc<AtomicBool>,
}

impl DeviceCallback for Lingering {
    fn fill(&mut self, output: &mut [f32]) {
        output.fill(0.0);
    }

    fn lost(&mut self) {
        self.reporting.store(true, Ordering::Release);
        while !self.closed.load(Ordering::Acquire) {
            thread::park_timeout(Duration::from_millis(2));
        }
    }
}

#[test]
fn a_stream_may_be_closed_while_its_loss_is_being_reported() {
    let reporting = Arc::new(AtomicBool::new(false));
    let closed = Arc::new(AtomicBool::new(false));
    let callback = Lingering {
        reporting: Arc::clone(&reporting),
        closed: Arc::clone(&closed),
    };
    let open = AaudioDevice.open(LATE_HZ as u32, Box::new(callback));
    let open = open.expect("opens");
    while !reporting.load(Ordering::Acquire) {
        thread::park_timeout(Duration::from_millis(2));
    }
    drop(open);
    closed.store(true, Ordering::Release);
    // The reporting thread, the last owner, drops the callback. Ten seconds at most: a lost callback would never be dropped.
    for _ in 0..5000 {
        if Arc::strong_count(&closed) == 1 {
            return;
        }
        thread::park_timeout(Duration::from_millis(2));
    }
    panic!("the callback was lost");
}
