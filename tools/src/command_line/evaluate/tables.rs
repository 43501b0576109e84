//! Rows of the tables: means over repeats, beside the paper's figures; CSV, JSON and text.

use std::io::Write;
use std::path::Path;

use foresound::output::WholeFile;
use foresound::runtime::Latency;
use foresound::{Error, Result};
use foresound_tools::paper::table_five;
use foresound_tools::report::{OverloadRow, Row};
use foresound_tools::scores::Spread;
use foresound_tools::settling::Settling;
use foresound_tools::si_snr::capped_text;
use serde_json::{Value, json};

use super::plan::{Part, Unit};
use super::unit::{Estimate, UnitResult, latency_name};

/// Rows by destination.
pub(super) struct Found {
    pub(super) rows: Vec<Row>,
    pub(super) doorway: Vec<Row>,
}

impl Found {
    /// Means over the repeats of each cell.
    pub(super) fn of(units: &[Unit], results: &[UnitResult]) -> Self {
        let mut found = Self {
            rows: Vec::new(),
            doorway: Vec::new(),
        };
        let same = |a: &Unit, b: &Unit| a.part == b.part && a.cell_name() == b.cell_name();
        let mut from = 0;
        while from < units.len() {
            let unit = &units[from];
            let count = units[from..].iter().take_while(|u| same(u, unit)).count();
            let repeats = &results[from..from + count];
            let rows = unit
                .estimates()
                .filter_map(|(kind, latency)| row(unit, repeats, kind.name(), latency));
            match unit.part {
                Part::Doorway => found.doorway.extend(rows),
                Part::Table => found.rows.extend(rows),
            }
            from += count;
        }
        found
    }
}

/// One row: a cell and predictor; `None` if no repeat has it.
fn row(unit: &Unit, repeats: &[UnitResult], name: &str, latency: Latency) -> Option<Row> {
    let is_it = |e: &&Estimate| e.predictor == name && e.latency == latency_name(latency);
    let estimates: Vec<&Estimate> = repeats
        .iter()
        .filter_map(|result| result.estimates.iter().find(is_it))
        .collect();
    let spread = |pick: &dyn Fn(&Estimate) -> f64| {
        Spread::of(estimates.iter().map(|estimate| pick(estimate)))
    };
    let recall = |index: usize| {
        let found = repeats.iter().filter_map(|result| result.reference_recall);
        Spread::of(found.map(|recall| recall[index])).map(|spread| spread.mean)
    };
    let first = repeats.first()?;
    Some(Row {
        renderer: unit.renderer,
        platform: unit.platform,
        scene: unit.scene.clone(),
        condition: unit.condition,
        sources: unit.sources,
        level: unit.pace.level,
        graphics_rate_hz: unit.pace.graphics_rate_hz,
        predictor: name.to_owned(),
        is_late: latency == Latency::Modelled,
        signal: unit.signal.clone(),
        repeats: estimates.len(),
        pesq: Spread::of(estimates.iter().filter_map(|e| e.scores.pesq)),
        ssim: spread(&|e| e.scores.ssim)?,
        si_snr_db: spread(&|e| e.scores.si_snr_db)?,
        settling: Settling::worst(estimates.iter().filter_map(|e| e.settling)),
        extrapolation_us: spread(&|e| e.extrapolation_us)?.mean,
        reference_paths: first.reference_paths,
        extrapolation_level: [0, 1].map(|i| spread(&|e| e.level[i]).map_or(0.0, |s| s.mean)),
        update_ms: spread(&|e| e.update_ms)?.mean,
        reference_update_ms: Spread::of(repeats.iter().map(|r| r.reference_update_ms))?.mean,
        other_seed: first.other_seed,
        reference_recall: recall(0),
        reference_energy_recall: recall(1),
        reference_checksum: first.reference_checksum.clone(),
        wav_stem: unit.cell_name(),
    })
}

fn value(row: &Row) -> Value {
    let printed = table_five(row.platform, &row.scene, row.condition, row.sources);
    json!({
        "renderer": row.renderer,
        "platform": row.platform,
        "scene": row.scene,
        "condition": row.condition.name(),
        "sources": row.sources,
        "level": row.level,
        "fps": row.graphics_rate_hz,
        "predictor": row.predictor,
        "pesq": row.pesq.map(|s| s.mean),
        "pesq_sd": row.pesq.map(|s| s.sd),
        "ssim": row.ssim.mean,
        "ssim_sd": row.ssim.sd,
        "si_snr_db": row.si_snr_db.mean,
        "si_snr_sd": row.si_snr_db.sd,
        "latency": if row.is_late { "modelled" } else { "none" },
        "signal": row.signal,
        "repeats": row.repeats,
        "jumps": row.settling.map(|s| s.jumps),
        "after_250_ms_db_p50": row.settling.map(|s| s.after_db[0]),
        "after_250_ms_db": row.settling.map(|s| s.after_db[1]),
        "settled_ms_p50": row.settling.map(|s| s.settled_ms[0]),
        "settled_ms": row.settling.map(|s| s.settled_ms[1]),
        "extrapolation_us": row.extrapolation_us,
        "extrapolation_share": row.extrapolation_share(),
        "level_p50": row.extrapolation_level[0],
        "level_p99": row.extrapolation_level[1],
        "update_ms": row.update_ms,
        "reference_update_ms": row.reference_update_ms,
        "other_seed_pesq": row.other_seed.and_then(|s| s.pesq),
        "other_seed_ssim": row.other_seed.map(|s| s.ssim),
        "other_seed_si_snr_db": row.other_seed.map(|s| s.si_snr_db),
        "reference_paths": row.reference_paths,
        "reference_recall": row.reference_recall,
        "reference_energy_recall": row.reference_energy_recall,
        "reference_checksum": row.reference_checksum,
        "paper_pesq": printed.map(|p| p.pesq),
        "paper_ssim": printed.map(|p| p.ssim),
        "paper_si_snr_db": printed.map(|p| p.si_snr_db),
    })
}

/// Everything as one JSON object: the rows of the tables, of the doorway and of playback under overload.
pub(super) fn json(found: &Found, overload: &[OverloadRow]) -> Value {
    let values = |rows: &[Row]| rows.iter().map(value).collect::<Vec<_>>();
    json!({
        "rows": values(&found.rows),
        "doorway": values(&found.doorway),
        "overload": overload,
    })
}

/// `tables.csv` and `tables.json`.
pub(super) fn write(out: &Path, found: &Found, text: &Value) -> Result<()> {
    WholeFile::write(out.join("tables.json"), |file| {
        writeln!(file, "{text:#}")?;
        Ok(())
    })?;
    let rows = found.rows.iter().chain(&found.doorway);
    let path = out.join("tables.csv");
    let mut writer = csv::Writer::from_writer(Vec::new());
    let wrong = |e: csv::Error| Error::file(&path, e, "report this as a mistake of ours");
    for (index, row) in rows.enumerate() {
        let Value::Object(object) = value(row) else {
            continue;
        };
        if index == 0 {
            writer.write_record(object.keys()).map_err(wrong)?;
        }
        let text = object.values().map(|value| match value {
            Value::String(text) => text.clone(),
            Value::Null => String::new(),
            other => other.to_string(),
        });
        writer.write_record(text).map_err(wrong)?;
    }
    let bytes = writer
        .into_inner()
        .map_err(|e| Error::file(&path, e, "report this as a mistake of ours"))?;
    WholeFile::write(&path, |file| {
        file.write_all(&bytes)?;
        Ok(())
    })
}

/// The rows on standard output.
pub(super) fn print(rows: &[Row]) {
    outln!(
        "{:<14} {:<12} {:<13} {:<9} {:>3} {:>3} {:<22} {:>6} {:>7} {:>8}   paper: PESQ, SSIM, SI-SNR",
        "renderer",
        "platform",
        "scene",
        "motion",
        "n",
        "L",
        "predictor",
        "PESQ",
        "SSIM",
        "SI-SNR"
    );
    for row in rows {
        let printed = table_five(row.platform, &row.scene, row.condition, row.sources);
        outln!(
            "{:<14} {:<12} {:<13} {:<9} {:>3} {:>3} {:<22} {:>6} {:>7.4} {:>8}   {}",
            row.renderer.name(),
            row.platform.name(),
            row.scene,
            row.condition.name(),
            row.sources,
            row.level,
            if row.is_late {
                row.predictor.clone()
            } else {
                format!("{}, at once", row.predictor)
            },
            row.pesq
                .map_or("-".to_owned(), |s| format!("{:.3}", s.mean)),
            row.ssim.mean,
            capped_text(row.si_snr_db.mean),
            printed.map_or(String::new(), |p| {
                format!("{}, {}, {}", p.pesq, p.ssim, p.si_snr_db)
            })
        );
    }
}
