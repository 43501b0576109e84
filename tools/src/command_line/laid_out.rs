//! Sources and a walk of any scene: its layout's, and in open space what that lacks.

use std::path::Path;

use foresound::scene::layout::{NamedSource, Walk};
use foresound::{Error, Result};
use foresound_tools::open_space::open_space;

use crate::inputs::{LoadedScene, counted, print_notes};

/// Where sound comes from and where it is heard.
pub(crate) struct LaidOut {
    pub(crate) sources: Vec<NamedSource>,
    pub(crate) walk: Walk,
}

/// Label of a scene in tables and files: its name, or its file's stem.
pub(crate) fn scene_label(named: &str) -> String {
    let stem = Path::new(named).file_stem();
    let stem = stem.map_or(named.into(), |stem| stem.to_string_lossy());
    let plain = |c: char| {
        if c.is_alphanumeric() || "_-".contains(c) {
            c
        } else {
            '_'
        }
    };
    stem.chars().map(plain).collect()
}

/// The sources and the walk of a scene, `most_sources` at most. What is put in open space is told in a note.
pub(crate) fn laid_out(named: &str, loaded: &LoadedScene, most_sources: usize) -> Result<LaidOut> {
    let layout = loaded.layout.as_ref();
    let mut sources = layout.map_or_else(Vec::new, |layout| layout.sources.clone());
    let mut walk = loaded.walk();
    if sources.is_empty() || walk.is_none() {
        let found = open_space(&loaded.scene, most_sources)?;
        if sources.is_empty() {
            let count = counted(found.sources.len(), "source");
            print_notes(&[format!("{named}: {count} laid out in open space")]);
            let numbered = (1..).zip(found.sources);
            sources = numbered
                .map(|(number, at)| NamedSource::plain(format!("source {number}"), at))
                .collect();
        }
        walk.get_or_insert_with(|| {
            let Walk { from, to, .. } = found.walk;
            print_notes(&[format!("{named}: a walk laid out from {from} to {to}")]);
            found.walk
        });
    }
    let walk = walk.ok_or_else(|| {
        let advice = "put a TOML file with sources and a listener beside the mesh file";
        Error::file(named, "has no layout", advice)
    })?;
    sources.truncate(most_sources);
    Ok(LaidOut { sources, walk })
}
