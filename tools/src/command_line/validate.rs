//! `validate`: the figures of every law and their bounds.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use foresound::{Error, Result};
use foresound_tools::edge_figure::draw_edge_figure;
use foresound_tools::validate::{late_figures, law_names, measure};
use serde_json::json;

use crate::printed::four_digits;
use crate::progress::Progress;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Measure only this law and all laws whose names start with it and a slash.
    #[arg(long)]
    law: Option<String>,
    /// Also write pictures of the laws into this folder.
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Success if all laws hold, exit code 1 otherwise.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    let laws = match &arguments.law {
        // `mesh` is the law of that name and all whose names start with `mesh/`.
        Some(law) => {
            let is_part = |name: &&str| {
                let rest = name.strip_prefix(law.as_str());
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
            };
            let parts: Vec<_> = law_names().into_iter().filter(is_part).collect();
            match parts.is_empty() {
                true => vec![law.as_str()],
                false => parts,
            }
        }
        None => law_names(),
    };
    let mut rows = Vec::new();
    let mut progress = Progress::new("validate", laws.len() as u64);
    for law in laws {
        rows.extend(measure(law)?);
        progress.step();
    }
    drop(progress);
    if let Some(folder) = &arguments.figures {
        write_figures(folder)?;
    }
    if arguments.json {
        let rows: Vec<_> = rows
            .iter()
            .map(|row| {
                json!({"law": row.law, "figure": row.figure, "bound": row.bound, "unit": row.unit, "pass": row.pass})
            })
            .collect();
        outln!("{}", json!({ "rows": rows }));
    } else {
        for row in &rows {
            let mark = if row.pass { "ok  " } else { "FAIL" };
            outln!(
                "{mark} {}: {} {} (bound {})",
                row.law,
                figure_text(row.figure),
                row.unit,
                figure_text(row.bound)
            );
        }
    }
    let all = rows.iter().all(|row| row.pass);
    Ok(if all {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// A figure in plain digits, and in powers of ten only where those would be zeros or many.
fn figure_text(figure: f64) -> String {
    match figure.abs() {
        0.0 => "0".to_owned(),
        1e-4..1e6 => four_digits(figure),
        _ => format!("{figure:.3e}"),
    }
}

/// Writes the pictures of the laws and prints their files.
fn write_figures(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder)
        .map_err(|error| Error::file(folder, error, "choose a folder that can be written"))?;
    let mut files = Vec::new();
    files.extend(late_figures::write(folder)?);
    let edge = folder.join("edge.png");
    draw_edge_figure()?.save_png(&edge)?;
    files.push(edge);
    for file in files {
        eprintln!("{}", file.display());
    }
    Ok(())
}
