//! Files that the program brings along: benchmark scenes, which it computes, and sounds, which are inside the binary. In the
//! repository's folder they are those of `assets`; elsewhere they are written to a cache of the user's, so that an installed
//! program needs no repository.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Write;
use std::path::{Path, PathBuf};

use foresound::output::WholeFile;
use foresound::scene::procedural::{by_name, write_files};
use foresound::{Error, Result};

// The folder is found by `tools/build.rs`.
macro_rules! sounds {
    ($($name:literal)*) => {
        &[$(($name, include_bytes!(concat!(env!("FORESOUND_BUNDLED"), "/", $name, ".wav")))),*]
    };
}

/// Sounds by their names.
const SOUNDS: &[(&str, &[u8])] = sounds! {
    "speech/voice01" "speech/voice02" "speech/voice03" "speech/voice04" "speech/voice05" "speech/voice06" "speech/voice07"
    "speech/voice08" "speech/voice09" "speech/voice10" "speech/voice11" "speech/voice12" "speech/voice13" "speech/voice14"
    "speech/voice15" "speech/voice16" "signals/music" "signals/percussion"
};

/// The measurement of which the built-in HRTF sets are made, a SOFA file.
pub(crate) const KEMAR: &[u8] = include_bytes!(concat!(
    env!("FORESOUND_BUNDLED"),
    "/hrtf/MIT_KEMAR_normal_pinna.sofa"
));

/// The OBJ file of a benchmark scene; its TOML file is beside it.
pub(crate) fn scene(name: &str) -> Result<PathBuf> {
    let here = Path::new("assets/scenes").join(name).with_extension("obj");
    if here.is_file() {
        return Ok(here);
    }
    let folder = cache()?.join("scenes").join(name);
    let file = folder.join(name).with_extension("obj");
    if file.is_file() {
        return Ok(file);
    }
    let Some(scene) = by_name(name) else {
        return Err(Error::file(here, "not found", "check the scene's name"));
    };
    // Written aside and renamed: another program may do the same.
    let aside = folder.with_extension(std::process::id().to_string());
    write_files(&scene, &aside)?;
    if fs::rename(&aside, &folder).is_err() {
        let removed = fs::remove_dir_all(&aside);
        if !file.is_file() {
            let problem = removed
                .err()
                .map_or("cannot be renamed".into(), |e| e.to_string());
            return Err(Error::file(folder, problem, ADVICE));
        }
    }
    Ok(file)
}

/// The WAV file of a sound, such as `speech/voice01`.
pub(crate) fn sound(name: &str) -> Result<PathBuf> {
    let here = Path::new("assets").join(format!("{name}.wav"));
    if here.is_file() {
        return Ok(here);
    }
    let Some((_, bytes)) = SOUNDS.iter().find(|(known, _)| *known == name) else {
        return Err(Error::file(here, "not found", "check the sound's name"));
    };
    let file = cache()?.join(format!("{name}.wav"));
    if fs::metadata(&file).is_ok_and(|found| found.len() == bytes.len() as u64) {
        return Ok(file);
    }
    let folder = file.parent().unwrap_or(&file);
    fs::create_dir_all(folder).map_err(|error| Error::file(folder, error, ADVICE))?;
    WholeFile::write(&file, |out| out.write_all(bytes))?;
    Ok(file)
}

const ADVICE: &str = "set XDG_CACHE_HOME to a folder that may be written to";

/// This program's folder in the user's cache: each build has its own.
fn cache() -> Result<PathBuf> {
    let variable = |name: &str| {
        let value = std::env::var_os(name).filter(|value| !value.is_empty());
        value.map(PathBuf::from).filter(|path| path.is_absolute())
    };
    let base = variable("XDG_CACHE_HOME")
        .or_else(|| variable("LOCALAPPDATA"))
        .or_else(|| Some(variable("HOME")?.join(".cache")))
        .unwrap_or_else(std::env::temp_dir);
    let mut build = DefaultHasher::new();
    let program = std::env::current_exe().and_then(fs::metadata);
    if let Ok(program) = program {
        (program.len(), program.modified().ok()).hash(&mut build);
    }
    let folder = base.join(format!("foresound/{:016x}", build.finish()));
    fs::create_dir_all(&folder).map_err(|error| Error::file(&folder, error, ADVICE))?;
    Ok(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A checkout without symbolic links has a line of text in place of each file of `bundled`: none is in the program, and
    /// each has a file of that name to become one of the package.
    #[test]
    fn sounds_are_files_and_not_links() {
        let bundled = Path::new(env!("CARGO_MANIFEST_DIR")).join("bundled");
        for (name, bytes) in SOUNDS {
            assert!(bytes.starts_with(b"RIFF"), "{name} is no WAV file");
            let file = bundled.join(format!("{name}.wav"));
            assert!(fs::symlink_metadata(&file).is_ok(), "{}", file.display());
        }
        assert!(KEMAR.starts_with(b"\x89HDF"), "no SOFA file");
    }
}
