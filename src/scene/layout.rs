//! Scene layouts: where sources stand and where a listener walks, in a TOML file beside a mesh.
//!
//! Control side. `NAME.toml` belongs to `NAME.obj`:
//!
//! ```toml
//! name = "concert_hall"            # the file's stem if absent
//! [[sources]]
//! name = "source01"
//! position = [1.0, 1.5, -2.0]      # more in `layout_source`
//! [listener]                       # optional
//! from = [0.0, 1.7, 0.0]
//! to = [10.0, 1.7, 0.0]
//! speed_m_s = 1.4
//! standing = [5.0, 1.7, 0.0]       # `from` if absent
//! [materials.own_wall]             # optional, see `materials`
//! absorption = 0.1
//! ```

use std::path::Path;

use glam::Vec3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::materials::MaterialTable;
use crate::error::Result;
use crate::scene::io::layout_source::{NamedSource, read_sources};
use crate::scene::io::toml_file::{TomlFile, read_text};

/// What goes into a scene beside its mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneLayout {
    /// Name of the scene.
    pub name: String,
    /// Sources by different names, in the file's order. May be empty.
    pub sources: Vec<NamedSource>,
    /// The listener, if the file places one.
    pub listener: Option<Walk>,
    /// The file's own materials, to be added to others with [`MaterialTable::extend`].
    pub materials: MaterialTable,
}

/// A listener who walks to and fro on a straight line at constant speed, or stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Walk {
    /// One end of the walk in metres, where it starts.
    pub from: Vec3,
    /// The other end in metres, not the same.
    pub to: Vec3,
    /// Speed in m/s, above zero.
    pub speed_m_s: f64,
    /// Where a listener stands who does not walk, in metres.
    pub standing: Vec3,
}

impl Walk {
    /// Position at a time, in metres. At time 0 the walk is `start_phase_m` metres along its way: from 0 at
    /// [`Self::from`] to its length at [`Self::to`], to twice that back again, and so on.
    pub fn position_at(&self, time_s: f64, start_phase_m: f64) -> Vec3 {
        let (from, to) = (self.from.as_dvec3(), self.to.as_dvec3());
        let length_m = from.distance(to);
        if length_m <= 0.0 {
            return self.from;
        }
        let way_m = (start_phase_m + self.speed_m_s * time_s).rem_euclid(2.0 * length_m);
        let share = 1.0 - (way_m / length_m - 1.0).abs();
        from.lerp(to, share).as_vec3()
    }
}

impl SceneLayout {
    /// Reads a layout file.
    ///
    /// # Errors
    /// As [`Self::parse`], and [`crate::Error::File`] where the file cannot be read.
    pub fn load(path: &Path) -> Result<Self> {
        Self::parse(path, &read_text(path)?)
    }

    /// Reads the text of a layout file; `path` is for errors and for a name where the text has none.
    ///
    /// # Errors
    /// [`crate::Error::Format`] with line and key for missing or unknown keys, numbers that are not finite, names that
    /// occur twice, a walk without length or speed, and whatever [`MaterialTable::parse`] refuses.
    pub fn parse(path: &Path, text: &str) -> Result<Self> {
        let file = TomlFile { path, text };
        let root = file.parse()?;
        file.known_keys(
            &root,
            "the file",
            &["name", "sources", "listener", "materials"],
        )?;
        let name = match root.get("name") {
            Some(value) => file.string(value, "name")?,
            None => path
                .file_stem()
                .map(|stem| stem.to_string_lossy().into_owned())
                .unwrap_or_default(),
        };
        let sources = match root.get("sources") {
            Some(value) => read_sources(file, value)?,
            None => Vec::new(),
        };
        let listener = match root.get("listener") {
            Some(value) => Some(read_walk(file, value)?),
            None => None,
        };
        let materials = match root.get("materials") {
            Some(value) => MaterialTable::from_toml(file, value)?,
            None => MaterialTable::default(),
        };
        Ok(Self {
            name,
            sources,
            listener,
            materials,
        })
    }
}

/// A key that must be there.
pub(super) fn required<'v, 'a>(
    file: TomlFile<'a>,
    owner: &Spanned<DeValue<'a>>,
    table: &'v DeTable<'a>,
    key: &str,
    place: &str,
) -> Result<&'v Spanned<DeValue<'a>>> {
    table.get(key).ok_or_else(|| {
        let problem = format!("`{key}` is missing in {place}");
        file.error(owner.span(), problem, &format!("add {key} = …"))
    })
}

fn read_walk<'a>(file: TomlFile<'a>, value: &Spanned<DeValue<'a>>) -> Result<Walk> {
    let table = file.table(value, "listener")?;
    file.known_keys(
        table,
        "`listener`",
        &["from", "to", "speed_m_s", "standing"],
    )?;
    let field = |key| required(file, value, table, key, "`listener`");
    let from = file.position(field("from")?, "from")?;
    let to_value = field("to")?;
    let to = file.position(to_value, "to")?;
    if from == to {
        return Err(file.error(
            to_value.span(),
            "`to` is the same place as `from`",
            "give the walk two different ends",
        ));
    }
    let speed_value = field("speed_m_s")?;
    let speed_m_s = file.number(speed_value, "speed_m_s")?;
    if speed_m_s <= 0.0 {
        return Err(file.error(
            speed_value.span(),
            format!("`speed_m_s` {speed_m_s} is not above 0"),
            "give metres a second; people walk at 1.4",
        ));
    }
    let standing = match table.get("standing") {
        Some(value) => file.position(value, "standing")?,
        None => from,
    };
    Ok(Walk {
        from,
        to,
        speed_m_s,
        standing,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn walk_turns_round_at_its_ends() {
        let layout = SceneLayout::parse(Path::new("x.toml"), HALL).unwrap();
        let walk = layout.listener.unwrap();
        for (time_s, phase_m, x) in [
            (0.0, 0.0, 0.0),
            (1.0, 0.0, 2.0),
            (2.0, 0.0, 4.0),
            (3.0, 0.0, 2.0),
            (4.0, 0.0, 0.0),
            (1.0, 3.0, 3.0),
            (-1.0, 0.0, 2.0),
        ] {
            assert_eq!(walk.position_at(time_s, phase_m), Vec3::new(x, 1.0, 0.0));
        }
    }

    #[test]
    fn errors_name_line_key_and_remedy() {
        let walk = "[listener]\nfrom = [0, 0, 0]\nto = [1, 0, 0]\n";
        for (text, expected) in [
            (
                "[[sources]]\nname = 'a'".to_owned(),
                "x.toml:1: `position` is missing in a source; add",
            ),
            (
                "[[sources]]\nname = 'a'\nposition = [0, nan, 0]".to_owned(),
                "x.toml:3: `position` is not a finite number",
            ),
            (
                "[[sources]]\nname = 'a'\nposition = [0, 0]".to_owned(),
                "x.toml:3: `position` has 2 numbers instead of 3",
            ),
            (
                "[[sources]]\nname = 'a'\nposition = [0, 1e9, 0]".to_owned(),
                "x.toml:3: `position` 1000000000 lies beyond",
            ),
            (
                "sources = [{name = 'a', position = [0,0,0]},\n{name = 'a', position = [1,0,0]}]"
                    .to_owned(),
                "x.toml:2: two sources named `a`",
            ),
            (
                format!("{walk}speed_m_s = 0"),
                "x.toml:4: `speed_m_s` 0 is not above 0",
            ),
            (walk.to_owned(), "x.toml:1: `speed_m_s` is missing"),
            (
                "[listener]\nfrom = [0,0,0]\nto = [0,0,0]\nspeed_m_s = 1".to_owned(),
                "x.toml:3: `to` is the same place",
            ),
            ("[source]".to_owned(), "x.toml:1: unknown key `source`"),
        ] {
            let text = SceneLayout::parse(Path::new("x.toml"), &text)
                .unwrap_err()
                .to_string();
            assert!(text.starts_with(expected), "{text}");
            assert_eq!(text.lines().count(), 1);
        }
    }
}
