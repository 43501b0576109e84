//! A source's mix: distance curve, gains of the parts of its sound, strengths of occlusion, transmission, Doppler shift and
//! air absorption. Physics is the default.
//!
//! `Copy`: part of the pose, which every stage receives. Own.

use crate::error::{Error, Result};

/// Greatest gain of a part.
const MAX_GAIN: f32 = 1e3;
/// Greatest strength of transmission and of the Doppler shift.
const MAX_STRENGTH: f32 = 4.0;
/// Greatest ratio of a curve to physics: 60 dB.
const MAX_RATIO: f32 = 1e3;
/// Greatest distance of a curve in metres.
const MAX_DISTANCE_M: f32 = 1e6;

/// Level by distance. A curve scales the whole sound of a source, reflections and late reverb included, by its ratio to
/// physics at the straight distance: delays and the levels of a source's paths relative to each other stay.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum DistanceCurve {
    /// One over the distance, 1 at 1 m: −6 dB for each doubling.
    #[default]
    Physical,
    /// 1 up to `min_m` metres, `min_m` over the distance up to `max_m`, and constant beyond. Range: 0 < `min_m` ≤ `max_m`.
    Inverse {
        /// Distance of full level in metres.
        min_m: f32,
        /// Distance in metres from which the level is constant.
        max_m: f32,
    },
    /// 1 up to `min_m` metres, falling linearly to silence at `max_m`. Range: 0 ≤ `min_m` < `max_m`.
    Linear {
        /// Distance of full level in metres.
        min_m: f32,
        /// Distance of silence in metres.
        max_m: f32,
    },
    /// A gain by distance.
    Table(DistanceTable),
}

/// Most points of a [`DistanceTable`].
pub const MAX_DISTANCE_POINTS: usize = 16;

/// Linear gains at rising distances; straight lines between them, constant before the first and after the last.
#[derive(Clone, Copy, PartialEq)]
pub struct DistanceTable {
    points: [[f32; 2]; MAX_DISTANCE_POINTS],
    count: usize,
}

impl std::fmt::Debug for DistanceTable {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_list().entries(self.points()).finish()
    }
}

impl DistanceTable {
    /// From pairs of a distance in metres and a linear gain.
    ///
    /// ```
    /// use foresound::DistanceTable;
    ///
    /// // Full level up to 2 m, half of it at 10 m, silence from 40 m on.
    /// let table = DistanceTable::new(&[[2.0, 1.0], [10.0, 0.5], [40.0, 0.0]])?;
    /// assert_eq!(table.gain(25.0), 0.25);
    /// # Ok::<(), foresound::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Setting`] for no point or more than [`MAX_DISTANCE_POINTS`], distances that do not rise or are outside 0 to
    /// 1e6, and gains outside 0 to 1000.
    pub fn new(points: &[[f32; 2]]) -> Result<Self> {
        let refuse =
            |problem: String, advice: &str| Err(Error::setting("distance table", problem, advice));
        if !(1..=MAX_DISTANCE_POINTS).contains(&points.len()) {
            return refuse(format!("{} points", points.len()), "give 1 to 16 points");
        }
        let mut before_m = -1.0;
        for [distance_m, gain] in points {
            if !(*distance_m > before_m && (0.0..=MAX_DISTANCE_M).contains(distance_m)) {
                let problem = format!("the distance {distance_m} m after {before_m} m");
                return refuse(problem, "give rising distances from 0 to 1e6 m");
            }
            if !(0.0..=MAX_GAIN).contains(gain) {
                let problem = format!("{gain} is no gain");
                return refuse(problem, "give a linear gain from 0 to 1000");
            }
            before_m = *distance_m;
        }
        let mut table = Self {
            points: [[0.0; 2]; MAX_DISTANCE_POINTS],
            count: points.len(),
        };
        table.points[..points.len()].copy_from_slice(points);
        Ok(table)
    }

    /// The points.
    pub fn points(&self) -> &[[f32; 2]] {
        &self.points[..self.count]
    }

    /// The gain at a distance in metres.
    pub fn gain(&self, distance_m: f32) -> f32 {
        let points = self.points();
        let after = points.partition_point(|[at_m, _]| *at_m <= distance_m);
        match (points.get(after.wrapping_sub(1)), points.get(after)) {
            (Some([from_m, from]), Some([to_m, to])) => {
                from + (to - from) * (distance_m - from_m) / (to_m - from_m)
            }
            (Some([_, gain]), None) | (None, Some([_, gain])) => *gain,
            (None, None) => 1.0,
        }
    }
}

impl DistanceCurve {
    /// The ratio of the curve to physics at a distance in metres, at most 60 dB; physics is constant below `min_distance_m`.
    pub(crate) fn ratio(&self, distance_m: f32, min_distance_m: f32) -> f32 {
        let gain = match self {
            Self::Physical => return 1.0,
            Self::Inverse { min_m, max_m } => min_m / distance_m.min(*max_m).max(*min_m),
            Self::Linear { min_m, max_m } => {
                ((max_m - distance_m) / (max_m - min_m)).clamp(0.0, 1.0)
            }
            Self::Table(table) => table.gain(distance_m),
        };
        let ratio = gain * distance_m.max(min_distance_m);
        // NaN of an unchecked curve counts as silence.
        if ratio > 0.0 {
            ratio.min(MAX_RATIO)
        } else {
            0.0
        }
    }

    fn check(&self) -> Result<()> {
        let (min_m, max_m, least_m) = match *self {
            Self::Physical | Self::Table(_) => return Ok(()),
            Self::Inverse { min_m, max_m } => (min_m, max_m, f32::MIN_POSITIVE),
            Self::Linear { min_m, max_m } => (min_m, max_m, 0.0),
        };
        let is_linear = matches!(self, Self::Linear { .. });
        let rises = min_m < max_m || !is_linear && min_m == max_m;
        if rises && min_m >= least_m && max_m <= MAX_DISTANCE_M {
            return Ok(());
        }
        Err(Error::setting(
            "distance curve",
            format!("{min_m} m to {max_m} m is no range"),
            "give a minimum above 0 (linear: or 0) and a maximum beyond it, up to 1e6 m",
        ))
    }
}

/// How a source's sound is mixed. The default is physics.
///
/// Changes while sound runs are smoothed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SourceMix {
    /// Level by distance.
    pub distance: DistanceCurve,
    /// Linear gain of the direct path, 0 to 1000.
    pub direct_gain: f32,
    /// Linear gain of reflected paths, 0 to 1000.
    pub reflections_gain: f32,
    /// Linear gain of diffracted paths, those with reflections included, 0 to 1000.
    pub diffraction_gain: f32,
    /// Linear gain of the late reverb, 0 to 1000.
    pub late_gain: f32,
    /// Strength of occlusion, 0 to 1: at 0 the direct path is as loud as if nothing were between source and listener.
    pub occlusion: f32,
    /// Linear gain of a direct path through walls, 0 to 4.
    pub transmission: f32,
    /// Strength of the Doppler shift, 0 to 4: factor of the delay of direct sound, whose change is the Doppler shift.
    /// All other sound of the source keeps its delay after the direct sound. At 0 nothing delays direct sound, so
    /// lightning and thunder come together.
    pub doppler: f32,
    /// Strength of the air's absorption along paths, 0 to 1. The late reverb decays for all sources alike, with air.
    pub air_absorption: f32,
}

impl Default for SourceMix {
    fn default() -> Self {
        Self::PHYSICAL
    }
}

impl SourceMix {
    /// Physics.
    pub const PHYSICAL: Self = Self {
        distance: DistanceCurve::Physical,
        direct_gain: 1.0,
        reflections_gain: 1.0,
        diffraction_gain: 1.0,
        late_gain: 1.0,
        occlusion: 1.0,
        transmission: 1.0,
        doppler: 1.0,
        air_absorption: 1.0,
    };

    /// Checks every range.
    ///
    /// # Errors
    /// [`Error::Setting`] names the value out of range.
    pub fn check(&self) -> Result<()> {
        self.distance.check()?;
        let ranges = [
            ("direct_gain", self.direct_gain, MAX_GAIN),
            ("reflections_gain", self.reflections_gain, MAX_GAIN),
            ("diffraction_gain", self.diffraction_gain, MAX_GAIN),
            ("late_gain", self.late_gain, MAX_GAIN),
            ("occlusion", self.occlusion, 1.0),
            ("transmission", self.transmission, MAX_STRENGTH),
            ("doppler", self.doppler, MAX_STRENGTH),
            ("air_absorption", self.air_absorption, 1.0),
        ];
        match ranges
            .iter()
            .find(|(_, value, most)| !(0.0..=*most).contains(value))
        {
            None => Ok(()),
            Some((name, value, most)) => Err(Error::setting(
                name,
                format!("{value} is out of range"),
                &format!("choose a value from 0 to {most}"),
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sets one value.
    type Set = fn(&mut SourceMix, f32);

    /// The absolute gain of a curve in the free field.
    fn gain(curve: DistanceCurve, distance_m: f32) -> f32 {
        curve.ratio(distance_m, 0.3) / distance_m.max(0.3)
    }

    #[test]
    fn curves_have_their_gains_at_every_distance() {
        let inverse = DistanceCurve::Inverse {
            min_m: 2.0,
            max_m: 8.0,
        };
        let linear = DistanceCurve::Linear {
            min_m: 2.0,
            max_m: 10.0,
        };
        let table = DistanceTable::new(&[[1.0, 0.5], [3.0, 1.0], [5.0, 0.0]]).expect("rises");
        let table = DistanceCurve::Table(table);
        for (distance_m, by_inverse, by_linear, by_table) in [
            (0.1, 1.0, 1.0, 0.5),
            (2.0, 1.0, 1.0, 0.75),
            (4.0, 0.5, 0.75, 0.5),
            (8.0, 0.25, 0.25, 0.0),
            (50.0, 0.25, 0.0, 0.0),
        ] {
            let gains = [inverse, linear, table].map(|curve| gain(curve, distance_m));
            for (found, exact) in gains.into_iter().zip([by_inverse, by_linear, by_table]) {
                assert!((found - exact).abs() < 1e-6, "{distance_m}: {gains:?}");
            }
        }
        assert_eq!(DistanceCurve::Physical.ratio(7.0, 0.3), 1.0);
    }

    #[test]
    fn values_out_of_range_are_refused_by_name() {
        let mixes: [(&str, Set); 8] = [
            ("direct_gain", |mix, value| mix.direct_gain = value),
            ("reflections_gain", |mix, value| {
                mix.reflections_gain = value
            }),
            ("diffraction_gain", |mix, value| {
                mix.diffraction_gain = value
            }),
            ("late_gain", |mix, value| mix.late_gain = value),
            ("occlusion", |mix, value| mix.occlusion = value),
            ("transmission", |mix, value| mix.transmission = value),
            ("doppler", |mix, value| mix.doppler = value),
            ("air_absorption", |mix, value| mix.air_absorption = value),
        ];
        for (name, set) in mixes {
            for value in [-0.1, 2e3, f32::NAN, f32::INFINITY] {
                let mut mix = SourceMix::default();
                set(&mut mix, value);
                let error = mix.check().expect_err("is out of range").to_string();
                assert!(error.contains(name), "{error}");
            }
        }
        for (min_m, max_m) in [
            (2.0, 1.0),
            (-1.0, 3.0),
            (f32::NAN, 3.0),
            (1.0, f32::INFINITY),
        ] {
            for distance in [
                DistanceCurve::Inverse { min_m, max_m },
                DistanceCurve::Linear { min_m, max_m },
            ] {
                let mix = SourceMix {
                    distance,
                    ..SourceMix::default()
                };
                assert!(mix.check().is_err(), "{distance:?}");
                // An unchecked curve is no NaN.
                assert!(distance.ratio(2.0, 0.3).is_finite());
            }
        }
        for points in [
            vec![],
            vec![[1.0, 1.0]; 2],
            vec![[2.0, 1.0], [1.0, 1.0]],
            vec![[0.0, -1.0]],
            vec![[f32::NAN, 1.0]],
            (0..17).map(|n| [n as f32, 1.0]).collect(),
        ] {
            assert!(DistanceTable::new(&points).is_err(), "{points:?}");
        }
    }
}
