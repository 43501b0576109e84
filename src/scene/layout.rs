//! Scene layouts: positions of sources and the walk of a listener.
//!
//! Control side. With the feature `files` a layout is read from `NAME.toml` beside `NAME.obj`:
//!
//! ```toml
//! name = "concert_hall"            # the file's stem if absent
//! [[sources]]
//! name = "organ"
//! position = [1.0, 1.5, -2.0]
//! facing = [0.0, 0.0, 1.0]                    # −z if absent
//! directivity = { weight = 0.5, order = 1 }   # weight: one number or eight, by band
//! radius_m = 0.5                              # constant level below this distance
//! extent_m = [20.0, 0.2, 1.5]                 # semi-axes of a source with a size; one number for a sphere
//! extent_points = 16                          # its points, 4 to 32
//! without = ["late", "transmission"]          # of direct, reflections, diffraction, transmission, late
//! [listener]                       # optional
//! from = [0.0, 1.7, 0.0]
//! to = [10.0, 1.7, 0.0]
//! speed_m_s = 1.4
//! standing = [5.0, 1.7, 0.0]       # `from` if absent
//! [materials.own_wall]             # optional, see `materials`
//! absorption = 0.1
//! ```
//!
//! Only name and position of a source are required. Instead of a pattern `directivity = { levels_db = [[0, 0, 0, 0, 0, 0, 0, 0],
//! …] }` holds rows of levels by band, the angles evenly from the front to the back.

use glam::{Quat, Vec3};

use super::materials::MaterialTable;
use super::pose::{SourceId, SourcePose};
use super::source::SourceSettings;

/// Sources, listener and materials of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneLayout {
    /// Name of the scene.
    pub name: String,
    /// Sources with unique names, in the file's order. May be empty.
    pub sources: Vec<NamedSource>,
    /// The listener, if the file has one.
    pub listener: Option<Walk>,
    /// The file's own materials, to be added to others with [`MaterialTable::extend`].
    pub materials: MaterialTable,
}

/// A listener that walks back and forth on a straight line at constant speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Walk {
    /// Start of the walk in metres.
    pub from: Vec3,
    /// Other end of the walk in metres, different from the start.
    pub to: Vec3,
    /// Speed in m/s, above zero.
    pub speed_m_s: f64,
    /// Position of a listener at rest, in metres.
    pub standing: Vec3,
}

impl Walk {
    /// Position at a time, in metres. `start_phase_m` is the distance walked at time 0: 0 is [`Self::from`], the length of
    /// the line is [`Self::to`], twice the length is [`Self::from`] again.
    pub fn position_at(&self, time_s: f64, start_phase_m: f64) -> Vec3 {
        let (from, to) = (self.from.as_dvec3(), self.to.as_dvec3());
        let length_m = from.distance(to);
        if length_m <= 0.0 {
            return self.from;
        }
        let path_length_m = (start_phase_m + self.speed_m_s * time_s).rem_euclid(2.0 * length_m);
        let share = 1.0 - (path_length_m / length_m - 1.0).abs();
        from.lerp(to, share).as_vec3()
    }
}

/// A sound source of a layout.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedSource {
    /// Unique name.
    pub name: String,
    /// Position in metres.
    pub position: Vec3,
    /// Turns source coordinates (+x right, +y up, −z ahead) into world coordinates.
    pub orientation: Quat,
    /// Directivity, radius, size and effects.
    pub settings: SourceSettings,
}

impl NamedSource {
    /// An omnidirectional source of default settings.
    pub fn plain(name: impl Into<String>, position: impl Into<Vec3>) -> Self {
        Self {
            name: name.into(),
            position: position.into(),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walk_reverses_at_its_ends() {
        let walk = Walk {
            from: Vec3::Y,
            to: Vec3::new(4.0, 1.0, 0.0),
            speed_m_s: 2.0,
            standing: Vec3::Y,
        };
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
}
