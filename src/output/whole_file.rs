//! A file that is either complete or absent.
//!
//! Control side; blocks on the disk. Content is written to `NAME.part` in the same folder and renamed when it is complete: a
//! file with its final name is always complete.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// A file being written. If it is dropped before [`Self::keep`], the partial file is removed.
#[derive(Debug)]
pub struct WholeFile {
    path: PathBuf,
    part: PathBuf,
    kept: bool,
}

impl WholeFile {
    /// Opens `NAME.part` for writing and creates missing folders. A link is followed: its target is replaced, and the
    /// link remains.
    ///
    /// # Errors
    /// [`Error::File`] if the path has no file name, is a folder or a device, or cannot be written.
    pub fn create(path: impl AsRef<Path>) -> Result<(Self, File)> {
        let given = path.as_ref();
        let path = fs::canonicalize(given).unwrap_or_else(|_| given.to_path_buf());
        let Some(name) = path.file_name() else {
            return Err(Error::file(given, "has no file name", "add a file name"));
        };
        if path.is_dir() {
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
        let mut part_name = OsString::from(name);
        part_name.push(".part");
        let part = path.with_file_name(part_name);
        if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
            fs::create_dir_all(folder).map_err(|e| write_error(folder, e))?;
        }
        let file = File::create(&part).map_err(|e| write_error(given, e))?;
        let kept = false;
        Ok((Self { path, part, kept }, file))
    }

    /// The final path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Renames the file to its final name. The caller must have flushed and closed it.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be renamed; the partial file is removed.
    pub fn keep(mut self) -> Result<()> {
        fs::rename(&self.part, &self.path).map_err(|e| write_error(&self.path, e))?;
        self.kept = true;
        Ok(())
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
        if !self.kept {
            // `drop` cannot report a failure; a remaining file keeps the `.part` suffix.
            let _ = fs::remove_file(&self.part);
        }
    }
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
        for bad in [folder.path(), Path::new("/dev/null"), &file.join("below")] {
            let error = WholeFile::create(bad).unwrap_err();
            assert!(matches!(error, Error::File { .. }), "{bad:?}: {error}");
        }
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
