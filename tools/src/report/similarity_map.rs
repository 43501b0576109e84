//! A picture of the differences of two sounds: structural similarity over time and frequency (the paper's Figure 6).

use crate::chart::{Picture, draw_title, px, sequential};
use crate::mel::{HOP_LENGTH, MEL_BANDS, MelAnalyser, mel_of_hz};
use crate::mel_map::{LEFT_PX, MelMap};
use crate::ssim::{LEAST_SIZE, ssim_map};
use foresound::Result;

/// Input of the picture: both ears' powers averaged.
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
    pub fn draw(&self) -> Result<Picture> {
        let analyser = MelAnalyser::new(self.rate_hz);
        let [a, b] = [self.reference, self.estimate].map(|channels| analyser.analyse(channels));
        let top_db = a.peak_db();
        let map = ssim_map(&a.scaled(top_db), &b.scaled(top_db), a.columns)?;
        let (width, height) = (a.columns + 1 - LEAST_SIZE, MEL_BANDS + 1 - LEAST_SIZE);
        let mean = map.iter().sum::<f64>() / map.len().max(1) as f64;
        let duration_s = (width * HOP_LENGTH) as f64 / f64::from(self.rate_hz);
        // Only windows that lie inside have a value: half of one is missing below and above.
        let band_mel = mel_of_hz(f64::from(self.rate_hz) / 2.0) / (MEL_BANDS + 1) as f64;
        let low_mel = (LEAST_SIZE / 2) as f64 * band_mel + 0.5 * band_mel;
        let value = |time_s: f64, mel: f64| {
            let column = (time_s / duration_s * width as f64) as usize;
            let band = ((mel - low_mel) / band_mel) as usize;
            map[band.min(height - 1) * width + column.min(width - 1)].clamp(0.0, 1.0)
        };
        Picture::draw(1400, 400, |area| {
            let caption = format!("SSIM {mean:.4}");
            draw_title(area, px(LEFT_PX), self.title, &caption)?;
            let (_, below) = area.split_vertically(px(70.0));
            MelMap {
                label: "",
                duration_s,
                mels: low_mel..low_mel + height as f64 * band_mel,
                range: 0.0..1.0,
                text: &|share| format!("{share:.1}"),
                colours: &sequential(),
                value: &value,
            }
            .draw(&below)
        })
    }
}
