//! `validate`: every law with its figure and bound.

use std::path::PathBuf;
use std::process::ExitCode;

use foresound::Result;
use foresound::evaluation::edge_figure::draw_edge_figure;
use foresound::evaluation::validate::{law_names, measure};
use serde_json::json;

use crate::progress::Progress;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Only this law.
    #[arg(long)]
    law: Option<String>,
    /// Write figures of the laws as PNG into this folder.
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Success if all laws hold, 1 if one does not.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    let laws = match &arguments.law {
        Some(law) => vec![law.as_str()],
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
        draw_edge_figure()?.save_png(folder.join("edge.png"))?;
    }
    if arguments.json {
        let rows: Vec<_> = rows
            .iter()
            .map(|row| {
                json!({"law": row.law, "figure": row.figure, "bound": row.bound, "unit": row.unit, "pass": row.pass})
            })
            .collect();
        println!("{}", json!({ "rows": rows }));
    } else {
        for row in &rows {
            let mark = if row.pass { "ok  " } else { "FAIL" };
            println!(
                "{mark} {}: {:.4e} {} (bound {:.4e})",
                row.law, row.figure, row.unit, row.bound
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
