//! Reads scenes from files: meshes from OBJ, PLY, glTF and GLB, materials and layouts from TOML.
//!
//! Control side; behind the feature `files`, glTF behind `gltf`.

pub mod formats;
#[cfg(feature = "gltf")]
mod gltf;
mod layout_file;
mod material_file;
pub mod mesh_file;
mod obj;
mod ply;
mod polygon;
mod toml_file;

use std::fs::File;
use std::path::Path;

use crate::error::{Error, Result};

/// Opens a file; a directory is an error.
fn open(path: &Path, advice: &str) -> Result<File> {
    let error = |reason: &dyn ToString| Error::file(path, reason.to_string(), advice);
    let file = File::open(path).map_err(|reason| error(&reason))?;
    match file.metadata() {
        Ok(metadata) if metadata.is_dir() => Err(error(&"is a directory")),
        Ok(_) => Ok(file),
        Err(reason) => Err(error(&reason)),
    }
}

/// The error of a mesh file that cannot be read to its end.
fn unreadable(path: &Path) -> Error {
    Error::file(
        path,
        "the file cannot be read to its end",
        "check the disk and the file's permissions",
    )
}
