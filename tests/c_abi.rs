//! Callers whose structures are shorter or longer than the library's: C programs compiled with an older and a newer header, made
//! from the library's and the table of structures, run against the shared library. Each structure lies between guard bytes; the
//! programs also run under AddressSanitizer and valgrind where those are at hand.
//!
//! The library is built in a folder of its own; FORESOUND_LIBRARY names a folder with a built one.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use foresound::bridge::enumeration::constant_case;
use foresound::bridge::interface::{Structure, structures};

/// How a caller's header differs from the library's.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Caller {
    /// Structures end after their first fields.
    First,
    /// Structures lack their last fields.
    Older,
    /// The library's.
    Same,
    /// Structures have further fields.
    Newer,
}

impl Caller {
    /// Fields that a structure keeps, the size included: those up to an end at which a structure can end, since it has no
    /// padding.
    fn kept(self, structure: &Structure) -> usize {
        let can_end =
            |count: &usize| structure.ends[*count - 1].is_multiple_of(structure.alignment);
        let counts = 1..=structure.ends.len();
        let all = structure.ends.len();
        match (self, &structure.initializer) {
            (Self::First, Some(_)) => counts.clone().find(can_end).unwrap_or(all),
            (Self::Older, Some(_)) => (1..all).rfind(can_end).unwrap_or(all),
            _ => all,
        }
    }
}

/// Splits a braced list at its own commas.
fn elements(list: &str) -> Vec<String> {
    let (mut depth, mut parts) = (0, vec![String::new()]);
    for letter in list[1..list.len() - 1].chars() {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(String::new());
                continue;
            }
            _ => {}
        }
        parts.last_mut().expect("never empty").push(letter);
    }
    parts
}

/// The library's header with a caller's layout.
fn header(caller: Caller) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut text = fs::read_to_string(root.join("include/foresound.h")).expect("text");
    let mut macros = String::new();
    for structure in structures() {
        let name = structure.name;
        let start = format!("typedef struct Foresound{name} {{\n");
        let end = format!("}} Foresound{name};");
        let from = text.find(&start).expect("the header has the structure") + start.len();
        let to = from + text[from..].find(&end).expect("the structure ends");
        let body = text[from..to].to_owned();
        let fields = body
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"));
        let sized = usize::from(structure.initializer.is_some());
        assert_eq!(
            fields.clone().count(),
            structure.fields.len() + sized,
            "{name}: {body}"
        );
        let kept = caller.kept(&structure);
        let mut shorter: String = fields
            .take(kept)
            .map(|field| format!("{field}\n"))
            .collect();
        let is_longer = caller == Caller::Newer && name != "Percentiles";
        if is_longer {
            shorter += match structure.alignment {
                8 => "  uint64_t later[5];\n",
                _ => "  uint32_t later[5];\n",
            };
        }
        text.replace_range(from..to, &shorter);
        let known = structure.ends[structure.ends.len() - 1];
        let _ = writeln!(macros, "#define KNOWN_{name} {known}u");
        for (field, _) in structure.fields.iter().take(kept - sized) {
            let _ = writeln!(macros, "#define HAS_{name}_{field}");
        }
        if let Some(initializer) = structure.initializer {
            let mut values = elements(&initializer);
            values.truncate(kept);
            values.extend(is_longer.then(|| " {1, 2, 3, 4, 5}".to_owned()));
            let (name, values) = (constant_case(name), values.join(","));
            let _ = writeln!(macros, "#undef FORESOUND_{name}_INIT");
            let _ = writeln!(macros, "#define FORESOUND_{name}_INIT {{{values}}}");
        }
    }
    if caller == Caller::Newer {
        let end = "} ForesoundPose;";
        text = text.replace(end, &format!("  uint32_t later[3];\n{end}"));
    }
    let _ = writeln!(macros, "#define KNOWN_Pose 32u");
    let end = text
        .rfind("#ifdef __cplusplus")
        .expect("the end of the declarations");
    text.insert_str(end, &macros);
    text
}

/// Runs a program; its output, or what went wrong.
fn run(command: &mut Command) -> Result<String, String> {
    let output = command.output().map_err(|error| error.to_string())?;
    let texts =
        [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    match output.status.success() {
        true => Ok(texts.concat()),
        false => Err(format!(
            "{:?}: {}{}",
            command.get_program(),
            output.status,
            texts.concat()
        )),
    }
}

fn compiler() -> Option<PathBuf> {
    let named = std::env::var_os("CC").map(PathBuf::from);
    let usual = ["cc", "gcc", "clang"].map(PathBuf::from);
    named
        .into_iter()
        .chain(usual)
        .find(|cc| run(Command::new(cc).arg("--version")).is_ok())
}

/// The folder of the shared library.
fn library() -> PathBuf {
    if let Some(folder) = std::env::var_os("FORESOUND_LIBRARY") {
        return folder.into();
    }
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).join("c_abi");
    let mut cargo = Command::new(env!("CARGO"));
    cargo
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args([
            "rustc",
            "--locked",
            "--lib",
            "--crate-type",
            "cdylib",
            "--features",
            "capi",
        ])
        .arg("--target-dir")
        .arg(&target);
    run(&mut cargo).expect("the shared library builds");
    target.join("debug")
}

#[test]
fn older_and_newer_callers_are_served_within_their_structures() {
    let Some(cc) = compiler().filter(|_| cfg!(unix)) else {
        eprintln!("SKIPPED: no C compiler here; set CC to one");
        return;
    };
    let library = library();
    let file = library.join(format!("{DLL_PREFIX}foresound{DLL_SUFFIX}"));
    assert!(file.exists(), "{} is missing", file.display());
    let folder = tempfile::tempdir().expect("a folder");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/c/caller.c");
    let compile = |caller: Caller, flags: &[&str]| {
        let include = folder.path().join(format!("{caller:?}"));
        fs::create_dir_all(&include).expect("a folder");
        fs::write(include.join("foresound.h"), header(caller)).expect("is written");
        let program = include.join(format!("caller{}", flags.concat()));
        let mut command = Command::new(&cc);
        command
            .args([
                "-std=c99",
                "-g",
                "-Wall",
                "-Wextra",
                "-Werror",
                "-Wno-missing-field-initializers",
                "-I",
            ])
            .arg(&include)
            .arg(&source)
            .args(flags)
            .arg("-o")
            .arg(&program)
            .arg("-L")
            .arg(&library)
            .arg("-lforesound")
            .arg(format!("-Wl,-rpath,{}", library.display()));
        run(&mut command).map(|_| program)
    };
    let sizes: Vec<usize> = structures()
        .iter()
        .map(|s| s.ends[s.ends.len() - 1])
        .collect();
    assert!(sizes.len() > 10, "{sizes:?}");
    let has_valgrind = run(Command::new("valgrind").arg("--version")).is_ok();
    for caller in [Caller::First, Caller::Older, Caller::Same, Caller::Newer] {
        let plain = compile(caller, &[]).expect("compiles");
        let told =
            run(&mut Command::new(&plain)).unwrap_or_else(|error| panic!("{caller:?}: {error}"));
        eprintln!("{caller:?}: {}", told.trim_end());
        match compile(caller, &["-fsanitize=address"]) {
            // The library keeps its tables of handles to the end.
            Ok(program) => {
                let mut command = Command::new(program);
                let told = run(command.env("ASAN_OPTIONS", "detect_leaks=0"));
                told.unwrap_or_else(|error| panic!("{caller:?}, AddressSanitizer: {error}"));
            }
            Err(_) => eprintln!("SKIPPED: {} has no AddressSanitizer", cc.display()),
        }
        if has_valgrind && caller != Caller::First {
            let mut command = Command::new("valgrind");
            command
                .args([OsStr::new("-q"), OsStr::new("--error-exitcode=9")])
                .arg(&plain);
            let told = run(&mut command);
            told.unwrap_or_else(|error| panic!("{caller:?}, valgrind: {error}"));
        }
    }
    if !has_valgrind {
        eprintln!("SKIPPED: no valgrind");
    }
}

/// A header of another layout differs in every structure that begins with its size.
#[test]
fn the_callers_headers_differ() {
    let all = [Caller::First, Caller::Older, Caller::Same, Caller::Newer];
    for structure in structures().iter().filter(|s| s.initializer.is_some()) {
        let counts = all.map(|caller| caller.kept(structure));
        assert!(
            counts[0] <= counts[1] && counts[1] < counts[2],
            "{}: {counts:?}",
            structure.name
        );
    }
    let newer = header(Caller::Newer);
    assert!(
        newer.matches("later[").count() >= structures().len(),
        "one a structure, the pose included"
    );
}
