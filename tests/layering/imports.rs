//! Which file imports which: `use` declarations and paths of a crate's sources, resolved through re-exports.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// What every module names, as segments from the crate's root.
type Named = Vec<(String, Vec<String>)>;

/// What is re-exported, by the path under which it is: segments from the crate's root.
type Exported = BTreeMap<String, Vec<String>>;

/// The sources of one crate.
pub(crate) struct Sources {
    /// Module path (`propagation::rays::packet`, empty for the root) and text without comments and unit tests.
    modules: BTreeMap<String, String>,
}

/// All Rust files below a folder: path relative to it, and text.
pub(crate) fn rust_files(root: &Path) -> Vec<(String, String)> {
    let mut open = vec![root.to_owned()];
    let mut found = Vec::new();
    while let Some(folder) = open.pop() {
        let mut entries: Vec<PathBuf> = fs::read_dir(&folder)
            .expect("a folder of sources")
            .map(|entry| entry.expect("readable").path())
            .collect();
        entries.sort();
        for path in entries {
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let name = path.strip_prefix(root).expect("below the root");
                let text = fs::read_to_string(&path).expect("text");
                found.push((name.to_string_lossy().into_owned(), text));
            }
        }
    }
    found
}

/// Code without comments and without its unit tests, which end a file.
pub(crate) fn code(text: &str) -> String {
    let tests = text.find("#[cfg(test)]\nmod tests").unwrap_or(text.len());
    let uncommented = |line: &str| line.split("//").next().unwrap_or_default().to_owned();
    let lines: Vec<String> = text[..tests].lines().map(uncommented).collect();
    lines.join("\n")
}

/// The leaves of a `use` tree, each as its segments: `a::{b, c::d}` is `[a, b]` and `[a, c, d]`.
fn leaves(tree: &str) -> Vec<Vec<String>> {
    fn parse(rest: &mut &str, prefix: &[String], found: &mut Vec<Vec<String>>) {
        let mut path = prefix.to_vec();
        loop {
            *rest = rest.trim_start();
            let word: String = rest
                .chars()
                .take_while(|c| c.is_alphanumeric() || "_*".contains(*c))
                .collect();
            if let Some(inner) = rest.strip_prefix("::") {
                *rest = inner;
            } else if let Some(inner) = rest.strip_prefix('{') {
                *rest = inner;
                while !rest.trim_start().starts_with('}') && !rest.is_empty() {
                    parse(rest, &path, found);
                    *rest = rest.trim_start();
                    *rest = rest.strip_prefix(',').unwrap_or(rest);
                }
                *rest = rest.trim_start().strip_prefix('}').unwrap_or("");
                return;
            } else if word == "as" {
                let end = rest.find([',', '}']).unwrap_or(rest.len());
                *rest = &rest[end..];
            } else if word.is_empty() {
                found.push(path);
                return;
            } else {
                *rest = &rest[word.len()..];
                if word != "self" || path.is_empty() {
                    path.push(word);
                }
            }
        }
    }
    let (mut rest, mut found) = (tree, Vec::new());
    while !rest.trim().is_empty() {
        let before = rest.len();
        parse(&mut rest, &[], &mut found);
        if rest.len() == before {
            break;
        }
    }
    found
}

/// `use` declarations of some code: whether each is a re-export, and its tree.
fn declarations(code: &str) -> Vec<(bool, &str)> {
    let starts = code.match_indices("use ").filter(|(at, _)| {
        let line = code[..*at].rsplit('\n').next().unwrap_or_default().trim();
        line.is_empty() || line == "pub" || (line.starts_with("pub(") && line.ends_with(')'))
    });
    starts
        .filter_map(|(at, word)| {
            let is_public = code[..at].trim_end_matches(' ').ends_with(['b', ')']);
            let tree = &code[at + word.len()..];
            Some((is_public, &tree[..tree.find(';')?]))
        })
        .collect()
}

impl Sources {
    /// Those below a folder.
    pub(crate) fn read(root: &Path) -> Self {
        let mut modules = BTreeMap::new();
        for (file, text) in rust_files(root) {
            if file.ends_with("tests.rs") {
                continue;
            }
            let stem = file.trim_end_matches(".rs");
            let stem = stem.strip_suffix("/mod").unwrap_or(stem);
            let stem = stem.strip_suffix("/main").unwrap_or(stem);
            let name = match stem {
                "lib" | "main" => String::new(),
                stem => stem.replace('/', "::"),
            };
            modules.insert(name, code(&text));
        }
        Self { modules }
    }

    /// A path in a module as segments from the crate's root; nothing if another crate is meant.
    fn absolute(&self, path: &[String], module: &str) -> Option<Vec<String>> {
        let mut here: Vec<String> = module.split("::").map(str::to_owned).collect();
        here.retain(|segment| !segment.is_empty());
        match path.first()?.as_str() {
            "crate" => Some(path[1..].to_vec()),
            "self" => Some([here, path[1..].to_vec()].concat()),
            "super" => {
                let up = path.iter().take_while(|s| *s == "super").count();
                here.truncate(here.len().saturating_sub(up));
                Some([here, path[up..].to_vec()].concat())
            }
            first => {
                let child = [here.clone(), vec![first.to_owned()]].concat().join("::");
                let is_child = self.modules.contains_key(&child);
                is_child.then(|| [here, path.to_vec()].concat())
            }
        }
    }

    /// What all modules name and re-export.
    fn named(&self) -> (Named, Exported) {
        let (mut named, mut exported) = (Vec::new(), BTreeMap::new());
        for (module, code) in &self.modules {
            let declared = declarations(code);
            for (is_public, tree) in &declared {
                for path in leaves(tree) {
                    let Some(path) = self.absolute(&path, module) else {
                        continue;
                    };
                    if let (true, Some(last)) = (is_public, path.last()) {
                        exported.insert(format!("{module}::{last}"), path.clone());
                    }
                    named.push((module.clone(), path));
                }
            }
            for start in ["crate::", "super::"] {
                for (at, _) in code.match_indices(start) {
                    let is_whole = !code[..at].ends_with([':', '_'])
                        && !code[..at].ends_with(char::is_alphanumeric);
                    let is_declared = declared.iter().any(|(_, tree)| {
                        let from = tree.as_ptr() as usize - code.as_ptr() as usize;
                        (from..from + tree.len()).contains(&at)
                    });
                    let end = code[at..].find(|c: char| !c.is_alphanumeric() && !"_:".contains(c));
                    let path: Vec<String> = code[at..at + end.unwrap_or(0)]
                        .split("::")
                        .map(str::to_owned)
                        .collect();
                    if is_whole && !is_declared {
                        let path = self.absolute(&path, module);
                        named.extend(path.map(|path| (module.clone(), path)));
                    }
                }
            }
        }
        (named, exported)
    }

    /// The module that defines what a path names.
    fn home(&self, path: &[String], exported: &Exported, depth: usize) -> String {
        for length in (0..=path.len()).rev() {
            let module = path[..length].join("::");
            if !self.modules.contains_key(&module) {
                continue;
            }
            let next = path.get(length).filter(|_| depth < 8);
            let target = next.and_then(|next| exported.get(&format!("{module}::{next}")));
            if let Some(target) = target {
                let path = [target.clone(), path[length + 1..].to_vec()].concat();
                return self.home(&path, exported, depth + 1);
            }
            return module;
        }
        String::new()
    }

    /// Modules and the modules that they import, both by path; parents and children of each other are left out.
    pub(crate) fn imports(&self) -> BTreeMap<String, BTreeSet<String>> {
        let (named, exported) = self.named();
        let mut imports: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (module, path) in named {
            let target = self.home(&path, &exported, 0);
            let is_family =
                |a: &str, b: &str| a.is_empty() || b == a || b.starts_with(&format!("{a}::"));
            if !is_family(&module, &target) && !is_family(&target, &module) {
                imports.entry(module).or_default().insert(target);
            }
        }
        imports
    }

    /// Modules that import each other, directly or through others: one that can be reached from itself, and one of its
    /// imports on the way back.
    pub(crate) fn circles(&self) -> Vec<(String, String)> {
        let imports = self.imports();
        let reach = |start: &str| {
            let (mut seen, mut open) = (BTreeSet::new(), vec![start.to_owned()]);
            while let Some(module) = open.pop() {
                let next = imports.get(&module).into_iter().flatten();
                open.extend(next.filter(|m| seen.insert((*m).clone())).cloned());
            }
            seen
        };
        let edges = imports
            .iter()
            .flat_map(|(from, to)| to.iter().map(move |to| (from, to)));
        edges
            .filter(|(from, to)| reach(to).contains(*from))
            .map(|(from, to)| (from.clone(), to.clone()))
            .collect()
    }
}

#[test]
fn trees_are_opened() {
    let found = leaves("crate::{scene::{Scene, pose::SourceId as Id, self}, Error}");
    let text: Vec<String> = found.iter().map(|path| path.join("::")).collect();
    let wanted = [
        "crate::scene::Scene",
        "crate::scene::pose::SourceId",
        "crate::scene",
        "crate::Error",
    ];
    assert_eq!(text, wanted);
}

#[test]
fn a_circle_is_found_through_a_re_export() {
    let source = |name: &str, text: &str| (name.to_owned(), code(text));
    let modules: BTreeMap<String, String> = [
        source("", "pub mod a; pub mod b;"),
        source("a", "pub use x::X;"),
        source("a::x", "use crate::b::Y; // use crate::b::Z;"),
        source("b", "use crate::a::X;\nfn f() { crate::a::x::g() }"),
    ]
    .into();
    let sources = Sources { modules };
    let circle = [("a::x".into(), "b".into()), ("b".into(), "a::x".into())];
    assert_eq!(sources.circles(), circle);
}
