//! A picture of two sounds: log-mel spectrograms of the reference and the estimate, and their difference.

use glam::{Vec2, vec2};

use super::axis::{hz_text, round_step, tick_text, ticks};
use super::canvas::Canvas;
use super::colormap::{Colormap, Colour};
use super::lettering::{Align, Font};
use super::mel::{FFT_LENGTH, HOP_LENGTH, LogMel, MEL_BANDS, MelAnalyser, RANGE_DB};
use foresound::{Error, Result};

/// Width of the picture in pixels.
const WIDTH_PX: f32 = 1400.0;
/// Left and right ends of the panels in pixels.
const LEFT_PX: f32 = 104.0;
const RIGHT_PX: f32 = WIDTH_PX - 118.0;
/// First panel's top edge, every panel's height, and from one panel's top edge to the next.
const TOP_PX: f32 = 118.0;
const PANEL_PX: f32 = 250.0;
const PITCH_PX: f32 = PANEL_PX + 58.0;
/// Room for the last panel's time axis.
const BOTTOM_PX: f32 = 62.0;
/// Labelled frequencies in Hz; those too close to the last one are left out.
const TICKS_HZ: [f64; 7] = [250.0, 500.0, 1e3, 2e3, 4e3, 8e3, 16e3];
/// Ranges of the difference panel in dB; the narrowest that holds 99 points of 100 is taken.
const DIFFERENCE_RANGES_DB: [f64; 5] = [4.0, 8.0, 16.0, 32.0, 64.0];

/// What the picture shows. Powers of several channels are averaged.
pub struct SpectrogramFigure<'a> {
    /// Title of the whole.
    pub title: &'a str,
    /// One line below the title, e.g. scene, level and SI-SNR.
    pub caption: &'a str,
    /// Sample rate of both sounds in Hz.
    pub rate_hz: u32,
    /// What the reference is called, e.g. "synchronous".
    pub reference_label: &'a str,
    /// What the estimate is called, e.g. "asynchronous".
    pub estimate_label: &'a str,
    /// Channels of the reference.
    pub reference: &'a [&'a [f32]],
    /// Channels of the estimate.
    pub estimate: &'a [&'a [f32]],
}

impl SpectrogramFigure<'_> {
    /// Draws the picture, 1400 pixels wide. The longer sound is cut to the shorter one's length.
    ///
    /// # Errors
    /// [`Error::Setting`] if a sound is shorter than one window.
    pub fn draw(&self) -> Result<Canvas> {
        let both = self.reference.iter().chain(self.estimate);
        let length = both.map(|c| c.len()).min().unwrap_or(0);
        let analyser = MelAnalyser::new(self.rate_hz);
        let analyse = |channels: &[&[f32]]| {
            let cut: Vec<&[f32]> = channels.iter().map(|c| &c[..length]).collect();
            analyser.analyse(&cut)
        };
        let (reference, estimate) = (analyse(self.reference), analyse(self.estimate));
        if reference.columns == 0 || estimate.columns == 0 {
            return Err(Error::setting(
                "spectrogram",
                format!("sounds of {length} samples"),
                "give at least 2048 samples of both",
            ));
        }
        let top_db = reference.peak_db();
        let relative = |mel: &LogMel| -> Vec<f64> {
            let scaled = mel.scaled(top_db);
            scaled.iter().map(|s| (s - 1.0) * RANGE_DB).collect()
        };
        let (reference_db, estimate_db) = (relative(&reference), relative(&estimate));
        let difference_db: Vec<f64> = estimate_db
            .iter()
            .zip(&reference_db)
            .map(|(e, r)| e - r)
            .collect();
        let range_db = difference_range_db(&difference_db);
        let (levels, differences) = (Colormap::sequential(), Colormap::diverging());
        let rows = [
            (
                self.reference_label.to_owned(),
                reference_db,
                (-RANGE_DB, 0.0),
                &levels,
            ),
            (
                self.estimate_label.to_owned(),
                estimate_db,
                (-RANGE_DB, 0.0),
                &levels,
            ),
            (
                format!(
                    "difference ({} − {})",
                    self.estimate_label, self.reference_label
                ),
                difference_db,
                (-range_db, range_db),
                &differences,
            ),
        ];
        let height = TOP_PX + 2.0 * PITCH_PX + PANEL_PX + BOTTOM_PX;
        let mut canvas = Canvas::new(WIDTH_PX as usize, height as usize)?;
        let room = RIGHT_PX - LEFT_PX;
        let title = Font::Title.fitted(self.title, room);
        canvas.text(
            vec2(LEFT_PX, 30.0),
            Align::Left,
            Font::Title,
            Colour::INK,
            &title,
        );
        let caption = Font::Label.fitted(self.caption, room);
        canvas.text(
            vec2(LEFT_PX, 58.0),
            Align::Left,
            Font::Label,
            Colour::TEXT,
            &caption,
        );
        for (index, (label, values, range, map)) in rows.iter().enumerate() {
            let panel = Panel {
                label,
                values,
                range: *range,
                map,
                mel: &reference,
                length,
                top_px: TOP_PX + index as f32 * PITCH_PX,
            };
            panel.draw(&mut canvas, index + 1 == rows.len());
        }
        Ok(canvas)
    }
}

/// One spectrogram with its axes.
struct Panel<'a> {
    label: &'a str,
    /// [`MEL_BANDS`] rows of values.
    values: &'a [f64],
    range: (f64, f64),
    map: &'a Colormap,
    /// For the axes only.
    mel: &'a LogMel,
    length: usize,
    top_px: f32,
}

impl Panel<'_> {
    fn draw(&self, canvas: &mut Canvas, is_last: bool) {
        let label_at = vec2(LEFT_PX, self.top_px - 16.0);
        let label = Font::Bold.fitted(self.label, RIGHT_PX - LEFT_PX);
        canvas.text(label_at, Align::Left, Font::Bold, Colour::INK, &label);
        self.draw_values(canvas);
        let (low, high) = (vec2(LEFT_PX, self.top_px), vec2(RIGHT_PX, self.bottom_px()));
        canvas.frame(low - 1.0, high + 1.0, Colour::AXIS);
        self.draw_frequency_axis(canvas);
        self.draw_time_axis(canvas, is_last);
        self.draw_colour_bar(canvas);
    }

    fn bottom_px(&self) -> f32 {
        self.top_px + PANEL_PX
    }

    fn draw_values(&self, canvas: &mut Canvas) {
        let (columns, width) = (self.mel.columns as f64, f64::from(RIGHT_PX - LEFT_PX));
        let rate_hop = self.length as f64 / HOP_LENGTH as f64 / width;
        let half_window = FFT_LENGTH as f64 / 2.0 / HOP_LENGTH as f64;
        for x in 0..width as usize {
            // Centre of the pixel in columns; a pixel that spans several columns shows their mean.
            let centre = (x as f64 + 0.5) * rate_hop - half_window;
            let steps = rate_hop.ceil().max(1.0) as usize;
            for y in 0..PANEL_PX as usize {
                let from_bottom = f64::from(PANEL_PX) - y as f64 - 0.5;
                let band = from_bottom / f64::from(PANEL_PX) * (MEL_BANDS + 1) as f64 - 1.0;
                let sum: f64 = (0..steps)
                    .map(|k| centre + ((k as f64 + 0.5) / steps as f64 - 0.5) * rate_hop)
                    .map(|column| self.between(band, column.clamp(0.0, columns - 1.0)))
                    .sum();
                let share = (sum / steps as f64 - self.range.0) / (self.range.1 - self.range.0);
                let (x, y) = (LEFT_PX as i64 + x as i64, self.top_px as i64 + y as i64);
                canvas.blend(x, y, self.map.at(share), 1.0);
            }
        }
    }

    /// Value between bands and columns, joined by straight lines.
    fn between(&self, band: f64, column: f64) -> f64 {
        let columns = self.mel.columns;
        let band = band.clamp(0.0, (MEL_BANDS - 1) as f64);
        let (low_band, low_column) = (band as usize, column as usize);
        let (high_band, high_column) = (
            (low_band + 1).min(MEL_BANDS - 1),
            (low_column + 1).min(columns - 1),
        );
        let row = |band: usize| {
            let (a, b) = (
                self.values[band * columns + low_column],
                self.values[band * columns + high_column],
            );
            a + (b - a) * (column - low_column as f64)
        };
        let (below, above) = (row(low_band), row(high_band));
        below + (above - below) * (band - low_band as f64)
    }

    fn draw_frequency_axis(&self, canvas: &mut Canvas) {
        let mut last_y = f32::MAX;
        let half_rate_hz = f64::from(self.mel.rate_hz) / 2.0;
        for hz in TICKS_HZ.into_iter().filter(|&hz| hz <= half_rate_hz) {
            let share = (self.mel.band_of_hz(hz) + 1.0) / (MEL_BANDS + 1) as f64;
            let y = self.bottom_px() - PANEL_PX * share as f32;
            if last_y - y < Font::Small.height_px() + 2.0 || self.bottom_px() - y < 8.0 {
                continue;
            }
            last_y = y;
            tick(canvas, vec2(LEFT_PX, y), vec2(-6.0, 0.0));
            let at = vec2(LEFT_PX - 11.0, y);
            canvas.text(at, Align::Right, Font::Small, Colour::TEXT, &hz_text(hz));
        }
        let middle = vec2(20.0, self.top_px + PANEL_PX / 2.0);
        canvas.text_up(middle, Font::Small, Colour::TEXT, "frequency (mel)");
    }

    fn draw_time_axis(&self, canvas: &mut Canvas, is_last: bool) {
        let duration_s = self.length as f64 / f64::from(self.mel.rate_hz);
        let step_s = round_step(duration_s, 12);
        for time_s in ticks(0.0, duration_s, 12) {
            let x = LEFT_PX + (RIGHT_PX - LEFT_PX) * (time_s / duration_s) as f32;
            tick(canvas, vec2(x, self.bottom_px()), vec2(0.0, 6.0));
            if is_last {
                let text = tick_text(time_s, step_s);
                canvas.text(
                    vec2(x, self.bottom_px() + 17.0),
                    Align::Centre,
                    Font::Small,
                    Colour::TEXT,
                    &text,
                );
            }
        }
        if is_last {
            let at = vec2((LEFT_PX + RIGHT_PX) / 2.0, self.bottom_px() + 42.0);
            canvas.text(at, Align::Centre, Font::Label, Colour::TEXT, "time (s)");
        }
    }

    fn draw_colour_bar(&self, canvas: &mut Canvas) {
        let (left, right) = (RIGHT_PX + 24.0, RIGHT_PX + 44.0);
        for y in 0..PANEL_PX as usize {
            let share = 1.0 - (y as f64 + 0.5) / f64::from(PANEL_PX);
            let top = self.top_px + y as f32;
            canvas.fill_rect(
                vec2(left, top),
                vec2(right, top + 1.0),
                self.map.at(share),
                1.0,
            );
        }
        canvas.frame(
            vec2(left - 1.0, self.top_px - 1.0),
            vec2(right + 1.0, self.bottom_px() + 1.0),
            Colour::AXIS,
        );
        let (low, high) = self.range;
        // A symmetric range in quarters has whole labels and one at zero.
        let step = if low < 0.0 && high > 0.0 {
            high / 2.0
        } else {
            round_step(high - low, 4)
        };
        let count = ((high - low) / step).round() as usize;
        for k in 0..=count {
            let value = low + k as f64 * step;
            let y = self.bottom_px() - PANEL_PX * (k as f32 / count as f32);
            tick(
                canvas,
                vec2(right, y.clamp(self.top_px + 0.5, self.bottom_px() - 0.5)),
                vec2(5.0, 0.0),
            );
            let sign = if low < 0.0 && high > 0.0 && value > 0.0 {
                "+"
            } else {
                ""
            };
            let text = format!("{sign}{} dB", tick_text(value, step));
            canvas.text(
                vec2(right + 10.0, y),
                Align::Left,
                Font::Small,
                Colour::TEXT,
                &text,
            );
        }
    }
}

fn tick(canvas: &mut Canvas, from: Vec2, along: Vec2) {
    canvas.line(from, from + along, 1.0, Colour::AXIS, 1.0);
}

fn difference_range_db(difference_db: &[f64]) -> f64 {
    let [.., widest] = DIFFERENCE_RANGES_DB;
    let allowed = difference_db.len() / 100;
    let holds = |range: &f64| difference_db.iter().filter(|d| d.abs() > *range).count() <= allowed;
    DIFFERENCE_RANGES_DB
        .into_iter()
        .find(holds)
        .unwrap_or(widest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Ten seconds of gliding voices, and the same with one voice louder for a while.
    fn sounds(rate_hz: u32) -> [Vec<f32>; 2] {
        let length = 10 * rate_hz;
        let mut state = 7u32;
        let mut phase = [0.0f64; 3];
        let mut sounds = [Vec::new(), Vec::new()];
        for n in 0..length {
            let t = f64::from(n) / f64::from(rate_hz);
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = f64::from(state >> 8) / f64::from(1 << 24) - 0.5;
            let syllable = (TAU * 1.7 * t).sin().max(0.0);
            let pitches = [
                150.0 + 40.0 * (0.9 * t).sin(),
                900.0 + 500.0 * (1.3 * t).sin(),
                3200.0 + 900.0 * t.sin(),
            ];
            let mut voices = [0.0; 3];
            for (k, hz) in pitches.into_iter().enumerate() {
                phase[k] += TAU * hz / f64::from(rate_hz);
                voices[k] = (1..6)
                    .map(|h| (phase[k] * f64::from(h)).sin() / f64::from(h * h))
                    .sum();
            }
            let [low, middle, high] = voices;
            let louder = if (4.0..6.0).contains(&t) { 2.0 } else { 1.0 };
            let dry = 0.3 * low + 0.02 * high + 0.01 * noise;
            sounds[0].push((syllable * (dry + 0.1 * middle)) as f32);
            sounds[1].push((syllable * (dry + 0.1 * louder * middle) + 1e-4 * noise) as f32);
        }
        sounds
    }

    /// Folder for pictures that a human wants to see: set FORESOUND_FIGURES to keep them.
    fn keep(canvas: &Canvas, name: &str) {
        if let Some(folder) = std::env::var_os("FORESOUND_FIGURES") {
            canvas
                .save_png(std::path::Path::new(&folder).join(name))
                .unwrap();
        }
    }

    #[test]
    fn the_difference_shows_where_the_sounds_differ() {
        let rate_hz = 44_100;
        let [reference, estimate] = sounds(rate_hz);
        let figure = SpectrogramFigure {
            title: "Concert hall, dynamic, 8 sources",
            caption: "workstation: 84.6 FPS, level 7, predictor linear; SI-SNR 18.42 dB, SSIM 0.934, PESQ 3.87",
            rate_hz,
            reference_label: "synchronous",
            estimate_label: "asynchronous",
            reference: &[&reference, &reference],
            estimate: &[&estimate, &estimate],
        };
        let canvas = figure.draw().unwrap();
        keep(&canvas, "spectrogram.png");
        assert_eq!(canvas.width(), 1400);
        // Redness of the difference panel, in the second with the louder voice and in one without.
        let redness = |time_s: f32| -> i64 {
            let x = (LEFT_PX + (RIGHT_PX - LEFT_PX) * time_s / 10.0) as usize;
            let top = (TOP_PX + 2.0 * PITCH_PX) as usize;
            let columns =
                (x..x + 100).flat_map(|x| (top..top + PANEL_PX as usize).map(move |y| (x, y)));
            columns
                .map(|(x, y)| canvas.pixel(x, y))
                .map(|c| i64::from(c.0) - i64::from(c.2))
                .sum()
        };
        assert!(
            redness(4.1) > 5 * redness(8.1).abs(),
            "{} {}",
            redness(4.1),
            redness(8.1)
        );
    }

    #[test]
    fn other_rates_and_lengths_are_drawn() {
        let [reference, estimate] = sounds(16_000);
        let short = SpectrogramFigure {
            title: "A title that is far too long for the picture: "
                .repeat(6)
                .leak(),
            caption: "",
            rate_hz: 16_000,
            reference_label: "reference",
            estimate_label: "estimate",
            reference: &[&reference[..20_000]],
            estimate: &[&estimate[..21_000]],
        };
        keep(&short.draw().unwrap(), "spectrogram_short.png");
        let none = SpectrogramFigure {
            estimate: &[&[0.0; 100]],
            ..short
        };
        assert!(none.draw().is_err());
        let silent = SpectrogramFigure {
            reference: &[&[0.0; 4096]],
            estimate: &[&[0.0; 4096]],
            ..none
        };
        assert!(silent.draw().is_ok());
    }

    #[test]
    fn the_difference_range_holds_all_but_one_in_a_hundred() {
        let mut values = vec![1.0; 1000];
        values[..10].fill(40.0);
        assert_eq!(difference_range_db(&values), 4.0);
        values[..11].fill(-20.0);
        assert_eq!(difference_range_db(&values), 32.0);
        assert_eq!(difference_range_db(&[99.0; 10]), 64.0);
    }
}
