//! A picture of where two sounds differ: structural similarity over time and frequency (the paper's Figure 6).

use glam::vec2;

use crate::axis::hz_text;
use crate::canvas::Canvas;
use crate::colormap::{Colormap, Colour};
use crate::lettering::{Align, Font};
use crate::mel::{HOP_LENGTH, MEL_BANDS, MelAnalyser};
use crate::ssim::{LEAST_SIZE, ssim_map};
use foresound::Result;

/// Width and height of the map in pixels, and the room around it.
const MAP_PX: [f32; 2] = [1180.0, 240.0];
const LEFT_PX: f32 = 90.0;
const TOP_PX: f32 = 64.0;

/// Frequencies that the axis names, in Hz.
const TICKS_HZ: [f64; 6] = [500.0, 1000.0, 2000.0, 4000.0, 8000.0, 16_000.0];

/// What the picture shows: both ears' powers averaged.
pub struct SimilarityMap<'a> {
    /// One line above the map.
    pub title: &'a str,
    /// Sample rate in Hz.
    pub rate_hz: u32,
    /// Channels of the reference.
    pub reference: &'a [&'a [f32]],
    /// Channels of the estimate.
    pub estimate: &'a [&'a [f32]],
}

impl SimilarityMap<'_> {
    /// Draws the map: dark where the sounds differ, bright where they are alike.
    ///
    /// # Errors
    /// [`foresound::Error::Setting`] if the sounds are too short or differ in length.
    pub fn draw(&self) -> Result<Canvas> {
        let analyser = MelAnalyser::new(self.rate_hz);
        let (a, b) = (
            analyser.analyse(self.reference),
            analyser.analyse(self.estimate),
        );
        let top_db = a.peak_db();
        let map = ssim_map(&a.scaled(top_db), &b.scaled(top_db), a.columns)?;
        let (width, height) = (a.columns + 1 - LEAST_SIZE, MEL_BANDS + 1 - LEAST_SIZE);
        let mean = map.iter().sum::<f64>() / map.len().max(1) as f64;
        let mut canvas = Canvas::new(1400, 380)?;
        let ink = Colour(30, 30, 34);
        let title = format!("{}: SSIM {mean:.4}", self.title);
        canvas.text(vec2(LEFT_PX, 34.0), Align::Left, Font::Title, ink, &title);
        let colours = Colormap::sequential();
        for x in 0..MAP_PX[0] as usize {
            let column = x * width / MAP_PX[0] as usize;
            for y in 0..MAP_PX[1] as usize {
                let band = height - 1 - y * height / MAP_PX[1] as usize;
                let value = map[band * width + column].clamp(0.0, 1.0);
                let (x, y) = (LEFT_PX as i64 + x as i64, TOP_PX as i64 + y as i64);
                canvas.blend(x, y, colours.at(value), 1.0);
            }
        }
        canvas.frame(
            vec2(LEFT_PX, TOP_PX),
            vec2(LEFT_PX + MAP_PX[0], TOP_PX + MAP_PX[1]),
            ink,
        );
        let seconds = (width * HOP_LENGTH) as f32 / self.rate_hz as f32;
        for second in 0..=seconds as usize {
            let x = LEFT_PX + MAP_PX[0] * second as f32 / seconds;
            let at = vec2(x, TOP_PX + MAP_PX[1] + 18.0);
            canvas.text(at, Align::Centre, Font::Small, ink, &format!("{second}"));
        }
        let below = vec2(LEFT_PX + 0.5 * MAP_PX[0], TOP_PX + MAP_PX[1] + 44.0);
        canvas.text(below, Align::Centre, Font::Label, ink, "time (s)");
        for hz in TICKS_HZ
            .into_iter()
            .filter(|hz| 2.0 * hz < f64::from(self.rate_hz))
        {
            // Windows that do not lie inside are left out: half of one below and above.
            let band = a.band_of_hz(hz) + 0.5 - (LEAST_SIZE / 2) as f64;
            let share = band / height as f64;
            if (0.0..=1.0).contains(&share) {
                let at = vec2(LEFT_PX - 8.0, TOP_PX + MAP_PX[1] * (1.0 - share as f32));
                canvas.line(at + vec2(3.0, 0.0), at + vec2(8.0, 0.0), 1.0, ink, 1.0);
                canvas.text(at, Align::Right, Font::Small, ink, &hz_text(hz));
            }
        }
        let beside = vec2(20.0, TOP_PX + 0.5 * MAP_PX[1]);
        canvas.text_up(beside, Font::Small, ink, "frequency (mel)");
        let above = vec2(LEFT_PX + MAP_PX[0] + 36.0, TOP_PX - 14.0);
        canvas.text(above, Align::Centre, Font::Small, ink, "SSIM");
        for (share, text) in [(0.0, "0"), (0.5, "0.5"), (1.0, "1")] {
            let y = TOP_PX + MAP_PX[1] * (1.0 - share as f32);
            canvas.text(
                vec2(LEFT_PX + MAP_PX[0] + 62.0, y),
                Align::Left,
                Font::Small,
                ink,
                text,
            );
        }
        for y in 0..MAP_PX[1] as usize {
            let colour = colours.at(1.0 - y as f64 / f64::from(MAP_PX[1]));
            let from = vec2(LEFT_PX + MAP_PX[0] + 24.0, TOP_PX + y as f32);
            canvas.fill_rect(from, from + vec2(24.0, 1.0), colour, 1.0);
        }
        Ok(canvas)
    }
}
