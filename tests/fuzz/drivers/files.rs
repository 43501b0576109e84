//! Files of all kinds: reading any content ends in a valid value or in an error of one line.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use foresound::Error;
use foresound::scene::{MaterialTable, MeshOptions, SceneLayout, UpAxis, load_mesh};
use foresound_tools::clip::{load_clip_within, load_recording};
use foresound_tools::listener_path::ListenerPath;

/// A file of this process and thread, in memory if the system has a memory file system.
fn file(name: &str) -> PathBuf {
    thread_local! {
        static FOLDER: OnceLock<tempfile::TempDir> = const { OnceLock::new() };
    }
    FOLDER.with(|folder| {
        let made = folder.get_or_init(|| {
            let memory = Path::new("/dev/shm");
            let made = match memory.is_dir() {
                true => tempfile::tempdir_in(memory),
                false => tempfile::tempdir(),
            };
            made.expect("a folder for a fuzzer's files")
        });
        made.path().join(name)
    })
}

fn written(name: &str, bytes: &[u8]) -> PathBuf {
    let path = file(name);
    std::fs::write(&path, bytes).expect("a fuzzer's file is written");
    path
}

/// An error has a text, on one line.
fn check_text(error: &Error) {
    let text = error.to_string();
    assert!(text.len() > 10 && text.lines().count() == 1, "{text:?}");
    assert!(!text.contains('\u{1b}'), "{text:?} would steer a terminal");
}

/// An OBJ file and, after a byte of 255, its material library.
pub(crate) fn obj(data: &[u8]) {
    let (&first, rest) = data.split_first().unwrap_or((&0, &[]));
    let (text, library) = match rest.iter().position(|&b| b == 255) {
        Some(at) => (&rest[..at], &rest[at + 1..]),
        None => (rest, &b""[..]),
    };
    written("m.mtl", library);
    mesh(first, text);
}

/// A mesh file of any format, read with options by a byte.
fn mesh(options: u8, data: &[u8]) {
    let options = MeshOptions::default()
        .with_scale([1.0, 0.01, 1e-30, 1e30][usize::from(options) % 4])
        .with_up([UpAxis::Y, UpAxis::Z][usize::from(options / 4) % 2])
        .with_max_triangles(1000);
    match load_mesh(&written("m.mesh", data), &options) {
        Ok(file) => {
            let mesh = file.mesh;
            mesh.check_indices()
                .expect("indices of a file that was read");
            assert!((1..=1000).contains(&mesh.triangles.len()));
            for corner in mesh.triangles.iter().flatten() {
                assert!(mesh.vertices[*corner as usize].is_finite());
            }
            let lines = |text: &String| text.lines().count() == 1;
            assert!(file.warnings.iter().all(lines));
            good_materials(&file.materials);
        }
        Err(error) => check_text(&error),
    }
}

/// A PLY, glTF or GLB file, told by its content.
pub(crate) fn mesh_file(data: &[u8]) {
    mesh(0, data);
}

fn good_materials(table: &MaterialTable) {
    for entry in table.entries() {
        let material = &entry.material;
        let shares = material.absorption.iter().chain(&material.scattering);
        assert!(
            shares
                .chain(&material.transmission)
                .all(|s| (0.0..=1.0).contains(s))
        );
    }
}

/// A materials' TOML file.
pub(crate) fn materials(data: &[u8]) {
    match MaterialTable::load(&written("m.toml", data)) {
        Ok(table) => good_materials(&table),
        Err(error) => check_text(&error),
    }
}

/// A scene's TOML file.
pub(crate) fn layout(data: &[u8]) {
    match SceneLayout::load(&written("l.toml", data)) {
        Ok(layout) => {
            good_materials(&layout.materials);
            for (slot, source) in (0..).zip(&layout.sources) {
                let pose = source.pose(foresound::scene::SourceId::new(slot, 0));
                assert!(pose.position.is_finite() && pose.orientation.is_finite());
                let ahead = pose.factor_towards(glam::Vec3::new(0.3, -0.2, 0.9));
                assert!(ahead.iter().all(|f| f.is_finite()), "{ahead:?}");
            }
            if let Some(walk) = layout.listener {
                for time_s in [0.0, 0.1, 1e3, 1e9] {
                    assert!(walk.position_at(time_s, 0.0).is_finite());
                }
            }
        }
        Err(error) => check_text(&error),
    }
}

/// A listener's CSV file.
pub(crate) fn listener(data: &[u8]) {
    let path = written("w.csv", data);
    match ListenerPath::parse(&path.to_string_lossy()) {
        Ok(walk) => {
            let end_s = walk.duration_s().expect("a recorded path has an end");
            for share in [-1.0, 0.0, 0.3, 0.999, 1.0, 2.0] {
                let pose = walk.at(share * end_s);
                assert!(pose.position.is_finite(), "{pose:?}");
                assert!(pose.orientation.is_finite(), "{pose:?}");
            }
        }
        Err(error) => check_text(&error),
    }
}

/// A SOFA file of an HRTF set, or a baked set.
pub(crate) fn sofa(data: &[u8]) {
    // The conversion takes seconds: one valid file in 32.
    if data.starts_with(b"\x89HDF") {
        match foresound::generation::baking::check_sofa(data, "s.sofa") {
            Ok(directions) => assert!(directions >= 8, "{directions}"),
            Err(error) => return check_text(&error),
        }
        if data.iter().copied().fold(0, u8::wrapping_add) % 32 != 0 {
            return;
        }
    }
    match foresound::Hrtf::read(data, "s.sofa", 48_000) {
        Ok(set) => {
            let mut weights = vec![foresound::simd::F32x8::ZERO; 2 * set.groups()];
            for direction in [glam::Vec3::NEG_Z, glam::Vec3::NEG_X, glam::Vec3::NEG_Y] {
                let delays = set.look_up(direction, &mut weights);
                assert!(delays.iter().all(|delay| (0.0..=1000.0).contains(delay)));
                let lanes = weights.iter().flat_map(|group| group.0);
                assert!(lanes.into_iter().all(f32::is_finite));
            }
        }
        Err(error) => check_text(&error),
    }
}

/// A WAV file, for the command line and for the bridges.
pub(crate) fn wav(data: &[u8]) {
    let path = written("s.wav", data);
    match load_clip_within(&path, 44_100, 1 << 16) {
        Ok((clip, _)) => {
            assert!(!clip.samples.is_empty() && clip.rate_hz == 44_100);
            assert!(clip.samples.iter().all(|s| s.is_finite()));
        }
        Err(error) => check_text(&error),
    }
    if let Err(error) = load_recording(&path, 44_100) {
        check_text(&error);
    }
    // The bridges' converter is a sum for each sample: only files that are short at their rate.
    if data.len() < 4096
        && let Ok(handle) = foresound::bridge::clip::from_wav(data, 1, 48_000)
    {
        let clip = foresound::bridge::clip::CLIPS.remove(handle);
        let clip = clip.expect("a clip that was just made");
        assert!(clip.samples.samples().iter().all(|s| s.is_finite()));
    }
}

/// A FLAC or Ogg file, for the command line and for the bridges.
pub(crate) fn compressed(data: &[u8]) {
    let most = 1 << 16;
    match foresound::output::compressed::decode(std::io::Cursor::new(data), most) {
        Ok(found) => {
            assert!((1..=64).contains(&found.channels) && found.rate_hz > 0);
            assert!(!found.samples.is_empty() && found.samples.len() <= most);
            assert!(found.samples.len().is_multiple_of(found.channels));
        }
        Err(problem) => assert!(!problem.is_empty() && !problem.contains('\n')),
    }
    if let Err(error) = load_clip_within(written("s.flac", data), 44_100, most) {
        check_text(&error);
    }
    if data.len() < 1 << 13
        && let Ok(handle) = foresound::bridge::clip::from_file(data, 2, 48_000)
    {
        let clip = foresound::bridge::clip::CLIPS.remove(handle);
        let clip = clip.expect("a clip that was just made");
        assert!(clip.samples.samples().iter().all(|s| s.is_finite()));
    }
}
