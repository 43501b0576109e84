//! Texts of the command line, on standard error with exit code 2.

use std::io::Write;
use std::process::{Command, Stdio};

use crate::Errors;

/// Runs the program with the given standard input; returns its last line.
fn line(arguments: &[&str], input: &str) -> String {
    let mut program = Command::new(env!("CARGO_BIN_EXE_foresound"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let mut pipe = program.stdin.take().expect("a pipe");
    // The program may end before it has read everything.
    let _ = pipe.write_all(input.as_bytes());
    drop(pipe);
    let output = program.wait_with_output().expect("the program ends");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
    let last = text.lines().last().unwrap_or_default();
    let found = last.strip_prefix("error: ");
    found
        .unwrap_or_else(|| panic!("{arguments:?}: {text}"))
        .to_owned()
}

pub(crate) fn make(errors: &mut Errors) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let room = "v 0 0 0\nv 6 0 0\nv 0 6 0\nv 0 0 6\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n";
    let (bare, one, out) = (path("bare.obj"), path("one.obj"), path("o.wav"));
    std::fs::write(&bare, room).expect("written");
    std::fs::write(&one, "v 0 0 0\nv 6 0 0\nv 0 6 0\nf 1 2 3\n").expect("written");
    let voice = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/fuzz/seeds/wav/mono");
    let heard = format!("1,1,1={voice}");
    let unknown = format!("unknown={voice}");
    let render = |scene: &str, source: &str, more: &[&str]| {
        let first = [
            "render",
            "--scene",
            scene,
            "--listener",
            "0,1,0",
            "--source",
        ];
        let arguments = [&first[..], &[source, "--out", &out], more].concat();
        line(&arguments, "")
    };
    for found in [
        line(&["inspect", "gone.obj"], ""),
        line(&["inspect", "doorway", "--up", "w"], ""),
        line(&["inspect", "doorway", "--scale", "0"], ""),
        line(&["inspect", &one], ""),
        // A pipe is not read again to find the line.
        line(&["inspect", "/dev/stdin"], "v 0 0 0\nv 1 0 0\nf 1 2 9\n"),
        line(
            &["inspect", "/dev/stdin"],
            "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        ),
        line(&["validate", "--law", "murphy"], ""),
        render("doorway", "1,2,3", &[]),
        render("doorway", "1,2,x=a.wav", &[]),
        render("doorway", &unknown, &[]),
        render(&bare, &unknown, &[]),
        render("doorway", "1,1,1=gone.wav", &[]),
        render("doorway", &heard, &["--schedule", "later"]),
        render("doorway", &heard, &["--predictor", "oracle"]),
        render("doorway", &heard, &["--seconds=-1"]),
        render("doorway", &heard, &["--rate", "7"]),
    ] {
        errors.line(&found);
    }
}
