//! Pictures of the late field's laws: reverberation time by band beside Eyring's, and the response where discrete paths
//! and tail join.

use std::path::{Path, PathBuf};

use glam::{Vec2, vec2};

use super::{decay, joining};
use crate::axis::{hz_text, round_step, tick_text, ticks};
use crate::canvas::Canvas;
use crate::colormap::Colour;
use crate::lettering::{Align, Font};
use foresound::acoustics::BANDS;
use foresound::error::Result;

/// Colours that stay apart in grey and for the colour-blind (\[OKABE08\]).
const TOLD: Colour = Colour(0, 114, 178);
const TRUTH: Colour = Colour(28, 32, 40);
const PATHS: Colour = Colour(230, 159, 0);
const TAIL: Colour = Colour(0, 158, 115);

/// Size of one chart in pixels.
const CHART: Vec2 = vec2(460.0, 320.0);

/// Band of the response's picture: 1 kHz.
const BAND: usize = 4;

/// Writes both pictures into a folder that is there; gives their files.
///
/// # Errors
/// Those of measuring and of writing.
pub fn write(folder: &Path) -> Result<Vec<PathBuf>> {
    Ok(vec![write_decay(folder)?, write_joining(folder)?])
}

fn write_decay(folder: &Path) -> Result<PathBuf> {
    let cases = decay::cases()?;
    let mut canvas = sheet(cases.len(), "T60 by band: propagation beside Eyring")?;
    for (place, case) in cases.iter().enumerate() {
        let most = case
            .told_s
            .iter()
            .chain(&case.eyring_s)
            .fold(0f32, |m, t| m.max(*t));
        let top = f64::from(most) * 1.15;
        let chart = Chart::new(place, (-0.4, 7.4), (0.0, top));
        chart.axes(&mut canvas, &case.name, "s", |chart, canvas| {
            for (b, hz) in [(0, 63.0), (2, 250.0), (4, 1000.0), (6, 4000.0)] {
                let at = chart.at(f64::from(b), 0.0) + vec2(0.0, 14.0);
                canvas.text(at, Align::Centre, Font::Small, Colour::TEXT, &hz_text(hz));
            }
        });
        let line = |values: &[f32; BANDS]| -> Vec<Vec2> {
            let points = values.iter().enumerate();
            points
                .map(|(b, t)| chart.at(b as f64, f64::from(*t)))
                .collect()
        };
        canvas.polyline(&line(&case.eyring_s), 2.0, TRUTH, 1.0);
        for point in line(&case.told_s) {
            canvas.fill_circle(point, 4.0, TOLD);
        }
    }
    legend(
        &mut canvas,
        &[("Eyring, with air", TRUTH), ("propagation", TOLD)],
    );
    let file = folder.join("decay.png");
    canvas.save_png(&file)?;
    Ok(file)
}

fn write_joining(folder: &Path) -> Result<PathBuf> {
    let cases = joining::cases()?;
    let mut canvas = sheet(
        cases.len(),
        "Energy in 40 ms at 1 kHz: discrete paths, tail and truth",
    )?;
    for (place, case) in cases.iter().enumerate() {
        let chart = Chart::new(
            place,
            (0.0, 1000.0 * joining::WINDOW_S * 16.0),
            (-60.0, 10.0),
        );
        let loudest = case.truth.iter().map(|e| e[BAND]).fold(1e-12, f64::max);
        chart.axes(&mut canvas, &case.name, "dB", |chart, canvas| {
            for ms in ticks(0.0, 600.0, 6) {
                let at = chart.at(ms, -60.0) + vec2(0.0, 14.0);
                canvas.text(
                    at,
                    Align::Centre,
                    Font::Small,
                    Colour::TEXT,
                    &tick_text(ms, 100.0),
                );
            }
        });
        let level = |energy: f64| (10.0 * (energy / loudest).max(1e-9).log10()).max(-60.0);
        let mut steps = |value: &dyn Fn(usize) -> f64, width: f32, colour: Colour| {
            let width_ms = 1000.0 * joining::WINDOW_S;
            let points: Vec<Vec2> = (0..joining::WINDOWS)
                .flat_map(|w| [w, w + 1].map(|edge| (edge, level(value(w)))))
                .map(|(edge, db)| chart.at(edge as f64 * width_ms, db))
                .collect();
            canvas.polyline(&points, width, colour, 1.0);
        };
        steps(&|w| case.truth[w][BAND], 4.0, TRUTH);
        steps(&|w| case.paths[w][BAND], 2.0, PATHS);
        steps(&|w| case.tail[w][BAND], 2.0, TAIL);
        steps(&|w| case.paths[w][BAND] + case.tail[w][BAND], 2.0, TOLD);
    }
    let entries = [
        ("truth", TRUTH),
        ("paths", PATHS),
        ("tail", TAIL),
        ("paths and tail", TOLD),
    ];
    legend(&mut canvas, &entries);
    let file = folder.join("joining.png");
    canvas.save_png(&file)?;
    Ok(file)
}

/// A canvas for so many charts, three in a row, with a title.
fn sheet(charts: usize, title: &str) -> Result<Canvas> {
    let rows = charts.div_ceil(3);
    let size = vec2(3.0 * CHART.x, 90.0 + rows as f32 * CHART.y);
    let mut canvas = Canvas::new(size.x as usize, size.y as usize)?;
    canvas.text(
        vec2(24.0, 26.0),
        Align::Left,
        Font::Title,
        Colour::INK,
        title,
    );
    Ok(canvas)
}

fn legend(canvas: &mut Canvas, entries: &[(&str, Colour)]) {
    let mut x = 24.0;
    for (text, colour) in entries {
        canvas.line(vec2(x, 58.0), vec2(x + 24.0, 58.0), 4.0, *colour, 1.0);
        canvas.text(
            vec2(x + 34.0, 58.0),
            Align::Left,
            Font::Label,
            Colour::TEXT,
            text,
        );
        x += 60.0 + Font::Label.width_px(text);
    }
}

/// One chart's place and ranges.
struct Chart {
    low: Vec2,
    high: Vec2,
    x: (f64, f64),
    y: (f64, f64),
}

impl Chart {
    fn new(place: usize, x: (f64, f64), y: (f64, f64)) -> Self {
        let corner = vec2(
            (place % 3) as f32 * CHART.x,
            80.0 + (place / 3) as f32 * CHART.y,
        );
        Self {
            low: corner + vec2(60.0, 34.0),
            high: corner + CHART - vec2(16.0, 40.0),
            x,
            y,
        }
    }

    fn at(&self, x: f64, y: f64) -> Vec2 {
        let share = |v: f64, (low, high): (f64, f64)| ((v - low) / (high - low)) as f32;
        let (right, up) = (share(x, self.x), share(y, self.y));
        let size = self.high - self.low;
        vec2(self.low.x + right * size.x, self.high.y - up * size.y)
    }

    fn axes(
        &self,
        canvas: &mut Canvas,
        title: &str,
        unit: &str,
        below: impl Fn(&Self, &mut Canvas),
    ) {
        canvas.frame(self.low, self.high, Colour::AXIS);
        let title_at = self.low - vec2(0.0, 14.0);
        canvas.text(title_at, Align::Left, Font::Small, Colour::INK, title);
        let step = round_step(self.y.1 - self.y.0, 6);
        for value in ticks(self.y.0, self.y.1, 6) {
            let at = self.at(self.x.0, value);
            canvas.line(at, vec2(self.high.x, at.y), 1.0, Colour::AXIS, 0.4);
            let text = format!("{} {unit}", tick_text(value, step));
            canvas.text(
                at - vec2(6.0, 0.0),
                Align::Right,
                Font::Small,
                Colour::TEXT,
                &text,
            );
        }
        below(self, canvas);
    }
}
