//! `bench speed`: the engine's two schedules ([`super::schedules`]) and propagation updates by themselves
//! ([`super::updates`]).
//!
//! `to_linear_in_sources` is a row's fastest update over that of its scene's first row, divided by the ratio of their
//! numbers of sources (1 is linear); `to_first_scene` is the ratio to the first scene's with as many sources.

use std::path::PathBuf;

use foresound::runtime::{Budget, EngineSettings, QualityChoice, QualityLevel, TraceLog};
use foresound::{Error, Result};
use foresound_tools::cells::{Platform, SCENES, SOURCE_COUNTS};
use foresound_tools::paper::{pace, printed_speed};
use serde_json::{Value, json};

use super::schedules::{Cell, LevelOf, loaded};
use super::updates;
use super::walk::Walk;
use crate::inputs::{counted, predictor_named, within};
use crate::printed;
use crate::traces::write_trace;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Benchmark scenes by name, or `million`; default: the three of the paper's kind.
    #[arg(long, value_delimiter = ',')]
    scene: Vec<String>,
    /// Numbers of sources.
    #[arg(long, value_delimiter = ',', default_values_t = [1, 2, 4, 8, 16])]
    sources: Vec<usize>,
    /// Seconds for each row.
    #[arg(long, default_value_t = 2.0)]
    seconds: f64,
    /// Milliseconds of the caller's own work in a graphics frame.
    #[arg(long, value_name = "MS", default_value_t = 0.0)]
    graphics_ms: f64,
    /// Factor on the paper's ray counts, 0.01 to 64.
    #[arg(
        long,
        value_name = "K",
        default_value_t = 1.0,
        conflicts_with = "level"
    )]
    load: f64,
    /// Choose the load that gives this level L: a number, or `workstation` or `mobile` for the paper's of each cell.
    #[arg(long, value_name = "L")]
    level: Option<String>,
    /// Schedule whose T_SPS is L graphics frames.
    #[arg(long, value_enum, default_value_t = LevelOf::Asynchronous, requires = "level")]
    level_of: LevelOf,
    /// Predictor of the asynchronous schedule and of single updates: hold, linear or best; default that of the engine.
    #[arg(long)]
    predictor: Option<String>,
    /// Quality level, 0 (everything) to 5.
    #[arg(long, alias = "tier", value_name = "N", default_value_t = 0)]
    quality_level: u8,
    /// Measure the schedules only, not single updates.
    #[arg(long)]
    schedules_only: bool,
    /// Numbers of moving instances: measure updates with and without them instead of the schedules.
    #[arg(long, value_name = "N", value_delimiter = ',')]
    instances: Vec<usize>,
    /// Write a trace of all threads' work for Perfetto.
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// The fastest update of a row, for later ratios.
struct Fastest {
    sources: usize,
    ms: f64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let scenes: Vec<&str> = match arguments.scene.is_empty() {
        false => arguments.scene.iter().map(String::as_str).collect(),
        true => vec!["concert_hall", "bootcamp", "angrybot"],
    };
    let mut rows = Vec::new();
    let mut log = TraceLog::default();
    let predictor = match &arguments.predictor {
        Some(name) => predictor_named(name)?,
        None => EngineSettings::default().predictor,
    };
    within("--load", arguments.load, 0.01..=64.0, "")?;
    within("--graphics-ms", arguments.graphics_ms, 0.0..=1000.0, " ms")?;
    let mut first_scene: Vec<Fastest> = Vec::new();
    for (number, name) in scenes.into_iter().enumerate() {
        let walk = Walk::through(name)?;
        for (&count, &moving) in arguments.sources.iter().flat_map(|count| {
            let instances = arguments.instances.iter();
            instances.map(move |instances| (count, instances))
        }) {
            let row = updates::with_instances(name, &walk, [count, moving], arguments.seconds)?;
            if !arguments.json {
                printed::row(&row);
            }
            rows.push(row);
        }
        let mut fewest: Option<Fastest> = None;
        let fixed = arguments.sources.iter();
        for &count in fixed.filter(|_| arguments.instances.is_empty()) {
            let poses = walk.sources(count)?;
            let cell = Cell {
                scene: &walk.scene,
                walk: walk.listener(),
                sources: &poses,
                predictor,
                budget: {
                    let mut budget = Budget::default();
                    let quality_level = QualityLevel(arguments.quality_level);
                    budget.quality = QualityChoice::Exactly(quality_level);
                    budget
                },
                graphics_ms: arguments.graphics_ms,
                seconds: arguments.seconds,
                trace: arguments.trace.is_some(),
            };
            let engine = match requested_level(arguments, name, count)? {
                Some(level) => cell.measure_at(level, arguments.level_of, 64.0, &mut log)?,
                None => cell.measure(arguments.load, &mut log)?,
            };
            let load = engine["load"].as_f64().unwrap_or(arguments.load);
            let mut row = json!({"scene": name, "sources": count, "predictor": predictor.name(), "graphics_ms": arguments.graphics_ms});
            if !arguments.schedules_only {
                let settings = loaded(load);
                let seconds = arguments.seconds;
                let times = updates::alone(&walk, &poses, settings, predictor, seconds)?;
                let ms = times["sps_best_ms"].as_f64().unwrap_or_default();
                extend(&mut row, times);
                let fewest = fewest.get_or_insert(Fastest { sources: count, ms });
                let linear = fewest.ms * count as f64 / fewest.sources as f64;
                row["triangles"] = json!(walk.scene.bvh().triangle_count());
                row["to_linear_in_sources"] = json!(ms / linear);
                if number == 0 {
                    first_scene.push(Fastest { sources: count, ms });
                }
                let same = first_scene.iter().find(|first| first.sources == count);
                row["to_first_scene"] = json!(same.map(|first| ms / first.ms));
            }
            extend(&mut row, engine);
            if let Some(printed) = printed_cell(arguments, name, count) {
                row["paper"] = printed;
            }
            if !arguments.json {
                printed::row(&row);
            }
            rows.push(row);
        }
    }
    let summary = summary(&rows, arguments.level_of);
    if let (Some(summary), false) = (&summary, arguments.json) {
        printed::row(summary);
    }
    if arguments.json {
        let threads = std::thread::available_parallelism().map_or(0, usize::from);
        let machine = json!({
            "arch": std::env::consts::ARCH,
            "os": std::env::consts::OS,
            "threads": threads,
        });
        let mut result = json!({ "rows": rows, "machine": machine });
        if let Some(summary) = summary {
            result["summary"] = summary;
        }
        outln!("{result}");
    }
    match &arguments.trace {
        Some(file) => write_trace(file, &log),
        None => Ok(()),
    }
}

/// Adds the keys of an object to another.
fn extend(row: &mut Value, more: Value) {
    if let (Value::Object(row), Value::Object(more)) = (row, more) {
        row.extend(more);
    }
}

/// The paper's platform of a name.
fn platform_named(level: &str) -> Option<Platform> {
    Platform::ALL
        .into_iter()
        .find(|platform| platform.name() == level)
}

/// The paper's figures of a cell, if `--level` names a platform.
fn printed_cell(arguments: &Arguments, scene: &str, sources: usize) -> Option<Value> {
    let platform = platform_named(arguments.level.as_deref()?)?;
    let printed = printed_speed(platform, scene, sources)?;
    Some(json!({
        "platform": platform.name(),
        "level": pace(platform, scene, sources).level,
        "sync_fps": printed.baseline_fps,
        "async_fps": printed.proposed_fps,
        "speedup": printed.speedup,
    }))
}

/// Means over the rows with figures of the paper.
fn summary(rows: &[Value], of: LevelOf) -> Option<Value> {
    let cells: Vec<&Value> = rows.iter().filter(|row| row["paper"].is_object()).collect();
    let mean = |key: &str| {
        let figures = cells.iter().filter_map(|row| row.pointer(key)?.as_f64());
        figures.sum::<f64>() / cells.len() as f64
    };
    let at_level = |row: &&&Value| of.found(row) == row["paper"]["level"].as_f64();
    (!cells.is_empty()).then(|| {
        json!({
            "cells": cells.len(),
            "cells_at_paper_level": cells.iter().filter(at_level).count(),
            "speedup_mean": mean("/speedup"),
            "paper_speedup_mean": mean("/paper/speedup"),
            "level_mean": mean("/level/p50"),
            "sync_level_mean": mean("/sync_level"),
            "paper_level_mean": mean("/paper/level"),
        })
    })
}

/// The level of a cell by `--level`.
fn requested_level(arguments: &Arguments, scene: &str, sources: usize) -> Result<Option<u32>> {
    let Some(text) = &arguments.level else {
        return Ok(None);
    };
    let Some(platform) = platform_named(text) else {
        let level = text.parse().ok().filter(|level| *level <= 1000);
        let advice = "give a number to 1000, workstation or mobile";
        let problem = format!("{text:?} is no level");
        return level
            .map(Some)
            .ok_or_else(|| Error::setting("--level", problem, advice));
    };
    if SCENES.contains(&scene) && SOURCE_COUNTS.contains(&sources) {
        return Ok(Some(pace(platform, scene, sources).level));
    }
    let problem = format!(
        "the paper has no {scene} with {}",
        counted(sources, "source")
    );
    Err(Error::setting("--level", problem, "give a number"))
}
