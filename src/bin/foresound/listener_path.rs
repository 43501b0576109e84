//! Where the listener is over time: a place, a recorded path, or a scene's walk.

use std::path::{Path, PathBuf};

use foresound::scene::ListenerPose;
use foresound::scene::layout::Walk;
use foresound::{Error, Result};
use glam::{Quat, Vec3};

use crate::inputs::parse_place;

/// A listener's whereabouts.
pub(crate) enum ListenerPath {
    /// Stands and looks along −z.
    Standing(Vec3),
    /// Walks to and fro, looking along −z.
    Walking(Walk),
    /// Goes through rows in time, straight in between, and stands before the first and after the last.
    Recorded(Vec<Row>),
}

/// One line of a recorded path.
#[derive(Clone, Copy, serde::Deserialize)]
pub(crate) struct Row {
    /// Seconds.
    t: f64,
    x: f32,
    y: f32,
    z: f32,
    /// Degrees to the left of −z.
    #[serde(default)]
    yaw: f32,
    /// Degrees upwards.
    #[serde(default)]
    pitch: f32,
}

impl ListenerPath {
    /// `x,y,z` or the name of a CSV file with the columns t,x,y,z and, if wanted, yaw and pitch.
    pub(crate) fn parse(text: &str) -> Result<Self> {
        let looks_like_place = text.split(',').count() == 3 && !text.ends_with(".csv");
        if looks_like_place {
            return Ok(Self::Standing(parse_place("--listener", text)?));
        }
        read_rows(Path::new(text)).map(Self::Recorded)
    }

    /// The pose at a time in seconds.
    pub(crate) fn at(&self, time_s: f64) -> ListenerPose {
        match self {
            Self::Standing(position) => ListenerPose::facing(*position, 0.0),
            Self::Walking(walk) => ListenerPose::facing(walk.position_at(time_s, 0.0), 0.0),
            Self::Recorded(rows) => recorded(rows, time_s),
        }
    }

    /// Seconds that a recorded path lasts.
    pub(crate) fn duration_s(&self) -> Option<f64> {
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
    let place = |row: &Row| Vec3::new(row.x, row.y, row.z);
    let turn = |row: &Row| {
        Quat::from_rotation_y(row.yaw.to_radians()) * Quat::from_rotation_x(row.pitch.to_radians())
    };
    ListenerPose {
        position: place(&before).lerp(place(&after), share),
        orientation: turn(&before).slerp(turn(&after), share),
    }
}

fn read_rows(file: &Path) -> Result<Vec<Row>> {
    const COLUMNS: &str = "write a header line t,x,y,z (yaw and pitch in degrees may follow) and rows in order of time";
    let path = || PathBuf::from(file);
    let opened = std::fs::File::open(file).map_err(|error| {
        Error::file(file, error, "give a place as x,y,z or an existing CSV file")
    })?;
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(opened);
    let mut rows: Vec<Row> = Vec::new();
    for record in reader.deserialize() {
        let row: Row = record.map_err(|error| {
            let line = error.position().map(|p| p.line() as usize);
            Error::format(path(), line, describe(&error), COLUMNS)
        })?;
        let line = Some(rows.len() + 2);
        let numbers = [row.t as f32, row.x, row.y, row.z, row.yaw, row.pitch];
        if !numbers.iter().all(|n| n.is_finite()) {
            return Err(Error::format(
                path(),
                line,
                "a number is not finite",
                COLUMNS,
            ));
        }
        if rows.last().is_some_and(|last| last.t >= row.t) {
            return Err(Error::format(
                path(),
                line,
                "time does not increase",
                COLUMNS,
            ));
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(Error::format(path(), None, "no rows", COLUMNS));
    }
    Ok(rows)
}

/// What a CSV error says, on one line and without the position, which the caller names.
fn describe(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::Deserialize { err, .. } => err.kind().to_string(),
        csv::ErrorKind::Utf8 { .. } => "this is not text".to_owned(),
        _ => error.to_string().replace('\n', " "),
    }
}
