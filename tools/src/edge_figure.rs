//! A picture of the law *edge*: level behind a wedge against the angle, ours beside the exact solution.

use std::f64::consts::PI;

use glam::{Vec2, vec2};

use super::axis::{hz_text, tick_text, ticks};
use super::canvas::Canvas;
use super::colormap::Colour;
use super::lettering::{Align, Font};
use super::validate::edge_scene::EdgeScene;
use foresound::acoustics::BANDS;
use foresound::acoustics::bands::CENTRES_HZ;
use foresound::error::Result;

/// Size of the picture, and where its panels begin and end, in pixels.
const SIZE_PX: Vec2 = Vec2::new(1400.0, 640.0);
const TOP_PX: f32 = 110.0;
const BOTTOM_PX: f32 = 560.0;
const PANELS_PX: [(f32, f32); 2] = [(90.0, 640.0), (730.0, 1280.0)];

/// Angles from the shadow boundary in degrees, and levels in dB re the free field.
const ANGLES_DEG: (f64, f64) = (-30.0, 60.0);
const LEVELS_DB: (f64, f64) = (-36.0, 6.0);

/// Bands drawn, and their colours.
const DRAWN: [(usize, Colour); 4] = [
    (0, Colour(36, 104, 196)),
    (2, Colour(20, 142, 96)),
    (4, Colour(232, 120, 16)),
    (7, Colour(208, 26, 48)),
];

/// Draws the level that paths give a listener who walks around a screen and around a corner, 5 m from the edge, and the
/// exact level of the incoming wave's side behind them.
///
/// # Errors
/// As committing a scene and making a canvas.
pub fn draw_edge_figure() -> Result<Canvas> {
    let mut canvas = Canvas::new(SIZE_PX.x as usize, SIZE_PX.y as usize)?;
    canvas.text(
        vec2(PANELS_PX[0].0, 30.0),
        Align::Left,
        Font::Title,
        Colour::INK,
        "Level behind an edge, source and listener 5 m from it",
    );
    canvas.text(
        vec2(PANELS_PX[0].0, 58.0),
        Align::Left,
        Font::Label,
        Colour::TEXT,
        "broad and pale: exact solution, integrated; dark and thin: sum of all paths of the propagator",
    );
    let cases = [
        ("thin screen (n = 2)", 2.0, 0.5 * PI),
        ("right-angled corner (n = 1.5)", 1.5, 0.25 * PI),
    ];
    for ((name, n, incoming), across) in cases.into_iter().zip(PANELS_PX) {
        draw_panel(&mut canvas, name, EdgeScene::new(n, incoming)?, across);
    }
    for (row, (band, colour)) in DRAWN.into_iter().enumerate() {
        let at = vec2(1296.0, TOP_PX + 20.0 + 26.0 * row as f32);
        canvas.line(at, at + vec2(22.0, 0.0), 3.0, colour, 1.0);
        let text = hz_text(CENTRES_HZ[band].round());
        canvas.text(
            at + vec2(28.0, 0.0),
            Align::Left,
            Font::Small,
            Colour::TEXT,
            &text,
        );
    }
    Ok(canvas)
}

fn draw_panel(canvas: &mut Canvas, name: &str, mut scene: EdgeScene, (left, right): (f32, f32)) {
    let x = |deg: f64| {
        let share = (deg - ANGLES_DEG.0) / (ANGLES_DEG.1 - ANGLES_DEG.0);
        left + share as f32 * (right - left)
    };
    let y = |db: f64| {
        let share =
            (db.clamp(LEVELS_DB.0, LEVELS_DB.1) - LEVELS_DB.0) / (LEVELS_DB.1 - LEVELS_DB.0);
        BOTTOM_PX - share as f32 * (BOTTOM_PX - TOP_PX)
    };
    canvas.text(
        vec2(left, TOP_PX - 18.0),
        Align::Left,
        Font::Bold,
        Colour::INK,
        name,
    );
    canvas.frame(vec2(left, TOP_PX), vec2(right, BOTTOM_PX), Colour::AXIS);
    for db in ticks(LEVELS_DB.0, LEVELS_DB.1, 8) {
        canvas.line(
            vec2(left, y(db)),
            vec2(right, y(db)),
            1.0,
            Colour::AXIS,
            0.25,
        );
        let at = vec2(left - 8.0, y(db));
        canvas.text(
            at,
            Align::Right,
            Font::Small,
            Colour::TEXT,
            &tick_text(db, 1.0),
        );
    }
    for deg in ticks(ANGLES_DEG.0, ANGLES_DEG.1, 9) {
        let at = vec2(x(deg), BOTTOM_PX + 16.0);
        canvas.text(
            at,
            Align::Centre,
            Font::Small,
            Colour::TEXT,
            &tick_text(deg, 1.0),
        );
    }
    let foot = vec2(0.5 * (left + right), BOTTOM_PX + 44.0);
    let label = "degrees beyond the shadow boundary";
    canvas.text(foot, Align::Centre, Font::Label, Colour::TEXT, label);
    canvas.text_up(
        vec2(left - 52.0, 0.5 * (TOP_PX + BOTTOM_PX)),
        Font::Label,
        Colour::TEXT,
        "dB re free field",
    );
    canvas.dashed_line(
        vec2(x(0.0), TOP_PX),
        vec2(x(0.0), BOTTOM_PX),
        1.0,
        [5.0, 5.0],
        Colour::AXIS,
    );
    let incoming = scene.wedge(0.0).angles[0];
    let (mut exact, mut ours) = (vec![Vec::new(); BANDS], vec![Vec::new(); BANDS]);
    for step in 0..=360 {
        // No step on the boundary itself, where a ray sees or does not.
        let deg = ANGLES_DEG.0 + 0.25 * f64::from(step) + 0.01;
        let outgoing = incoming + PI + deg.to_radians();
        if outgoing > scene.n * PI {
            break;
        }
        let direct_m = scene.wedge(outgoing).direct_m();
        let level = scene.level(outgoing, false);
        for b in 0..BANDS {
            let db = |size: f64| 20.0 * (size * direct_m).max(1e-9).log10();
            exact[b].push(vec2(x(deg), y(db(scene.exact(outgoing, b)))));
            ours[b].push(vec2(x(deg), y(db(level[b]))));
        }
    }
    for (band, colour) in DRAWN {
        canvas.polyline(&exact[band], 6.0, colour, 0.3);
    }
    for (band, colour) in DRAWN {
        canvas.polyline(&ours[band], 1.4, colour.mixed(Colour::INK, 0.3), 1.0);
    }
}
