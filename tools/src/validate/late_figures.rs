//! Pictures of the late field's laws: reverberation time by band beside Eyring's, and the energy over time of discrete
//! paths and late reverb beside the exact response.

use std::path::{Path, PathBuf};

use plotters::prelude::*;

use super::{decay, joining};
use crate::chart::{Area, Axes, Drawn, Picture, Ticked, draw_title, hz_text, legend, px};
use foresound::acoustics::BANDS;
use foresound::error::Result;

/// Colours that are distinct in grey and for the colour-blind (\[OKABE08\]).
const OURS: RGBColor = RGBColor(0, 114, 178);
const EXACT: RGBColor = RGBColor(28, 32, 40);
const PATHS: RGBColor = RGBColor(230, 159, 0);
const LATE: RGBColor = RGBColor(0, 158, 115);

/// Band of the response's picture: 1 kHz.
const BAND: usize = 4;
/// Lowest level of the response's picture, in dB.
const FLOOR_DB: f64 = -60.0;

/// Writes both pictures into an existing folder and returns their files.
///
/// # Errors
/// Those of measuring and of writing.
pub fn write(folder: &Path) -> Result<Vec<PathBuf>> {
    let files = ["decay.png", "joining.png"].map(|name| folder.join(name));
    let entries = [("Eyring, with air", EXACT), ("propagation", OURS)];
    let title = "T60 by band: propagation beside Eyring";
    sheet(title, &entries, &decay::cases()?, draw_decay)?.save_png(&files[0])?;
    let entries = [
        ("exact", EXACT),
        ("paths", PATHS),
        ("late reverb", LATE),
        ("paths and late reverb", OURS),
    ];
    let title = "Energy in 40 ms at 1 kHz: discrete paths, late reverb and exact response";
    sheet(title, &entries, &joining::cases()?, draw_joining)?.save_png(&files[1])?;
    Ok(files.into())
}

/// A picture of a chart for each case, three in a row, with a title and a legend.
fn sheet<C>(
    title: &str,
    entries: &[(&str, RGBColor)],
    cases: &[C],
    draw: impl Fn(&Area<'_>, &C) -> Drawn,
) -> Result<Picture> {
    let rows = cases.len().div_ceil(3);
    Picture::draw(1380, 96 + rows * 320, |area| {
        draw_title(area, px(24.0), title, "")?;
        let entries: Vec<_> = entries
            .iter()
            .map(|(text, colour)| ((*text).to_owned(), *colour))
            .collect();
        legend(area, (px(24.0), px(60.0)), &entries)?;
        let (_, below) = area.split_vertically(px(84.0));
        let areas = below.split_evenly((rows, 3));
        areas
            .iter()
            .zip(cases)
            .try_for_each(|(area, case)| draw(area, case))
    })
}

fn draw_decay(area: &Area<'_>, case: &decay::Case) -> Drawn {
    let longest_s = case
        .ours_s
        .iter()
        .chain(&case.eyring_s)
        .fold(0f32, |m, t| m.max(*t));
    let bands = [(0.0, 63.0), (2.0, 250.0), (4.0, 1000.0), (6.0, 4000.0)];
    let mut chart = Axes {
        title: &case.name,
        x: Ticked {
            range: -0.4..7.4,
            ticks: bands.map(|(b, hz)| (b, hz_text(hz))).into(),
        },
        y: 0.0..1.15 * f64::from(longest_s),
        y_text: &|t| format!("{t:.1} s"),
        names: ["band", "T60"],
    }
    .draw(area)?;
    let points = |values: &[f32; BANDS]| -> Vec<(f64, f64)> {
        values
            .iter()
            .enumerate()
            .map(|(b, t)| (b as f64, f64::from(*t)))
            .collect()
    };
    chart.draw_series(LineSeries::new(
        points(&case.eyring_s),
        EXACT.stroke_width(px(2.0) as u32),
    ))?;
    let dots = points(&case.ours_s)
        .into_iter()
        .map(|at| Circle::new(at, px(4.0), OURS.filled()));
    chart.draw_series(dots)?;
    Ok(())
}

fn draw_joining(area: &Area<'_>, case: &joining::Case) -> Drawn {
    let width_ms = 1000.0 * joining::WINDOW_S;
    let mut chart = Axes {
        title: &case.name,
        x: Ticked {
            range: 0.0..width_ms * joining::WINDOWS as f64,
            ticks: (0..7)
                .map(|k| (f64::from(100 * k), format!("{}", 100 * k)))
                .collect(),
        },
        y: FLOOR_DB..10.0,
        y_text: &|db| format!("{db:.0} dB"),
        names: ["time (ms)", "energy"],
    }
    .draw(area)?;
    let loudest = case.exact.iter().map(|e| e[BAND]).fold(1e-12, f64::max);
    let level = |energy: f64| (10.0 * (energy / loudest).max(1e-9).log10()).max(FLOOR_DB);
    let mut steps = |width: f32, colour: RGBColor, energy: &dyn Fn(usize) -> f64| {
        let ends = |w: usize| [w, w + 1].map(|edge| (edge as f64 * width_ms, level(energy(w))));
        let points: Vec<_> = (0..joining::WINDOWS).flat_map(ends).collect();
        let series = LineSeries::new(points, colour.stroke_width(px(width) as u32));
        chart.draw_series(series).map(drop)
    };
    steps(4.0, EXACT, &|w| case.exact[w][BAND])?;
    steps(2.0, PATHS, &|w| case.paths[w][BAND])?;
    steps(2.0, LATE, &|w| case.late[w][BAND])?;
    steps(2.0, OURS, &|w| case.paths[w][BAND] + case.late[w][BAND])
}
