//! A picture of two sounds: log-mel spectrograms of the reference and the estimate, and their difference.

use super::chart::{Picture, diverging, draw_title, px, sequential};
use super::mel::{FFT_LENGTH, HOP_LENGTH, LogMel, MEL_BANDS, MelAnalyser, RANGE_DB, mel_of_hz};
use super::mel_map::{ABOVE_PX, BELOW_PX, LEFT_PX, MelMap};
use foresound::{Error, Result};

/// Width of the picture in pixels.
const WIDTH_PX: usize = 1400;
/// First panel's top edge, the height of a map, and from one panel's top edge to the next.
const TOP_PX: f32 = 84.0;
const MAP_PX: f32 = 250.0;
const PITCH_PX: f32 = ABOVE_PX + MAP_PX + BELOW_PX;
/// Ranges of the difference panel in dB; the narrowest that holds 99 points of 100 is taken.
const DIFFERENCE_RANGES_DB: [f64; 5] = [4.0, 8.0, 16.0, 32.0, 64.0];

/// Input of the picture. Powers of several channels are averaged.
pub struct SpectrogramFigure<'a> {
    /// Title of the whole.
    pub title: &'a str,
    /// One line below the title, e.g. scene, level and SI-SNR.
    pub caption: &'a str,
    /// Sample rate of both sounds in Hz.
    pub rate_hz: u32,
    /// Name of the reference, e.g. "synchronous".
    pub reference_label: &'a str,
    /// Name of the estimate, e.g. "asynchronous".
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
    pub fn draw(&self) -> Result<Picture> {
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
        let (levels, differences) = (sequential(), diverging());
        let difference_label = format!(
            "difference ({} − {})",
            self.estimate_label, self.reference_label
        );
        let panels = [
            (self.reference_label, &reference_db, -RANGE_DB..0.0, &levels),
            (self.estimate_label, &estimate_db, -RANGE_DB..0.0, &levels),
            (
                &difference_label,
                &difference_db,
                -range_db..range_db,
                &differences,
            ),
        ];
        let (columns, rate_hz) = (reference.columns, f64::from(self.rate_hz));
        let duration_s = length as f64 / rate_hz;
        let top_mel = mel_of_hz(rate_hz / 2.0);
        let height = TOP_PX + 3.0 * PITCH_PX;
        Picture::draw(WIDTH_PX, height as usize, |area| {
            draw_title(area, px(LEFT_PX), self.title, self.caption)?;
            let (_, below) = area.split_vertically(px(TOP_PX));
            for (area, (label, values, range, colours)) in
                below.split_evenly((3, 1)).iter().zip(panels)
            {
                let value = |time_s: f64, mel: f64| {
                    let column = (time_s * rate_hz - FFT_LENGTH as f64 / 2.0) / HOP_LENGTH as f64;
                    between(
                        values,
                        columns,
                        mel / top_mel * (MEL_BANDS + 1) as f64 - 1.0,
                        column,
                    )
                };
                let has_sign = range.end > 0.0;
                MelMap {
                    label,
                    duration_s,
                    mels: 0.0..top_mel,
                    range,
                    text: &|db| {
                        if has_sign && *db > 0.0 {
                            format!("+{db:.0} dB")
                        } else {
                            format!("{db:.0} dB")
                        }
                    },
                    colours,
                    value: &value,
                }
                .draw(area)?;
            }
            Ok(())
        })
    }
}

/// Value between bands and columns, joined by straight lines.
fn between(values: &[f64], columns: usize, band: f64, column: f64) -> f64 {
    let band = band.clamp(0.0, (MEL_BANDS - 1) as f64);
    let column = column.clamp(0.0, (columns - 1) as f64);
    let (low_band, low_column) = (band as usize, column as usize);
    let (high_band, high_column) = (
        (low_band + 1).min(MEL_BANDS - 1),
        (low_column + 1).min(columns - 1),
    );
    let row = |band: usize| {
        let (a, b) = (
            values[band * columns + low_column],
            values[band * columns + high_column],
        );
        a + (b - a) * (column - low_column as f64)
    };
    row(low_band) + (row(high_band) - row(low_band)) * (band - low_band as f64)
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
    use crate::mel_map::RIGHT_PX;
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

    /// Keeps a picture in the folder FORESOUND_FIGURES, if that is set.
    fn keep(canvas: &Picture, name: &str) {
        if let Some(folder) = std::env::var_os("FORESOUND_FIGURES") {
            canvas
                .save_png(std::path::Path::new(&folder).join(name))
                .unwrap();
        }
    }

    #[test]
    fn the_difference_panel_is_coloured_where_the_sounds_differ() {
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
        assert_eq!(canvas.size().0, 1400);
        // Redness of the difference panel, in the second with the louder voice and in one without.
        let redness = |time_s: f32| -> i64 {
            let width = WIDTH_PX as f32 - LEFT_PX - RIGHT_PX;
            let x = (LEFT_PX + width * time_s / 10.0) as usize;
            let top = (TOP_PX + 2.0 * PITCH_PX + ABOVE_PX) as usize;
            let columns =
                (x..x + 100).flat_map(|x| (top..top + MAP_PX as usize).map(move |y| (x, y)));
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
