//! A picture of the law *edge*: level behind a wedge over the angle, by propagation and by the exact solution.

use std::f64::consts::PI;

use plotters::prelude::*;

use super::chart::{
    AXIS, Area, Axes, DrawError, INK, Picture, Ticked, draw_title, hz_text, legend, mixed, px,
};
use super::validate::edge_scene::EdgeScene;
use foresound::acoustics::bands::CENTRES_HZ;
use foresound::error::Result;

/// Angles from the shadow boundary in degrees, and levels in dB re the free field.
const ANGLES_DEG: (f64, f64) = (-30.0, 60.0);
const LEVELS_DB: (f64, f64) = (-36.0, 6.0);

/// Bands drawn, and their colours.
const DRAWN: [(usize, RGBColor); 4] = [
    (0, RGBColor(36, 104, 196)),
    (2, RGBColor(20, 142, 96)),
    (4, RGBColor(232, 120, 16)),
    (7, RGBColor(208, 26, 48)),
];

/// Points (degrees, dB) of a curve.
type Curve = Vec<(f64, f64)>;

/// Draws the level behind a screen and behind a corner, 5 m from the edge: the sum of all paths, and the exact
/// solution.
///
/// # Errors
/// Those of committing a scene and of drawing.
pub fn draw_edge_figure() -> Result<Picture> {
    let panels = [
        (
            "thin screen (n = 2)",
            curves(EdgeScene::new(2.0, 0.5 * PI)?),
        ),
        (
            "right-angled corner (n = 1.5)",
            curves(EdgeScene::new(1.5, 0.25 * PI)?),
        ),
    ];
    Picture::draw(1400, 640, |area| {
        let title = "Level behind an edge, source and listener 5 m from it";
        let caption = "broad and pale: exact solution, integrated; dark and thin: sum of all paths of the propagator";
        draw_title(area, px(76.0), title, caption)?;
        let names = DRAWN.map(|(band, colour)| (hz_text(CENTRES_HZ[band].round()), colour));
        legend(area, (px(76.0), px(84.0)), &names)?;
        let (_, below) = area.split_vertically(px(104.0));
        let areas = below.split_evenly((1, 2));
        areas
            .iter()
            .zip(&panels)
            .try_for_each(|(area, (name, curves))| draw_panel(area, name, curves))
    })
}

fn draw_panel(
    area: &Area<'_>,
    title: &str,
    curves: &[[Curve; 2]],
) -> std::result::Result<(), DrawError> {
    let degrees = (-3..=6).map(|tens| (f64::from(10 * tens), format!("{}", 10 * tens)));
    let mut chart = Axes {
        title,
        x: Ticked {
            range: ANGLES_DEG.0..ANGLES_DEG.1,
            ticks: degrees.collect(),
        },
        y: LEVELS_DB.0..LEVELS_DB.1,
        y_text: &|db| format!("{db:.0}"),
        names: ["degrees beyond the shadow boundary", "dB re free field"],
    }
    .draw(area)?;
    let boundary = [(0.0, LEVELS_DB.0), (0.0, LEVELS_DB.1)];
    chart.draw_series(DashedLineSeries::new(
        boundary,
        px(5.0) as u32,
        px(5.0) as u32,
        AXIS.stroke_width(1),
    ))?;
    for ([exact, _], (_, colour)) in curves.iter().zip(DRAWN) {
        let style = colour.mix(0.4).stroke_width(px(6.0) as u32);
        chart.draw_series(LineSeries::new(exact.iter().copied(), style))?;
    }
    for ([_, paths], (_, colour)) in curves.iter().zip(DRAWN) {
        let style = mixed(colour, INK, 0.3).stroke_width(px(1.5) as u32);
        chart.draw_series(LineSeries::new(paths.iter().copied(), style))?;
    }
    Ok(())
}

/// The exact solution and the sum of all paths, in each of the bands [`DRAWN`].
fn curves(mut scene: EdgeScene) -> Vec<[Curve; 2]> {
    let mut curves = vec![[Curve::new(), Curve::new()]; DRAWN.len()];
    let incoming = scene.wedge(0.0).angles[0];
    for step in 0..=360 {
        // No step is on the boundary itself, where the source is neither visible nor hidden.
        let deg = ANGLES_DEG.0 + 0.25 * f64::from(step) + 0.01;
        let outgoing = incoming + PI + deg.to_radians();
        if outgoing > scene.n * PI {
            break;
        }
        let direct_m = scene.wedge(outgoing).direct_m();
        let (level, exact) = (scene.level(outgoing, false), scene.exact(outgoing));
        let db = |amplitude: f64| {
            (20.0 * (amplitude * direct_m).max(1e-9).log10()).clamp(LEVELS_DB.0, LEVELS_DB.1)
        };
        for (curves, (band, _)) in curves.iter_mut().zip(DRAWN) {
            curves[0].push((deg, db(exact[band])));
            curves[1].push((deg, db(level[band])));
        }
    }
    curves
}
