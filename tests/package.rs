//! The packages of the registry: what they hold, and how large they are. `.ci/package` builds them too.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A dependent of the library downloads no more than this. The program brings sounds along: its limit is the registry's own.
const MAX_BYTES: [(&str, u64); 2] = [("foresound", 2_000_000), ("foresound-tools", 10 << 20)];

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Runs `cargo package` without a network, or with one where this disk lacks the registry's index.
fn cargo(arguments: &[&str]) -> String {
    for network in [&["--offline"][..], &[]] {
        let output = Command::new(env!("CARGO"))
            .current_dir(ROOT)
            .args(["package", "--allow-dirty", "--locked"])
            .args(arguments)
            .args(network)
            .output()
            .expect("cargo runs");
        if output.status.success() {
            return String::from_utf8(output.stdout).expect("text");
        }
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(!network.is_empty(), "{errors}");
    }
    unreachable!("the second run returns or fails")
}

#[test]
fn packages_are_smaller_than_their_limits() {
    let folder = tempfile::tempdir().expect("a folder");
    let target = folder.path().to_str().expect("a plain name");
    cargo(&["--workspace", "--no-verify", "--target-dir", target]);
    for (name, max_bytes) in MAX_BYTES {
        let version = env!("CARGO_PKG_VERSION");
        let path = folder
            .path()
            .join(format!("package/{name}-{version}.crate"));
        let bytes = fs::metadata(&path).expect("a package").len();
        println!("{name}: {bytes} bytes");
        assert!(bytes < max_bytes, "{name} takes {bytes} bytes");
    }
}

/// Every source file is in the package, and every file that one of them includes.
#[test]
fn packages_hold_their_sources_and_what_those_include() {
    for (package, folder) in [("foresound", ""), ("foresound-tools", "tools/")] {
        let list = cargo(&["--list", "-p", package]);
        let has = |path: &Path| list.lines().any(|line| Path::new(line) == path);
        let root = Path::new(ROOT).join(folder);
        let mut sources = Vec::new();
        collect(&root.join("src"), &mut sources);
        assert!(sources.len() > 50, "{} sources", sources.len());
        for source in sources {
            let inside = source.strip_prefix(&root).expect("inside");
            assert!(has(inside), "{package} lacks {}", inside.display());
            for included in includes(&source) {
                let path = fs::canonicalize(&included).expect("an included file");
                let path = path.strip_prefix(fs::canonicalize(&root).expect("a folder"));
                let path =
                    path.unwrap_or_else(|_| panic!("{} leaves {package}", included.display()));
                let has_files = || list.lines().any(|line| Path::new(line).starts_with(path));
                assert!(has_files(), "{package} lacks {}", path.display());
            }
        }
        for wanted in ["README.md", "LICENSE-APACHE", "LICENSE-MIT"] {
            assert!(has(Path::new(wanted)), "{package} lacks {wanted}");
        }
        for foreign in [
            "assets/speech",
            "assets/scenes",
            "tests/",
            "android/",
            "docs/",
        ] {
            let found = list.lines().find(|line| line.starts_with(foreign));
            assert_eq!(found, None, "{package} has what nobody builds");
        }
    }
}

/// What the program brings along is named by links into `assets`, which `tools/build.rs` goes around and `cargo package`
/// follows. A checkout without links has their text in their place. Licences are files everywhere.
#[test]
fn packaged_files_are_those_of_the_repository() {
    let root = Path::new(ROOT);
    let list = cargo(&["--list", "-p", "foresound-tools"]);
    let bundled: Vec<&str> = list.lines().filter(|l| l.starts_with("bundled/")).collect();
    assert_eq!(bundled.len(), 19, "{bundled:?}");
    for line in bundled {
        let name = line.strip_prefix("bundled/").expect("filtered");
        let own = fs::read(root.join("tools").join(line)).expect("a link or a file");
        let asset = fs::read(root.join("assets").join(name)).expect("an asset of this name");
        let link = format!("../../../assets/{name}");
        assert!(own == asset || own == link.as_bytes(), "{line}");
    }
    for name in ["LICENSE-APACHE", "LICENSE-MIT"] {
        let own = root.join("tools").join(name);
        assert!(!own.is_symlink(), "tools/{name}");
        let same = fs::read(own).expect("a file") == fs::read(root.join(name)).expect("a file");
        assert!(same, "tools/{name} differs");
    }
}

fn collect(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            collect(&path, into);
        } else if path.extension().is_some_and(|end| end == "rs") {
            into.push(path);
        }
    }
}

/// Files that a source names in `include_bytes!`, `include_str!` and `#[path]`, but for what only tests compile. Of a name
/// that `concat!` makes, its folder.
fn includes(source: &Path) -> Vec<PathBuf> {
    let text = fs::read_to_string(source).expect("a source");
    let folder = source.parent().expect("a folder");
    let text: String = text
        .split_inclusive('\n')
        .filter(|line| !line.contains("//"))
        .collect();
    ["include_bytes!(", "include_str!(", "#[path = "]
        .iter()
        .flat_map(|call| text.split(call).zip(text.split(call).skip(1)))
        .filter(|(before, _)| !is_for_tests(before))
        .map(|(_, rest)| rest.strip_prefix("concat!(").unwrap_or(rest))
        .filter_map(|rest| rest.trim_start().strip_prefix('"')?.split('"').next())
        .map(|name| folder.join(name))
        .collect()
}

/// Whether the attribute of tests or of documentation tests stands in the lines right before.
fn is_for_tests(before: &str) -> bool {
    let lines: Vec<&str> = before.lines().rev().take(3).collect();
    lines
        .iter()
        .any(|line| line.contains("#[cfg(test)]") || line.contains("#[cfg(doctest)]"))
}
