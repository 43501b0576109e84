//! The sources of a layout file: place, front, directivity, size and wanted effects.
//!
//! Control side. Everything but name and position may be left out:
//!
//! ```toml
//! [[sources]]
//! name = "organ"
//! position = [1.0, 1.5, -2.0]
//! facing = [0.0, 0.0, 1.0]                    # −z if absent
//! directivity = { weight = 0.5, order = 1 }   # weight: one number or eight, by band
//! radius_m = 0.5                              # no louder than at this distance
//! without = ["late", "transmission"]          # of direct, reflections, diffraction, transmission, late
//! ```
//!
//! Instead of a pattern `directivity = { levels_db = [[0, 0, 0, 0, 0, 0, 0, 0], …] }` gives rows of levels by band, the
//! angles evenly from the front to the back.

use glam::{Quat, Vec3};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::acoustics::{BANDS, BandArray};
use crate::error::{Error, Result};
use crate::scene::directivity::{Directivity, DirectivityTable};
use crate::scene::io::toml_file::TomlFile;
use crate::scene::layout::required;
use crate::scene::pose::{SourceId, SourcePose};
use crate::scene::source::{Effects, FRONT, SourceSettings};

/// A sound source of a layout.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedSource {
    /// Name, unlike any other source's.
    pub name: String,
    /// Position in metres.
    pub position: Vec3,
    /// Turns source coordinates (+x right, +y up, −z ahead) into world coordinates.
    pub orientation: Quat,
    /// Directivity, size and wanted effects.
    pub settings: SourceSettings,
}

impl NamedSource {
    /// An omnidirectional source of default settings.
    pub fn plain(name: impl Into<String>, position: Vec3) -> Self {
        Self {
            name: name.into(),
            position,
            orientation: Quat::IDENTITY,
            settings: SourceSettings::default(),
        }
    }

    /// The source under a handle.
    pub fn pose(&self, id: SourceId) -> SourcePose {
        SourcePose {
            id,
            position: self.position,
            orientation: self.orientation,
            settings: self.settings,
        }
    }
}

const KEYS: [&str; 6] = [
    "name",
    "position",
    "facing",
    "directivity",
    "radius_m",
    "without",
];

/// The list of sources.
pub(crate) fn read_sources<'a>(
    file: TomlFile<'a>,
    value: &Spanned<DeValue<'a>>,
) -> Result<Vec<NamedSource>> {
    let DeValue::Array(values) = value.get_ref() else {
        return Err(file.error(
            value.span(),
            "`sources` is not a list",
            "write [[sources]] with two brackets",
        ));
    };
    let mut sources: Vec<NamedSource> = Vec::new();
    for value in values.iter() {
        let table = file.table(value, "sources")?;
        file.known_keys(table, "a source", &KEYS)?;
        let name_value = required(file, value, table, "name", "a source")?;
        let name = file.string(name_value, "name")?;
        if sources.iter().any(|source| source.name == name) {
            return Err(file.error(
                name_value.span(),
                format!("two sources named `{}`", name.escape_debug()),
                "give each source a name of its own",
            ));
        }
        let position = required(file, value, table, "position", "a source")?;
        let mut source = NamedSource::plain(name, file.position(position, "position")?);
        read_settings(file, table, &mut source)?;
        sources.push(source);
    }
    Ok(sources)
}

fn read_settings<'a>(
    file: TomlFile<'a>,
    table: &DeTable<'a>,
    source: &mut NamedSource,
) -> Result<()> {
    if let Some(value) = table.get("facing") {
        let facing = file.position(value, "facing")?;
        let Some(facing) = facing.try_normalize() else {
            return Err(file.error(
                value.span(),
                "`facing` has no direction",
                "give a direction such as [0, 0, 1]",
            ));
        };
        source.orientation = Quat::from_rotation_arc(FRONT, facing);
    }
    if let Some(value) = table.get("directivity") {
        source.settings.directivity = read_directivity(file, value)?;
    }
    if let Some(value) = table.get("radius_m") {
        let radius_m = file.number(value, "radius_m")?;
        if !(radius_m > 0.0 && radius_m <= 1000.0) {
            return Err(file.error(
                value.span(),
                format!("`radius_m` {radius_m} is no radius"),
                "give metres above 0 and up to 1000",
            ));
        }
        source.settings.radius_m = Some(radius_m as f32);
    }
    if let Some(value) = table.get("without") {
        source.settings.effects = read_effects(file, value)?;
    }
    Ok(())
}

fn read_directivity<'a>(file: TomlFile<'a>, value: &Spanned<DeValue<'a>>) -> Result<Directivity> {
    let table = file.table(value, "directivity")?;
    file.known_keys(table, "`directivity`", &["weight", "order", "levels_db"])?;
    let mut directivity = Directivity::OMNI;
    if let Some(value) = table.get("weight") {
        directivity.weight = read_bands(file, value, "weight")?;
        for weight in directivity.weight {
            if !(0.0..=1.0).contains(&weight) {
                return Err(file.error(
                    value.span(),
                    format!("`weight` {weight} is out of range"),
                    "give 0 (the same everywhere) over 0.5 (cardioid) to 1 (dipole)",
                ));
            }
        }
    }
    if let Some(value) = table.get("order") {
        let order = file.number(value, "order")?;
        if !(0.0..=64.0).contains(&order) {
            return Err(file.error(
                value.span(),
                format!("`order` {order} is out of range"),
                "give 0 to 64; 1 is the plain pattern",
            ));
        }
        directivity.order = order as f32;
    }
    if let Some(value) = table.get("levels_db") {
        let DeValue::Array(rows) = value.get_ref() else {
            return Err(file.error(
                value.span(),
                "`levels_db` is not a list of rows",
                "give a row of eight levels an angle, from the front to the back",
            ));
        };
        let rows: Vec<BandArray> = rows
            .iter()
            .map(|row| read_bands(file, row, "levels_db"))
            .collect::<Result<_>>()?;
        let table = DirectivityTable::from_levels_db(&rows).map_err(|error| {
            let (problem, advice) = match error {
                Error::Setting {
                    problem, advice, ..
                } => (problem, advice),
                other => (other.to_string(), "give levels in dB".to_owned()),
            };
            file.error(value.span(), problem, &advice)
        })?;
        directivity.table = Some(table);
    }
    Ok(directivity)
}

/// One number for all bands, or eight.
fn read_bands<'a>(
    file: TomlFile<'a>,
    value: &Spanned<DeValue<'a>>,
    key: &str,
) -> Result<BandArray> {
    let numbers = file.numbers(value, key)?;
    match numbers.len() {
        1 => Ok([numbers[0].0 as f32; BANDS]),
        BANDS => Ok(std::array::from_fn(|band| numbers[band].0 as f32)),
        count => Err(file.error(
            value.span(),
            format!("`{key}` has {count} numbers"),
            "give one for all bands, or eight from 63 Hz to 8 kHz",
        )),
    }
}

fn read_effects<'a>(file: TomlFile<'a>, value: &Spanned<DeValue<'a>>) -> Result<Effects> {
    let DeValue::Array(names) = value.get_ref() else {
        return Err(file.error(
            value.span(),
            "`without` is not a list",
            "write without = [\"late\"]",
        ));
    };
    let mut effects = Effects::default();
    for name in names.iter() {
        let wanted = match file.string(name, "without")?.as_str() {
            "direct" => &mut effects.direct,
            "reflections" => &mut effects.reflections,
            "diffraction" => &mut effects.diffraction,
            "transmission" => &mut effects.transmission,
            "late" => &mut effects.late,
            other => {
                return Err(file.error(
                    name.span(),
                    format!("`{}` is no effect", other.escape_debug()),
                    "use direct, reflections, diffraction, transmission, late",
                ));
            }
        };
        *wanted = false;
    }
    Ok(effects)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::layout::SceneLayout;

    const SOURCE: &str = "[[sources]]\nname = 'a'\nposition = [1, 2, 3]\n";

    fn parse(more: &str) -> Result<SceneLayout> {
        SceneLayout::parse(Path::new("x.toml"), &format!("{SOURCE}{more}"))
    }

    #[test]
    fn what_a_source_says_of_itself_arrives() {
        let layout = parse(
            "facing = [0, 0, 2]\ndirectivity = { weight = [0, 0, 0, 0, 0.5, 0.5, 0.5, 1], order = 2 }\n\
             radius_m = 0.5\nwithout = ['late', 'transmission']",
        )
        .unwrap();
        let pose = layout.sources[0].pose(SourceId::new(3, 0));
        assert_eq!(pose.id.slot(), 3);
        assert!((pose.orientation * FRONT - Vec3::Z).length() < 1e-6);
        assert_eq!(pose.settings.directivity.weight[7], 1.0);
        assert_eq!(pose.settings.directivity.order, 2.0);
        assert_eq!(pose.settings.radius_m, Some(0.5));
        let effects = pose.settings.effects;
        assert!(!effects.late && !effects.transmission && effects.direct && effects.diffraction);
        let plain = parse("").unwrap();
        assert_eq!(
            plain.sources[0],
            NamedSource::plain("a", Vec3::new(1.0, 2.0, 3.0))
        );
    }

    #[test]
    fn tables_of_levels_arrive() {
        let layout = parse("directivity = { levels_db = [0, -6, [-12, 0, 0, 0, 0, 0, 0, -60]] }");
        let directivity = layout.unwrap().sources[0].settings.directivity;
        assert!((20.0 * directivity.factor(0.0)[0].log10() + 6.0).abs() < 0.3);
        assert!((20.0 * directivity.factor(-1.0)[7].log10() + 60.0).abs() < 0.3);
        assert_eq!(directivity.factor(1.0), [1.0; BANDS]);
    }

    #[test]
    fn errors_name_line_key_and_remedy() {
        for (more, expected) in [
            ("facing = [0, 0, 0]", "x.toml:4: `facing` has no direction"),
            ("radius_m = -1", "x.toml:4: `radius_m` -1 is no radius"),
            ("without = ['echo']", "x.toml:4: `echo` is no effect"),
            (
                "directivity = { weight = [1, 1] }",
                "x.toml:4: `weight` has 2 numbers",
            ),
            (
                "directivity = { weight = 2 }",
                "x.toml:4: `weight` 2 is out of range",
            ),
            (
                "directivity = { order = 99 }",
                "x.toml:4: `order` 99 is out of range",
            ),
            (
                "directivity = { levels_db = [0] }",
                "x.toml:4: 1 rows of angles",
            ),
            (
                "directivity = { shape = 1 }",
                "x.toml:4: unknown key `shape`",
            ),
        ] {
            let text = parse(more).unwrap_err().to_string();
            assert!(text.starts_with(expected), "{text}");
            assert_eq!(text.lines().count(), 1);
        }
    }
}
