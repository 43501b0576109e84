//! Colours: single ones, and maps from a number to a colour.
//!
//! The maps are own: a few anchors, joined by straight lines in Oklab (Ottosson 2020), in which equal steps look
//! equal. Lightness rises all along the sequential map and falls evenly from the middle of the diverging one.

/// An sRGB colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Colour(pub u8, pub u8, pub u8);

impl Colour {
    /// Background.
    pub const WHITE: Self = Self(255, 255, 255);
    /// Titles.
    pub const INK: Self = Self(28, 32, 40);
    /// Labels and captions.
    pub const TEXT: Self = Self(70, 76, 88);
    /// Axes and frames.
    pub const AXIS: Self = Self(150, 156, 166);

    /// Mix with another colour: 0 gives this one, 1 the other. In sRGB values, as screens blend.
    pub fn mixed(self, other: Self, share: f32) -> Self {
        let share = share.clamp(0.0, 1.0);
        let mix =
            |a: u8, b: u8| (f32::from(a) + (f32::from(b) - f32::from(a)) * share).round() as u8;
        Self(
            mix(self.0, other.0),
            mix(self.1, other.1),
            mix(self.2, other.2),
        )
    }

    /// Oklab lightness and the two colour axes.
    fn oklab(self) -> [f64; 3] {
        let [r, g, b] = [self.0, self.1, self.2].map(|c| {
            let c = f64::from(c) / 255.0;
            if c <= 0.040_45 {
                c / 12.92
            } else {
                ((c + 0.055) / 1.055).powf(2.4)
            }
        });
        let l = (0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b).cbrt();
        let m = (0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b).cbrt();
        let s = (0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b).cbrt();
        [
            0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
            1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
            0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
        ]
    }

    fn from_oklab([light, a, b]: [f64; 3]) -> Self {
        let l = (light + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
        let m = (light - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
        let s = (light - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
        let [r, g, b] = [
            4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
            -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
            -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
        ]
        .map(|c| {
            let c = if c <= 0.003_130_8 {
                12.92 * c
            } else {
                1.055 * c.powf(1.0 / 2.4) - 0.055
            };
            (c * 255.0).round().clamp(0.0, 255.0) as u8
        });
        Self(r, g, b)
    }
}

/// A map from 0 … 1 to colours, tabulated.
pub struct Colormap {
    table: Vec<Colour>,
}

/// Entries of a map's table: more than an 8-bit channel tells apart.
const TABLE_LENGTH: usize = 512;

impl Colormap {
    /// Dark to light, for levels.
    pub fn sequential() -> Self {
        Self::through(&[
            Colour(10, 8, 28),
            Colour(52, 22, 98),
            Colour(122, 36, 122),
            Colour(200, 60, 98),
            Colour(244, 124, 72),
            Colour(253, 196, 102),
            Colour(253, 247, 205),
        ])
    }

    /// Blue (less) over white (equal) to red (more), for differences.
    pub fn diverging() -> Self {
        Self::through(&[
            Colour(18, 52, 122),
            Colour(64, 122, 196),
            Colour(170, 205, 232),
            Colour(250, 250, 250),
            Colour(244, 190, 168),
            Colour(208, 84, 72),
            Colour(118, 14, 38),
        ])
    }

    /// Through evenly spaced anchors.
    pub fn through(anchors: &[Colour]) -> Self {
        let labs: Vec<[f64; 3]> = anchors.iter().map(|c| c.oklab()).collect();
        let colour = |i: usize| match labs.len() {
            0 => Colour::WHITE,
            1 => anchors[0],
            count => {
                let place = i as f64 / (TABLE_LENGTH - 1) as f64 * (count - 1) as f64;
                let below = (place as usize).min(count - 2);
                let share = place - below as f64;
                let (from, to) = (labs[below], labs[below + 1]);
                Colour::from_oklab(std::array::from_fn(|k| from[k] + (to[k] - from[k]) * share))
            }
        };
        Self {
            table: (0..TABLE_LENGTH).map(colour).collect(),
        }
    }

    /// The colour of a value, clipped to 0 … 1; no number has the first colour.
    pub fn at(&self, value: f64) -> Colour {
        let place = value.clamp(0.0, 1.0) * (TABLE_LENGTH - 1) as f64;
        self.table[place.round() as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lightness(map: &Colormap) -> Vec<f64> {
        map.table.iter().map(|c| c.oklab()[0]).collect()
    }

    #[test]
    fn oklab_and_back_is_the_same_colour() {
        for colour in [
            Colour::WHITE,
            Colour::INK,
            Colour(255, 0, 0),
            Colour(3, 200, 90),
        ] {
            let Colour(r, g, b) = Colour::from_oklab(colour.oklab());
            assert!(
                r.abs_diff(colour.0) <= 1 && g.abs_diff(colour.1) <= 1 && b.abs_diff(colour.2) <= 1
            );
        }
    }

    #[test]
    fn lightness_rises_along_the_sequential_map() {
        // 8-bit rounding may step back by less than one part in 255.
        let light = lightness(&Colormap::sequential());
        assert!(light.windows(2).all(|w| w[1] > w[0] - 0.004));
        assert!(light[0] < 0.2 && light[TABLE_LENGTH - 1] > 0.95);
    }

    #[test]
    fn the_diverging_map_is_white_in_the_middle_and_even_at_both_sides() {
        let map = Colormap::diverging();
        let light = lightness(&map);
        let middle = map.at(0.5);
        assert!(middle.0 > 245 && middle.1 > 245 && middle.2 > 245);
        for i in 0..TABLE_LENGTH / 2 {
            assert!((light[i] - light[TABLE_LENGTH - 1 - i]).abs() < 0.06, "{i}");
        }
        assert!(map.at(0.0).2 > map.at(0.0).0 && map.at(1.0).0 > map.at(1.0).2);
    }

    #[test]
    fn values_outside_are_clipped() {
        let map = Colormap::sequential();
        assert_eq!(map.at(-3.0), map.at(0.0));
        assert_eq!(map.at(7.0), map.at(1.0));
        assert_eq!(map.at(f64::NAN), map.at(0.0));
    }
}
