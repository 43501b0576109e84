//! Pictures drawn with `plotters`, with shared fonts, colours and axis texts.
//!
//! `plotters` draws broad lines with hard edges, so everything is drawn [`FINENESS`] times as large and averaged down.
//! Drawing coordinates are these finer pixels; [`px`] converts to them.

use std::ops::Range;
use std::path::Path;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font, text_anchor::*};

use foresound::output::WholeFile;
use foresound::{Error, Result};

/// Fine pixels along the side of a pixel.
pub const FINENESS: usize = 2;

/// Largest width and height, in pixels.
const MAX_SIDE: usize = 16_384;

/// Titles.
pub const INK: RGBColor = RGBColor(28, 32, 40);
/// Labels and captions.
pub const TEXT: RGBColor = RGBColor(70, 76, 88);
/// Axes and frames.
pub const AXIS: RGBColor = RGBColor(150, 156, 166);

/// Font sizes in pixels: tick labels, labels and captions, titles.
pub const SMALL: f32 = 13.0;
/// Labels, legends and captions.
pub const LABEL: f32 = 15.0;
/// Titles.
pub const TITLE: f32 = 19.0;

/// The drawing area of a picture.
pub type Area<'a> = DrawingArea<BitMapBackend<'a>, Shift>;
/// A chart with its axes.
pub type Chart<'a> = ChartContext<'a, BitMapBackend<'a>, Cartesian2d<Ticked, RangedCoordf64>>;
/// Errors of drawing.
pub type DrawError = DrawingAreaErrorKind<<BitMapBackend<'static> as DrawingBackend>::ErrorType>;
/// Result of drawing.
pub type Drawn = std::result::Result<(), DrawError>;

/// Pixels in fine pixels.
pub fn px(pixels: f32) -> i32 {
    (pixels * FINENESS as f32).round() as i32
}

/// An RGB picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

/// The family of the built-in fonts, which the first call registers.
fn font_family() -> &'static str {
    static FONTS: Once = Once::new();
    FONTS.call_once(|| {
        for (style, font) in [
            (FontStyle::Normal, dejavu::sans::regular()),
            (FontStyle::Bold, dejavu::sans::bold()),
        ] {
            // Both files are part of the program; a broken one is an error of drawing.
            let _ = register_font("sans-serif", style, font);
        }
    });
    "sans-serif"
}

impl Picture {
    /// A white picture of a width and height in pixels, drawn on by `draw`.
    ///
    /// # Errors
    /// [`Error::Setting`] if a side is zero or above 16,384, or if drawing fails.
    pub fn draw(
        width: usize,
        height: usize,
        draw: impl FnOnce(&Area<'_>) -> Drawn,
    ) -> Result<Self> {
        let fault = |problem: String| {
            Error::setting("picture", problem, "choose sides of 1 to 16384 pixels")
        };
        if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
            return Err(fault(format!("{width} by {height} pixels")));
        }
        let fine = [width * FINENESS, height * FINENESS];
        let mut rgb = vec![255; fine[0] * fine[1] * 3];
        {
            // Sides are at most MAX_SIDE times FINENESS.
            let size = (fine[0] as u32, fine[1] as u32);
            let area = BitMapBackend::with_buffer(&mut rgb, size).into_drawing_area();
            draw(&area).map_err(|error| fault(error.to_string()))?;
        }
        let mean = |index: usize| {
            let (pixel, channel) = (index / 3, index % 3);
            let corner = pixel / width * FINENESS * fine[0] + pixel % width * FINENESS;
            let fine_pixels =
                (0..FINENESS * FINENESS).map(|k| corner + k / FINENESS * fine[0] + k % FINENESS);
            let sum: usize = fine_pixels
                .map(|at| usize::from(rgb[3 * at + channel]))
                .sum();
            ((sum + FINENESS * FINENESS / 2) / (FINENESS * FINENESS)) as u8
        };
        let rgb = (0..width * height * 3).map(mean).collect();
        Ok(Self { width, height, rgb })
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The colour of a pixel.
    ///
    /// # Panics
    /// If the pixel lies outside.
    pub fn pixel(&self, x: usize, y: usize) -> RGBColor {
        let at = (y * self.width + x) * 3;
        RGBColor(self.rgb[at], self.rgb[at + 1], self.rgb[at + 2])
    }

    /// Writes the picture as PNG; the file is whole or absent.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be written.
    pub fn save_png(&self, path: impl AsRef<Path>) -> Result<()> {
        WholeFile::write(path, |out| {
            // Sides are at most MAX_SIDE.
            let mut encoder = png::Encoder::new(out, self.width as u32, self.height as u32);
            encoder.set_color(png::ColorType::Rgb);
            encoder.set_depth(png::BitDepth::Eight);
            encoder.set_compression(png::Compression::High);
            let mut writer = encoder.write_header()?;
            writer.write_image_data(&self.rgb)?;
            writer.finish()?;
            Ok(())
        })
    }
}

/// Text of a size in pixels, vertically centred on its point.
pub fn text_style(size: f32, colour: RGBColor, align: HPos) -> TextStyle<'static> {
    let font = (font_family(), px(size)).into_font();
    font.color(&colour).pos(Pos::new(align, VPos::Center))
}

/// Text at the axes of a chart, which `plotters` aligns.
pub fn axis_style() -> TextStyle<'static> {
    (font_family(), px(SMALL)).into_font().color(&TEXT)
}

/// Bold text for the label above a chart.
pub fn bold_style() -> TextStyle<'static> {
    let font = (font_family(), px(LABEL), FontStyle::Bold).into_font();
    font.color(&INK).pos(Pos::new(HPos::Left, VPos::Center))
}

/// Draws the title and the caption at the top of a picture.
pub fn draw_title(area: &Area<'_>, left: i32, title: &str, caption: &str) -> Drawn {
    let style = text_style(TITLE, INK, HPos::Left);
    area.draw(&Text::new(title, (left, px(28.0)), style))?;
    let style = text_style(LABEL, TEXT, HPos::Left);
    area.draw(&Text::new(caption, (left, px(56.0)), style))
}

/// Mix of two colours: 0 is the first, 1 the second. In sRGB values, as screens blend.
pub fn mixed(from: RGBColor, to: RGBColor, share: f32) -> RGBColor {
    let share = share.clamp(0.0, 1.0);
    let mix = |a: u8, b: u8| (f32::from(a) + (f32::from(b) - f32::from(a)) * share).round() as u8;
    RGBColor(mix(from.0, to.0), mix(from.1, to.1), mix(from.2, to.2))
}

/// Dark to light, for levels.
pub fn sequential() -> DerivedColorMap<RGBColor> {
    DerivedColorMap::new(&[
        RGBColor(10, 8, 28),
        RGBColor(52, 22, 98),
        RGBColor(122, 36, 122),
        RGBColor(200, 60, 98),
        RGBColor(244, 124, 72),
        RGBColor(253, 196, 102),
        RGBColor(253, 247, 205),
    ])
}

/// Blue (less) over white (equal) to red (more), for differences.
pub fn diverging() -> DerivedColorMap<RGBColor> {
    DerivedColorMap::new(&[
        RGBColor(18, 52, 122),
        RGBColor(64, 122, 196),
        RGBColor(170, 205, 232),
        RGBColor(250, 250, 250),
        RGBColor(244, 190, 168),
        RGBColor(208, 84, 72),
        RGBColor(118, 14, 38),
    ])
}

/// Draws a rectangle's outline on the rim of an area.
pub fn frame(area: &Area<'_>) -> Drawn {
    let (width, height) = area.dim_in_pixel();
    let corner = (width as i32 - 1, height as i32 - 1);
    area.draw(&Rectangle::new([(0, 0), corner], AXIS.stroke_width(1)))
}

/// A range with labels at given values.
#[derive(Debug, Clone)]
pub struct Ticked {
    /// The range.
    pub range: Range<f64>,
    /// Labelled values and their texts.
    pub ticks: Vec<(f64, String)>,
}

impl Ranged for Ticked {
    type ValueType = f64;
    type FormatOption = NoDefaultFormatting;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        RangedCoordf64::from(self.range.clone()).map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, _hint: Hint) -> Vec<f64> {
        self.ticks.iter().map(|tick| tick.0).collect()
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl ValueFormatter<f64> for Ticked {
    fn format_ext(&self, value: &f64) -> String {
        let tick = self.ticks.iter().find(|tick| tick.0 == *value);
        tick.map_or(String::new(), |tick| tick.1.clone())
    }
}

/// Axes of a chart: a title above, a frame, and grid lines at the labels.
pub struct Axes<'a> {
    /// Title above the chart.
    pub title: &'a str,
    /// Range from left to right.
    pub x: Ticked,
    /// Range from bottom to top.
    pub y: Range<f64>,
    /// Text of a value of the vertical axis.
    pub y_text: &'a dyn Fn(&f64) -> String,
    /// Description of the axes.
    pub names: [&'a str; 2],
}

impl Axes<'_> {
    /// Draws the axes and returns the chart for its curves.
    ///
    /// # Errors
    /// Those of drawing.
    pub fn draw<'a>(&self, area: &Area<'a>) -> std::result::Result<Chart<'a>, DrawError> {
        area.draw(&Text::new(self.title, (px(76.0), px(14.0)), bold_style()))?;
        let mut chart = ChartBuilder::on(area)
            .margin_top(px(28.0))
            .margin_right(px(16.0))
            .margin_left(px(16.0))
            .x_label_area_size(px(46.0))
            .y_label_area_size(px(60.0))
            .build_cartesian_2d(self.x.clone(), self.y.clone())?;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .max_light_lines(0)
            .bold_line_style(AXIS.mix(0.3))
            .axis_style(AXIS)
            .label_style(axis_style())
            .axis_desc_style(axis_style())
            .y_label_formatter(self.y_text)
            .x_desc(self.names[0])
            .y_desc(self.names[1])
            .draw()?;
        frame(&chart.plotting_area().strip_coord_spec())?;
        Ok(chart)
    }
}

/// Draws a legend of coloured lines with their names, from left to right, at a height.
pub fn legend(area: &Area<'_>, at: (i32, i32), entries: &[(String, RGBColor)]) -> Drawn {
    let mut x = at.0;
    for (text, colour) in entries {
        let ends = vec![(x, at.1), (x + px(26.0), at.1)];
        area.draw(&PathElement::new(ends, colour.stroke_width(px(3.0) as u32)))?;
        x += px(34.0);
        let style = text_style(LABEL, TEXT, HPos::Left);
        area.draw(&Text::new(text.as_str(), (x, at.1), style.clone()))?;
        x += area.estimate_text_size(text, &style)?.0 as i32 + px(26.0);
    }
    Ok(())
}

/// A frequency in Hz, or in kHz from 1000 Hz on.
pub fn hz_text(hz: f64) -> String {
    if hz >= 1000.0 {
        format!("{} kHz", hz / 1000.0)
    } else {
        format!("{hz} Hz")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn png_round_trip_preserves_every_pixel() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("figures/a.png");
        let disc = RGBColor(200, 30, 90);
        let picture = Picture::draw(31, 17, |area| {
            area.draw(&Circle::new((px(12.0), px(8.0)), px(6.0), disc.filled()))
        })
        .unwrap();
        assert_eq!(picture.pixel(12, 8), disc);
        assert_eq!(picture.pixel(30, 16), WHITE);
        picture.save_png(&path).unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut rgb = vec![0; 31 * 17 * 3];
        reader.next_frame(&mut rgb).unwrap();
        assert_eq!(rgb, picture.rgb);
        assert!(picture.save_png(folder.path()).is_err());
        assert!(Picture::draw(0, 5, |_| Ok(())).is_err());
    }

    #[test]
    fn text_is_drawn_with_the_built_in_fonts() {
        for style in [bold_style(), text_style(LABEL, INK, HPos::Left)] {
            let picture = Picture::draw(200, 40, |area| {
                area.draw(&Text::new("Level 12 dB", (px(10.0), px(20.0)), style))
            })
            .unwrap();
            let dark = (0..200 * 40).filter(|i| picture.pixel(i % 200, i / 200).0 < 128);
            assert!(dark.count() > 100);
        }
    }
}
