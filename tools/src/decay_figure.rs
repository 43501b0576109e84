//! A picture of decay curves: the energy that is still to come, in each band and altogether.

use plotters::prelude::*;

use super::chart::{
    Area, Axes, Drawn, INK, Picture, Ticked, draw_title, hz_text, legend, mixed, px, sequential,
};
use super::room_parameters::{DECAY_STEP_S, RoomParameters};
use foresound::acoustics::bands::{BANDS, NOMINAL_HZ};
use foresound::error::Result;

/// Levels drawn, in dB re all energy.
const LEVELS_DB: (f64, f64) = (-70.0, 0.0);

/// Draws the decay curves of a response: bands in colours, the whole response in black.
///
/// # Errors
/// Those of drawing.
pub fn draw_decay_figure(parameters: &RoomParameters) -> Result<Picture> {
    let curves: Vec<Vec<(f64, f64)>> = parameters.decays_db.iter().map(|c| points(c)).collect();
    let last_s = curves.iter().filter_map(|curve| Some(curve.last()?.0));
    let last_s = last_s.fold(DECAY_STEP_S, f64::max);
    Picture::draw(1000, 640, |area| {
        let caption = "black: all bands together; reverberation times are slopes of these curves";
        draw_title(area, px(76.0), "Decay of the energy still to come", caption)?;
        let names = NOMINAL_HZ.map(|hz| hz_text(f64::from(hz)));
        let colours = (0..BANDS).map(colour);
        let entries: Vec<(String, RGBColor)> = names.into_iter().zip(colours).collect();
        legend(area, (px(76.0), px(84.0)), &entries)?;
        let (_, below) = area.split_vertically(px(104.0));
        draw_curves(&below, &curves, last_s)
    })
}

/// A band's colour.
fn colour(band: usize) -> RGBColor {
    let RGBColor(r, g, b) = sequential().get_color(0.15 + 0.75 * band as f32 / (BANDS - 1) as f32);
    RGBColor(r, g, b)
}

/// Times in seconds and levels, as far as they are drawn.
fn points(decay_db: &[f64]) -> Vec<(f64, f64)> {
    let points = decay_db.iter().enumerate();
    let points = points.map(|(step, level_db)| (step as f64 * DECAY_STEP_S, *level_db));
    points
        .take_while(|(_, level_db)| *level_db >= LEVELS_DB.0)
        .collect()
}

fn draw_curves(area: &Area<'_>, curves: &[Vec<(f64, f64)>], last_s: f64) -> Drawn {
    let step_s = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0];
    let step_s = step_s
        .into_iter()
        .find(|step| last_s / step <= 12.0)
        .unwrap_or(20.0);
    let count = (last_s / step_s).ceil() as usize;
    let ticks = (0..=count).map(|n| n as f64 * step_s);
    let mut chart = Axes {
        title: "",
        x: Ticked {
            range: 0.0..count as f64 * step_s,
            ticks: ticks.map(|s| (s, format!("{s:.1}"))).collect(),
        },
        y: LEVELS_DB.0..LEVELS_DB.1,
        y_text: &|db| format!("{db:.0}"),
        names: ["seconds after the first sound", "dB re all energy"],
    }
    .draw(area)?;
    for (index, curve) in curves.iter().enumerate() {
        let style = match index {
            BANDS => INK.stroke_width(px(3.0) as u32),
            band => mixed(colour(band), INK, 0.1).stroke_width(px(2.0) as u32),
        };
        chart.draw_series(LineSeries::new(curve.iter().copied(), style))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::room_parameters::room_parameters;

    #[test]
    fn a_decay_and_a_silence_have_pictures() {
        let decay: Vec<f32> = (0..48_000)
            .map(|n| {
                if n % 7 == 0 {
                    10f32.powf(-3.0 * n as f32 / 24_000.0)
                } else {
                    0.0
                }
            })
            .collect();
        for response in [&decay[..], &[0.0; 4800]] {
            let parameters = room_parameters(response, 48_000);
            assert!(draw_decay_figure(&parameters).is_ok());
        }
    }
}
