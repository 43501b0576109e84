//! Directivity of sources: the cardioid family, and tables of levels by angle.
//!
//! Any thread; `Copy` and small. Both depend only on the angle from the source's front.

use crate::acoustics::{BANDS, BandArray};
use crate::error::{Error, Result};

/// Directivity in each band: pressure `|(1 − w) + w cos θ|ⁿ` at the angle θ from the front, the first-order patterns of
/// microphones and loudspeakers, sharpened by an exponent, times the table's factor if there is a table.
///
/// # Range
/// Weights 0 (omnidirectional) over ½ (cardioid) to 1 (dipole); other values count as the nearest of these. Orders 0 to
/// 64. The level at the front is constant: a band with a narrower pattern has less power.
///
/// # Examples
/// ```
/// use foresound::Directivity;
///
/// let cardioid = Directivity::even(0.5, 1.0);
/// assert_eq!(cardioid.factor(1.0)[0], 1.0); // at the front
/// assert_eq!(cardioid.factor(0.0)[0], 0.5); // at 90 degrees: -6 dB
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Directivity {
    /// Weight `w` of the dipole, one per band.
    pub weight: BandArray,
    /// Exponent `n`; 1 is the plain pattern.
    pub order: f32,
    /// Levels by angle, which multiply the pattern.
    pub table: Option<DirectivityTable>,
}

impl Directivity {
    /// The same in all directions.
    pub const OMNI: Self = Self::even(0.0, 1.0);

    /// The same pattern in all bands.
    pub const fn even(weight: f32, order: f32) -> Self {
        Self {
            weight: [weight; BANDS],
            order,
            table: None,
        }
    }

    /// Measured levels instead of a pattern.
    pub const fn measured(table: DirectivityTable) -> Self {
        Self {
            weight: [0.0; BANDS],
            order: 1.0,
            table: Some(table),
        }
    }

    /// Pressure factor at the angle of this cosine from the front.
    pub fn factor(&self, cos_angle: f32) -> BandArray {
        let cosine = cos_angle.clamp(-1.0, 1.0);
        let order = if self.order.is_finite() {
            self.order.clamp(0.0, 64.0)
        } else {
            1.0
        };
        let mut factor = self.weight.map(|weight| {
            // NaN counts as 0.
            let weight = if weight > 0.0 { weight.min(1.0) } else { 0.0 };
            ((1.0 - weight) + weight * cosine).abs().powf(order)
        });
        if let Some(table) = &self.table {
            for (value, level) in factor.iter_mut().zip(table.factor(cosine)) {
                *value *= level;
            }
        }
        factor
    }

    /// Whether every factor is 1.
    pub fn is_omni(&self) -> bool {
        self.table.is_none() && (self.weight.iter().all(|w| *w <= 0.0) || self.order == 0.0)
    }
}

impl Default for Directivity {
    fn default() -> Self {
        Self::OMNI
    }
}

/// Angles of a table, evenly from the front (0°) to the back (180°): every 15°.
const ANGLES: usize = 13;
/// Code of silence.
const SILENT: i8 = i8::MIN;
/// Steps of one decibel.
const STEPS_A_DB: f32 = 2.0;

/// Levels in dB by angle and band, rounded to half a decibel; between angles the pressure is interpolated.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct DirectivityTable {
    levels: [[i8; BANDS]; ANGLES],
}

impl std::fmt::Debug for DirectivityTable {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("DirectivityTable")
            .finish_non_exhaustive()
    }
}

impl DirectivityTable {
    /// From rows of eight levels in dB, the angles evenly from the front to the back, both included. Minus infinity is
    /// silence. Tables of another number of rows than thirteen are resampled.
    ///
    /// # Errors
    /// [`Error::Setting`] for fewer than two or more than 181 rows, and for levels that are not numbers, above 60 dB or,
    /// if finite, below −63 dB.
    pub fn from_levels_db(rows: &[BandArray]) -> Result<Self> {
        let refuse = |problem: String, advice: &str| {
            Err(Error::setting("directivity levels", problem, advice))
        };
        if !(2..=181).contains(&rows.len()) {
            let problem = format!("{} rows of angles", rows.len());
            return refuse(problem, "give 2 to 181 rows from 0 to 180 degrees");
        }
        for level in rows.iter().flatten() {
            if !(*level == f32::NEG_INFINITY || (-63.0..=60.0).contains(level)) {
                let problem = format!("{level} dB is out of range");
                return refuse(problem, "give -63 to 60 dB, or -inf for silence");
            }
        }
        let mut levels = [[0; BANDS]; ANGLES];
        for (index, row) in levels.iter_mut().enumerate() {
            let position = index as f32 / (ANGLES - 1) as f32 * (rows.len() - 1) as f32;
            for (band, level) in row.iter_mut().enumerate() {
                let pressure = |row: usize| 10f32.powf(rows[row][band] / 20.0);
                *level = quantised(between(position, rows.len(), pressure));
            }
        }
        Ok(Self { levels })
    }

    /// Pressure factor at the angle of this cosine, −1 to 1.
    fn factor(&self, cosine: f32) -> BandArray {
        let position = cosine.acos() / std::f32::consts::PI * (ANGLES - 1) as f32;
        std::array::from_fn(|band| {
            between(position, ANGLES, |row| match self.levels[row][band] {
                SILENT => 0.0,
                level => 10f32.powf(f32::from(level) / (20.0 * STEPS_A_DB)),
            })
        })
    }
}

/// Linear interpolation at a position among values at 0, 1, … `count` − 1.
fn between(position: f32, count: usize, value: impl Fn(usize) -> f32) -> f32 {
    let below = (position.max(0.0) as usize).min(count - 2);
    let share = position - below as f32;
    value(below) * (1.0 - share) + value(below + 1) * share
}

fn quantised(pressure: f32) -> i8 {
    let steps = 20.0 * STEPS_A_DB * pressure.log10();
    if steps < f32::from(SILENT) + 0.5 {
        return SILENT;
    }
    steps.round() as i8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn omni_is_one_everywhere() {
        for i in 0..=20 {
            let cosine = -1.0 + 0.1 * i as f32;
            assert_eq!(Directivity::OMNI.factor(cosine), [1.0; BANDS]);
            assert_eq!(
                Directivity::even(f32::NAN, 1.0).factor(cosine),
                [1.0; BANDS]
            );
        }
    }

    #[test]
    fn dipole_is_silent_aside_and_cardioid_behind() {
        assert_eq!(Directivity::even(1.0, 1.0).factor(0.0), [0.0; BANDS]);
        assert_eq!(Directivity::even(0.5, 2.0).factor(-1.0), [0.0; BANDS]);
        for weight in [0.0, 0.3, 0.5, 1.0] {
            assert_eq!(Directivity::even(weight, 3.0).factor(1.0), [1.0; BANDS]);
        }
    }

    #[test]
    fn mean_power_is_that_of_the_integral() {
        // ∫ ((1 − w) + w x)² dx / 2 over −1 … 1 is (1 − w)² + w² / 3.
        for weight in [0.0f64, 0.25, 0.5, 1.0] {
            let pattern = Directivity::even(weight as f32, 1.0);
            let steps = 2000;
            let mean: f64 = (0..steps)
                .map(|i| {
                    let cosine = -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(steps);
                    f64::from(pattern.factor(cosine as f32)[3]).powi(2) / f64::from(steps)
                })
                .sum();
            let exact = (1.0 - weight).powi(2) + weight * weight / 3.0;
            // Midpoints err by the step squared, single precision by 1e-6.
            assert!((mean - exact).abs() < 1e-5, "{weight}: {mean}");
        }
    }

    #[test]
    fn a_table_of_a_cardioid_is_a_cardioid() {
        let rows: Vec<BandArray> = (0..=36)
            .map(|i| {
                let angle = f32::to_radians(5.0 * i as f32);
                [20.0 * (0.5 + 0.5 * angle.cos()).max(1e-3).log10(); BANDS]
            })
            .collect();
        let table = DirectivityTable::from_levels_db(&rows).unwrap();
        let (measured, exact) = (Directivity::measured(table), Directivity::even(0.5, 1.0));
        for i in 0..=40 {
            let cosine = -1.0 + 0.05 * i as f32;
            let off = measured.factor(cosine)[5] - exact.factor(cosine)[5];
            // A quarter of a decibel of rounding, and chords over 15 degrees.
            assert!(off.abs() < 0.03, "{cosine}: {off}");
        }
    }

    #[test]
    fn bands_of_a_table_stay_apart_and_silence_is_silent() {
        let mut back = [0.0; BANDS];
        back[7] = f32::NEG_INFINITY;
        back[3] = -20.0;
        let table = DirectivityTable::from_levels_db(&[[0.0; BANDS], back]).unwrap();
        let behind = Directivity::measured(table).factor(-1.0);
        assert_eq!((behind[0], behind[7]), (1.0, 0.0));
        assert!((behind[3] - 0.1).abs() < 1e-6);
        assert!(!Directivity::measured(table).is_omni());
    }

    #[test]
    fn tables_that_say_nothing_are_refused() {
        for rows in [
            vec![],
            vec![[0.0; BANDS]],
            vec![[f32::NAN; BANDS]; 2],
            vec![[90.0; BANDS]; 2],
            vec![[-64.0; BANDS]; 2],
        ] {
            assert!(DirectivityTable::from_levels_db(&rows).is_err(), "{rows:?}");
        }
    }
}
