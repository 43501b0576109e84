//! Files that are missing, of the wrong kind or cannot be written, and sounds.

use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use foresound::output::{WavSink, WholeFile};
use foresound::scene::procedural::{self, write_files};
use foresound::scene::{MaterialTable, MeshOptions, load_mesh};
use foresound_tools::clip::{load_clip, load_clip_within, load_recording};
use foresound_tools::listener_path::ListenerPath;

use crate::Errors;

pub(crate) fn make(errors: &mut Errors) {
    let folder = tempfile::tempdir().expect("a folder");
    read(errors, folder.path());
    written(errors, folder.path());
    sounds(errors, folder.path());
}

fn read(errors: &mut Errors, folder: &Path) {
    let options = MeshOptions::default();
    errors.of("no mesh", load_mesh(Path::new("gone.obj"), &options));
    errors.of("a folder", load_mesh(folder, &options));
    errors.of("no materials", MaterialTable::load(Path::new("gone.toml")));
    errors.of("a folder", MaterialTable::load(folder));
    errors.of("no walk", ListenerPath::parse("gone.csv"));
    errors.of("a folder", ListenerPath::parse(&folder.to_string_lossy()));
    errors.of("no sound", load_clip("gone.wav", 44_100));
    let endless = Path::new("/dev/zero");
    errors.of("endless materials", MaterialTable::load(endless));
    errors.of("an endless walk", ListenerPath::parse("/dev/zero"));
    // The start of a process' memory is not mapped: its file opens and cannot be read.
    let unreadable = load_mesh(Path::new("/proc/self/mem"), &options);
    errors.of("an unreadable file", unreadable);
}

fn written(errors: &mut Errors, folder: &Path) {
    let file = folder.join("file");
    std::fs::write(&file, "x").expect("written");
    errors.of("no name", WholeFile::create("/"));
    errors.of("a folder", WholeFile::create(folder));
    errors.of("a device", WholeFile::create("/dev/null"));
    errors.of("below a file", WholeFile::create(file.join("below")));
    let long = folder.join("x".repeat(300));
    errors.of("a long name", WholeFile::create(long));
    // A full disk's error, simulated by the content: tests may run as root, for whom no folder is read-only.
    for kind in [
        ErrorKind::PermissionDenied,
        ErrorKind::StorageFull,
        ErrorKind::TimedOut,
    ] {
        let content = |out: &mut io::BufWriter<std::fs::File>| {
            out.write_all(b"half")?;
            Err(io::Error::from(kind))
        };
        errors.of(
            "a failing disk",
            WholeFile::write(folder.join("o"), content),
        );
    }
    // So many zeros take address space and no memory.
    let large = vec![0.0; (1 << 30) + 1];
    let mut sink = WavSink::create(folder.join("o.wav"), 44_100, 1).expect("a file");
    errors.of("four gigabytes", sink.write(&large));
    let scene = procedural::doorway();
    errors.of("scenes in a file", write_files(&scene, &file));
}

fn wav(folder: &Path, name: &str, spec: [u32; 3], count: usize) -> PathBuf {
    let path = folder.join(name);
    let spec = hound::WavSpec {
        channels: spec[0] as u16,
        sample_rate: spec[1],
        bits_per_sample: spec[2] as u16,
        sample_format: hound::SampleFormat::Int,
    };
    let mut writer = hound::WavWriter::create(&path, spec).expect("a file");
    (0..count).for_each(|_| writer.write_sample(1i8).expect("written"));
    writer.finalize().expect("written");
    path
}

fn sounds(errors: &mut Errors, folder: &Path) {
    let good = wav(folder, "good.wav", [1, 44_100, 16], 9);
    let two = wav(folder, "two.wav", [2, 44_100, 16], 4);
    let many = wav(folder, "many.wav", [65, 44_100, 16], 65);
    let slow = wav(folder, "slow.wav", [1, 10, 16], 4);
    let eight = wav(folder, "eight.wav", [1, 44_100, 8], 4);
    let none = wav(folder, "none.wav", [1, 44_100, 16], 0);
    errors.of("two channels", load_clip(two, 44_100));
    errors.of("65 channels", load_recording(many, 44_100));
    errors.of("10 Hz", load_clip(slow, 44_100));
    errors.of("eight bits", load_clip(eight, 44_100));
    errors.of("no samples", load_clip(none, 44_100));
    errors.of("too many", load_clip_within(&good, 44_100, 8));
    let low = wav(folder, "low.wav", [1, 1000, 16], 400_000);
    errors.of("too many after conversion", load_clip(low, 48_000));
    errors.of("a rate of 7 Hz", load_clip(&good, 7));
    let text = folder.join("text.wav");
    std::fs::write(&text, b"no sound at all").expect("written");
    errors.of("text", load_clip(text, 44_100));
    let mut bytes = std::fs::read(good).expect("read");
    bytes.truncate(bytes.len() - 6);
    let cut = folder.join("cut.wav");
    std::fs::write(&cut, bytes).expect("written");
    errors.of("cut off", load_clip(cut, 44_100));
    let flac = folder.join("cut.flac");
    std::fs::write(&flac, b"fLaC\0\0\0\x22 and no more").expect("written");
    errors.of("a FLAC file cut off", load_clip(flac, 44_100));
    let odd = folder.join("nan.wav");
    let spec = hound::WavSpec {
        channels: 1,
        sample_rate: 44_100,
        bits_per_sample: 32,
        sample_format: hound::SampleFormat::Float,
    };
    let mut writer = hound::WavWriter::create(&odd, spec).expect("a file");
    writer.write_sample(f32::NAN).expect("written");
    writer.finalize().expect("written");
    errors.of("a non-finite sample", load_clip(odd, 44_100));
}
