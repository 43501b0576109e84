//! `ERRORS.md` lists every error, and every row of it is a real error: each is caused here through the command line or
//! the library and its text compared; and every advice in the sources is in the table.
#![expect(clippy::panic, reason = "a test reports the missing row")]

mod engine;
mod files;
mod formats;
mod meshes;
mod program;
mod sources;
mod table;
mod without_threads;

use foresound::Error;

use table::{row_of, table};

/// The texts of the caused errors.
#[derive(Default)]
pub(crate) struct Errors(Vec<String>);

impl Errors {
    /// Records a result that must be an error.
    pub(crate) fn of<T>(&mut self, what: &str, result: Result<T, Error>) {
        match result {
            Ok(_) => panic!("{what} is no error"),
            Err(error) => self.0.push(error.to_string()),
        }
    }

    /// Records a line that a program has printed.
    pub(crate) fn line(&mut self, line: &str) {
        self.0.push(line.to_owned());
    }
}

/// Rows that no test causes, and the reason for each.
const NOT_MADE: [(&str, &str); 23] = [
    // Texts of a real device's backend. Tests open none, since a machine may lack one.
    (
        "there is no sound device",
        "plug one in, or start the sound system",
    ),
    (
        "the device does not play … Hz",
        "choose another device, or its rate in the system's settings",
    ),
    (
        "the sound device refuses: …",
        "look whether another program has it, or plug in another",
    ),
    (
        "no sound device: …",
        "close other apps that use sound, or try again",
    ),
    (
        "the device plays … channels of … at … Hz instead of … of PCM_Float at … Hz",
        "make the engine with the device's sample rate, or build with the feature oboe, which converts",
    ),
    // Another build of the library: `.ci/run` compiles it without the feature.
    (
        "no HRTF set is built in",
        "give one, or build with the feature builtin-hrtf",
    ),
    (
        "is a glTF file, which is not read",
        "build the library with its feature `gltf`, or export the model as OBJ or PLY",
    ),
    // SOFA files: tests/sofa.rs writes them.
    (
        "… Hz is outside 16000 to 96000",
        "choose the engine's sample rate in that range",
    ),
    (
        "no response within … degrees of azimuth …, elevation …",
        "give a set measured all around the head",
    ),
    ("…", "load the file from its source again"),
    ("…", "give a file that ends in .sofa"),
    ("…", "give a set of one head"),
    (
        "… has the shape … and not …",
        "give a set of the convention SimpleFreeFieldHRIR",
    ),
    (
        "the convention is … and not SimpleFreeFieldHRIR",
        "give head-related impulse responses in free field",
    ),
    (
        "… has the coordinates …",
        "give a set with spherical or cartesian coordinates",
    ),
    (
        "… is turned",
        "give a set whose listener looks along +x, with +z above",
    ),
    (
        "the … receiver is silent in measurement …",
        "remove that measurement, or load the file again",
    ),
    (
        "a sample rate of … Hz, …",
        "resample the file to 44100 or 48000 Hz",
    ),
    // Another build of the library.
    (
        "a SOFA file for … Hz, which this build does not read",
        "build with the feature sofa, or give a baked set of `foresound hrtf`",
    ),
    // Half a gigabyte of text.
    (
        "larger than … MiB",
        "keep the files that a .gltf refers to beside it, or export one GLB file",
    ),
    // Sixty-seven million triangles: gigabytes.
    (
        "… triangles, more than …",
        "simplify the model; sound needs walls, not ornaments",
    ),
    // Defects of the library, to be fixed when found.
    ("propagation was lost", "make another engine"),
    (
        "building the scene panicked",
        "the scene before is kept; report the mesh",
    ),
];

#[test]
fn every_row_is_an_error_and_every_error_has_a_row() {
    let rows = table();
    let mut errors = Errors::default();
    files::make(&mut errors);
    formats::make(&mut errors);
    meshes::make(&mut errors);
    engine::make(&mut errors);
    program::make(&mut errors);
    without_threads::make(&mut errors);
    let mut made = vec![false; rows.len()];
    for line in &errors.0 {
        assert_eq!(line.lines().count(), 1, "{line:?}");
        let Some(found) = row_of(&rows, line) else {
            panic!("ERRORS.md has no row for: {line}");
        };
        for (row, made) in rows.iter().zip(&mut made) {
            *made |= row == found;
        }
    }
    for (problem, advice) in NOT_MADE {
        let listed = rows
            .iter()
            .zip(&mut made)
            .find(|(row, _)| row.problem == problem && row.advice == advice);
        let (row, made) = listed.unwrap_or_else(|| panic!("{problem}; {advice}: is no row"));
        assert!(!*made, "is made after all: {}", row.pattern());
        *made = true;
    }
    let missing: Vec<String> = (rows.iter().zip(made))
        .filter(|(_, made)| !made)
        .map(|(row, _)| row.pattern())
        .collect();
    assert!(missing.is_empty(), "no test makes: {missing:#?}");
}
