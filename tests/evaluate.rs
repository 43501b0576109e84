//! `evaluate` on a cell small enough for a test: keys, files, and results that are not made twice.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

fn evaluate(out: &Path, more: &[&str]) -> (Option<i32>, String) {
    let cell = [
        "--scene",
        "doorway",
        "--platform",
        "mobile",
        "--sources",
        "1",
    ];
    let short = ["--seconds", "2", "--repeats", "1", "--json", "--out"];
    let output = Command::new(env!("CARGO_BIN_EXE_foresound"))
        .arg("evaluate")
        .args(cell)
        .args(short)
        .arg(out)
        .args(more)
        .output()
        .expect("the program runs");
    let text = String::from_utf8(output.stdout).expect("text");
    (output.status.code(), text)
}

#[test]
fn a_standing_listener_scores_as_identical_and_once() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = ["--condition", "static", "--predictor", "best"];
    let (code, first) = evaluate(folder.path(), &arguments);
    assert_eq!(code, Some(0));
    let found: Value = serde_json::from_str(&first).expect("one JSON object");
    let row = &found["rows"][0];
    for (key, value) in [
        ("platform", "mobile"),
        ("scene", "doorway"),
        ("condition", "static"),
        ("predictor", "best"),
        ("latency", "modelled"),
    ] {
        assert_eq!(row[key], value, "{key}");
    }
    assert_eq!(
        (row["level"].as_u64(), row["sources"].as_u64()),
        (Some(3), Some(1))
    );
    assert!(row["si_snr_db"].as_f64().expect("a number") > 40.0, "{row}");
    assert!(row["ssim"].as_f64().expect("a number") > 0.9995, "{row}");
    assert!(
        row["reference_recall"].as_f64().expect("a share") > 0.9,
        "{row}"
    );
    for file in ["index.html", "tables.csv", "tables.json"] {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
    let cells = || -> Vec<_> {
        let entries = std::fs::read_dir(folder.path().join("cells")).expect("kept results");
        entries
            .map(|e| {
                e.expect("an entry")
                    .metadata()
                    .expect("data")
                    .modified()
                    .expect("a time")
            })
            .collect()
    };
    let kept = cells();
    assert_eq!(kept.len(), 1);
    assert_eq!(evaluate(folder.path(), &arguments), (Some(0), first));
    assert_eq!(cells(), kept);
}

#[test]
fn a_choice_that_is_none_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for wrong in [
        ["--predictor", "guess"],
        ["--condition", "sitting"],
        ["--latency", "much"],
        ["--signal", "silence"],
    ] {
        let (code, text) = evaluate(folder.path(), &wrong);
        assert_eq!((code, text.as_str()), (Some(2), ""), "{wrong:?}");
    }
}
