//! A device that refuses, is lost, stalls and returns: the sound continues.
//!
//! In real time, waiting for events only: a busy machine makes it slower, not wrong.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use foresound::output::{Device, DeviceCallback, DeviceGrant, OpenDevice};
use foresound::runtime::{AffinityPolicy, DeviceOutput, DeviceReport, Engine, EngineSettings};
use foresound::scene::ListenerPose;
use foresound::{Error, Result};
use glam::Vec3;

/// Behaviour of a device for one opening.
#[derive(Clone, Copy)]
enum Behaviour {
    FailsToOpen,
    /// Plays some blocks of changing size, then reports its loss.
    IsLost,
    /// Plays one block, then stops calling back.
    Stalls,
    Plays,
}

const BEHAVIOURS: [Behaviour; 5] = [
    Behaviour::FailsToOpen,
    Behaviour::IsLost,
    Behaviour::FailsToOpen,
    Behaviour::Stalls,
    Behaviour::Plays,
];

#[derive(Default)]
struct Seen {
    openings: AtomicU32,
    /// Open devices; never two.
    open: AtomicU32,
    most_open: AtomicU32,
    /// Nonzero samples.
    heard: AtomicU64,
}

struct Fake {
    seen: Arc<Seen>,
}

struct OpenFake {
    seen: Arc<Seen>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

fn play(
    behaviour: Behaviour,
    mut callback: Box<dyn DeviceCallback>,
    seen: &Seen,
    stop: &AtomicBool,
) {
    let sizes = [192, 96, 480, 1, 33];
    let mut block = [0.0f32; 2 * 480];
    let blocks = match behaviour {
        Behaviour::IsLost => 20,
        Behaviour::Stalls => 1,
        Behaviour::Plays | Behaviour::FailsToOpen => usize::MAX,
    };
    for n in 0..blocks {
        if stop.load(Ordering::Acquire) {
            return;
        }
        let part = &mut block[..2 * sizes[n % sizes.len()]];
        callback.fill(part);
        let heard = part.iter().filter(|sample| **sample != 0.0).count();
        seen.heard.fetch_add(heard as u64, Ordering::Relaxed);
        thread::park_timeout(Duration::from_millis(2));
    }
    if let Behaviour::IsLost = behaviour {
        callback.lost();
    }
}

impl Device for Fake {
    fn open(
        &mut self,
        rate_hz: u32,
        callback: Box<dyn DeviceCallback>,
    ) -> Result<Box<dyn OpenDevice>> {
        let opening = self.seen.openings.fetch_add(1, Ordering::Relaxed) as usize;
        let behaviour = BEHAVIOURS.get(opening).copied().unwrap_or(Behaviour::Plays);
        assert_eq!(rate_hz, 44_100);
        if let Behaviour::FailsToOpen = behaviour {
            return Err(Error::engine("no device yet", "try again"));
        }
        let open = 1 + self.seen.open.fetch_add(1, Ordering::Relaxed);
        self.seen.most_open.fetch_max(open, Ordering::Relaxed);
        let (seen, stop) = (Arc::clone(&self.seen), Arc::new(AtomicBool::new(false)));
        let stopped = Arc::clone(&stop);
        let thread = thread::spawn(move || play(behaviour, callback, &seen, &stopped));
        Ok(Box::new(OpenFake {
            seen: Arc::clone(&self.seen),
            stop,
            thread: Some(thread),
        }))
    }
}

impl OpenDevice for OpenFake {
    fn grant(&self) -> DeviceGrant {
        DeviceGrant {
            rate_hz: 44_100,
            burst_frames: 192,
            ..DeviceGrant::default()
        }
    }

    fn xruns(&mut self) -> u32 {
        3
    }
}

impl Drop for OpenFake {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.join().expect("plays without a panic");
        }
        self.seen.open.fetch_sub(1, Ordering::Relaxed);
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
fn sound_continues_when_the_device_fails() {
    let mut settings = EngineSettings::default();
    settings.affinity = AffinityPolicy::System;
    let (mut controller, renderer) = Engine::new(settings).expect("can be");
    let source = controller
        .add_source(Vec3::new(0.0, 0.0, -1.0))
        .expect("has room");
    let tone: Vec<f32> = (0..441).map(|n| (n as f32 * 0.1).sin()).collect();
    controller
        .play(source, tone.into(), true)
        .expect("is there");
    controller
        .tick(ListenerPose::default(), &[])
        .expect("a valid pose");

    let seen = Arc::new(Seen::default());
    let fake = Fake {
        seen: Arc::clone(&seen),
    };
    let output = DeviceOutput::start(renderer, 4, Box::new(fake)).expect("starts");
    assert_eq!(output.report().ring_frames, 4 * 256);

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
    assert_eq!(report.grant.map(|grant| grant.burst_frames), Some(192));
    assert_eq!(
        (report.min_callback_frames, report.max_callback_frames),
        (1, 480)
    );
    assert!(seen.heard.load(Ordering::Relaxed) > 0, "all was silent");
    assert_eq!(seen.most_open.load(Ordering::Relaxed), 1);

    // The renderer is returned and plays on another device.
    let mut renderer = output.stop().expect("no thread panicked");
    assert_eq!(seen.open.load(Ordering::Relaxed), 0);
    let mut block = vec![0.0; 2 * 4096];
    renderer.render(&mut block);
    assert!(block.iter().any(|sample| *sample != 0.0));
}

#[test]
fn an_engine_without_any_device_keeps_working() {
    struct Never;
    impl Device for Never {
        fn open(&mut self, _: u32, _: Box<dyn DeviceCallback>) -> Result<Box<dyn OpenDevice>> {
            Err(Error::engine("no device", "use another system"))
        }
    }
    let (controller, renderer) = Engine::new(EngineSettings::default()).expect("can be");
    let output = DeviceOutput::start(renderer, 1, Box::new(Never)).expect("starts");
    let report = wait_for(&output, |report| report.refused >= 3);
    assert_eq!(
        (report.opened, report.grant, report.callbacks),
        (0, None, 0)
    );
    drop(controller);
    drop(output);
}
