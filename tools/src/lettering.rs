//! Text on a [`Canvas`], in the fixed-width fonts of `embedded-graphics`.

use std::convert::Infallible;

use embedded_graphics::mono_font::{MonoFont, MonoTextStyle, iso_8859_1 as fonts};
use embedded_graphics::pixelcolor::BinaryColor;
use embedded_graphics::prelude::{DrawTarget, Drawable, OriginDimensions, Pixel, Point, Size};
use embedded_graphics::text::{Baseline, Text};
use glam::{Vec2, vec2};

use super::canvas::Canvas;
use super::colormap::Colour;

/// A font by its use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Font {
    /// Ticks in crowded places: 7 by 14 pixels a letter.
    Small,
    /// Labels, legends, captions: 9 by 18.
    Label,
    /// Labels that stand out: 9 by 18, bold.
    Bold,
    /// Titles: 10 by 20.
    Title,
}

impl Font {
    fn mono(self) -> &'static MonoFont<'static> {
        match self {
            Self::Small => &fonts::FONT_7X14,
            Self::Label => &fonts::FONT_9X18,
            Self::Bold => &fonts::FONT_9X18_BOLD,
            Self::Title => &fonts::FONT_10X20,
        }
    }

    /// Width of a letter in pixels, gap included.
    pub fn advance_px(self) -> f32 {
        let font = self.mono();
        (font.character_size.width + font.character_spacing) as f32
    }

    /// Height of a line in pixels.
    pub fn height_px(self) -> f32 {
        self.mono().character_size.height as f32
    }

    /// Width of a text in pixels.
    pub fn width_px(self, text: &str) -> f32 {
        spelled(text).chars().count() as f32 * self.advance_px()
    }

    /// The text, or as much of its beginning as fits a width, with three dots.
    pub fn fitted(self, text: &str, width_px: f32) -> String {
        let text = spelled(text);
        let room = (width_px / self.advance_px()).max(0.0) as usize;
        if text.chars().count() <= room {
            return text;
        }
        let start: String = text.chars().take(room.saturating_sub(3)).collect();
        format!("{}...", start.trim_end())
    }
}

/// Which part of a text lies at the point given for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// Its left end.
    Left,
    /// Its middle.
    Centre,
    /// Its right end.
    Right,
}

impl Canvas {
    /// Writes a line of text. The point is `align`'s end of it, at half its height.
    pub fn text(&mut self, at: Vec2, align: Align, font: Font, colour: Colour, text: &str) {
        let corner = corner(align, font, text);
        write(self, font, colour, text, |x, y| at + corner + vec2(x, y));
    }

    /// Writes a line of text that reads upwards. The point is its middle.
    pub fn text_up(&mut self, at: Vec2, font: Font, colour: Colour, text: &str) {
        let corner = corner(Align::Centre, font, text);
        write(self, font, colour, text, |x, y| {
            at + vec2(corner.y + y, -corner.x - x - 1.0)
        });
    }

    /// Writes a line of text with a white rim, for busy grounds.
    pub fn text_on_ground(
        &mut self,
        at: Vec2,
        align: Align,
        font: Font,
        colour: Colour,
        text: &str,
    ) {
        for (dx, dy) in [
            (-2, 0),
            (2, 0),
            (0, -2),
            (0, 2),
            (-1, -1),
            (1, -1),
            (-1, 1),
            (1, 1),
        ] {
            let beside = at + vec2(dx as f32, dy as f32);
            self.text(beside, align, font, Colour::WHITE, text);
        }
        self.text(at, align, font, colour, text);
    }
}

/// From the given point to the text's top left corner.
fn corner(align: Align, font: Font, text: &str) -> Vec2 {
    let share = match align {
        Align::Left => 0.0,
        Align::Centre => 0.5,
        Align::Right => 1.0,
    };
    -vec2(font.width_px(text) * share, font.height_px() / 2.0)
}

/// Text in the letters that the fonts have (ISO 8859-1).
fn spelled(text: &str) -> String {
    let mut spelled = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '−' | '–' | '—' => spelled.push('-'),
            '‘' | '’' => spelled.push('\''),
            '“' | '”' => spelled.push('"'),
            '…' => spelled.push_str("..."),
            '→' => spelled.push_str("->"),
            '≤' => spelled.push_str("<="),
            '≥' => spelled.push_str(">="),
            '\n' | '\t' => spelled.push(' '),
            other => spelled.push(other),
        }
    }
    spelled
}

/// Hands the pixels of a text to the canvas, at the places that `place` makes of them.
struct Pen<'a, F> {
    canvas: &'a mut Canvas,
    colour: Colour,
    place: F,
}

impl<F: Fn(f32, f32) -> Vec2> DrawTarget for Pen<'_, F> {
    type Color = BinaryColor;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<BinaryColor>>>(
        &mut self,
        pixels: I,
    ) -> Result<(), Infallible> {
        for Pixel(point, ink) in pixels {
            if ink.is_on() {
                let at = (self.place)(point.x as f32, point.y as f32).round();
                self.canvas
                    .blend(at.x as i64, at.y as i64, self.colour, 1.0);
            }
        }
        Ok(())
    }
}

impl<F> OriginDimensions for Pen<'_, F> {
    fn size(&self) -> Size {
        // Sides are at most 16,384.
        Size::new(self.canvas.width() as u32, self.canvas.height() as u32)
    }
}

fn write(
    canvas: &mut Canvas,
    font: Font,
    colour: Colour,
    text: &str,
    place: impl Fn(f32, f32) -> Vec2,
) {
    let text = spelled(text);
    let style = MonoTextStyle::new(font.mono(), BinaryColor::On);
    let mut pen = Pen {
        canvas,
        colour,
        place,
    };
    // The pen cannot fail; what is drawn next is of no use here.
    let _ = Text::with_baseline(&text, Point::zero(), style, Baseline::Top).draw(&mut pen);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inked(canvas: &Canvas) -> Vec<(usize, usize)> {
        (0..canvas.height())
            .flat_map(|y| (0..canvas.width()).map(move |x| (x, y)))
            .filter(|&(x, y)| canvas.pixel(x, y) != Colour::WHITE)
            .collect()
    }

    #[test]
    fn text_stays_within_its_measure() {
        for align in [Align::Left, Align::Centre, Align::Right] {
            let mut canvas = Canvas::new(300, 60).unwrap();
            canvas.text(
                vec2(150.0, 30.0),
                align,
                Font::Label,
                Colour::INK,
                "Level 12 dB",
            );
            let width = Font::Label.width_px("Level 12 dB");
            let left = match align {
                Align::Left => 150.0,
                Align::Centre => 150.0 - width / 2.0,
                Align::Right => 150.0 - width,
            };
            let pixels = inked(&canvas);
            assert!(pixels.len() > 100);
            for (x, y) in pixels {
                assert!((left - 1.0..left + width + 1.0).contains(&(x as f32)));
                assert!((20..=40).contains(&y));
            }
        }
    }

    #[test]
    fn upward_text_is_the_same_text_turned() {
        let mut flat = Canvas::new(100, 100).unwrap();
        let mut up = flat.clone();
        flat.text(
            vec2(50.0, 50.0),
            Align::Centre,
            Font::Label,
            Colour::INK,
            "Hz",
        );
        up.text_up(vec2(50.0, 50.0), Font::Label, Colour::INK, "Hz");
        let mut turned: Vec<_> = inked(&flat).iter().map(|&(x, y)| (y, 99 - x)).collect();
        turned.sort_by_key(|&(x, y)| (y, x));
        assert_eq!(inked(&up), turned);
    }

    #[test]
    fn long_text_is_cut_and_foreign_letters_are_spelled() {
        assert_eq!(Font::Label.fitted("short", 500.0), "short");
        assert_eq!(Font::Label.fitted("a long title here", 90.0), "a long...");
        assert_eq!(spelled("−3 dB → “x”…"), "-3 dB -> \"x\"...");
    }
}
