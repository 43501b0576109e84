//! The house's order: which module may name which. ARCHITECTURE.md explains it; this holds it.

mod imports;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use imports::{Sources, code, rust_files};

/// A part of the library (the longest prefix counts), and what it may import besides itself.
const TABLE: [(&str, &[&str]); 0] = [];

/// Words that only `runtime`, `bridge` (handles are used from any thread), evaluation and the command line may use: a stage
/// has no thread, clock or atomic.
const CLOCKS_AND_THREADS: [&str; 5] = [
    "std::thread",
    "std::time::Instant",
    "std::sync::atomic",
    "std::sync::Mutex",
    "std::sync::RwLock",
];

/// Where `unsafe` may stand.
const UNSAFE_HOMES: [&str; 9] = [
    "geometry/intersect/neon/",
    "geometry/intersect/x86/",
    "geometry/stack",
    "simd/neon/",
    "simd/x86/",
    "runtime/",
    "output/oboe",
    "bridge/",
    // An allocator cannot be written without.
    "bin/foresound/counting",
];

/// Longest source file.
const MOST_LINES: usize = 600;

fn sources() -> Vec<(String, String)> {
    rust_files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"))
}

fn module_of(file: &str) -> &str {
    file.split('/')
        .next()
        .unwrap_or(file)
        .trim_end_matches(".rs")
}

/// The row of the table for a module.
fn row(module: &str) -> Option<(&'static str, &'static [&'static str])> {
    let rows = TABLE
        .into_iter()
        .filter(|(part, _)| is_within(module, part));
    rows.max_by_key(|(part, _)| part.len())
}

fn is_within(module: &str, part: &str) -> bool {
    module == part || module.starts_with(&format!("{part}::"))
}

#[test]
fn every_part_imports_only_what_its_row_allows() {
    let sources = Sources::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    let (mut breaches, mut used) = (Vec::new(), BTreeSet::new());
    for (module, imports) in sources.imports() {
        let Some((part, allowed)) = row(&module) else {
            breaches.push(format!("{module} has no row"));
            continue;
        };
        for import in imports {
            let entry = allowed.iter().find(|entry| is_within(&import, entry));
            used.extend(entry.map(|entry| (part, *entry)));
            if entry.is_none() && row(&import).map(|row| row.0) != Some(part) {
                breaches.push(format!("{module} imports {import}"));
            }
        }
    }
    assert!(breaches.is_empty(), "{breaches:#?}");
    let all = TABLE
        .iter()
        .flat_map(|(part, allowed)| allowed.iter().map(|entry| (*part, *entry)));
    let unused: Vec<_> = all.filter(|entry| !used.contains(entry)).collect();
    assert!(
        unused.is_empty(),
        "the table allows what nothing imports: {unused:?}"
    );
}

#[test]
fn no_file_imports_what_imports_it() {
    for folder in ["src", "tools/src"] {
        let sources = Sources::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder));
        assert!(sources.imports().len() > 50, "{folder} is not read");
        let circles = sources.circles();
        assert!(circles.is_empty(), "{folder}: {circles:#?}");
    }
}

#[test]
fn stages_have_no_thread_clock_or_atomic() {
    for (file, text) in sources() {
        if ["runtime", "bridge", "evaluation", "bin"].contains(&module_of(&file)) {
            continue;
        }
        for word in CLOCKS_AND_THREADS {
            assert!(!code(&text).contains(word), "{file} uses {word}");
        }
    }
}

#[test]
fn unsafe_stays_in_its_homes() {
    for (file, text) in sources() {
        let at_home = UNSAFE_HOMES.iter().any(|home| file.starts_with(home));
        let block = code(&text)
            .split(|c: char| !c.is_alphanumeric() && c != '_')
            .any(|w| w == "unsafe");
        assert!(at_home || !block, "{file} has unsafe code");
    }
}

/// ARCHITECTURE.md says of every file with unsafe code what it is for and what would notice a breach, and of no other.
#[test]
fn unsafe_code_is_accounted_for() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(root.join("ARCHITECTURE.md")).expect("text");
    let section = text.split("## Unsafe code").nth(1).expect("the section");
    let section = section.split("\n## ").next().expect("its text");
    let mut told: Vec<String> = section
        .lines()
        .filter_map(|line| {
            let cells: Vec<&str> = line.split(" | ").collect();
            let name = cells.first()?.strip_prefix("| `")?.strip_suffix('`')?;
            assert!(cells.len() == 3 && cells[2].len() > 10, "{line}");
            Some(name.to_owned())
        })
        .collect();
    told.sort();
    let mut found: Vec<String> = sources()
        .into_iter()
        .filter(|(_, text)| {
            code(text)
                .split(|c: char| !c.is_alphanumeric() && c != '_')
                .any(|w| w == "unsafe")
        })
        .map(|(file, _)| file)
        .collect();
    found.sort();
    assert_eq!(told, found);
    let manifest = fs::read_to_string(root.join("Cargo.toml")).expect("text");
    for lint in [
        "undocumented_unsafe_blocks",
        "multiple_unsafe_ops_per_block",
    ] {
        assert!(manifest.contains(&format!("{lint} = \"deny\"")), "{lint}");
    }
}

/// Android's log is a system call and may wait: only where devices are opened and where the library is loaded.
#[test]
fn nothing_on_the_audio_side_logs() {
    const HOMES: [&str; 2] = ["runtime/device_output.rs", "bridge/jni/mod.rs"];
    const CALLS: [&str; 5] = ["error!", "warn!", "info!", "debug!", "trace!"];
    for (file, text) in sources() {
        if HOMES.contains(&&*file) || ["evaluation", "bin"].contains(&module_of(&file)) {
            continue;
        }
        for call in CALLS {
            assert!(
                !code(&text).contains(&format!("log::{call}")),
                "{file} logs"
            );
        }
    }
}

#[test]
fn files_stay_small() {
    for (file, text) in sources() {
        let lines = text.lines().count();
        assert!(lines <= MOST_LINES, "{file} has {lines} lines");
    }
}
