//! Commands that measure, and those about the program itself.

use std::fs;
use std::process::Command;

use crate::harness::{Folder, foresound, printed, refused, text};

#[test]
fn a_soak_reports_its_findings() {
    let output = foresound(&["soak", "--minutes", "0.02", "--sources", "2", "--json"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{output:?}");
    let found: serde_json::Value = serde_json::from_str(&text).expect("one JSON object");
    for key in [
        "blocks",
        "missed",
        "p50_share",
        "p999_share",
        "worst_share",
        "swaps",
        "sources_added",
        "rss_mb_start",
        "rss_mb_end",
    ] {
        assert!(found[key].is_number(), "{key} in {text}");
    }
    assert_eq!(found["allocations"], 0);
    refused(&["soak", "--minutes", "nan"], &["--minutes"]);
    for count in ["0", "257"] {
        refused(&["soak", "--sources", count], &["--sources", "1 to 256"]);
    }
    for count in ["4097", "100000"] {
        let update = ["bench", "update", "--scene", "doorway", "--sources", count];
        refused(&update, &["--sources", "4096"]);
    }
}

#[test]
fn a_speed_bench_prints_all_keys_and_writes_a_valid_trace() {
    let folder = Folder::new();
    let trace = folder.path("trace.json");
    let output = foresound(&[
        "bench",
        "speed",
        "--scene",
        "doorway",
        "--sources",
        "2",
        "--seconds",
        "0.1",
        "--json",
        "--trace",
        text(&trace),
    ]);
    assert!(output.status.success(), "{output:?}");
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(found["machine"].is_object());
    let row = &found["rows"][0];
    for key in [
        "/graphics_ms",
        "/sync_fps",
        "/async_fps",
        "/speedup",
        "/sps_ms/p50",
        "/sps_ms/p95",
        "/eps_us/p50",
        "/sgs_us/p50",
        "/direct_us/p50",
        "/level/p50",
        "/level/p95",
        "/paths_p50",
        "/rays_per_update",
        "/sps_two_threads_ms/p50",
        "/rays_alone_ms",
        "/moving_sources_ms/p50",
        "/moving_sources_two_threads_ms/p50",
        "/update_to_rays",
    ] {
        let value = row.pointer(key).and_then(serde_json::Value::as_f64);
        assert!(value.is_some_and(f64::is_finite), "{key} of {row}");
    }
    let traced = std::fs::read_to_string(&trace).expect("is there");
    let traced: serde_json::Value = serde_json::from_str(&traced).expect("JSON");
    let events = traced["traceEvents"].as_array().expect("events");
    for name in ["tick", "update (SPS)", "block"] {
        assert!(events.iter().any(|event| event["name"] == name), "{name}");
    }
    refused(&["bench", "speed", "--load", "0"], &["--load"]);
    refused(&["bench", "speed", "--level", "deep"], &["--level"]);
    refused(
        &["bench", "speed", "--predictor", "magic"],
        &["--predictor"],
    );
}

#[test]
fn an_impulse_response_has_named_bands_a_broadband_row_and_a_picture() {
    let folder = Folder::new();
    let (room, out, plot) = (
        folder.room(),
        folder.path("rir.wav"),
        folder.path("decay.png"),
    );
    let places = ["--source", "1,1,1", "--listener", "1.5,1,1"];
    let arguments = [
        &[
            "rir",
            "--scene",
            text(&room),
            "--out",
            text(&out),
            "--seconds",
            "3",
            "--plot",
            text(&plot),
        ],
        &places[..],
    ]
    .concat();
    let table = printed(&arguments);
    for word in ["  125 ", " 1000 ", "T20", "T30", "broadband"] {
        assert!(table.contains(word), "{table} lacks {word:?}");
    }
    assert!(fs::read(&plot).expect("a picture").starts_with(b"\x89PNG"));
    let json = printed(&[&arguments[..], &["--json"]].concat());
    let value: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(
        value["bands_hz"],
        serde_json::json!([63, 125, 250, 500, 1000, 2000, 4000, 8000])
    );
    for key in ["t20_s", "t30_s", "edt_s", "c50_db", "c80_db", "d50"] {
        assert_eq!(value[key].as_array().expect(key).len(), 8);
        assert!(!value["broadband"][key].is_null(), "{key}: {json}");
    }
}

#[test]
fn completions_and_manual_name_the_commands() {
    for shell in ["bash", "zsh", "fish"] {
        assert!(printed(&["completions", shell]).contains("materials"));
    }
    assert!(printed(&["manual"]).contains(".TH"));
    let folder = Folder::new();
    printed(&["manual", "--folder", text(&folder.path("man"))]);
    assert!(folder.path("man").join("foresound-rir.1").is_file());
    if cfg!(not(feature = "play")) {
        refused(&["play", "--scene", "doorway"], &["features play"]);
    }
}

/// From another folder, with nothing but its own file.
#[test]
fn an_installed_program_finds_its_scenes() {
    let folder = Folder::new();
    for _ in 0..2 {
        let output = Command::new(env!("CARGO_BIN_EXE_foresound"))
            .args(["inspect", "doorway", "--json"])
            .current_dir(&folder.0)
            .env("XDG_CACHE_HOME", folder.path("cache"))
            .output()
            .expect("runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect(&said);
        assert!(value["triangles"].as_u64() > Some(100), "{value}");
        assert_eq!(value["defaulted_materials"], serde_json::json!([]));
    }
}
