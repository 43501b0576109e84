//! The supervisor with a scripted device on a virtual clock.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::atomic::AtomicU64;

use super::*;
use crate::error::Error;
use crate::runtime::device::reopen_policy::{MAX_WAIT_S, STALL_S};

/// Behaviour of the fake device, and its record.
#[derive(Default)]
struct Script {
    is_there: bool,
    attempts: u32,
    lost: Option<Arc<AtomicBool>>,
}

struct Fake(Rc<RefCell<Script>>);

struct FakeStream(RefCell<LeasedCallback>);

impl Backend for Fake {
    type Stream = FakeStream;

    fn open(&mut self, callback: LeasedCallback, lost: Arc<AtomicBool>) -> Result<FakeStream> {
        let mut script = self.0.borrow_mut();
        script.attempts += 1;
        if !script.is_there {
            return Err(Error::engine("no device", "plug one in"));
        }
        script.lost = Some(lost);
        Ok(FakeStream(RefCell::new(callback)))
    }
}

fn supervised(
    null_device: Option<NullDeviceSettings>,
) -> (Supervisor<Fake>, Rc<RefCell<Script>>, Arc<AtomicU64>) {
    let script = Rc::new(RefCell::new(Script {
        is_there: true,
        ..Script::default()
    }));
    let blocks = Arc::new(AtomicU64::new(0));
    let counted = Arc::clone(&blocks);
    let fill = move |block: &mut [f32]| {
        block.fill(counted.fetch_add(1, Ordering::Relaxed) as f32);
    };
    let supervisor = Supervisor::new(Fake(Rc::clone(&script)), fill, null_device);
    (supervisor, script, blocks)
}

fn lose(script: &RefCell<Script>) {
    let script = script.borrow();
    let lost = script.lost.as_ref().expect("was opened");
    lost.store(true, Ordering::Release);
}

fn play_block(supervisor: &Supervisor<Fake>) -> f32 {
    let mut block = [-1.0; 2];
    let stream = supervisor.stream().expect("plays");
    stream.0.borrow_mut().fill(&mut block);
    block[0]
}

#[test]
fn a_lost_device_is_reopened_and_sound_continues() {
    let (mut supervisor, script, _) = supervised(None);
    assert_eq!(supervisor.poll(0.0), DeviceState::Playing);
    assert_eq!(
        (play_block(&supervisor), play_block(&supervisor)),
        (0.0, 1.0)
    );
    lose(&script);
    let DeviceState::Waiting { until_s, because } = supervisor.poll(10.0) else {
        panic!("waits");
    };
    assert_eq!((until_s, because.as_str()), (10.1, "the device was lost"));
    assert_eq!(
        supervisor.poll(10.05),
        DeviceState::Waiting { until_s, because }
    );
    assert_eq!(supervisor.poll(10.11), DeviceState::Playing);
    assert_eq!(play_block(&supervisor), 2.0);
    let counts = supervisor.counts();
    assert_eq!((counts.opened, counts.lost, counts.stalled), (2, 1, 0));
}

#[test]
fn failed_steps_up_become_rarer_and_never_stop() {
    let (mut supervisor, script, _) = supervised(None);
    script.borrow_mut().is_there = false;
    let mut times = Vec::new();
    let mut attempts = 0;
    for step in 0..6000 {
        let time_s = f64::from(step) * 0.01;
        supervisor.poll(time_s);
        if script.borrow().attempts > attempts {
            attempts = script.borrow().attempts;
            times.push(time_s);
        }
    }
    let gaps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!((gaps[0] - 0.1).abs() < 0.02 && (gaps[1] - 0.2).abs() < 0.02);
    assert!(gaps.iter().all(|gap| *gap <= MAX_WAIT_S + 0.02));
    assert!((gaps.last().expect("many") - MAX_WAIT_S).abs() < 0.02);
    script.borrow_mut().is_there = true;
    assert_eq!(supervisor.poll(70.0), DeviceState::Playing);
}

#[test]
fn a_device_that_fails_at_once_is_retried_at_growing_intervals() {
    let (mut supervisor, script, _) = supervised(None);
    for step in 0..1000 {
        if supervisor.poll(f64::from(step) * 0.01) == DeviceState::Playing {
            lose(&script);
        }
    }
    // In ten seconds: at intervals of 0.1, 0.2, 0.4 …, not a hundred times.
    let opened = supervisor.counts().opened;
    assert!((5..=8).contains(&opened), "{opened} opens");
}

#[test]
fn a_device_that_stops_calling_back_is_opened_again() {
    let (mut supervisor, _, _) = supervised(None);
    assert_eq!(supervisor.poll(0.0), DeviceState::Playing);
    play_block(&supervisor);
    assert_eq!(supervisor.poll(0.5), DeviceState::Playing);
    let silent = supervisor.poll(0.5 + STALL_S);
    assert!(
        matches!(&silent, DeviceState::Waiting { because, .. } if because.contains("stopped calling back")),
        "{silent:?}"
    );
    assert_eq!(supervisor.poll(0.7 + STALL_S), DeviceState::Playing);
    assert_eq!(play_block(&supervisor), 1.0);
    assert_eq!(supervisor.counts().stalled, 1);
}

#[test]
fn a_null_device_plays_while_no_device_is_open() {
    let shape = NullDeviceSettings {
        rate_hz: 44_100,
        block_frames: 64,
        affinity: AffinityPolicy::System,
    };
    let (mut supervisor, script, blocks) = supervised(Some(shape));
    script.borrow_mut().is_there = false;
    supervisor.poll(0.0);
    while blocks.load(Ordering::Relaxed) < 3 {
        std::thread::yield_now();
    }
    script.borrow_mut().is_there = true;
    assert_eq!(supervisor.poll(1.0), DeviceState::Playing);
    let played = blocks.load(Ordering::Relaxed);
    assert_eq!(play_block(&supervisor), played as f32);
}
