//! Rows of the tables: means over repeats, beside what the paper printed; CSV, JSON and text.

use std::io::Write;
use std::path::Path;

use foresound::evaluation::paper::table_five;
use foresound::evaluation::report::Row;
use foresound::evaluation::scores::Spread;
use foresound::evaluation::si_snr::capped_text;
use foresound::output::WholeFile;
use foresound::runtime::Latency;
use foresound::{Error, Result};
use serde_json::{Value, json};

use super::plan::Unit;
use super::unit::UnitResult;

/// One row a cell and predictor, in the order of the units.
pub(super) fn rows(units: &[Unit], results: &[UnitResult]) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut from = 0;
    while from < units.len() {
        let unit = &units[from];
        let name = unit.cell_name();
        let count = units[from..]
            .iter()
            .take_while(|u| u.cell_name() == name)
            .count();
        let repeats = &results[from..from + count];
        for (place, variant) in unit.variants.iter().enumerate() {
            let scores = || repeats.iter().map(|result| result.estimates[place].scores);
            let times = repeats.iter().map(|r| r.estimates[place].extrapolation_us);
            let (Some(ssim), Some(si_snr_db)) = (
                Spread::of(scores().map(|s| s.ssim)),
                Spread::of(scores().map(|s| s.si_snr_db)),
            ) else {
                continue;
            };
            let of_all = |values: &mut dyn Iterator<Item = f64>| {
                Spread::of(values).map_or(0.0, |spread| spread.mean)
            };
            rows.push(Row {
                platform: unit.platform,
                scene: unit.scene.clone(),
                dynamic: unit.dynamic,
                sources: unit.sources,
                level: unit.pace.level,
                graphics_rate_hz: unit.pace.graphics_rate_hz,
                predictor: variant.name.to_owned(),
                is_late: unit.latency == Latency::Modelled,
                signal: unit.signal.clone(),
                repeats: count,
                pesq: Spread::of(scores().filter_map(|s| s.pesq)),
                ssim,
                si_snr_db,
                extrapolation_us: of_all(&mut { times }),
                reference_paths: repeats[0].reference_paths,
                reference_recall: of_all(&mut repeats.iter().map(|r| r.reference_recall)),
                reference_checksum: repeats[0].reference_checksum.clone(),
                wav_stem: name.clone(),
            });
        }
        from += count;
    }
    rows
}

fn value(row: &Row) -> Value {
    let printed = table_five(row.platform, &row.scene, row.dynamic, row.sources);
    json!({
        "platform": row.platform,
        "scene": row.scene,
        "condition": row.condition(),
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
        "extrapolation_us": row.extrapolation_us,
        "reference_paths": row.reference_paths,
        "reference_recall": row.reference_recall,
        "reference_checksum": row.reference_checksum,
        "paper_pesq": printed.map(|p| p.pesq),
        "paper_ssim": printed.map(|p| p.ssim),
        "paper_si_snr_db": printed.map(|p| p.si_snr_db),
    })
}

/// Everything as one JSON object.
pub(super) fn json(rows: &[Row]) -> Value {
    json!({ "rows": rows.iter().map(value).collect::<Vec<_>>() })
}

/// `tables.csv` and `tables.json`.
pub(super) fn write(out: &Path, rows: &[Row]) -> Result<()> {
    WholeFile::write(out.join("tables.json"), |file| {
        writeln!(file, "{:#}", json(rows))?;
        Ok(())
    })?;
    let path = out.join("tables.csv");
    let mut writer = csv::Writer::from_writer(Vec::new());
    let wrong = |e: csv::Error| Error::file(&path, e, "report this as a mistake of ours");
    for (place, row) in rows.iter().enumerate() {
        let Value::Object(object) = value(row) else {
            continue;
        };
        if place == 0 {
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
    println!(
        "{:<12} {:<13} {:<8} {:>3} {:>3} {:<22} {:>6} {:>7} {:>8}   paper: PESQ, SSIM, SI-SNR",
        "platform", "scene", "listener", "n", "L", "predictor", "PESQ", "SSIM", "SI-SNR"
    );
    for row in rows {
        let printed = table_five(row.platform, &row.scene, row.dynamic, row.sources);
        println!(
            "{:<12} {:<13} {:<8} {:>3} {:>3} {:<22} {:>6} {:>7.4} {:>8}   {}",
            row.platform.name(),
            row.scene,
            row.condition(),
            row.sources,
            row.level,
            row.predictor,
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
