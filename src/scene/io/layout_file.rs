//! Reads scene layouts; [`crate::scene::layout`] has the format.
//!
//! Control side.

use std::path::Path;

use glam::{Quat, Vec3};
use serde::Deserialize;
use toml::Spanned;

use super::material_file::{Materials, read_materials};
use super::toml_file::{PerBand, Position, TomlFile, Within, read_text};
use crate::error::{Error, Result};
use crate::scene::directivity::{Directivity, DirectivityTable};
use crate::scene::layout::{NamedSource, SceneLayout, Walk};
use crate::scene::source::{
    Effects, FRONT, MAX_EXTENT_POINTS, MIN_EXTENT_POINTS, SourceExtent, SourceSettings,
};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LayoutFile {
    name: Option<String>,
    #[serde(default)]
    sources: Vec<SourceFields>,
    listener: Option<WalkFields>,
    #[serde(default)]
    materials: Materials,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SourceFields {
    name: Spanned<String>,
    position: Position,
    facing: Option<Facing>,
    #[serde(default)]
    directivity: DirectivityFields,
    radius_m: Option<Within<0, 1000, true>>,
    extent_m: Option<SemiAxes>,
    extent_points: Option<Points>,
    #[serde(default)]
    without: Vec<Effect>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct DirectivityFields {
    weight: Option<PerBand<0, 1>>,
    order: Option<Within<0, 64>>,
    levels_db: Option<Levels>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WalkFields {
    from: Position,
    to: Spanned<Position>,
    speed_m_s: Within<0, { i32::MAX }, true>,
    standing: Option<Position>,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Effect {
    Direct,
    Reflections,
    Diffraction,
    Transmission,
    Late,
}

/// The rotation that turns the front of a source towards a direction.
#[derive(Deserialize)]
#[serde(try_from = "Position")]
struct Facing(Quat);

impl TryFrom<Position> for Facing {
    type Error = &'static str;

    fn try_from(direction: Position) -> std::result::Result<Self, Self::Error> {
        let direction = direction.0.try_normalize();
        let direction = direction.ok_or("no direction; give a direction such as [0, 0, 1]")?;
        Ok(Self(Quat::from_rotation_arc(FRONT, direction)))
    }
}

/// Semi-axes of a source in metres: one number for a sphere, or three.
#[derive(Deserialize)]
#[serde(try_from = "toml::Value")]
struct SemiAxes(Vec3);

impl TryFrom<toml::Value> for SemiAxes {
    type Error = String;

    fn try_from(value: toml::Value) -> std::result::Result<Self, String> {
        let values = match value {
            toml::Value::Array(values) => values,
            single => vec![single; 3],
        };
        let numbers = values
            .into_iter()
            .map(|value| value.try_into::<Within<0, 1000>>().map(|n| n.0 as f32))
            .collect::<std::result::Result<Vec<f32>, _>>()
            .map_err(|error| error.message().to_owned())?;
        let axes = <[f32; 3]>::try_from(numbers).map_err(|numbers| {
            format!(
                "{} numbers instead of 3; give the semi-axes along x, y and z in metres, or the radius of a sphere",
                numbers.len()
            )
        })?;
        Ok(Self(axes.into()))
    }
}

/// Points of a source with a size.
#[derive(Deserialize)]
#[serde(try_from = "i64")]
struct Points(usize);

impl TryFrom<i64> for Points {
    type Error = String;

    fn try_from(number: i64) -> std::result::Result<Self, String> {
        let (least, most) = (MIN_EXTENT_POINTS, MAX_EXTENT_POINTS);
        let points = usize::try_from(number).ok();
        points
            .filter(|points| (least..=most).contains(points))
            .map(Self)
            .ok_or_else(|| {
                format!("{number} is outside {least} to {most}; give a whole number in that range")
            })
    }
}

/// Levels in dB, one row an angle.
#[derive(Deserialize)]
#[serde(try_from = "Vec<PerBand<-63, 60>>")]
struct Levels(DirectivityTable);

impl TryFrom<Vec<PerBand<-63, 60>>> for Levels {
    type Error = Error;

    fn try_from(rows: Vec<PerBand<-63, 60>>) -> Result<Self> {
        let rows: Vec<_> = rows.iter().map(|row| row.0).collect();
        DirectivityTable::from_levels_db(&rows).map(Self)
    }
}

impl SceneLayout {
    /// Reads a layout file.
    ///
    /// # Errors
    /// As [`Self::parse`], and [`Error::File`] where the file cannot be read.
    pub fn load(path: &Path) -> Result<Self> {
        Self::parse(path, &read_text(path)?)
    }

    /// Parses a layout file; `path` is for errors and for a missing name.
    ///
    /// # Errors
    /// [`Error::Format`] with line and key for missing or unknown keys, numbers out of range, names
    /// that occur twice, a walk without length or speed, and the errors of [`crate::scene::MaterialTable::parse`].
    pub fn parse(path: &Path, text: &str) -> Result<Self> {
        let file = TomlFile { path, text };
        let content: LayoutFile = file.read()?;
        let mut sources: Vec<NamedSource> = Vec::new();
        for fields in content.sources {
            let name = fields.name.get_ref();
            if sources.iter().any(|source| source.name == *name) {
                return Err(file.error(
                    fields.name.span(),
                    format!("two sources named `{name}`"),
                    "give each source a name of its own",
                ));
            }
            sources.push(fields.into());
        }
        Ok(Self {
            name: content.name.unwrap_or_else(|| {
                let stem = path.file_stem().unwrap_or_default();
                stem.to_string_lossy().into_owned()
            }),
            sources,
            listener: content.listener.map(|walk| walk.read(&file)).transpose()?,
            materials: read_materials(&file, content.materials)?,
        })
    }
}

impl From<SourceFields> for NamedSource {
    fn from(fields: SourceFields) -> Self {
        let mut effects = Effects::default();
        for effect in fields.without {
            *match effect {
                Effect::Direct => &mut effects.direct,
                Effect::Reflections => &mut effects.reflections,
                Effect::Diffraction => &mut effects.diffraction,
                Effect::Transmission => &mut effects.transmission,
                Effect::Late => &mut effects.late,
            } = false;
        }
        let DirectivityFields {
            weight,
            order,
            levels_db,
        } = fields.directivity;
        Self {
            name: fields.name.into_inner(),
            position: fields.position.0,
            orientation: fields.facing.map_or(Quat::IDENTITY, |facing| facing.0),
            settings: SourceSettings {
                directivity: Directivity {
                    weight: weight.map_or(Directivity::OMNI.weight, |weight| weight.0),
                    order: order.map_or(Directivity::OMNI.order, |order| order.0 as f32),
                    table: levels_db.map(|levels| levels.0),
                },
                radius_m: fields.radius_m.map(|radius| radius.0 as f32),
                extent: SourceExtent {
                    semi_axes_m: fields.extent_m.map_or(Vec3::ZERO, |axes| axes.0),
                    points: fields
                        .extent_points
                        .map_or(SourceExtent::POINT.points, |points| points.0),
                },
                effects,
                ..SourceSettings::default()
            },
        }
    }
}

impl WalkFields {
    fn read(self, file: &TomlFile) -> Result<Walk> {
        if self.from == *self.to.get_ref() {
            return Err(file.error(
                self.to.span(),
                "`to` is the same position as `from`",
                "give the walk two different ends",
            ));
        }
        Ok(Walk {
            from: self.from.0,
            to: self.to.get_ref().0,
            speed_m_s: self.speed_m_s.0,
            standing: self.standing.unwrap_or(self.from).0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acoustics::BANDS;
    use crate::scene::SourceId;

    const HALL: &str = "name = \"hall\"\n[[sources]]\nname = \"a\"\nposition = [1, 2.5, 3]\n\
        [[sources]]\nname = \"b\"\nposition = [0, 0, 0]\n[listener]\nfrom = [0, 1, 0]\nto = [4, 1, 0]\n\
        speed_m_s = 2\n[materials.own]\nabsorption = 0.5\n";

    #[test]
    fn everything_in_the_file_arrives() {
        let layout = SceneLayout::parse(Path::new("x.toml"), HALL).unwrap();
        assert_eq!(layout.name, "hall");
        assert_eq!(layout.sources[0].position, Vec3::new(1.0, 2.5, 3.0));
        assert_eq!(layout.sources.len(), 2);
        assert_eq!(layout.listener.unwrap().standing, Vec3::new(0.0, 1.0, 0.0));
        assert!(layout.materials.get("own").is_some());
        let bare = SceneLayout::parse(Path::new("dir/yard.toml"), "").unwrap();
        assert_eq!(bare.name, "yard");
    }

    #[test]
    fn errors_name_line_key_and_remedy() {
        let walk = "[listener]\nfrom = [0, 0, 0]\nto = [1, 0, 0]\n";
        for (text, expected) in [
            (
                "[[sources]]\nname = 'a'".to_owned(),
                "x.toml:1: `sources`: missing field `position`",
            ),
            (
                "[[sources]]\nname = 'a'\nposition = [0, nan, 0]".to_owned(),
                "x.toml:3: `sources.position`: NaN is outside",
            ),
            (
                "[[sources]]\nname = 'a'\nposition = [0, 0]".to_owned(),
                "x.toml:3: `sources.position`: 2 numbers instead of 3",
            ),
            (
                "[[sources]]\nname = 'a'\nposition = [0, 1e9, 0]".to_owned(),
                "x.toml:3: `sources.position`: 1000000000 is outside -100000 to 100000",
            ),
            (
                "sources = [{name = 'a', position = [0,0,0]},\n{name = 'a', position = [1,0,0]}]"
                    .to_owned(),
                "x.toml:2: two sources named `a`",
            ),
            (
                format!("{walk}speed_m_s = 0"),
                "x.toml:4: `listener.speed_m_s`: 0 is outside above 0",
            ),
            (
                walk.to_owned(),
                "x.toml:1: `listener`: missing field `speed_m_s`",
            ),
            (
                "[listener]\nfrom = [0,0,0]\nto = [0,0,0]\nspeed_m_s = 1".to_owned(),
                "x.toml:3: `to` is the same position",
            ),
            ("[source]".to_owned(), "x.toml:1: unknown field `source`"),
        ] {
            let text = SceneLayout::parse(Path::new("x.toml"), &text)
                .unwrap_err()
                .to_string();
            assert!(text.starts_with(expected), "{text}");
            assert_eq!(text.lines().count(), 1);
        }
    }

    const SOURCE: &str = "[[sources]]\nname = 'a'\nposition = [1, 2, 3]\n";

    fn parse(more: &str) -> Result<SceneLayout> {
        SceneLayout::parse(Path::new("x.toml"), &format!("{SOURCE}{more}"))
    }

    #[test]
    fn source_settings_are_read() {
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
    fn sizes_of_sources_are_read() {
        let extent = |more: &str| parse(more).unwrap().sources[0].settings.extent;
        assert_eq!(extent(""), SourceExtent::POINT);
        assert_eq!(extent("extent_m = 2"), SourceExtent::sphere(2.0));
        let river = extent("extent_m = [30, 0, 1.5]\nextent_points = 32");
        assert_eq!(river.semi_axes_m, Vec3::new(30.0, 0.0, 1.5));
        assert_eq!(river.points, 32);
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
    fn errors_of_sources_name_line_key_and_remedy() {
        for (more, expected) in [
            (
                "facing = [0, 0, 0]",
                "x.toml:4: `sources.facing`: no direction; give",
            ),
            (
                "radius_m = -1",
                "x.toml:4: `sources.radius_m`: -1 is outside above 0 to 1000",
            ),
            (
                "extent_m = [1, 2]",
                "x.toml:4: `sources.extent_m`: 2 numbers instead of 3; give the semi-axes",
            ),
            (
                "extent_m = -1",
                "x.toml:4: `sources.extent_m`: -1 is outside 0 to 1000",
            ),
            (
                "extent_points = 33",
                "x.toml:4: `sources.extent_points`: 33 is outside 4 to 32",
            ),
            (
                "without = ['echo']",
                "x.toml:4: `sources.without`: unknown variant `echo`",
            ),
            (
                "directivity = { weight = [1, 1] }",
                "x.toml:4: `sources.directivity.weight`: 2 numbers",
            ),
            (
                "directivity = { weight = 2 }",
                "x.toml:4: `sources.directivity.weight`: 2 is outside 0 to 1",
            ),
            (
                "directivity = { order = 99 }",
                "x.toml:4: `sources.directivity.order`: 99 is outside 0 to 64",
            ),
            (
                "directivity = { levels_db = [0] }",
                "x.toml:4: `sources.directivity.levels_db`: directivity levels: 1 rows of angles",
            ),
            (
                "directivity = { shape = 1 }",
                "x.toml:4: `sources.directivity`: unknown field `shape`",
            ),
        ] {
            let text = parse(more).unwrap_err().to_string();
            assert!(text.starts_with(expected), "{text}");
            assert_eq!(text.lines().count(), 1);
        }
    }
}
