//! SOFA files of the convention SimpleFreeFieldHRIR \[AES69\], read by the crate `hdf5-pure` and checked.
//!
//! A file's sizes are checked before its values are read: what is claimed and not there takes no memory.

use std::collections::HashMap;
use std::hash::BuildHasher;

use glam::DVec3;
use hdf5_pure::{AttrValue, Dataset, File};

use crate::error::{Error, Result};

use super::sphere_grid;

/// First bytes of an HDF5 file.
pub(crate) const SIGNATURE: &[u8; 8] = b"\x89HDF\r\n\x1a\n";
const CONVENTION: &str = "SimpleFreeFieldHRIR";
/// Limits of a set: directions, taps and samples of all responses.
const DIRECTIONS: [u64; 2] = [8, 65_536];
const TAPS: [u64; 2] = [16, 65_536];
const MOST_SAMPLES: u64 = 16 << 20;
/// Limits of sample rates in Hz.
const RATES_HZ: [f64; 2] = [16_000.0, 192_000.0];
/// Longest delay of a response in seconds: 34 m.
const LONGEST_DELAY_S: f64 = 0.1;
const DAMAGED: &str = "load the file from its source again";

/// Responses of both ears by direction.
pub(super) struct Measurement {
    pub(super) rate_hz: u32,
    /// Unit vectors: +x right, +y up, −z ahead.
    pub(super) directions: Vec<DVec3>,
    /// Delays of the left and right ear on top of the responses.
    pub(super) delays_s: Vec<[f64; 2]>,
    taps: usize,
    /// Ordered by direction, then by ear.
    responses: Vec<f32>,
}

impl Measurement {
    /// Errors: [`Error::Format`] with `name`.
    pub(super) fn read(bytes: &[u8], name: &str) -> Result<Self> {
        let reader = Reader { name };
        if !bytes.starts_with(SIGNATURE) {
            return Err(reader.refused("this is no SOFA file", "give a file that ends in .sofa"));
        }
        let file = File::from_bytes(bytes.to_vec()).map_err(|error| reader.damaged(error))?;
        let attributes = file.root().attrs().map_err(|error| reader.damaged(error))?;
        reader.check_convention(&attributes)?;

        let (shape, impulses) = reader.dataset(&file, "Data.IR")?;
        let [count, ears, taps] = *shape.as_slice() else {
            return Err(reader.of_shape("Data.IR", &shape, "[directions, 2, taps]"));
        };
        if ears != 2 {
            return Err(reader.of_shape("Data.IR", &shape, "[directions, 2, taps]"));
        }
        let range =
            |what: &str, value: u64, [low, high]: [u64; 2]| match (low..=high).contains(&value) {
                true => Ok(()),
                false => Err(reader.refused(
                    &format!("{value} {what}, outside {low} to {high}"),
                    "give a set of one head",
                )),
            };
        range("directions", count, DIRECTIONS)?;
        range("taps", taps, TAPS)?;
        let [rate_hz] = *reader.values(&file, "Data.SamplingRate", &[&[1]])? else {
            return Err(reader.refused("more than one sample rate", "give a set of one head"));
        };
        if !(RATES_HZ[0]..=RATES_HZ[1]).contains(&rate_hz)
            || (rate_hz - rate_hz.round()).abs() > 0.01
        {
            let problem =
                format!("a sample rate of {rate_hz} Hz, no whole number from 16000 to 192000");
            return Err(reader.refused(&problem, "resample the file to 44100 or 48000 Hz"));
        }
        reader.check_listener(&file)?;
        let directions = reader.directions(&file, count)?;
        let swapped = reader.has_right_ear_first(&file)?;
        let delays = reader.values(&file, "Data.Delay", &[&[1, 2], &[count, 2]]);
        let delays = delays.or_else(|error| match file.dataset("Data.Delay") {
            Ok(_) => Err(error),
            Err(_) => Ok(vec![0.0; 2]),
        })?;
        if delays
            .iter()
            .any(|frames| !(0.0..=LONGEST_DELAY_S).contains(&(frames / rate_hz)))
        {
            let problem = format!("a delay outside 0 to {LONGEST_DELAY_S} s");
            return Err(reader.refused(&problem, DAMAGED));
        }
        let mut responses = reader.read_f32(&impulses, count * 2 * taps)?;
        reader.check_responses(&responses, taps as usize)?;
        let mut delays_s: Vec<[f64; 2]> = (0..count as usize)
            .map(|n| std::array::from_fn(|ear| delays[(2 * n + ear) % delays.len()] / rate_hz))
            .collect();
        if swapped {
            for pair in responses.chunks_exact_mut(2 * taps as usize) {
                let (first, second) = pair.split_at_mut(taps as usize);
                first.swap_with_slice(second);
            }
            delays_s.iter_mut().for_each(|pair| pair.reverse());
        }
        Ok(Self {
            rate_hz: rate_hz as u32,
            directions,
            delays_s,
            taps: taps as usize,
            responses,
        })
    }

    /// The response of a direction's left (0) or right (1) ear.
    pub(super) fn response(&self, direction: usize, ear: usize) -> &[f32] {
        &self.responses[(2 * direction + ear) * self.taps..][..self.taps]
    }

    /// The measurement without directions that are close to others.
    pub(super) fn thinned(&self) -> Self {
        let kept = sphere_grid::apart(&self.directions);
        let pair = |index: &usize| &self.responses[2 * index * self.taps..][..2 * self.taps];
        Self {
            rate_hz: self.rate_hz,
            directions: kept.iter().map(|index| self.directions[*index]).collect(),
            delays_s: kept.iter().map(|index| self.delays_s[*index]).collect(),
            taps: self.taps,
            responses: kept.iter().flat_map(pair).copied().collect(),
        }
    }
}

/// Checks and errors of one file.
struct Reader<'a> {
    name: &'a str,
}

impl Reader<'_> {
    fn refused(&self, problem: &str, advice: &str) -> Error {
        Error::format(self.name, None, problem, advice)
    }

    /// An error of the HDF5 reader, on one line and without control characters.
    fn damaged(&self, error: impl ToString) -> Error {
        let text = plain(&error.to_string());
        self.refused(&format!("a damaged SOFA file: {text}"), DAMAGED)
    }

    fn of_shape(&self, name: &str, shape: &[u64], wanted: &str) -> Error {
        let problem = format!("{name} has the shape {shape:?} and not {wanted}");
        self.refused(&problem, "give a set of the convention SimpleFreeFieldHRIR")
    }

    fn check_convention<S: BuildHasher>(
        &self,
        attributes: &HashMap<String, AttrValue, S>,
    ) -> Result<()> {
        let text = |key: &str| attributes.get(key).and_then(AttrValue::as_str);
        if text("Conventions") != Some("SOFA") {
            return Err(self.refused(
                "this is an HDF5 file, but no SOFA file",
                "give a file that ends in .sofa",
            ));
        }
        let convention = text("SOFAConventions").unwrap_or("none");
        if convention != CONVENTION {
            let problem = format!(
                "the convention is {} and not {CONVENTION}",
                plain(convention)
            );
            return Err(self.refused(
                &problem,
                "give head-related impulse responses in free field",
            ));
        }
        Ok(())
    }

    /// A data set and its shape; chunks of a stored one are no larger than a set may be.
    fn dataset(&self, file: &File, name: &str) -> Result<(Vec<u64>, Dataset)> {
        let missing = |_| self.refused(&format!("{name} is missing"), DAMAGED);
        let dataset = file.dataset(name).map_err(missing)?;
        let shape = dataset.shape().map_err(|error| self.damaged(error))?;
        let chunk = dataset.chunk_shape().map_err(|error| self.damaged(error))?;
        for sizes in [Some(&shape), chunk.as_ref()].into_iter().flatten() {
            let values = sizes
                .iter()
                .try_fold(1_u64, |product, size| product.checked_mul(*size));
            if values.is_none_or(|values| values > MOST_SAMPLES) {
                let problem =
                    format!("{name} claims the shape {sizes:?}, more than {MOST_SAMPLES} values");
                return Err(self.refused(&problem, "give a set of one head"));
            }
        }
        Ok((shape, dataset))
    }

    /// The values of a data set of one of some shapes.
    fn values(&self, file: &File, name: &str, shapes: &[&[u64]]) -> Result<Vec<f64>> {
        let (shape, dataset) = self.dataset(file, name)?;
        if !shapes.contains(&shape.as_slice()) {
            return Err(self.of_shape(name, &shape, &format!("{:?}", shapes[0])));
        }
        self.read(&dataset, shape.iter().product())
    }

    fn read(&self, dataset: &Dataset, count: u64) -> Result<Vec<f64>> {
        let values = dataset.read_f64().map_err(|error| self.damaged(error))?;
        if values.len() as u64 != count || values.iter().any(|value| !value.is_finite()) {
            return Err(self.refused("values are missing or not finite", DAMAGED));
        }
        Ok(values)
    }

    fn read_f32(&self, dataset: &Dataset, count: u64) -> Result<Vec<f32>> {
        let values = dataset.read_f32().map_err(|error| self.damaged(error))?;
        if values.len() as u64 != count || values.iter().any(|value| !value.is_finite()) {
            return Err(self.refused("values are missing or not finite", DAMAGED));
        }
        Ok(values)
    }

    /// Unit vectors of the sources in head coordinates.
    fn directions(&self, file: &File, count: u64) -> Result<Vec<DVec3>> {
        let positions = self.values(file, "SourcePosition", &[&[count, 3]])?;
        let to_vector = self.coordinates(file, "SourcePosition")?;
        let direction = |position: &[f64]| {
            let vector = to_vector([position[0], position[1], position[2]]);
            vector
                .try_normalize()
                .ok_or_else(|| self.refused("a source in the middle of the head", DAMAGED))
        };
        positions.chunks_exact(3).map(direction).collect()
    }

    /// How positions of a data set become vectors: by its attributes `Type` and `Units`.
    fn coordinates(&self, file: &File, name: &str) -> Result<fn([f64; 3]) -> DVec3> {
        let (_, dataset) = self.dataset(file, name)?;
        let attributes = dataset.attrs().map_err(|error| self.damaged(error))?;
        let text = |key: &str| {
            attributes
                .get(key)
                .and_then(AttrValue::as_str)
                .unwrap_or("")
        };
        match (text("Type"), text("Units").starts_with("rad")) {
            ("spherical", false) => Ok(|[azimuth, elevation, distance]| {
                spherical([azimuth.to_radians(), elevation.to_radians(), distance])
            }),
            ("spherical", true) => Ok(spherical),
            ("cartesian", _) => Ok(cartesian),
            (other, _) => {
                let problem = format!("{name} has the coordinates {:?}", plain(other));
                Err(self.refused(
                    &problem,
                    "give a set with spherical or cartesian coordinates",
                ))
            }
        }
    }

    /// The listener looks along +x and has +z above, as by default.
    fn check_listener(&self, file: &File) -> Result<()> {
        for (name, wanted) in [("ListenerView", DVec3::NEG_Z), ("ListenerUp", DVec3::Y)] {
            let Ok(values) = self.values(file, name, &[&[1, 3]]) else {
                continue;
            };
            // `ListenerUp` has the coordinates of `ListenerView` where it names none.
            let to_vector = self
                .coordinates(file, name)
                .or_else(|_| self.coordinates(file, "ListenerView"));
            let Ok(to_vector) = to_vector else { continue };
            let vector = to_vector([values[0], values[1], values[2]]).normalize_or_zero();
            if vector.dot(wanted) < 0.999 {
                let problem = format!("{name} is turned");
                return Err(self.refused(
                    &problem,
                    "give a set whose listener looks along +x, with +z above",
                ));
            }
        }
        Ok(())
    }

    /// Whether the first receiver is on the right. Without positions the left ear is the first.
    fn has_right_ear_first(&self, file: &File) -> Result<bool> {
        if file.dataset("ReceiverPosition").is_err() {
            return Ok(false);
        }
        let values = self.values(file, "ReceiverPosition", &[&[2, 3, 1], &[2, 3]])?;
        let to_vector = self.coordinates(file, "ReceiverPosition")?;
        let across = [0, 3].map(|n| to_vector([values[n], values[n + 1], values[n + 2]]).x);
        Ok(across[0] > across[1])
    }

    fn check_responses(&self, responses: &[f32], taps: usize) -> Result<()> {
        let largest = responses.iter().fold(0.0_f32, |a, b| a.max(b.abs()));
        if !(1e-12..=1e12).contains(&largest) {
            return Err(self.refused(&format!("responses with a peak of {largest:e}"), DAMAGED));
        }
        let is_silent =
            |response: &[f32]| response.iter().all(|sample| sample.abs() < 1e-6 * largest);
        match responses.chunks_exact(taps).position(is_silent) {
            Some(index) => {
                let ear = ["first", "second"][index % 2];
                let problem = format!("the {ear} receiver is silent in measurement {}", index / 2);
                Err(self.refused(&problem, "remove that measurement, or load the file again"))
            }
            None => Ok(()),
        }
    }
}

/// SOFA's axes (+x ahead, +y left, +z up) in head coordinates.
fn cartesian([x, y, z]: [f64; 3]) -> DVec3 {
    DVec3::new(-y, z, -x)
}

/// Azimuth to the left and elevation in radians.
fn spherical([azimuth, elevation, distance]: [f64; 3]) -> DVec3 {
    let across = distance * elevation.cos();
    cartesian([
        across * azimuth.cos(),
        across * azimuth.sin(),
        distance * elevation.sin(),
    ])
}

/// At most 120 characters of a text, without control characters.
fn plain(text: &str) -> String {
    let printable = text.chars().map(|c| if c.is_control() { ' ' } else { c });
    printable.take(120).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_those_of_the_head() {
        let ahead = spherical([0.0, 0.0, 2.0]);
        let left = spherical([90_f64.to_radians(), 0.0, 1.0]);
        let above = spherical([0.3, 90_f64.to_radians(), 1.0]);
        for (found, wanted) in [
            (ahead, 2.0 * DVec3::NEG_Z),
            (left, DVec3::NEG_X),
            (above, DVec3::Y),
        ] {
            assert!(found.distance(wanted) < 1e-12, "{found} {wanted}");
        }
    }
}
