//! Values over time and frequency as colours, with axes and a colour bar.

use std::ops::Range;

use plotters::prelude::*;

use super::chart::{AXIS, Area, Drawn, Ticked, axis_style, bold_style, frame, hz_text, px};
use super::mel::mel_of_hz;

/// From an area's left edge to its map, and from the map to the area's right edge, in pixels.
pub const LEFT_PX: f32 = 104.0;
/// Room for the colour bar and its labels, in pixels.
pub const RIGHT_PX: f32 = 118.0;
/// Room for the label above the map, and for the time axis below, in pixels.
pub const ABOVE_PX: f32 = 28.0;
/// Room for the time axis, in pixels.
pub const BELOW_PX: f32 = 46.0;
/// Labelled frequencies in Hz.
const TICKS_HZ: [f64; 7] = [250.0, 500.0, 1e3, 2e3, 4e3, 8e3, 16e3];

/// A map of values over time (to the right) and frequency (upwards).
pub struct MelMap<'a> {
    /// Label above the map.
    pub label: &'a str,
    /// Seconds shown.
    pub duration_s: f64,
    /// Frequencies shown, on the mel scale.
    pub mels: Range<f64>,
    /// Values at the ends of the colour bar.
    pub range: Range<f64>,
    /// Text of a value at the colour bar.
    pub text: &'a dyn Fn(&f64) -> String,
    /// Colours from the range's start to its end.
    pub colours: &'a DerivedColorMap<RGBColor>,
    /// Value at a time in seconds and a frequency in mel.
    pub value: &'a dyn Fn(f64, f64) -> f64,
}

impl MelMap<'_> {
    /// Draws the map into an area.
    ///
    /// # Errors
    /// Those of drawing.
    pub fn draw(&self, area: &Area<'_>) -> Drawn {
        let label = bold_style();
        area.draw(&Text::new(self.label, (px(LEFT_PX), px(6.0)), label))?;
        let (left, right) = area.split_horizontally(area.dim_in_pixel().0 as i32 - px(RIGHT_PX));
        let ticks = TICKS_HZ.map(|hz| (mel_of_hz(hz), hz_text(hz))).into_iter();
        let mels = Ticked {
            range: self.mels.clone(),
            ticks: ticks.filter(|(mel, _)| self.mels.contains(mel)).collect(),
        };
        let mut chart = ChartBuilder::on(&left)
            .margin_top(px(ABOVE_PX))
            .x_label_area_size(px(BELOW_PX))
            .margin_left(px(16.0))
            .y_label_area_size(px(LEFT_PX) - px(16.0))
            .build_cartesian_2d(0.0..self.duration_s, mels)?;
        let surface = chart.plotting_area().strip_coord_spec();
        let (width, height) = surface.dim_in_pixel();
        let share = |at: u32, side: u32| (f64::from(at) + 0.5) / f64::from(side);
        let between =
            |range: &Range<f64>, share: f64| range.start + share * (range.end - range.start);
        for (x, y) in (0..width).flat_map(|x| (0..height).map(move |y| (x, y))) {
            let mel = between(&self.mels, 1.0 - share(y, height));
            let value = (self.value)(share(x, width) * self.duration_s, mel);
            surface.draw_pixel((x as i32, y as i32), &self.colour(value))?;
        }
        chart
            .configure_mesh()
            .disable_mesh()
            .x_labels(12)
            .axis_style(AXIS)
            .label_style(axis_style())
            .axis_desc_style(axis_style())
            .x_label_formatter(&|time_s| format!("{}", (100.0 * time_s).round() / 100.0))
            .x_desc("time (s)")
            .y_desc("frequency (mel)")
            .draw()?;
        frame(&surface)?;
        let mut bar = ChartBuilder::on(&right)
            .margin_top(px(ABOVE_PX))
            .margin_bottom(px(BELOW_PX))
            .margin_left(px(24.0))
            .right_y_label_area_size(px(70.0))
            .build_cartesian_2d(0.0..1.0, self.range.clone())?;
        let surface = bar.plotting_area().strip_coord_spec();
        let (width, height) = surface.dim_in_pixel();
        for y in 0..height {
            let colour = self.colour(between(&self.range, 1.0 - share(y, height)));
            let ends = [(0, y as i32), (width as i32, y as i32 + 1)];
            surface.draw(&Rectangle::new(ends, colour.filled()))?;
        }
        frame(&surface)?;
        bar.configure_mesh()
            .disable_mesh()
            .disable_x_axis()
            .y_labels(5)
            .set_tick_mark_size(LabelAreaPosition::Right, px(8.0))
            .axis_style(AXIS)
            .label_style(axis_style())
            .y_label_formatter(self.text)
            .draw()
    }

    #[expect(clippy::manual_clamp, reason = "`clamp` keeps NaN")]
    fn colour(&self, value: f64) -> RGBColor {
        let share = (value - self.range.start) / (self.range.end - self.range.start);
        // A value that is not finite counts as the range's start.
        self.colours.get_color(share.max(0.0).min(1.0))
    }
}
