//! Dependencies: every licence is in deny.toml's list, every crate comes from the registry, and no crate comes in two
//! versions unless listed here. Read from cargo's own metadata, without a network.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// Crates that are built in two versions: all behind dependencies of tests or of other systems, not fixable from here. A
/// new one needs a review.
const DOUBLED: &[&str] = &[
    "criterion",
    "criterion-plot",
    "itertools",
    "jni-sys",
    "miniz_oxide",
    "syn",
    "thiserror",
    "thiserror-impl",
    "toml",
    "toml_datetime",
    "winnow",
];

/// Crates under the MPL-2.0: for tests only, in no product; or behind the feature `compressed`, named in NOTICE.
const EXCEPTIONS: [&str; 8] = [
    "cbindgen",
    "symphonia",
    "symphonia-bundle-flac",
    "symphonia-codec-vorbis",
    "symphonia-common",
    "symphonia-core",
    "symphonia-format-ogg",
    "symphonia-metadata",
];

fn metadata() -> serde_json::Value {
    let output = Command::new(env!("CARGO"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args([
            "metadata",
            "--format-version",
            "1",
            "--locked",
            "--offline",
            "--all-features",
        ])
        .output()
        .expect("cargo runs");
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    if !output.status.success() {
        // Crates of other systems may be missing on this disk; those that are built are present.
        let output = Command::new(env!("CARGO"))
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .args([
                "metadata",
                "--format-version",
                "1",
                "--locked",
                "--all-features",
            ])
            .output()
            .expect("cargo runs");
        assert!(output.status.success(), "{errors}");
        return serde_json::from_slice(&output.stdout).expect("JSON");
    }
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn allowed() -> Vec<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("deny.toml");
    let text = std::fs::read_to_string(path).expect("deny.toml");
    let list = text.lines().find_map(|line| line.strip_prefix("allow = ["));
    let list = list.expect("a list of licences").trim_end_matches(']');
    list.split(", ")
        .map(|word| word.trim_matches('"').to_owned())
        .collect()
}

/// Whether a licence expression is satisfied: `OR` needs one side, `AND` both. An exception only allows more.
fn is_met(expression: &str, allowed: &[String]) -> bool {
    let plain = expression.replace(['(', ')'], " ").replace('/', " OR ");
    // In the crates' own expressions `AND` occurs outside brackets only.
    plain.split(" AND ").all(|part| {
        part.split(" OR ").any(|licence| {
            let name = licence.split_whitespace().next().unwrap_or_default();
            allowed.iter().any(|allowed| allowed == name)
        })
    })
}

#[test]
fn licences_are_allowed_ones() {
    let allowed = allowed();
    assert!(is_met("(MIT OR Apache-2.0) AND Unicode-3.0", &allowed));
    assert!(!is_met("MIT AND GPL-3.0", &allowed) && !is_met("MPL-2.0", &allowed));
    let metadata = metadata();
    let packages = metadata["packages"].as_array().expect("packages");
    assert!(packages.len() > 100, "{} packages", packages.len());
    for package in packages {
        let name = package["name"].as_str().expect("a name");
        let licence = package["license"].as_str().unwrap_or("none");
        let is_excepted = licence == "MPL-2.0" && EXCEPTIONS.contains(&name);
        let met = is_met(licence, &allowed) || is_excepted;
        assert!(met, "{name} is under {licence}");
        let source = package["source"].as_str().unwrap_or("registry+ours");
        assert!(
            source.starts_with("registry+"),
            "{name} comes from {source}"
        );
    }
}

#[test]
fn no_further_crate_comes_twice() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.lock");
    let text = std::fs::read_to_string(path).expect("Cargo.lock");
    let mut count: BTreeMap<&str, usize> = BTreeMap::new();
    for name in text.lines().filter_map(|line| line.strip_prefix("name = ")) {
        *count.entry(name.trim_matches('"')).or_default() += 1;
    }
    let doubled: Vec<&str> = count
        .iter()
        .filter(|(_, n)| **n > 1)
        .map(|(name, _)| *name)
        .collect();
    assert_eq!(doubled, DOUBLED);
}
