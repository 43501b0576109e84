//! The order of modules, which ARCHITECTURE.md explains: what may import what, and where threads, clocks, `unsafe` and logging
//! may be.

mod imports;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use imports::{Sources, code, rust_files};

/// A part of the library, without the parts inside it that have rows of their own, and the parts that it may import. A folder
/// and the files around it may import each other; files may not ([`no_file_imports_what_imports_it`]).
const TABLE: [(&str, &str); 44] = [
    ("error", ""),
    ("binary", ""),
    ("acoustics", "binary"),
    ("simd", ""),
    ("geometry", "binary simd"),
    (
        "scene",
        "acoustics binary error scene::materials scene::surface",
    ),
    ("scene::materials", "acoustics"),
    ("scene::surface", "binary geometry scene"),
    (
        "scene::edges",
        "acoustics binary geometry scene scene::surface",
    ),
    (
        "scene::committed",
        "acoustics binary error geometry scene scene::edges scene::materials scene::surface",
    ),
    ("scene::io", "acoustics error scene scene::materials"),
    ("scene::procedural", "error scene"),
    (
        "propagation",
        "acoustics error propagation::image_source propagation::rays scene scene::committed simd",
    ),
    (
        "propagation::rays",
        "geometry propagation propagation::image_source scene::committed simd",
    ),
    (
        "propagation::image_source",
        "acoustics geometry propagation propagation::rays scene scene::committed scene::surface simd",
    ),
    (
        "propagation::diffraction",
        "acoustics geometry propagation propagation::image_source propagation::transmission scene scene::committed scene::edges simd",
    ),
    (
        "propagation::curved_reflection",
        "acoustics geometry propagation propagation::image_source scene::committed scene::surface simd",
    ),
    (
        "propagation::diffuse",
        "acoustics geometry propagation propagation::image_source propagation::rays scene scene::committed scene::surface simd",
    ),
    (
        "propagation::transmission",
        "acoustics geometry propagation propagation::image_source scene scene::committed",
    ),
    (
        "propagation::propagator",
        "error propagation propagation::diffraction propagation::diffuse propagation::image_source propagation::rays propagation::source_task scene scene::committed",
    ),
    (
        "propagation::source_task",
        "acoustics propagation propagation::curved_reflection propagation::diffraction propagation::diffuse propagation::image_source propagation::rays scene scene::committed",
    ),
    (
        "extrapolation",
        "acoustics extrapolation::geometric propagation propagation::diffraction propagation::diffuse propagation::transmission scene scene::committed scene::edges",
    ),
    (
        "extrapolation::geometric",
        "acoustics extrapolation geometry propagation propagation::curved_reflection propagation::diffraction propagation::image_source scene scene::committed",
    ),
    (
        "generation",
        "acoustics error extrapolation generation::bands generation::binaural generation::delay generation::panning generation::reverb generation::voices simd",
    ),
    ("generation::bands", "acoustics generation::delay simd"),
    ("generation::delay", "acoustics simd"),
    ("generation::panning", "error simd"),
    (
        "generation::binaural",
        "error generation generation::delay generation::panning generation::reverb simd",
    ),
    ("generation::baking", "error generation::binaural simd"),
    (
        "generation::reverb",
        "acoustics extrapolation generation generation::bands generation::delay propagation simd",
    ),
    (
        "generation::voices",
        "acoustics extrapolation generation generation::bands generation::binaural generation::delay generation::panning simd",
    ),
    ("output", "error"),
    ("runtime", ""),
    ("runtime::budget", "error propagation"),
    (
        "runtime::device",
        "error output runtime::engine runtime::handover runtime::threads",
    ),
    (
        "runtime::engine",
        "acoustics error extrapolation extrapolation::geometric generation generation::binaural generation::panning propagation propagation::propagator runtime::budget runtime::handover runtime::phone runtime::pipeline runtime::threads runtime::trace scene scene::committed scene::materials",
    ),
    ("runtime::handover", ""),
    (
        "runtime::offline",
        "error extrapolation extrapolation::geometric generation generation::binaural generation::panning propagation propagation::propagator runtime::pipeline runtime::threads scene scene::committed",
    ),
    (
        "runtime::pipeline",
        "extrapolation extrapolation::geometric generation geometry propagation propagation::diffuse propagation::propagator scene scene::committed",
    ),
    ("runtime::phone", "runtime::budget"),
    ("runtime::threads", "error propagation"),
    ("runtime::trace", "runtime::threads"),
    (
        "bridge",
        "acoustics error extrapolation extrapolation::geometric generation::binaural generation::panning output propagation runtime runtime::budget runtime::device runtime::engine runtime::handover runtime::threads scene scene::committed scene::io scene::materials",
    ),
    ("bridge::capi", "bridge scene"),
];

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
const UNSAFE_HOMES: [&str; 8] = [
    "geometry/intersect/neon/",
    "geometry/intersect/x86/",
    "geometry/stack",
    "simd/neon/",
    "simd/x86/",
    "runtime/",
    "output/oboe",
    "bridge/",
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
fn row(module: &str) -> Option<(&'static str, &'static str)> {
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
            let Some((target, _)) = row(&import) else {
                continue;
            };
            if allowed.split(' ').any(|entry| entry == target) {
                used.insert((part, target));
            } else if target != part {
                breaches.push(format!("{module} imports {import}"));
            }
        }
    }
    assert!(breaches.is_empty(), "{breaches:#?}");
    let all = TABLE
        .iter()
        .flat_map(|(part, allowed)| allowed.split_whitespace().map(|entry| (*part, entry)));
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
        assert!(sources.imports().len() > 20, "{folder} is not read");
        let circles = sources.circles();
        assert!(circles.is_empty(), "{folder}: {circles:#?}");
    }
}

#[test]
fn stages_have_no_thread_clock_or_atomic() {
    for (file, text) in sources() {
        if ["runtime", "bridge"].contains(&module_of(&file)) {
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
    const HOMES: [&str; 3] = [
        "runtime/device/output.rs",
        "bridge/jni/mod.rs",
        // Its test.
        "bridge/logging.rs",
    ];
    const CALLS: [&str; 5] = ["error!", "warn!", "info!", "debug!", "trace!"];
    for (file, text) in sources() {
        if HOMES.contains(&&*file) {
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

/// Every file and folder that ARCHITECTURE.md names is there.
#[test]
fn the_architecture_names_what_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(root.join("ARCHITECTURE.md")).expect("text");
    let quoted = text.split('`').skip(1).step_by(2);
    let paths = quoted.filter(|word| word.contains('/') && !word.contains([' ', ':', '*']));
    let exists = |path: &&str| {
        ["", "src"]
            .iter()
            .any(|base| root.join(base).join(path).exists())
    };
    let (found, missing): (Vec<&str>, Vec<&str>) = paths.partition(exists);
    assert!(found.len() > 50, "{found:?}");
    assert!(missing.is_empty(), "{missing:?}");
}
