//! Runs the program, in folders of its own.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hound::{SampleFormat, WavSpec, WavWriter};

/// A folder that is removed at the end.
pub(crate) struct Folder(pub(crate) tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, text).expect("written");
        path
    }

    /// A tetrahedron, around the point (0.5, 0.5, 0.5).
    pub(crate) fn room(&self) -> PathBuf {
        let text = "usemtl plaster\nv 0 0 0\nv 6 0 0\nv 0 6 0\nv 0 0 6\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n";
        self.write("room.obj", text)
    }

    pub(crate) fn wav(&self, name: &str, channels: u16, bits_per_sample: u16) -> PathBuf {
        let spec = WavSpec {
            channels,
            sample_rate: 44_100,
            bits_per_sample,
            sample_format: SampleFormat::Int,
        };
        let mut writer = WavWriter::create(self.path(name), spec).expect("a WAV");
        for n in 0..4410 * i32::from(channels) {
            writer.write_sample((n * 37 % 199) - 99).expect("a sample");
        }
        writer.finalize().expect("a whole WAV");
        self.path(name)
    }
}

pub(crate) fn foresound(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_foresound"))
        .args(arguments)
        .output()
        .expect("the program runs")
}

/// Exit code 2, nothing on standard output, and a last line on standard error that has all `parts`.
pub(crate) fn refused(arguments: &[&str], parts: &[&str]) {
    let output = foresound(arguments);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
    assert!(
        output.stdout.is_empty(),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&output.stdout)
    );
    let errors: Vec<&str> = text
        .lines()
        .filter(|line| !line.starts_with("note: "))
        .collect();
    assert_eq!(errors.len(), 1, "{arguments:?}: {text}");
    for part in parts {
        assert!(
            errors[0].contains(part),
            "{arguments:?}: {:?} lacks {part:?}",
            errors[0]
        );
    }
    assert!(!text.contains("panicked"), "{text}");
}

pub(crate) fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

/// Standard output of a command that succeeds.
pub(crate) fn printed(arguments: &[&str]) -> String {
    let output = foresound(arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).expect("text")
}
