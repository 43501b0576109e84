//! Output files, standard output and signals: a run leaves a whole file or none, and nothing that is another's.
#![cfg(unix)]

use std::ffi::OsStr;
use std::fs::{self, File};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

fn program() -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_foresound"));
    program.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    program
}

/// An impulse response in a benchmark scene, of so many seconds.
fn rir(out: &Path, listener: &str, seconds: &str) -> Command {
    let mut program = program();
    program
        .args(["rir", "--scene", "doorway", "--source", "2,1.5,2"])
        .args([
            "--listener",
            listener,
            "--seconds",
            seconds,
            "--json",
            "--out",
        ])
        .arg(out)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    program
}

fn names(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut names: Vec<_> = entries.map(|e| e.expect("an entry").path()).collect();
    names.sort();
    names
}

#[test]
fn concurrent_runs_of_one_output_write_one_of_their_results_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out.wav");
    let listeners = ["3,1.5,3", "1,1.2,1.7"];
    let alone = listeners.map(|listener| {
        assert!(rir(&out, listener, "0.4").status().expect("runs").success());
        fs::read(&out).expect("is there")
    });
    assert_ne!(alone[0], alone[1]);
    for _ in 0..3 {
        let runs: Vec<Child> = (0..4)
            .map(|k| rir(&out, listeners[k % 2], "0.4").spawn().expect("starts"))
            .collect();
        for run in runs {
            let output = run.wait_with_output().expect("ends");
            assert!(output.status.success(), "{output:?}");
        }
        let written = fs::read(&out).expect("is there");
        assert!(alone.contains(&written), "a mixture of two runs");
        assert_eq!(names(folder.path()), std::slice::from_ref(&out));
    }
}

/// Sends a signal once the run has a file open.
#[expect(clippy::disallowed_methods, reason = "waits for another program")]
fn ended_by(signal: &str, folder: &Path) -> Option<i32> {
    let mut run = rir(&folder.join("out.wav"), "3,1.5,3", "60");
    let mut run = run.spawn().expect("starts");
    while names(folder).is_empty() {
        assert!(run.try_wait().expect("is asked").is_none(), "ended early");
        std::thread::sleep(Duration::from_millis(5));
    }
    // Some time into the work.
    std::thread::sleep(Duration::from_millis(100));
    let kill = Command::new("kill")
        .args([signal, &run.id().to_string()])
        .status();
    assert!(kill.expect("runs").success());
    run.wait().expect("ends").signal()
}

/// Whether this process ignores a signal, and so the programs that it starts: a job in the background of a shell ignores SIGINT.
fn is_ignored(number: i32) -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (number - 1) & 1 == 1)
}

#[test]
fn signals_leave_no_file() {
    for (signal, number) in [("-INT", 2), ("-TERM", 15), ("-HUP", 1)] {
        if is_ignored(number) {
            continue;
        }
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(ended_by(signal, folder.path()), Some(number));
        let left = names(folder.path());
        assert!(left.is_empty(), "{signal}: {left:?}");
    }
}

#[test]
fn a_full_or_closed_standard_output_is_an_exit_code() {
    let runs: [&[&str]; 4] = [
        &["inspect", "doorway"],
        &["inspect", "doorway", "--json"],
        &["validate", "--law", "air"],
        &["--help"],
    ];
    for arguments in runs {
        let full = File::options()
            .write(true)
            .open("/dev/full")
            .expect("Linux has it");
        let (reader, closed) = std::io::pipe().expect("a pipe");
        drop(reader);
        for (out, says) in [(Stdio::from(full), "standard output"), (closed.into(), "")] {
            let output = program()
                .args(arguments)
                .stdout(out)
                .output()
                .expect("runs");
            let text = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
            assert!(!text.contains("panicked") && text.contains(says), "{text}");
        }
    }
}

#[test]
fn an_output_may_have_any_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join(OsStr::from_bytes(b"o\xff.wav"));
    let output = rir(&out, "3,1.5,3", "0.1").output().expect("runs");
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("text");
    let found: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert!(
        found["out"]
            .as_str()
            .is_some_and(|name| name.ends_with(".wav"))
    );
    assert_eq!(names(folder.path()), [out]);
}
