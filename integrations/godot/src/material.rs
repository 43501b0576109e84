//! Values of a material resource as a material of the library.

use foresound::{BANDS, Material};

/// A value in each octave band from 63 Hz to 8 kHz: eight values, or one for all.
///
/// # Errors
/// Says what is wrong with the values under their name.
pub fn bands(name: &str, values: &[f32]) -> Result<[f32; BANDS], String> {
    let bands = match *values {
        [one] => [one; BANDS],
        _ => <[f32; BANDS]>::try_from(values)
            .map_err(|_| format!("{name} has {} values: give one or {BANDS}", values.len()))?,
    };
    match bands.iter().find(|value| !(0.0..=1.0).contains(*value)) {
        Some(value) => Err(format!("{name} of {value}: choose values from 0 to 1")),
        None => Ok(bands),
    }
}

/// A material of own values.
///
/// # Errors
/// As [`bands`], and where more passes through than the material absorbs.
pub fn material(
    name: String,
    absorption: &[f32],
    scattering: &[f32],
    transmission: &[f32],
) -> Result<Material, String> {
    let material = Material {
        absorption: bands("absorption", absorption)?,
        scattering: bands("scattering", scattering)?,
        transmission: bands("transmission", transmission)?,
        name,
    };
    let mut pairs = material.transmission.iter().zip(&material.absorption);
    match pairs.find(|(through, absorbed)| through > absorbed) {
        Some((through, absorbed)) => Err(format!(
            "transmission of {through} with an absorption of {absorbed}: absorption counts what passes through"
        )),
        None => Ok(material),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_value_is_all_eight() {
        assert_eq!(bands("absorption", &[0.5]), Ok([0.5; BANDS]));
        let eight = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
        assert_eq!(bands("absorption", &eight), Ok(eight));
    }

    #[test]
    fn values_out_of_range_are_named() {
        for (values, part) in [
            (&[][..], "absorption has 0 values"),
            (&[0.1, 0.2], "absorption has 2 values"),
            (&[1.5], "absorption of 1.5"),
            (&[f32::NAN], "absorption of NaN"),
        ] {
            let error = bands("absorption", values).expect_err("refused");
            assert!(error.contains(part), "{error}");
        }
        let error = material("m".into(), &[0.1], &[0.1], &[0.2]).expect_err("refused");
        assert!(error.contains("transmission of 0.2"), "{error}");
    }
}
