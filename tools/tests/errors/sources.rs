//! Every advice of the sources is in the table.

use std::path::Path;

use crate::table::{Row, fits, table};

/// Beginnings of advice.
const VERBS: [&str; 34] = [
    "add ",
    "bake ",
    "check ",
    "choose ",
    "close ",
    "commit ",
    "convert ",
    "count ",
    "cut ",
    "end ",
    "export ",
    "free ",
    "give ",
    "keep ",
    "leave ",
    "let ",
    "load ",
    "look ",
    "make ",
    "name ",
    "plug ",
    "put ",
    "raise ",
    "refer ",
    "remove ",
    "save ",
    "simplify ",
    "take ",
    "the last good ",
    "use ",
    "write ",
    "print ",
    "stop ",
    "start ",
];

/// Sources with advice for a user of the library. The command line's own arguments are self-explanatory; pictures and
/// scores are evaluation's.
const FOLDERS: [&str; 8] = [
    "src/scene/",
    "src/propagation/",
    "src/generation/",
    "src/runtime/",
    "tools/src/clip.rs",
    "tools/src/listener_path.rs",
    "src/output/whole_file.rs",
    "src/output/oboe.rs",
];

/// A literal of the sources in the table's notation.
fn as_pattern(literal: &str) -> String {
    let mut pattern = String::new();
    let mut depth = 0;
    for c in literal.replace("\\\"", "\"").chars() {
        match c {
            '{' => {
                if depth == 0 {
                    pattern.push('…');
                }
                depth += 1;
            }
            '}' => depth -= 1,
            _ if depth == 0 => pattern.push(c),
            _ => {}
        }
    }
    pattern
}

#[test]
fn every_advice_of_the_sources_is_in_the_table() {
    let rows = table();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut open = vec![root.join("src"), root.join("tools/src")];
    let (mut missing, mut seen) = (Vec::new(), 0);
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path
                .strip_prefix(&root)
                .expect("below")
                .to_string_lossy()
                .into_owned();
            if path.is_dir() {
                open.push(path);
                continue;
            }
            let included = FOLDERS.iter().any(|folder| name.starts_with(folder));
            if !included
                || name.contains("tests")
                || name.contains("procedural")
                || !name.ends_with(".rs")
            {
                continue;
            }
            let text = std::fs::read_to_string(&path).expect("text");
            let code = text.split("#[cfg(test)]").next().unwrap_or_default();
            let code: String = code
                .lines()
                .filter(|line| !line.trim_start().starts_with("//"))
                .collect::<Vec<_>>()
                .join("\n");
            // Every second piece between unescaped quotes is a literal.
            let marked = code.replace("\\\"", "\u{1}").replace("'\"'", "''");
            for literal in marked.split('"').skip(1).step_by(2) {
                let literal = literal.replace('\u{1}', "\"");
                if !VERBS.iter().any(|verb| literal.starts_with(verb)) {
                    continue;
                }
                seen += 1;
                let pattern = as_pattern(&literal);
                let matches = |row: &Row| fits(&row.advice, &pattern) || row.advice == pattern;
                if !rows.iter().any(matches) {
                    missing.push(format!("{name}: {literal}"));
                }
            }
        }
    }
    assert!(seen > 60, "only {seen} found");
    assert!(missing.is_empty(), "ERRORS.md lacks: {missing:#?}");
}
