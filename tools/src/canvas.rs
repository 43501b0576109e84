//! A small picture to draw on, with soft edges, written as PNG.
//!
//! Coordinates are pixels from the top left corner; whole numbers are pixel corners, so the first pixel's centre is
//! (0.5, 0.5). What lies outside is left out. Text is in [`super::lettering`].

use std::ops::Range;
use std::path::Path;

use glam::{Vec2, vec2};

use super::colormap::Colour;
use foresound::output::WholeFile;
use foresound::{Error, Result};

/// Largest width and height, in pixels.
const MAX_SIDE: usize = 16_384;

/// An RGB picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Canvas {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Canvas {
    /// A white picture of a width and height in pixels.
    ///
    /// # Errors
    /// [`Error::Setting`] if a side is zero or above 16,384.
    pub fn new(width: usize, height: usize) -> Result<Self> {
        if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
            return Err(Error::setting(
                "picture",
                format!("{width} by {height} pixels"),
                "choose sides of 1 to 16384 pixels",
            ));
        }
        let rgb = vec![255; width * height * 3];
        Ok(Self { width, height, rgb })
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The colour of a pixel; white outside.
    pub fn pixel(&self, x: usize, y: usize) -> Colour {
        if x >= self.width || y >= self.height {
            return Colour::WHITE;
        }
        let at = (y * self.width + x) * 3;
        Colour(self.rgb[at], self.rgb[at + 1], self.rgb[at + 2])
    }

    /// Covers a pixel with a share (0 … 1) of a colour.
    pub fn blend(&mut self, x: i64, y: i64, colour: Colour, share: f32) {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else {
            return;
        };
        if x >= self.width || y >= self.height || share <= 0.0 {
            return;
        }
        let Colour(r, g, b) = self.pixel(x, y).mixed(colour, share);
        let at = (y * self.width + x) * 3;
        self.rgb[at..at + 3].copy_from_slice(&[r, g, b]);
    }

    /// Fills a rectangle from one corner to the opposite one, with soft edges where they cut pixels.
    pub fn fill_rect(&mut self, from: Vec2, to: Vec2, colour: Colour, share: f32) {
        let (low, high) = (from.min(to), from.max(to));
        let cover = |pixel: i64, low: f32, high: f32| {
            let pixel = pixel as f32;
            (high.min(pixel + 1.0) - low.max(pixel)).clamp(0.0, 1.0)
        };
        for y in self.rows(low.y, high.y) {
            let down = cover(y, low.y, high.y);
            for x in self.columns(low.x, high.x) {
                self.blend(x, y, colour, share * down * cover(x, low.x, high.x));
            }
        }
    }

    /// Outlines a rectangle, one pixel wide, on the pixels just inside.
    pub fn frame(&mut self, from: Vec2, to: Vec2, colour: Colour) {
        let (low, high) = (from.min(to).round(), from.max(to).round());
        self.fill_rect(low, vec2(high.x, low.y + 1.0), colour, 1.0);
        self.fill_rect(vec2(low.x, high.y - 1.0), high, colour, 1.0);
        self.fill_rect(
            vec2(low.x, low.y + 1.0),
            vec2(low.x + 1.0, high.y - 1.0),
            colour,
            1.0,
        );
        self.fill_rect(
            vec2(high.x - 1.0, low.y + 1.0),
            vec2(high.x, high.y - 1.0),
            colour,
            1.0,
        );
    }

    /// Draws a straight line with round ends.
    pub fn line(&mut self, from: Vec2, to: Vec2, width_px: f32, colour: Colour, share: f32) {
        let size = (self.width, self.height);
        line_cover(size, from, to, width_px, |x, y, cover| {
            self.blend(x as i64, y as i64, colour, share * cover);
        });
    }

    /// Draws a line of dashes: `on_px` drawn, `off_px` left out.
    pub fn dashed_line(
        &mut self,
        from: Vec2,
        to: Vec2,
        width_px: f32,
        dash: [f32; 2],
        colour: Colour,
    ) {
        let (length, [on_px, off_px]) = (from.distance(to), dash);
        let period = (on_px + off_px).max(1.0);
        for k in 0..(length / period).ceil().min(MAX_SIDE as f32) as usize {
            let start = k as f32 * period;
            let end = (start + on_px).min(length);
            let at = |s: f32| from + (to - from) * (s / length);
            self.line(at(start), at(end), width_px, colour, 1.0);
        }
    }

    /// Draws straight lines from point to point.
    pub fn polyline(&mut self, points: &[Vec2], width_px: f32, colour: Colour, share: f32) {
        for pair in points.windows(2) {
            self.line(pair[0], pair[1], width_px, colour, share);
        }
    }

    /// Fills a circle.
    pub fn fill_circle(&mut self, centre: Vec2, radius_px: f32, colour: Colour) {
        self.line(centre, centre, 2.0 * radius_px, colour, 1.0);
    }

    /// Fills a polygon, inside by the even-odd rule, with soft edges.
    pub fn fill_polygon(&mut self, corners: &[Vec2], colour: Colour, share: f32) {
        /// Lines a pixel row is cut into; coverage along a line is exact.
        const LINES: usize = 5;
        if corners.iter().any(|c| !c.is_finite()) {
            return;
        }
        let bounds = |pick: fn(&Vec2) -> f32| {
            let values = corners.iter().map(pick);
            values.fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(v), h.max(v)))
        };
        let ((left, right), (top, bottom)) = (bounds(|c| c.x), bounds(|c| c.y));
        for y in self.rows(top, bottom) {
            let columns = self.columns(left, right);
            let mut cover = vec![0.0f32; columns.clone().count()];
            for line in 0..LINES {
                let level = y as f32 + (line as f32 + 0.5) / LINES as f32;
                for span in crossings(corners, level).chunks_exact(2) {
                    for (x, cover) in columns.clone().zip(&mut cover) {
                        let inside = span[1].min(x as f32 + 1.0) - span[0].max(x as f32);
                        *cover += inside.clamp(0.0, 1.0) / LINES as f32;
                    }
                }
            }
            for (x, cover) in columns.zip(cover) {
                self.blend(x, y, colour, share * cover);
            }
        }
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

    /// Pixel rows that touch an interval.
    fn rows(&self, low: f32, high: f32) -> Range<i64> {
        clipped(low, high, self.height)
    }

    /// Pixel columns that touch an interval.
    fn columns(&self, low: f32, high: f32) -> Range<i64> {
        clipped(low, high, self.width)
    }
}

/// Calls `covered` with column, row and share (0 … 1) of every pixel that a straight line with round ends covers in
/// a picture of a width and height.
pub(super) fn line_cover(
    size: (usize, usize),
    from: Vec2,
    to: Vec2,
    width_px: f32,
    mut covered: impl FnMut(usize, usize, f32),
) {
    if !from.is_finite() || !to.is_finite() {
        return;
    }
    let (along, reach) = (to - from, width_px / 2.0 + 0.5);
    let length_squared = along.length_squared();
    let (low, high) = (from.min(to) - reach, from.max(to) + reach);
    for y in clipped(low.y, high.y, size.1) {
        let centre_y = y as f32 + 0.5;
        // Only the stretch of the row that the line can reach is visited.
        let (mut left, mut right) = (low.x, high.x);
        if along.y.abs() > 1e-3 {
            let x = from.x + along.x * (centre_y - from.y) / along.y;
            let half = reach * length_squared.sqrt() / along.y.abs() + 1.0;
            left = left.max(x - half);
            right = right.min(x + half);
        }
        for x in clipped(left, right, size.0) {
            let centre = vec2(x as f32 + 0.5, centre_y);
            let place = (centre - from).dot(along) / length_squared.max(1e-12);
            let nearest = from + along * place.clamp(0.0, 1.0);
            let cover = (reach - centre.distance(nearest)).clamp(0.0, 1.0);
            if cover > 0.0 {
                covered(x as usize, y as usize, cover.min(width_px));
            }
        }
    }
}

fn clipped(low: f32, high: f32, side: usize) -> Range<i64> {
    let end = (high.ceil() as i64).min(side as i64);
    (low.floor() as i64).clamp(0, end.max(0))..end.max(0)
}

/// Where a polygon's outline crosses a level, from left to right.
fn crossings(corners: &[Vec2], level: f32) -> Vec<f32> {
    let next = corners.iter().cycle().skip(1);
    let mut crossings: Vec<f32> = corners
        .iter()
        .zip(next)
        .filter(|(a, b)| (a.y <= level) != (b.y <= level))
        .map(|(a, b)| a.x + (b.x - a.x) * (level - a.y) / (b.y - a.y))
        .collect();
    crossings.sort_by(f32::total_cmp);
    crossings
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum of darkness of black ink on white, in pixels.
    fn ink(canvas: &Canvas) -> f32 {
        canvas.rgb.iter().map(|&c| f32::from(255 - c) / 765.0).sum()
    }

    const BLACK: Colour = Colour(0, 0, 0);

    #[test]
    fn covered_area_is_the_shape_s_area() {
        type Draw = fn(&mut Canvas);
        let shapes: [(Draw, f32); 4] = [
            (
                |c| c.fill_rect(vec2(3.3, 4.1), vec2(20.8, 9.6), BLACK, 1.0),
                17.5 * 5.5,
            ),
            (|c| c.fill_circle(vec2(25.2, 25.7), 10.0, BLACK), 314.2),
            (
                |c| {
                    c.fill_polygon(
                        &[vec2(2.0, 3.0), vec2(40.0, 8.0), vec2(11.0, 41.0)],
                        BLACK,
                        1.0,
                    )
                },
                // Half the cross product of two sides.
                0.5 * (38.0 * 38.0 - 5.0 * 9.0),
            ),
            (
                |c| c.line(vec2(5.0, 7.0), vec2(35.0, 47.0), 3.0, BLACK, 1.0),
                150.0 + 7.07,
            ),
        ];
        for (index, (draw, area)) in shapes.into_iter().enumerate() {
            let mut canvas = Canvas::new(50, 60).unwrap();
            draw(&mut canvas);
            let found = ink(&canvas);
            assert!(
                (found / area - 1.0).abs() < 0.01,
                "shape {index}: {found} for {area}"
            );
        }
    }

    #[test]
    fn thin_lines_are_pale_and_shares_are_kept() {
        let mut canvas = Canvas::new(40, 40).unwrap();
        canvas.line(vec2(5.0, 20.5), vec2(35.0, 20.5), 0.5, BLACK, 1.0);
        assert!((canvas.pixel(20, 20).0).abs_diff(128) < 3);
        let mut canvas = Canvas::new(40, 40).unwrap();
        canvas.line(vec2(5.0, 20.5), vec2(35.0, 20.5), 3.0, BLACK, 0.5);
        assert!((canvas.pixel(20, 20).0).abs_diff(128) < 3);
    }

    #[test]
    fn drawing_outside_changes_nothing() {
        let mut canvas = Canvas::new(10, 10).unwrap();
        let blank = canvas.clone();
        canvas.line(vec2(-50.0, -5.0), vec2(-3.0, 90.0), 4.0, BLACK, 1.0);
        canvas.fill_rect(vec2(11.0, 11.0), vec2(1e9, 1e9), BLACK, 1.0);
        canvas.fill_polygon(
            &[vec2(-9.0, -9.0), vec2(-2.0, -9.0), vec2(-2.0, -2.0)],
            BLACK,
            1.0,
        );
        canvas.line(vec2(f32::NAN, 0.0), vec2(5.0, 5.0), 1.0, BLACK, 1.0);
        canvas.blend(-1, 3, BLACK, 1.0);
        assert_eq!(canvas, blank);
        canvas.frame(vec2(0.0, 0.0), vec2(10.0, 10.0), BLACK);
        assert!((ink(&canvas) - 36.0).abs() < 1e-3);
    }

    #[test]
    fn png_comes_back_pixel_for_pixel() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("figures/a.png");
        let mut canvas = Canvas::new(31, 17).unwrap();
        canvas.fill_circle(vec2(12.0, 8.0), 6.0, Colour(200, 30, 90));
        canvas.save_png(&path).unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut rgb = vec![0; 31 * 17 * 3];
        reader.next_frame(&mut rgb).unwrap();
        assert_eq!(rgb, canvas.rgb);
        assert!(canvas.save_png(folder.path()).is_err());
        assert!(Canvas::new(0, 5).is_err());
    }
}
