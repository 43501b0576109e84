//! The fuzz targets without a fuzzer: their seeds, every input that ever broke one, and damaged seeds, in every test run.
//! `.ci/fuzz` runs the same targets under libFuzzer if the tools are installed.
#![expect(clippy::panic, reason = "a test reports the failing input")]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

#[path = "../../tests/fuzz/drivers/mod.rs"]
mod drivers;

/// Damaged inputs a target, unless FUZZ_INPUTS sets another number.
const DAMAGED: u64 = 300;

/// An endless sequence of numbers from a seed (the mixer of SplitMix64).
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, most: usize) -> usize {
        (self.next() % most.max(1) as u64) as usize
    }
}

/// Words that are difficult for readers of these formats.
const WORDS: [&[u8]; 18] = [
    b"nan",
    b"inf",
    b"-0",
    b"1e39",
    b"-1",
    b"99999999999999999999",
    b"\n",
    b"\r\n",
    b"\\\n",
    b"\"",
    b"\0",
    b"\xff",
    b"\xef\xbb\xbf",
    b"]",
    b"[[",
    b",",
    b"=",
    b"\xff\xff\xff\xff",
];

fn inputs(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
        .map(|entry| entry.expect("readable").path())
        .collect();
    files.sort();
    let read = |path: PathBuf| {
        let bytes = std::fs::read(&path).expect("a seed is read");
        (path, bytes)
    };
    files.into_iter().map(read).collect()
}

/// A seed with some bytes changed, words inserted, parts doubled or cut off; or bytes without a seed.
fn damaged(seeds: &[(PathBuf, Vec<u8>)], dice: &mut Dice) -> Vec<u8> {
    let mut bytes = match dice.below(5) {
        0 => (0..dice.below(600)).map(|_| dice.next() as u8).collect(),
        _ => seeds[dice.below(seeds.len())].1.clone(),
    };
    for _ in 0..=dice.below(6) {
        let at = dice.below(bytes.len() + 1);
        let end = (at + dice.below(12)).min(bytes.len());
        match dice.below(5) {
            0 => bytes.truncate(at),
            1 => drop(bytes.splice(at..at, WORDS[dice.below(WORDS.len())].iter().copied())),
            2 => drop(bytes.splice(at..end, WORDS[dice.below(WORDS.len())].iter().copied())),
            3 => {
                let part = bytes[at..end].to_vec();
                drop(bytes.splice(at..at, part));
            }
            _ => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = dice.next() as u8;
                }
            }
        }
    }
    bytes
}

/// Runs a target; an input that breaks it is kept beside the test program, to become a seed.
fn run((name, target): drivers::Target, what: &str, bytes: &[u8]) {
    if catch_unwind(AssertUnwindSafe(|| target(bytes))).is_err() {
        let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("broke-{name}"));
        std::fs::write(&kept, bytes).expect("the input is kept");
        panic!("{what} breaks {name}; the input is {}", kept.display());
    }
}

fn twin(target: drivers::Target) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fuzz/seeds");
    let seeds = inputs(&folder.join(target.0));
    assert!(!seeds.is_empty(), "{} has no seeds", target.0);
    for (path, bytes) in &seeds {
        run(target, &path.display().to_string(), bytes);
    }
    let setting = std::env::var("FUZZ_INPUTS").ok();
    let count = setting.map_or(DAMAGED, |text| text.parse().expect("a number of inputs"));
    let mut dice = Dice(0x5eed);
    for number in 0..count {
        let bytes = damaged(&seeds, &mut dice);
        run(target, &format!("damaged input {number}"), &bytes);
    }
}

macro_rules! twins {
    ($($name:ident $index:literal),*) => {
        $(#[test]
        fn $name() {
            let target = drivers::TARGETS[$index];
            assert_eq!(target.0, stringify!($name));
            twin(target);
        })*
    };
}

twins!(
    obj 0, materials 1, layout 2, listener 3, wav 4, c_calls 5, commit 6, matching 7, ply 8, gltf 9, saved 10, sofa 11,
    compressed 12
);

#[test]
fn every_target_has_a_fuzz_target() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fuzz/fuzz_targets");
    let mut files: Vec<String> = inputs(&folder)
        .iter()
        .map(|(path, _)| {
            path.file_stem()
                .expect("a name")
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    files.sort();
    let mut names: Vec<&str> = drivers::TARGETS.iter().map(|(name, _)| *name).collect();
    names.sort_unstable();
    assert_eq!(files, names);
}
