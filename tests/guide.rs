//! The guide under `docs/` and the other pages: every link leads somewhere, code is that of files which are compiled, and
//! tables and names are those of the library. `cargo test --doc` runs the Rust code of the guide and of the README.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use foresound::MaterialTable;
use foresound::runtime::budget::QUALITY_LEVELS;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
/// Languages of code blocks.
const LANGUAGES: [&str; 8] = [
    "c", "kotlin", "rust", "sh", "text", "toml", "csharp", "gdscript",
];

fn read(path: impl AsRef<Path>) -> String {
    let path = Path::new(ROOT).join(path);
    fs::read_to_string(&path).expect("a file of the repository")
}

/// The guide's pages, without the table of contents.
fn chapters() -> Vec<PathBuf> {
    let folder = Path::new(ROOT).join("docs/src");
    let files = fs::read_dir(folder)
        .expect("the guide")
        .map(|entry| entry.expect("an entry").path());
    let mut pages: Vec<_> = files
        .filter(|path| {
            path.extension().is_some_and(|end| end == "md") && !path.ends_with("SUMMARY.md")
        })
        .collect();
    pages.sort();
    assert!(pages.len() >= 10, "{} pages", pages.len());
    pages
}

/// All pages that users read.
fn pages() -> Vec<PathBuf> {
    let mut pages = chapters();
    for other in [
        "README.md",
        "CHANGELOG.md",
        "android/README.md",
        "integrations/README.md",
        "integrations/godot/README.md",
        "tools/README.md",
        "docs/src/SUMMARY.md",
    ] {
        pages.push(Path::new(ROOT).join(other));
    }
    pages
}

/// A page without its code blocks.
fn prose(text: &str) -> String {
    text.split("```").step_by(2).collect()
}

/// Targets of Markdown links and images, without addresses and anchors.
fn links(text: &str) -> Vec<String> {
    let prose = prose(text);
    let targets = prose
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next());
    let files = targets.filter(|target| !target.contains("://") && !target.starts_with('#'));
    files
        .map(|target| target.split('#').next().unwrap_or_default().to_owned())
        .collect()
}

#[test]
fn every_link_leads_to_a_file() {
    let mut count = 0;
    for page in pages() {
        for link in links(&read(&page)) {
            let target = page.parent().expect("a folder").join(&link);
            assert!(target.exists(), "{}: no {link}", page.display());
            count += 1;
        }
    }
    // The book is published without the repository around it.
    for page in chapters() {
        for link in links(&read(&page)) {
            assert!(!link.contains(".."), "{}: {link}", page.display());
        }
    }
    assert!(count > 30, "{count} links");
    assert_eq!(
        links("[a](b.md#c) `x` ![p](q.png) [r](https://s)"),
        ["b.md", "q.png"]
    );
}

#[test]
fn the_table_of_contents_has_every_page_once() {
    let listed = links(&read("docs/src/SUMMARY.md"));
    let present: Vec<String> = chapters()
        .iter()
        .map(|path| {
            path.file_name()
                .expect("a name")
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    let sorted: BTreeSet<_> = listed.iter().cloned().collect();
    assert_eq!(listed.len(), sorted.len());
    assert_eq!(sorted.into_iter().collect::<Vec<_>>(), present);
}

/// Language, code, and the file that the code is of.
fn blocks(text: &str) -> Vec<(String, String, Option<String>)> {
    let parts: Vec<&str> = text.split("```").collect();
    assert!(parts.len() % 2 == 1, "a code block has no end");
    let numbers = (1..parts.len()).step_by(2);
    numbers
        .map(|at| {
            let (language, code) = parts[at].split_once('\n').unwrap_or((parts[at], ""));
            let before = parts[at - 1].trim_end().lines().last().unwrap_or_default();
            let file = before
                .strip_prefix("<!-- file: ")
                .and_then(|rest| rest.strip_suffix(" -->"));
            (
                language.trim().to_owned(),
                code.to_owned(),
                file.map(str::to_owned),
            )
        })
        .collect()
}

#[test]
fn code_is_that_of_the_files_that_are_compiled() {
    let mut files = Vec::new();
    for page in chapters() {
        for (language, code, file) in blocks(&read(&page)) {
            let name = page.display();
            assert!(
                LANGUAGES.contains(&language.as_str()),
                "{name}: a block of `{language}`"
            );
            if let Some(file) = file {
                let same = code == read(&file);
                assert!(
                    same,
                    "{name} has another {file}: copy the file into its block"
                );
                files.push(file);
            }
        }
    }
    // Bevy's example is compiled with the tests of its workspace, Godot's runs in its check, Unity's sample is compiled and run
    // with its package, the others are compiled by check.sh.
    let [bevy, c, kotlin, godot, unity] = files.as_slice() else {
        panic!("{files:?}");
    };
    assert_eq!(bevy, "integrations/bevy/examples/first_sound.rs");
    assert_eq!(godot, "integrations/godot/project/first_sound.gd");
    assert_eq!(unity, "android/unity/Samples~/FirstSound/FirstSound.cs");
    let others = [c, kotlin];
    assert_eq!(others, ["android/c/first.c", "android/jvm/FirstSound.kt"]);
    let check = read("android/check.sh");
    assert!(others.iter().all(|file| check.contains(file.as_str())));
}

#[test]
fn functions_of_c_exist() {
    let header = read("include/foresound.h");
    let mut count = 0;
    for page in pages() {
        let text = read(&page);
        let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
        for word in words.filter(|word| word.starts_with("foresound_") && !word.ends_with('_')) {
            let is_function = header.contains(&format!("{word}("));
            assert!(
                is_function || word == "foresound_tools" || word == "foresound_bevy",
                "{}: no {word}",
                page.display()
            );
            count += 1;
        }
    }
    assert!(count > 20, "{count} names");
}

/// The rows of the table or the list after a marker.
fn after(text: &str, marker: &str) -> Vec<String> {
    let rest = text
        .split(&format!("<!-- {marker} -->\n"))
        .nth(1)
        .expect("the marker");
    rest.lines()
        .take_while(|line| !line.is_empty())
        .map(str::to_owned)
        .collect()
}

#[test]
fn tables_are_those_of_the_library() {
    let geometry = read("docs/src/geometry.md");
    let named = after(&geometry, "materials").concat();
    let named: BTreeSet<&str> = named.split('`').skip(1).step_by(2).collect();
    let table = MaterialTable::built_in();
    let known: BTreeSet<&str> = table
        .entries()
        .iter()
        .map(|entry| entry.material.name.as_str())
        .collect();
    assert_eq!(named, known);

    let rows = after(&read("docs/src/phone.md"), "quality levels");
    assert_eq!(rows.len(), QUALITY_LEVELS.len() + 2);
    for (row, level) in rows[2..].iter().zip(QUALITY_LEVELS) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let percent = |share: f32| format!("{:.0} %", 100.0 * share);
        assert_eq!(cells[2], percent(level.guide_rays), "{row}");
        assert_eq!(cells[3], percent(level.paths), "{row}");
        let fewer = [
            "all orders",
            "one order less",
            "two orders less",
            "three orders less",
        ];
        assert_eq!(cells[4], fewer[usize::from(level.skipped_orders)], "{row}");
        let rate = ["every update", "every 2nd", "every 3rd", "every 4th"];
        assert_eq!(cells[5], rate[level.late_interval as usize - 1], "{row}");
    }
}
