//! The C header is made of the sources, and `include/foresound.h` is what they make today.
#![cfg(feature = "capi")]

use std::fs;
use std::path::{Path, PathBuf};

use cbindgen::{
    Builder, Config, DocumentationStyle, EnumConfig, ExportConfig, ItemType, Language, RenameRule,
    Style,
};

const HEAD: &str = "\
/* Foresound: real-time ray-traced sound. The C interface, for C, C++ and engines that speak either.
 *
 * Made from src/bridge by `FORESOUND_WRITE_HEADER=1 cargo test --test c_header`; do not edit.
 *
 * Handles. Engines, renderers, scenes, clips, streams and outputs are 64-bit numbers, never 0, closed with
 * foresound_close. A closed handle, another kind's, or any number at all is an error and never a crash.
 *
 * Threads. Each function says which threads may call it; \"the audio thread\" is whichever makes sound. Calls on one
 * handle from several threads wait for each other, but for foresound_render and foresound_stream_write, which never
 * wait and never allocate.
 *
 * Units. Metres, seconds, Hz, pressure ratios; right-handed, +y up. An audio frame is one sample a channel; a graphics
 * frame is the app's tick.
 *
 * Errors. Every call returns a ForesoundStatus; foresound_last_error has the words. What a call was to give is 0 if it
 * fails.
 *
 * Options. Structures begin with their size: fill them with the defaults (foresound_..._default), then change fields.
 * A library that is newer than its caller keeps the defaults of what the caller does not know.
 */";

fn header() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = Config {
        language: Language::C,
        header: Some(HEAD.into()),
        include_guard: Some("FORESOUND_H".into()),
        cpp_compat: true,
        documentation_style: DocumentationStyle::C99,
        style: Style::Both,
        usize_is_size_t: true,
        no_includes: true,
        sys_includes: vec!["stddef.h".into(), "stdint.h".into()],
        after_includes: Some(format!(
            "\n/* The interface that this header describes, as foresound_version gives it. */\n#define FORESOUND_API_VERSION {:#010x}u",
            foresound::bridge::VERSION
        )),
        line_length: 120,
        export: ExportConfig {
            prefix: Some("Foresound".into()),
            item_types: vec![ItemType::Enums, ItemType::Structs, ItemType::Functions],
            ..ExportConfig::default()
        },
        enumeration: EnumConfig {
            rename_variants: RenameRule::ScreamingSnakeCase,
            prefix_with_name: true,
            ..EnumConfig::default()
        },
        ..Config::default()
    };
    let mut builder = Builder::new().with_config(config);
    let mut files: Vec<PathBuf> = [
        "fault",
        "health",
        "options",
        "picture",
        "pose",
        "scenes",
        "session",
        "sound",
        "statistics",
    ]
    .iter()
    .map(|name| root.join(format!("src/bridge/{name}.rs")))
    .collect();
    // Its modules are followed.
    files.push(root.join("src/bridge/capi/mod.rs"));
    for file in files {
        builder = builder.with_src(file);
    }
    let mut bytes = Vec::new();
    builder
        .generate()
        .expect("the sources parse")
        .write(&mut bytes);
    let text = String::from_utf8(bytes).expect("is text");
    // The sections for Rust's readers are the caller's word, which the rest says already.
    text.replace("// # Safety\n", "// Pointers:\n")
}

#[test]
fn the_header_is_what_the_sources_make() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/foresound.h");
    let made = header();
    if std::env::var_os("FORESOUND_WRITE_HEADER").is_some() {
        fs::write(&path, &made).expect("include is there");
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        made == kept,
        "include/foresound.h is old: run FORESOUND_WRITE_HEADER=1 cargo test --test c_header"
    );
}

/// Every exported function stands in the header, whatever file it is in.
#[test]
fn the_header_has_every_exported_function() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/bridge/capi");
    let made = header();
    let mut count = 0;
    for entry in fs::read_dir(folder).expect("is there") {
        let text = fs::read_to_string(entry.expect("readable").path()).expect("text");
        for part in text.split("extern \"C\" fn ").skip(1) {
            let name = part.split('(').next().unwrap_or_default();
            assert!(
                made.contains(&format!(" {name}(")) || made.contains(&format!("*{name}(")),
                "{name} is missing"
            );
            count += 1;
        }
    }
    assert!(count > 20, "{count} functions");
}
