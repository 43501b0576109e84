//! Air: speed of sound and atmospheric absorption.
//!
//! Source: \[ISO9613-1\] for absorption, literal; \[CRAMER93\] for the speed of sound in dry air.

use super::bands::{BANDS, BandArray, CENTRES_HZ};

/// Speed of sound in dry air at 0 °C, in m/s (\[CRAMER93\]). At 20 °C it gives 343.4 m/s.
const SPEED_AT_0_C_M_S: f64 = 331.45;

/// Frequencies in Hz above the bands at which the absorption of air shapes a path. An interpolation through them has the
/// least error at 20 °C and 50 %, up to 100 m.
pub(crate) const HIGH_AIR_HZ: [f64; 4] = [9_000.0, 12_000.0, 14_000.0, 16_000.0];

/// State of the air, uniform within a scene.
///
/// ```
/// use foresound::acoustics::Medium;
/// let air = Medium { temperature_c: 0.0, ..Medium::default() };
/// assert!((air.speed_of_sound_m_s() - 331.45).abs() < 1e-9);
/// assert!(air.absorption_db_per_m(4000.0) > air.absorption_db_per_m(250.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Medium {
    /// Temperature in °C.
    pub temperature_c: f64,
    /// Relative humidity in percent.
    pub humidity_percent: f64,
    /// Static pressure in kPa.
    pub pressure_kpa: f64,
}

impl Default for Medium {
    /// 20 °C, 50 % relative humidity, 101.325 kPa.
    fn default() -> Self {
        Self {
            temperature_c: 20.0,
            humidity_percent: 50.0,
            pressure_kpa: 101.325,
        }
    }
}

impl Medium {
    /// Speed of sound in m/s (\[CRAMER93\], dry air).
    pub fn speed_of_sound_m_s(&self) -> f64 {
        SPEED_AT_0_C_M_S * (1.0 + self.temperature_c / 273.15).sqrt()
    }

    /// Attenuation of a pure tone in dB/m (\[ISO9613-1\] equations 3 to 5, literal; saturation pressure by B.2 and B.3).
    pub fn absorption_db_per_m(&self, frequency_hz: f64) -> f64 {
        let t = self.temperature_c + 273.15;
        let t0 = 293.15;
        let p = self.pressure_kpa / 101.325;
        let saturation = 10f64.powf(-6.8346 * (273.16 / t).powf(1.261) + 4.6151);
        let h = self.humidity_percent * saturation / p;
        let oxygen_hz = p * (24.0 + 4.04e4 * h * (0.02 + h) / (0.391 + h));
        let nitrogen_hz = p
            * (t / t0).powf(-0.5)
            * (9.0 + 280.0 * h * (-4.170 * ((t / t0).powf(-1.0 / 3.0) - 1.0)).exp());
        let f2 = frequency_hz * frequency_hz;
        let classical = 1.84e-11 / p * (t / t0).sqrt();
        let oxygen = 0.01275 * (-2239.1 / t).exp() / (oxygen_hz + f2 / oxygen_hz);
        let nitrogen = 0.1068 * (-3352.0 / t).exp() / (nitrogen_hz + f2 / nitrogen_hz);
        8.686 * f2 * (classical + (t / t0).powf(-2.5) * (oxygen + nitrogen))
    }

    /// Attenuation of pressure in Np/m at each band's centre: the factor over `r` metres is `exp(-m r)`.
    pub fn absorption_np_per_m(&self) -> BandArray {
        let mut m = [0.0; BANDS];
        for (value, centre) in m.iter_mut().zip(CENTRES_HZ) {
            *value = (self.absorption_db_per_m(centre) / 8.686) as f32;
        }
        m
    }

    /// Attenuation of pressure in Np/m at [`HIGH_AIR_HZ`].
    pub(crate) fn high_absorption_np_per_m(&self) -> [f32; HIGH_AIR_HZ.len()] {
        HIGH_AIR_HZ.map(|hz| (self.absorption_db_per_m(hz) / 8.686) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn air_absorbs_as_iso_9613_1_says() {
        let rows = [
            (
                20.0,
                50.0,
                [0.123, 0.445, 1.318, 2.733, 4.665, 9.855, 29.419, 103.912],
            ),
            (
                20.0,
                70.0,
                [0.090, 0.339, 1.132, 2.798, 4.978, 9.016, 22.911, 76.621],
            ),
            (
                10.0,
                70.0,
                [0.122, 0.411, 1.043, 1.928, 3.658, 9.664, 32.77, 116.882],
            ),
            (
                15.0,
                20.0,
                [0.272, 0.647, 1.221, 2.704, 8.166, 28.191, 88.786, 201.761],
            ),
            (
                30.0,
                70.0,
                [0.065, 0.256, 0.963, 3.135, 7.407, 12.746, 23.058, 59.261],
            ),
        ];
        for (temperature_c, humidity_percent, db_per_km) in rows {
            let air = Medium {
                temperature_c,
                humidity_percent,
                ..Medium::default()
            };
            for (expected, centre) in db_per_km.iter().zip(CENTRES_HZ) {
                let figure = 1000.0 * air.absorption_db_per_m(centre);
                // The anchors are printed to 0.001 dB/km.
                assert!(
                    (figure - expected).abs() < 0.005 * expected + 0.0006,
                    "{figure} for {expected}"
                );
            }
        }
    }

    #[test]
    fn speed_at_twenty_degrees() {
        assert!((Medium::default().speed_of_sound_m_s() - 343.37).abs() < 0.01);
    }
}
