//! Reads one material of a TOML file.
//!
//! Control side. Takes a `[materials.NAME]` table, gives a [`MaterialEntry`] whose numbers are in range, or an error
//! with the line of the one that is not.

use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use crate::acoustics::bands::{BANDS, BandArray};
use crate::acoustics::material::Material;
use crate::error::Result;
use crate::scene::io::toml_file::TomlFile;
use crate::scene::materials::{DEFAULT_SCATTERING, DEFAULT_TRANSMISSION, MaterialEntry};

/// By how much transmission may exceed absorption: the rounding of a level to two digits.
const TRANSMISSION_SLACK: f32 = 1e-6;

const KEYS: [&str; 5] = [
    "absorption",
    "scattering",
    "transmission",
    "transmission_loss_db",
    "source",
];

pub(crate) fn read_entry<'a>(
    file: TomlFile<'a>,
    name: &Spanned<DeString<'a>>,
    fields: &DeTable<'a>,
) -> Result<MaterialEntry> {
    let name_text = name.get_ref().as_ref();
    let place = format!("material `{}`", name_text.escape_debug());
    file.known_keys(fields, &place, &KEYS)?;
    let Some(absorption) = fields.get("absorption") else {
        return Err(file.error(
            name.span(),
            format!("{place} has no `absorption`"),
            "add absorption = [eight numbers from 0 to 1], 63 Hz to 8 kHz",
        ));
    };
    let absorption = bands(file, absorption, "absorption", &place)?;
    let scattering = match fields.get("scattering") {
        Some(value) => bands(file, value, "scattering", &place)?,
        None => [DEFAULT_SCATTERING; BANDS],
    };
    let passage = fields
        .get("transmission")
        .or_else(|| fields.get("transmission_loss_db"));
    let transmission = match (
        fields.get("transmission"),
        fields.get("transmission_loss_db"),
    ) {
        (Some(value), None) => bands(file, value, "transmission", &place)?,
        (None, Some(value)) => levels(file, value, "transmission_loss_db", &place)?
            .map(|loss_db| 10f32.powf(-loss_db / 10.0)),
        (None, None) => [DEFAULT_TRANSMISSION; BANDS],
        (Some(value), Some(_)) => {
            return Err(file.error(
                value.span(),
                format!("{place} has both `transmission` and `transmission_loss_db`"),
                "keep one of them",
            ));
        }
    };
    if let (Some(value), Some(b)) = (
        passage,
        (0..BANDS).find(|&b| transmission[b] > absorption[b] + TRANSMISSION_SLACK),
    ) {
        return Err(file.error(
            value.span(),
            format!(
                "{place} transmits {:.3} but absorbs {} in band {} of 8",
                transmission[b],
                absorption[b],
                b + 1
            ),
            "raise absorption (it counts what passes through) or lower transmission",
        ));
    }
    let transmission = std::array::from_fn(|b| transmission[b].min(absorption[b]));
    let source = match fields.get("source") {
        Some(value) => file.string(value, "source")?,
        None => String::new(),
    };
    Ok(MaterialEntry {
        material: Material {
            name: name_text.to_owned(),
            absorption,
            scattering,
            transmission,
        },
        source,
    })
}

/// One ratio a band, from 0 to 1.
fn bands(
    file: TomlFile<'_>,
    value: &Spanned<DeValue<'_>>,
    key: &str,
    place: &str,
) -> Result<BandArray> {
    spectrum(file, value, key, place, 1.0, "give numbers from 0 to 1")
}

/// One level a band, from 0 dB.
fn levels(
    file: TomlFile<'_>,
    value: &Spanned<DeValue<'_>>,
    key: &str,
    place: &str,
) -> Result<BandArray> {
    let advice = "give decibels from 0 to 200";
    spectrum(file, value, key, place, 200.0, advice)
}

fn spectrum(
    file: TomlFile<'_>,
    value: &Spanned<DeValue<'_>>,
    key: &str,
    place: &str,
    most: f64,
    advice: &str,
) -> Result<BandArray> {
    let numbers = file.numbers(value, key)?;
    for (number, span) in &numbers {
        if !(0.0..=most).contains(number) {
            let problem = format!("`{key}` of {place} has {number}, outside 0 to {most}");
            return Err(file.error(span.clone(), problem, advice));
        }
    }
    match numbers[..] {
        [(single, _)] => Ok([single as f32; BANDS]),
        _ if numbers.len() == BANDS => Ok(std::array::from_fn(|b| numbers[b].0 as f32)),
        _ => Err(file.error(
            value.span(),
            format!(
                "`{key}` of {place} has {} numbers instead of {BANDS}",
                numbers.len()
            ),
            "give one for each octave from 63 Hz to 8 kHz, or a single number for all",
        )),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::materials::MaterialTable;

    fn problem(text: &str) -> String {
        MaterialTable::parse(Path::new("m.toml"), text)
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn losses_become_energy_ratios_and_defaults_hold() {
        let text = "[materials.a]\nabsorption = 0.2\ntransmission_loss_db = 20\n[materials.b]\nabsorption = 1\n";
        let table = MaterialTable::parse(Path::new("m.toml"), text).unwrap();
        let a = &table.get("a").unwrap().material;
        assert!((a.transmission[7] - 0.01).abs() < 1e-8);
        let b = &table.get("b").unwrap().material;
        assert_eq!(b.scattering, [DEFAULT_SCATTERING; BANDS]);
        assert_eq!(b.transmission, [DEFAULT_TRANSMISSION; BANDS]);
    }

    #[test]
    fn errors_name_line_key_and_remedy() {
        for (text, expected) in [
            (
                "[materials.a]\nabsorption = [0.1, 0.2]",
                "m.toml:2: `absorption` of material `a` has 2 numbers instead of 8; give one",
            ),
            (
                "[materials.a]\nabsorption = 1.5",
                "m.toml:2: `absorption` of material `a` has 1.5, outside 0 to 1; give",
            ),
            (
                "[materials.a]\nabsorption = nan",
                "m.toml:2: `absorption` is not a finite number",
            ),
            (
                "\n[materials.a]\nscattering = 0.1",
                "m.toml:2: material `a` has no `absorption`",
            ),
            (
                "[materials.a]\nabsorption = 0.1\ntransmission = 0.2",
                "m.toml:3: material `a` transmits 0.200 but absorbs 0.1 in band 1 of 8; raise",
            ),
            (
                "[materials.a]\nabsorption = 0.1\nabsorbtion = 0.2",
                "m.toml:3: unknown key `absorbtion` in material `a`; use absorption",
            ),
            (
                "[materials.a]\nabsorption = 'x'",
                "m.toml:2: `absorption` is a string instead of a number",
            ),
            (
                "[materials.a]\nabsorption = 1\ntransmission = 0\ntransmission_loss_db = 3",
                "m.toml:3: material `a` has both",
            ),
            ("materials = 3", "m.toml:1: `materials` is a number instead"),
            (
                "[material.a]",
                "m.toml:1: unknown key `material` in the file",
            ),
            ("[materials.a\n", "m.toml:1: "),
        ] {
            let text = problem(text);
            assert!(text.starts_with(expected), "{text}");
            assert_eq!(text.lines().count(), 1);
        }
    }
}
