//! `ERRORS.md` knows every error, and every row of it is an error that can be had: each is made here through the command
//! line or the library and its text compared; and every advice that stands in the sources stands there too.
#![expect(clippy::panic, reason = "a test says what is missing")]

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

/// The texts of errors that were made.
#[derive(Default)]
pub(crate) struct Errors(Vec<String>);

impl Errors {
    /// What has to fail, and does.
    pub(crate) fn of<T>(&mut self, what: &str, result: Result<T, Error>) {
        match result {
            Ok(_) => panic!("{what} is no error"),
            Err(error) => self.0.push(error.to_string()),
        }
    }

    /// A line that a program has printed.
    pub(crate) fn line(&mut self, line: &str) {
        self.0.push(line.to_owned());
    }
}

/// Rows that no test makes, and why.
const NOT_MADE: [(&str, &str); 7] = [
    // What a real device's backend says. Tests open none, since a machine may have one or not.
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
    // Another build of the library: `.ci/run` compiles it without the feature.
    (
        "no HRTF set is built in",
        "give one, or build with the feature builtin-hrtf",
    ),
    // Sixty-seven million triangles: gigabytes.
    (
        "… triangles, more than …",
        "simplify the model; sound needs walls, not ornaments",
    ),
    // A defect of the library. Whoever finds one mends it.
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
    for (says, advises) in NOT_MADE {
        let listed = rows
            .iter()
            .zip(&mut made)
            .find(|(row, _)| row.says == says && row.advises == advises);
        let (row, made) = listed.unwrap_or_else(|| panic!("{says}; {advises}: is no row"));
        assert!(!*made, "is made after all: {}", row.pattern());
        *made = true;
    }
    let missing: Vec<String> = (rows.iter().zip(made))
        .filter(|(_, made)| !made)
        .map(|(row, _)| row.pattern())
        .collect();
    assert!(missing.is_empty(), "no test makes: {missing:#?}");
}
