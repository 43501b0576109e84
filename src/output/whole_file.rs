//! A file that is either complete or absent.
//!
//! Control side; blocks on the disk. Content is written to a new file of a name that nothing else has, in the same folder, and
//! renamed when it is complete: a file with its final name is always complete, and concurrent writers do not meet.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use tempfile::{Builder, TempPath};

use crate::{Error, Result};

/// What is called with the path of a temporary file: with true when it is there, with false when it is renamed or removed.
pub type Watch = fn(&Path, bool);

static WATCH: OnceLock<Watch> = OnceLock::new();

/// Has `watch` called for all temporary files of the process from now on, on the thread that writes them. A program that a
/// signal ends removes the files that it knows of. The first call counts.
pub fn watch_temporary_files(watch: Watch) {
    WATCH.get_or_init(|| watch);
}

fn report(path: &Path, is_there: bool) {
    if let Some(watch) = WATCH.get() {
        watch(path, is_there);
    }
}

/// A file being written. If it is dropped before [`Self::keep`], the temporary file is removed.
#[derive(Debug)]
pub struct WholeFile {
    path: PathBuf,
    /// Removed when dropped.
    temporary: Option<TempPath>,
}

impl WholeFile {
    /// Opens a temporary file for writing and creates missing folders. If the path is a link, its target is replaced, and
    /// the link remains.
    ///
    /// # Errors
    /// [`Error::File`] if the path has no file name, is a folder or a device, or cannot be written.
    pub fn create(path: impl AsRef<Path>) -> Result<(Self, File)> {
        let given = path.as_ref();
        let path = fs::canonicalize(given).unwrap_or_else(|_| given.to_path_buf());
        if path.file_name().is_none() {
            return Err(Error::file(given, "has no file name", "add a file name"));
        }
        if path.is_dir() || ends_in_separator(given) {
            return Err(Error::file(given, "is a folder", "add a file name"));
        }
        // The rename would replace a device with a regular file.
        if path.exists() && !path.is_file() {
            return Err(Error::file(
                given,
                "is not a regular file",
                "choose a file that may be replaced",
            ));
        }
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        fs::create_dir_all(folder).map_err(|e| write_error(folder, e))?;
        // A name that the system does not take is found before the content is made.
        match fs::symlink_metadata(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                return Err(write_error(given, error));
            }
            _ => {}
        }
        let mut builder = Builder::new();
        builder.prefix(".foresound-").suffix(".part");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // Those of any new file: the process's mask applies.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let made = builder.tempfile_in(folder);
        let (file, temporary) = made.map_err(|e| write_error(given, e))?.into_parts();
        report(&temporary, true);
        let temporary = Some(temporary);
        Ok((Self { path, temporary }, file))
    }

    /// The final path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Overwrites bytes of the temporary file, which the caller has flushed and closed.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be written.
    pub(crate) fn patch(&self, offset: u64, bytes: &[u8]) -> Result<()> {
        let Some(temporary) = &self.temporary else {
            return Ok(());
        };
        let file = OpenOptions::new().write(true).open(temporary);
        file.and_then(|mut file| {
            file.seek(SeekFrom::Start(offset))?;
            file.write_all(bytes)
        })
        .map_err(|error| write_error(&self.path, error))
    }

    /// Renames the file to its final name. The caller must have flushed and closed it.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be renamed; the temporary file is removed.
    pub fn keep(mut self) -> Result<()> {
        let Some(temporary) = self.temporary.take() else {
            return Ok(());
        };
        let name = temporary.to_path_buf();
        let kept = temporary.persist(&self.path);
        report(&name, false);
        kept.map_err(|failed| write_error(&self.path, failed.error))
    }

    /// Writes a complete file.
    ///
    /// # Errors
    /// [`Error::File`] as [`Self::create`] and [`Self::keep`], or with the error of `content`.
    pub fn write(
        path: impl AsRef<Path>,
        content: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
    ) -> Result<()> {
        let (whole, file) = Self::create(path)?;
        let mut buffer = BufWriter::new(file);
        content(&mut buffer)
            .and_then(|()| buffer.flush())
            .map_err(|e| write_error(&whole.path, e))?;
        drop(buffer);
        whole.keep()
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        if let Some(temporary) = self.temporary.take() {
            let name = temporary.to_path_buf();
            // `drop` cannot report a failure; a remaining file has a name of its own.
            let _ = temporary.close();
            report(&name, false);
        }
    }
}

/// Whether a path names a folder by its last character.
fn ends_in_separator(path: &Path) -> bool {
    let bytes = path.as_os_str().as_encoded_bytes();
    bytes
        .last()
        .is_some_and(|&last| std::path::is_separator(char::from(last)))
}

/// The error of a failed write, with advice for its cause.
pub(crate) fn write_error(path: &Path, error: io::Error) -> Error {
    let advice = match error.kind() {
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            "choose a folder that may be written to"
        }
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "free some space and run again",
        ErrorKind::NotADirectory | ErrorKind::AlreadyExists => {
            "a part of the path is a file: choose another folder"
        }
        ErrorKind::InvalidFilename => "choose a shorter name of plain characters",
        _ => "check the path and the disk",
    };
    Error::file(path, error, advice)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_appears_only_when_it_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b/note.txt");
        let (whole, mut file) = WholeFile::create(&path).unwrap();
        file.write_all(b"new").unwrap();
        assert!(!path.exists());
        drop(file);
        whole.keep().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn failure_leaves_the_old_file_and_no_part() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("note.txt");
        fs::write(&path, "old").unwrap();
        let failed = WholeFile::write(&path, |out| {
            out.write_all(b"half")?;
            Err(io::Error::from(ErrorKind::StorageFull))
        });
        let text = failed.unwrap_err().to_string();
        assert!(text.contains("note.txt") && text.contains("free some space"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn folders_devices_and_files_as_folders_are_rejected() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "x").unwrap();
        let new_folder = folder.path().join("new/");
        let long = folder.path().join("n".repeat(300));
        for bad in [
            folder.path(),
            Path::new("/dev/null"),
            &file.join("below"),
            &new_folder,
            &long,
        ] {
            let error = WholeFile::create(bad).unwrap_err();
            assert!(matches!(error, Error::File { .. }), "{bad:?}: {error}");
        }
    }

    #[test]
    fn writers_of_one_file_do_not_meet() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("note.txt");
        let part = folder.path().join("note.txt.part");
        fs::write(&part, "of a user").unwrap();
        let (first, mut one) = WholeFile::create(&path).unwrap();
        let (second, mut other) = WholeFile::create(&path).unwrap();
        one.write_all(b"first").unwrap();
        other.write_all(b"second").unwrap();
        drop((one, other));
        first.keep().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"first");
        second.keep().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        drop(WholeFile::create(&path).unwrap());
        assert_eq!(fs::read(&part).unwrap(), b"of a user");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_in_the_place_of_a_temporary_file_is_not_followed() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (path, target) = (folder.path().join("a"), folder.path().join("b"));
        fs::write(&target, "of a user").unwrap();
        std::os::unix::fs::symlink(&target, folder.path().join("a.part")).unwrap();
        WholeFile::write(&path, |out| out.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"of a user");
        // Others may read it as any new file.
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&path), mode(&target));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_remains_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let (target, link) = (folder.path().join("target"), folder.path().join("link"));
        fs::write(&target, "old").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        WholeFile::write(&link, |out| out.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }
}
