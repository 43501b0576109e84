//! Errors of a system without free threads: in a separate process, whose threads request more stack than there are
//! addresses.

use std::process::Command;

use foresound::runtime::{
    AffinityPolicy, Engine, EngineSchedule, EngineState, NullDevice, SoundThread, Threads,
};
use foresound::scene::{ListenerPose, MaterialTable, SceneSettings};

use crate::Errors;
use crate::engine::small;
use crate::meshes::room;

/// The test of the process without threads; in any other process it does nothing.
const WITHIN: &str = "without_threads::is_run_without_threads";

/// Prefix of its lines.
const MARK: &str = "said: ";

/// Bytes of stack: all that a process can address.
const STACK: &str = "140737488351232";

pub(crate) fn make(errors: &mut Errors) {
    let program = std::env::current_exe().expect("this program");
    let output = Command::new(program)
        .args(["--exact", WITHIN, "--nocapture", "--test-threads", "1"])
        .env("RUST_MIN_STACK", STACK)
        .output()
        .expect("this program runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let lines: Vec<&str> = text
        .lines()
        .filter_map(|l| l.split_once(MARK))
        .map(|(_, line)| line)
        .collect();
    assert_eq!(lines.len(), 6, "{output:?}");
    for line in lines {
        errors.line(line);
    }
}

#[test]
fn is_run_without_threads() {
    if std::env::var("RUST_MIN_STACK").as_deref() != Ok(STACK) {
        return;
    }
    let mut errors = Errors::default();
    errors.of("a helper", Threads::start(2));
    let mut settings = small();
    settings.schedule = EngineSchedule::Synchronous;
    settings.tracing_threads = 1;
    let (mut controller, renderer) = Engine::new(settings).expect("an engine without threads");
    let built = controller.build_scene(room(), MaterialTable::built_in(), SceneSettings::default());
    errors.of("a scene", built);
    let device = NullDevice::start(16_000, 64, AffinityPolicy::System, |_| ());
    errors.of("a device", device.map(drop));
    // The schedule stays, and propagation goes on by it.
    for what in ["propagation", "propagation again"] {
        let result = controller.set_schedule(EngineSchedule::Asynchronous);
        errors.of(what, result);
        assert_eq!(controller.state(), EngineState::Running);
        let updates = controller.statistics().propagation.count;
        let ticked = controller.tick(ListenerPose::default(), &[]);
        ticked.expect("a good pose");
        assert_eq!(controller.statistics().propagation.count, updates + 1);
    }
    errors.of("a sound thread", SoundThread::start(renderer, 2).map(drop));
    for line in errors.0 {
        println!("{MARK}{line}");
    }
}
