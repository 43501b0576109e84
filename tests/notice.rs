//! `NOTICE`, which goes with every binary: origin and licence of all that is inside. Written from Cargo.lock and the crates'
//! own files by `FORESOUND_WRITE_NOTICE=1 cargo test --test notice`; this test fails when a dependency is missing in it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
/// Platforms that binaries are made for.
const TARGETS: [&str; 5] = [
    "aarch64-linux-android",
    "x86_64-linux-android",
    "x86_64-unknown-linux-gnu",
    "aarch64-unknown-linux-gnu",
    "x86_64-pc-windows-gnu",
];
/// Where an MIT licence's own words begin, after the copyright.
const MIT_BEGINS: &str = "Permission is hereby granted";

const PREAMBLE: &str = "\
Foresound: real-time ray-traced sound
Licence: MIT or Apache-2.0, at your choice. The texts of both are below.

A product that contains Foresound's binaries ships this file or its text, for instance on a page of licences.
Written by tests/notice.rs; do not edit.


HEAD-RELATED TRANSFER FUNCTIONS

The built-in HRTFs are made from the measurements of a KEMAR dummy head by Bill Gardner and Keith Martin:

    This data is Copyright 1994 by the MIT Media Laboratory. It is provided free with no restrictions on use,
    provided the authors are cited when the data is used in any research or commercial application.

Cite: W. G. Gardner and K. D. Martin, \"HRTF measurements of a KEMAR dummy-head microphone\", MIT Media Laboratory
Perceptual Computing Technical Report 280, May 1994. A library built without the feature builtin-hrtf has none of it.


OBOE (Android only)

The crate oboe-sys contains Oboe, Copyright The Android Open Source Project, licensed under the Apache
License, Version 2.0.


FLAC AND OGG VORBIS (only where the library is built with its feature `compressed`, and in the command line)

The crates symphonia, symphonia-bundle-flac, symphonia-codec-vorbis, symphonia-common, symphonia-core, symphonia-format-ogg and
symphonia-metadata, Copyright The Project Symphonia Developers, are licensed under the Mozilla Public License, Version 2.0
(https://mozilla.org/MPL/2.0/). Their source is unchanged: https://github.com/pdeljanov/Symphonia.


RUST STANDARD LIBRARY

Copyright (c) The Rust Project contributors, MIT or Apache-2.0. It contains parts of LLVM's runtime libraries (libunwind,
compiler-rt; on Android libc++ too), Apache-2.0 with LLVM exception.
";

struct Crate {
    name: String,
    version: String,
    licence: String,
    folder: PathBuf,
}

fn cargo(arguments: &[&str]) -> Vec<u8> {
    for network in [&["--offline"][..], &[]] {
        let output = Command::new(env!("CARGO"))
            .current_dir(ROOT)
            .args(arguments)
            .arg("--locked")
            .args(network)
            .output()
            .expect("cargo runs");
        if output.status.success() {
            return output.stdout;
        }
        // Crates of other systems may be missing on this disk.
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(!network.is_empty(), "{errors}");
    }
    unreachable!("the second run returns or fails")
}

/// What the shared libraries are linked from, without Foresound itself.
fn crates() -> Vec<Crate> {
    let output = cargo(&["metadata", "--format-version", "1", "--all-features"]);
    let metadata: serde_json::Value = serde_json::from_slice(&output).expect("JSON");
    let word =
        |package: &serde_json::Value, key: &str| package[key].as_str().unwrap_or("").to_owned();
    let packages = metadata["packages"].as_array().expect("packages");
    let mut known: BTreeMap<(String, String), Crate> = BTreeMap::new();
    for package in packages {
        let (name, version) = (word(package, "name"), word(package, "version"));
        let manifest = PathBuf::from(word(package, "manifest_path"));
        let one = Crate {
            name: name.clone(),
            version: version.clone(),
            licence: word(package, "license"),
            folder: manifest.parent().expect("a folder").to_owned(),
        };
        known.insert((name, version), one);
    }
    let mut arguments = vec!["tree", "-p", "foresound", "--edges", "normal,no-proc-macro"];
    arguments.extend([
        "--no-default-features",
        "--features",
        "builtin-hrtf,capi,jni,oboe",
    ]);
    arguments.extend(["--prefix", "none", "--format", "{p}"]);
    for target in TARGETS {
        arguments.extend(["--target", target]);
    }
    let tree = String::from_utf8(cargo(&arguments)).expect("text");
    let mut linked: Vec<(String, String)> = tree
        .lines()
        .filter_map(|line| {
            let mut words = line.split_whitespace();
            let name = words.next()?;
            let version = words.next()?.strip_prefix('v')?;
            (name != "foresound").then(|| (name.to_owned(), version.to_owned()))
        })
        .collect();
    linked.sort();
    linked.dedup();
    let take = |key: &(String, String)| known.remove(key).expect("in cargo's metadata");
    linked.iter().map(take).collect()
}

fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The crate's file with the MIT licence.
fn mit_file(folder: &Path) -> Option<String> {
    let names = [
        "LICENSE-MIT",
        "LICENSE.MIT",
        "license-mit",
        "LICENSE",
        "LICENSE.md",
        "COPYING",
    ];
    let mut texts = names
        .iter()
        .filter_map(|name| fs::read_to_string(folder.join(name)).ok());
    texts.find(|text| text.contains(MIT_BEGINS))
}

/// The lines of an MIT licence that name who holds the copyright, indented.
fn holders(text: &str) -> String {
    let before = text.split(MIT_BEGINS).next().unwrap_or_default();
    let lines = before.lines().map(str::trim);
    lines
        .filter(|line| line.to_lowercase().contains("copyright"))
        .fold(String::new(), |all, line| all + "    " + line + "\n")
}

fn notice() -> String {
    let read = |name: &str| fs::read_to_string(Path::new(ROOT).join(name)).expect("a licence");
    let (mit, apache) = (read("LICENSE-MIT"), read("LICENSE-APACHE"));
    let body = |text: &str| words(&text[text.find(MIT_BEGINS).expect("an MIT licence")..]);
    let (mut under_mit, mut under_apache, mut in_full) =
        (String::new(), String::new(), String::new());
    for one in crates() {
        let line = format!("{} {} ({})\n", one.name, one.version, one.licence);
        let may_be_mit = one.licence.contains("MIT");
        let mit_text = mit_file(&one.folder).filter(|_| may_be_mit);
        assert!(
            mit_text.is_some() || one.licence.contains("Apache-2.0"),
            "{} gives no text of its licence, {}",
            one.name,
            one.licence
        );
        match mit_text {
            Some(text) if body(&text) == body(&mit) => {
                under_mit += &line;
                under_mit += &holders(&text);
            }
            Some(text) => {
                let text = text.trim().replace('\r', "");
                let _ = write!(in_full, "{line}\n{text}\n\n");
            }
            // A crate without a file of its own is taken by the licence that asks for no more than its text.
            None => under_apache += &line,
        }
    }
    let line = "-".repeat(80);
    let mit = mit[mit.find(MIT_BEGINS).expect("an MIT licence")..].trim();
    format!(
        "{PREAMBLE}\n\nCRATES UNDER THE MIT LICENCE\n\n{under_mit}\n\
         CRATES UNDER THE APACHE LICENCE, VERSION 2.0\n\n{under_apache}\n\
         CRATES WITH OTHER WORDS\n\n{in_full}\
         {line}\nMIT LICENCE\n\n{mit}\n\n{line}\n{}\n",
        apache.trim_end()
    )
}

#[test]
fn the_notice_names_everything_in_the_binaries() {
    let path = Path::new(ROOT).join("NOTICE");
    let text = notice();
    for wanted in ["oboe-sys ", "jni ", "ndk ", "glam ", "windows-sys "] {
        assert!(
            text.lines().any(|line| line.starts_with(wanted)),
            "no {wanted}"
        );
    }
    for absent in ["criterion ", "clap ", "proptest "] {
        assert!(
            !text.lines().any(|line| line.starts_with(absent)),
            "{absent} is not linked"
        );
    }
    if std::env::var_os("FORESOUND_WRITE_NOTICE").is_some() {
        fs::write(&path, &text).expect("written");
    }
    let present = fs::read_to_string(&path).unwrap_or_default();
    let missing = text
        .lines()
        .find(|line| !present.lines().any(|other| other == *line));
    assert!(
        present == text,
        "NOTICE is out of date (it lacks {missing:?}): FORESOUND_WRITE_NOTICE=1 cargo test --release --test notice"
    );
}
