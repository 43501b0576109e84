//! `commit`: prepares a scene and saves it, to be loaded without the work.

use std::io::Write;
use std::path::{Path, PathBuf};

use foresound::output::whole_file::WholeFile;
use foresound::{Error, Result};
use serde_json::json;

use crate::inputs::{SceneArguments, bytes_text, counted, keep_inputs, load_scene, print_notes};

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// OBJ, PLY, glTF or GLB file, or the name of a benchmark scene.
    scene: PathBuf,
    #[command(flatten)]
    intake: SceneArguments,
    /// Saved scene to write: every command, and an app, reads it like a mesh file.
    #[arg(long, value_name = "FILE.fscene")]
    out: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let out = &arguments.out;
    if out.as_os_str() == "-" {
        let problem = "a saved scene is a file";
        return Err(Error::file(
            out,
            problem,
            "give a name that ends in .fscene",
        ));
    }
    let inputs = arguments.intake.files(&arguments.scene);
    keep_inputs(out, inputs.iter().map(|file| -> &Path { file }))?;
    let loaded = load_scene(&arguments.scene, &arguments.intake)?;
    print_notes(&loaded.notes);
    let bytes = loaded.scene.to_bytes()?;
    WholeFile::write(out, |file| file.write_all(&bytes))?;
    let triangles = loaded.scene.report().triangles;
    if arguments.json {
        let value = json!({
            "file": out.display().to_string(),
            "bytes": bytes.len(),
            "triangles": triangles,
            "surfaces": loaded.scene.surfaces().len(),
        });
        outln!("{value}");
    } else {
        let size = bytes_text(bytes.len());
        let triangles = counted(triangles, "triangle");
        outln!("{}: {triangles}, {size}", out.display());
    }
    Ok(())
}
