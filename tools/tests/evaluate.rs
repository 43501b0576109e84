//! `evaluate` on a cell small enough for a test: keys, files, and reuse of results.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

fn evaluate(out: &Path, more: &[&str]) -> (Option<i32>, String) {
    let scene = if more.contains(&"--scene") {
        &[][..]
    } else {
        &["--scene", "doorway"]
    };
    let cell = ["--platform", "mobile", "--sources", "1"];
    let short = ["--seconds", "2", "--repeats", "1", "--json", "--out"];
    let output = Command::new(env!("CARGO_BIN_EXE_foresound"))
        .arg("evaluate")
        .args(scene)
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
fn a_listener_at_rest_scores_as_identical_and_results_are_reused() {
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

/// Motion without prediction through both renderers: keys, pace, jumps.
#[test]
fn teleports_are_scored_through_the_engine_too() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = [
        "--condition",
        "teleport",
        "--predictor",
        "best",
        "--engine",
        "virtual",
    ];
    let (code, text) = evaluate(folder.path(), &arguments);
    assert_eq!(code, Some(0));
    let found: Value = serde_json::from_str(&text).expect("one JSON object");
    let rows = found["rows"].as_array().expect("rows");
    let renderers: Vec<_> = rows.iter().map(|row| row["renderer"].as_str()).collect();
    assert_eq!(renderers, [Some("offline"), Some("engine-virtual")]);
    for row in rows {
        // The one jump of two seconds, at 1.5 s.
        assert_eq!(row["jumps"], 1, "{row}");
        // A named platform has its own pace.
        assert_eq!((&row["level"], &row["fps"]), (&3.into(), &82.4.into()));
        assert_eq!(row["level_p50"], 3.0, "{row}");
        for key in [
            "after_250_ms_db",
            "settled_ms",
            "extrapolation_share",
            "level_p99",
            "update_ms",
            "other_seed_si_snr_db",
        ] {
            assert!(row[key].is_number(), "{key}: {row}");
        }
    }
    let sounds = folder.path().join("wav");
    for renderer in ["", "-engine-virtual"] {
        let file = format!("mobile-doorway-teleport-1{renderer}-reference.wav");
        assert!(sounds.join(&file).is_file(), "{file}");
    }
}

#[test]
fn an_invalid_choice_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for wrong in [
        ["--predictor", "guess"],
        ["--condition", "sitting"],
        ["--latency", "much"],
        ["--engine", "steam"],
        ["--signal", "silence"],
        ["--repeats", "0"],
        ["--speech", "no/such/folder"],
        ["--speed", "no-such-file.json"],
    ] {
        let (code, text) = evaluate(folder.path(), &wrong);
        assert_eq!((code, text.as_str()), (Some(2), ""), "{wrong:?}");
    }
}

/// A room of 8 by 3 by 5 metres as an OBJ file, without materials and without a layout.
fn room(file: &Path) {
    let corner = |k: usize| {
        [
            [0.0, 8.0][k & 1],
            [0.0, 3.0][k >> 1 & 1],
            [0.0, 5.0][k >> 2],
        ]
    };
    let mut text: String = (0..8)
        .map(corner)
        .map(|[x, y, z]| format!("v {x} {y} {z}\n"))
        .collect();
    for [a, b, c, d] in [
        [1, 2, 6, 5],
        [3, 7, 8, 4],
        [1, 3, 4, 2],
        [5, 6, 8, 7],
        [1, 5, 7, 3],
        [2, 4, 8, 6],
    ] {
        text.push_str(&format!("f {a} {b} {c}\nf {a} {c} {d}\n"));
    }
    std::fs::write(file, text).expect("a file is written");
}

/// Two materials of one list, on other faces: another sound, whatever was kept.
#[test]
fn other_materials_of_faces_are_another_result() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (mesh, out) = (folder.path().join("room.obj"), folder.path().join("out"));
    let mut heard = Vec::new();
    for soft in [1, 5] {
        room(&mesh);
        let text = std::fs::read_to_string(&mesh).expect("is there");
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        // Vertices come first. Both rooms begin with the hard material and have the same list.
        lines.insert(8, "usemtl concrete".into());
        lines.insert(9 + 2 * soft, "usemtl acoustic_ceiling".into());
        lines.insert(12 + 2 * soft, "usemtl concrete".into());
        std::fs::write(&mesh, lines.join("\n") + "\n").expect("written");
        let scene = mesh.display().to_string();
        let arguments = [
            "--scene",
            &scene,
            "--condition",
            "static",
            "--predictor",
            "hold",
        ];
        let (code, _) = evaluate(&out, &arguments);
        assert_eq!(code, Some(0));
        let cells = std::fs::read_dir(out.join("cells")).expect("kept results");
        let mut checksums: Vec<String> = cells
            .map(|cell| {
                let bytes = std::fs::read(cell.expect("an entry").path()).expect("is read");
                let cell: Value = serde_json::from_slice(&bytes).expect("JSON");
                cell["reference_checksum"].to_string()
            })
            .collect();
        checksums.sort();
        checksums.dedup();
        heard.push(checksums.len());
    }
    assert_eq!(heard, [1, 2], "results kept after each run");
}

#[test]
fn any_mesh_and_recordings_can_be_evaluated() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (mesh, speech) = (
        folder.path().join("my room.obj"),
        folder.path().join("talk"),
    );
    room(&mesh);
    std::fs::create_dir(&speech).expect("a folder");
    let out = folder.path().join("out");
    let (mesh_text, speech_text) = (mesh.display().to_string(), speech.display().to_string());
    let arguments = [
        "--scene",
        &mesh_text,
        "--speech",
        &speech_text,
        "--condition",
        "stress",
        "--predictor",
        "hold",
        "--latency",
        "both",
    ];
    // An empty folder first.
    assert_eq!(evaluate(&out, &arguments), (Some(2), String::new()));
    let spec = hound::WavSpec {
        channels: 2,
        sample_rate: 16_000,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let mut wav = hound::WavWriter::create(speech.join("a.WAV"), spec).expect("a WAV file");
    for n in 0..32_000 {
        let tone = 8000.0 * (f64::from(n / 2) * 0.2).sin() * (f64::from(n) * 0.0007).sin();
        wav.write_sample(tone as i16).expect("a sample");
    }
    wav.finalize().expect("a whole file");
    let (code, text) = evaluate(&out, &arguments);
    assert_eq!(code, Some(0));
    let found: Value = serde_json::from_str(&text).expect("one JSON object");
    let rows = found["rows"].as_array().expect("rows");
    let latencies: Vec<_> = rows.iter().map(|row| row["latency"].as_str()).collect();
    assert_eq!(latencies, [Some("modelled"), Some("none")]);
    for row in rows {
        assert_eq!(row["scene"], "my_room");
        assert_eq!(row["condition"], "stress");
        assert_eq!(row["level"], 24);
        // Held for a quarter of a second at 5 m/s, every path has changed.
        let ratio = row["si_snr_db"].as_f64().expect("a number");
        assert!(ratio.is_finite() && ratio < 20.0, "{row}");
        assert!(row["paper_pesq"].is_null(), "{row}");
    }
    // Late results score no better than immediate ones.
    let ssim = |index: usize| rows[index]["ssim"].as_f64().expect("a number");
    assert!(ssim(0) < ssim(1) + 0.05, "{} {}", ssim(0), ssim(1));
    for name in ["reference", "hold", "hold-at-once"] {
        let file = format!("wav/mobile-my_room-stress-1-{name}.wav");
        assert!(out.join(&file).is_file(), "{file}");
    }
}
