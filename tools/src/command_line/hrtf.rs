//! `hrtf`: converts a SOFA file to a baked set, and compares a set with its measurement.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use foresound::Result;
use foresound::generation::Hrtf;
use foresound::generation::baking::accuracy::{HrtfAccuracy, LevelErrors};
use foresound::output::whole_file::WholeFile;
use serde_json::{Value, json};

use crate::assets::KEMAR;
use crate::hrtf_file::read;
use crate::inputs::keep_inputs;
use crate::printed;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// SOFA file of the convention SimpleFreeFieldHRIR; without one the built-in set is compared with its measurement.
    #[arg(value_name = "FILE.sofa")]
    file: Option<PathBuf>,
    /// Baked set to write; by default the file's name with the ending .hrtf.
    #[arg(long, value_name = "FILE.hrtf", requires = "file")]
    out: Option<PathBuf>,
    /// Sample rate of the set in Hz: 16000 to 96000, or 44100 and 48000 for the built-in one.
    #[arg(long, default_value_t = 44_100, value_name = "HZ")]
    rate: u32,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[expect(
    clippy::disallowed_methods,
    reason = "states how long the conversion took; no result depends on it"
)]
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let Some(file) = &arguments.file else {
        let set = Hrtf::builtin(arguments.rate)?;
        let errors = HrtfAccuracy::compare(&set, KEMAR, "MIT_KEMAR_normal_pinna.sofa")?;
        print(arguments, &set, &errors, "built-in", None);
        return Ok(());
    };
    let out = arguments
        .out
        .clone()
        .unwrap_or_else(|| file.with_extension("hrtf"));
    keep_inputs(&out, [file.as_path()])?;
    let content = read(file)?;
    let name = file.to_string_lossy();
    let start = Instant::now();
    let set = Hrtf::from_sofa(&content, &name, arguments.rate)?;
    let seconds = start.elapsed().as_secs_f64();
    let bytes = set.to_bytes();
    WholeFile::write(&out, |file| file.write_all(&bytes))?;
    let errors = HrtfAccuracy::compare(&set, &content, &name)?;
    print(
        arguments,
        &set,
        &errors,
        &out.to_string_lossy(),
        Some(seconds),
    );
    Ok(())
}

fn print(
    arguments: &Arguments,
    set: &Hrtf,
    errors: &HrtfAccuracy,
    name: &str,
    seconds: Option<f64>,
) {
    let percent = |share: f64| (1e3 * share).round() / 10.0;
    let tenths = |time_s: f64| (1e7 * time_s).round() / 10.0;
    let levels = |errors: &LevelErrors| {
        json!({
            "within_1_db_percent": percent(errors.within_1_db),
            "mean_db": errors.mean_db,
            "worst_db": errors.worst_db,
        })
    };
    let delay = &errors.interaural_delay;
    let [low, middle, high] = errors.phase_delay_s.map(tenths);
    let mut value = json!({
        "set": name,
        "measurement": arguments.file.as_deref().map_or("MIT KEMAR".into(), Path::to_string_lossy),
        "rate_hz": set.rate_hz(),
        "filters": 8 * set.groups(),
        "taps": set.taps(),
        "bytes": set.to_bytes().len(),
        "directions": errors.directions,
        "itd": {
            "within_20_us_percent": percent(delay.within_20_us),
            "mean_us": tenths(delay.mean_s),
            "worst_us": tenths(delay.worst_s),
        },
        "phase_delay_us": { "250": low, "500": middle, "1000": high },
        "octaves": levels(&errors.octaves),
        "thirds": levels(&errors.thirds),
    });
    if let (Some(seconds), Value::Object(keys)) = (seconds, &mut value) {
        keys.insert("seconds".into(), json!(seconds));
    }
    if arguments.json {
        outln!("{value}");
    } else {
        printed::row(&value);
    }
}
