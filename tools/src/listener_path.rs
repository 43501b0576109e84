//! The listener over time: a position, a recorded path, or a scene's walk.
//!
//! Control side. Reads at most [`LARGEST_FILE`] of a file.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use glam::{Quat, Vec3};

use foresound::scene::ListenerPose;
use foresound::scene::layout::Walk;
use foresound::scene::mesh::LARGEST_COORDINATE_M;
use foresound::{Error, Result};

/// Largest file in bytes: an hour at a hundred rows a second is a third of it.
pub const LARGEST_FILE: u64 = 1 << 26;

/// A listener over time.
pub enum ListenerPath {
    /// At rest, facing −z.
    AtRest(Vec3),
    /// Walks to and fro, facing −z.
    Walking(Walk),
    /// Interpolates rows in time and jumps between two of one time; at rest before the first and after the last.
    Recorded(Vec<Row>),
}

/// One line of a recorded path.
#[derive(Clone, Copy, serde::Deserialize)]
pub struct Row {
    /// Seconds.
    t: f64,
    /// Metres, +y up.
    x: f32,
    y: f32,
    z: f32,
    /// Degrees to the left of −z.
    #[serde(default)]
    yaw: Option<f32>,
    /// Degrees upwards.
    #[serde(default)]
    pitch: Option<f32>,
}

impl ListenerPath {
    /// `x,y,z` or the name of a CSV file with the columns t,x,y,z and optionally yaw and pitch.
    ///
    /// # Errors
    /// [`Error::Setting`] for invalid coordinates, [`Error::File`] for a file that cannot be read or is larger than
    /// [`LARGEST_FILE`], [`Error::Format`] with the line for rows that are invalid, out of order, or farther out than
    /// [`LARGEST_COORDINATE_M`].
    pub fn parse(text: &str) -> Result<Self> {
        let looks_like_place = text.split(',').count() == 3 && !text.ends_with(".csv");
        if looks_like_place {
            return Ok(Self::AtRest(parse_position("--listener", text)?));
        }
        read_rows(Path::new(text)).map(Self::Recorded)
    }

    /// A recorded path from the bytes of such a file; `file` is for errors.
    ///
    /// # Errors
    /// [`Error::Format`] as [`Self::parse`].
    pub fn from_csv(file: &Path, text: &[u8]) -> Result<Self> {
        parse_rows(file, text).map(Self::Recorded)
    }

    /// The pose at a time in seconds.
    pub fn at(&self, time_s: f64) -> ListenerPose {
        match self {
            Self::AtRest(position) => ListenerPose::facing(*position, 0.0),
            Self::Walking(walk) => ListenerPose::facing(walk.position_at(time_s, 0.0), 0.0),
            Self::Recorded(rows) => recorded(rows, time_s),
        }
    }

    /// Whether a recorded path has angles.
    pub fn is_oriented(&self) -> bool {
        let has_angle = |row: &Row| row.yaw.is_some() || row.pitch.is_some();
        matches!(self, Self::Recorded(rows) if rows.iter().any(has_angle))
    }

    /// Seconds that a recorded path lasts.
    pub fn duration_s(&self) -> Option<f64> {
        match self {
            Self::Recorded(rows) => rows.last().map(|row| row.t),
            _ => None,
        }
    }
}

fn recorded(rows: &[Row], time_s: f64) -> ListenerPose {
    let next = rows.partition_point(|row| row.t <= time_s);
    let before = rows[next.saturating_sub(1)];
    let after = rows[next.min(rows.len() - 1)];
    let span_s = after.t - before.t;
    let share = if span_s > 0.0 {
        ((time_s - before.t) / span_s).clamp(0.0, 1.0) as f32
    } else {
        0.0
    };
    let position = |row: &Row| Vec3::new(row.x, row.y, row.z);
    let turn = |row: &Row| {
        let radians = |degrees: Option<f32>| degrees.unwrap_or(0.0).to_radians();
        Quat::from_rotation_y(radians(row.yaw)) * Quat::from_rotation_x(radians(row.pitch))
    };
    ListenerPose {
        position: position(&before).lerp(position(&after), share),
        orientation: turn(&before).slerp(turn(&after), share),
    }
}

fn read_rows(file: &Path) -> Result<Vec<Row>> {
    let advice = "give a place as x,y,z or an existing CSV file";
    let opened = File::open(file).map_err(|error| Error::file(file, error, advice))?;
    if opened.metadata().is_ok_and(|about| about.is_dir()) {
        return Err(Error::file(file, "is a directory", advice));
    }
    let mut text = Vec::new();
    opened
        .take(LARGEST_FILE + 1)
        .read_to_end(&mut text)
        .map_err(|error: io::Error| Error::file(file, error, advice))?;
    if text.len() as u64 > LARGEST_FILE {
        return Err(Error::file(file, "larger than 64 MiB", advice));
    }
    parse_rows(file, &text)
}

/// The rows of a CSV text; `file` is for errors.
fn parse_rows(file: &Path, text: &[u8]) -> Result<Vec<Row>> {
    const NAMES: [&str; 6] = ["t", "x", "y", "z", "yaw", "pitch"];
    const COLUMNS: &str = "write a header line t,x,y,z (yaw and pitch in degrees may follow) and rows in order of time";
    let path = || PathBuf::from(file);
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(text);
    let headers = reader.headers().cloned().map_err(|error| {
        let line = error.position().map(|p| p.line() as usize);
        Error::format(path(), line, describe(&error), COLUMNS)
    })?;
    let mut rows: Vec<Row> = Vec::new();
    let mut record = csv::StringRecord::new();
    loop {
        let wrong = |line: Option<usize>, problem: String| {
            Err(Error::format(path(), line, problem, COLUMNS))
        };
        match reader.read_record(&mut record) {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) => {
                let line = error.position().map(|p| p.line() as usize);
                return wrong(line, describe(&error));
            }
        }
        let line = record.position().map(|p| p.line() as usize);
        let row: Row = match record.deserialize(Some(&headers)) {
            Ok(row) => row,
            Err(error) => return wrong(line, describe(&error)),
        };
        let unknown = |name: &&str| !name.is_empty() && !NAMES.contains(name);
        if let Some(name) = headers.iter().find(unknown) {
            let header = headers.position().map(|p| p.line() as usize);
            return wrong(
                header,
                format!("no column is called `{}`", name.escape_debug()),
            );
        }
        // A decimal comma makes two cells of a number.
        if record
            .iter()
            .skip(headers.len())
            .any(|cell| !cell.is_empty())
        {
            return wrong(line, "the row has more cells than the header".into());
        }
        let mut missing = headers.iter().skip(record.len());
        if let Some(name) = missing.find(|name| !name.is_empty()) {
            return wrong(line, format!("the row ends before `{name}`"));
        }
        let numbers = [row.t as f32, row.x, row.y, row.z];
        let turns = row.yaw.into_iter().chain(row.pitch);
        if !numbers.into_iter().chain(turns).all(f32::is_finite) {
            return wrong(line, "a number is not finite".into());
        }
        let coordinates = [row.x, row.y, row.z];
        if let Some(far) = coordinates.iter().find(|n| n.abs() > LARGEST_COORDINATE_M) {
            return wrong(
                line,
                format!("{far:e} lies beyond {LARGEST_COORDINATE_M} m"),
            );
        }
        // Two rows of one time are a jump.
        let last = rows.last().map_or(f64::NEG_INFINITY, |last| last.t);
        let is_pair = matches!(rows[..], [.., a, b] if a.t == b.t);
        if row.t < last || row.t == last && is_pair {
            let problem = "time runs backwards, or three rows have one time";
            return wrong(line, problem.into());
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(Error::format(path(), None, "no rows", COLUMNS));
    }
    Ok(rows)
}

/// The text of a CSV error, on one line and without the position, which the caller adds.
fn describe(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::Deserialize { err, .. } => err.kind().to_string(),
        csv::ErrorKind::Utf8 { .. } => "this is not text".to_owned(),
        _ => error.to_string().replace('\n', " "),
    }
}

/// Three numbers with commas between, in metres, +y up. `argument` is the option's name in errors.
///
/// # Errors
/// [`Error::Setting`] for anything else, and beyond [`LARGEST_COORDINATE_M`].
pub fn parse_position(argument: &str, text: &str) -> Result<Vec3> {
    let numbers: Vec<f32> = text
        .split(',')
        .filter_map(|n| n.trim().parse().ok())
        .collect();
    match numbers[..] {
        [x, y, z] if text.split(',').count() == 3 && numbers.iter().all(|n| n.is_finite()) => {
            let position = Vec3::new(x, y, z);
            if position.abs().max_element() > LARGEST_COORDINATE_M {
                let problem = format!("{text:?} lies beyond {LARGEST_COORDINATE_M} m");
                return Err(Error::setting(argument, problem, "give metres"));
            }
            Ok(position)
        }
        _ => Err(Error::setting(
            argument,
            format!("{text:?} is not a position"),
            "give three numbers in metres such as 1,1.6,-2",
        )),
    }
}
