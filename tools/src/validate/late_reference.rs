//! What the particles of `late_particles.rs` give in the rooms of the late field's laws: a table, `late_particles.csv`.
//!
//! `examples/late_particles.rs` makes it. A line has a key of all that the particles know of a room: a changed room without a new
//! line is an error. The tests let the particles fly again, the first ones in every room and all of them in one.

use foresound::acoustics::Material;
use foresound::error::{Error, Result};
use foresound::scene::Scene;

use super::late_particles::Echogram;
use super::late_rooms::{self, Room};
use crate::fnv::fnv;

/// The table: lines of [`Line`].
const TABLE: &str = include_str!("late_particles.csv");

/// What stands above the lines.
const HEAD: &str = "\
# What particles give in the rooms of the laws late/slopes and late/direction; made by tools/examples/late_particles.rs.
# A line: the room; the key of its geometry and materials; the energy that the first particles alone give; the late energy
# from -x, x, -y, y, -z, z; the energy in each 10 ms after emission, zeros at the end left out. Energies are relative to the
# free field at 1 m, without the direct sound and without the air's absorption. Rooms: tools/src/validate/late_rooms.rs.
";

/// Legs of a room's first particles.
const SAMPLE_LEGS: u64 = 100_000;

/// A line of the table.
struct Line<'a> {
    name: &'a str,
    key: &'a str,
    sample: &'a str,
    /// Late energy by direction, then energy over time.
    energies: &'a str,
}

fn lines() -> impl Iterator<Item = Line<'static>> {
    TABLE.lines().filter_map(|line| {
        // Names are in quotes, with commas.
        let (name, rest) = line.strip_prefix('"')?.split_once("\",")?;
        let (key, rest) = rest.split_once(',')?;
        let (sample, energies) = rest.split_once(',')?;
        Some(Line {
            name,
            key,
            sample,
            energies,
        })
    })
}

/// What the particles give in a room, with the air of its scene.
pub(super) fn find(room: &Room, scene: &Scene) -> Result<Echogram> {
    let speed_m_s = scene.speed_of_sound_m_s();
    let key = key(room, speed_m_s);
    let is_current = |line: &Line<'_>| line.name == room.name && line.key == key;
    let line = lines().find(is_current).ok_or_else(|| stale(room))?;
    let numbers = line.energies.split(',').map(str::parse);
    let numbers: Vec<f64> = numbers
        .collect::<std::result::Result<_, _>>()
        .map_err(|_| stale(room))?;
    let (towards, energies) = numbers.split_first_chunk().ok_or_else(|| stale(room))?;
    let mut echogram = Echogram::new(room.late_from_s(speed_m_s));
    echogram.towards = *towards;
    for (sum, energy) in echogram.energy.iter_mut().zip(energies) {
        sum[0] = *energy;
    }
    echogram.damp(scene.air_np_per_m(), speed_m_s);
    Ok(echogram)
}

fn stale(room: &Room) -> Error {
    Error::setting(
        "late_particles.csv",
        format!("the room {:?} is not in it as it is now", room.name),
        "run `cargo run --release -p foresound-tools --example late_particles`",
    )
}

/// Checksum of all that the particles know of a room.
fn key(room: &Room, speed_m_s: f64) -> String {
    let mut numbers = vec![speed_m_s, room.legs as f64];
    numbers.extend(
        [room.source, room.listener]
            .map(|p| p.as_dvec3())
            .iter()
            .flat_map(|p| p.to_array()),
    );
    for panel in &room.panels {
        numbers.extend([panel.axis as f64, panel.at, panel.material as f64]);
        numbers.extend(panel.corners.iter().flat_map(|corner| corner.to_array()));
    }
    for triangle in &room.triangles {
        numbers.push(triangle.material as f64);
        numbers.extend(triangle.corners.iter().flat_map(|corner| corner.to_array()));
    }
    for Material {
        absorption,
        scattering,
        transmission,
        ..
    } in &room.materials
    {
        numbers.extend([absorption[0], scattering[0], transmission[0]].map(f64::from));
    }
    let bytes = numbers
        .iter()
        .flat_map(|number| number.to_bits().to_le_bytes());
    format!("{:016x}", fnv(bytes))
}

/// Energy that the first particles of a room give.
fn sample(room: &Room, speed_m_s: f64) -> String {
    let echogram = room.sample(speed_m_s, SAMPLE_LEGS);
    printed(echogram.energy.iter().map(|energy| energy[0]).sum())
}

/// What all particles of a room give, as in [`Line::energies`].
fn energies(room: &Room, speed_m_s: f64) -> String {
    let echogram = room.trace(speed_m_s);
    let last = echogram.energy.iter().rposition(|energy| energy[0] > 0.0);
    let over_time = echogram.energy[..last.map_or(0, |last| last + 1)]
        .iter()
        .map(|energy| energy[0]);
    let all = echogram.towards.into_iter().chain(over_time);
    all.map(printed).collect::<Vec<_>>().join(",")
}

fn printed(energy: f64) -> String {
    format!("{energy:.4e}")
}

/// The table. Lines of rooms that have not changed stay, unless all shall be made again.
///
/// # Errors
/// Those of committing a scene.
pub fn table(is_made_again: bool) -> Result<String> {
    let mut text = HEAD.to_owned();
    for room in late_rooms::all() {
        let speed_m_s = room.scene()?.speed_of_sound_m_s();
        let (name, key, sample) = (room.name, key(&room, speed_m_s), sample(&room, speed_m_s));
        let is_current =
            |line: &Line<'_>| (line.name, line.key, line.sample) == (name, &*key, &*sample);
        let energies = match lines().find(is_current) {
            Some(line) if !is_made_again => line.energies.to_owned(),
            _ => energies(&room, speed_m_s),
        };
        text.push_str(&format!("\"{name}\",{key},{sample},{energies}\n"));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All particles fly again in this room: it takes the fewest.
    const FLOWN_AGAIN: &str = "cube";

    fn rooms() -> Vec<(Room, std::sync::Arc<Scene>)> {
        let with_scene = |room: Room| {
            let scene = room.scene().expect("commits");
            (room, scene)
        };
        late_rooms::all().into_iter().map(with_scene).collect()
    }

    #[test]
    fn every_room_has_one_line() {
        let names: Vec<_> = rooms().iter().map(|(room, _)| room.name).collect();
        let lines: Vec<_> = lines().map(|line| line.name).collect();
        assert_eq!(lines, names);
        assert!(TABLE.starts_with(HEAD));
    }

    #[test]
    fn the_first_particles_of_every_room_give_what_the_table_says() {
        for ((room, scene), line) in rooms().into_iter().zip(lines()) {
            let speed_m_s = scene.speed_of_sound_m_s();
            assert_eq!(line.key, key(&room, speed_m_s), "{}", stale(&room));
            assert_eq!(line.sample, sample(&room, speed_m_s), "{}", stale(&room));
            // The rest of the line is of the same room: so few particles are within 3 dB of all in each.
            let number = |text: &str| text.parse::<f64>().expect("a number");
            let whole: f64 = line.energies.split(',').skip(6).map(number).sum();
            let off_db = 10.0 * (number(line.sample) / whole).log10();
            assert!(off_db.abs() < 4.0, "{}: {off_db} dB", room.name);
        }
    }

    #[test]
    fn all_particles_of_one_room_give_its_line() {
        let (room, scene) = rooms()
            .into_iter()
            .find(|(room, _)| room.name == FLOWN_AGAIN)
            .expect("a room");
        let line = lines().find(|line| line.name == room.name).expect("a line");
        let again = energies(&room, scene.speed_of_sound_m_s());
        assert!(line.energies == again, "{} with the word all", stale(&room));
    }

    #[test]
    fn a_changed_room_asks_for_a_new_line() {
        let room = late_rooms::all().remove(0);
        let scene = room.scene().expect("commits");
        assert!(find(&room, &scene).is_ok());
        let mut changed = [(); 5].map(|()| room.clone());
        changed[0].panels[3].corners[1].x += 0.01;
        changed[1].materials[0].absorption[0] += 0.01;
        changed[2].materials[0].scattering[0] += 0.01;
        changed[3].listener.z += 0.01;
        changed[4].legs += 1;
        for room in changed {
            let error = find(&room, &scene).expect_err("refused").to_string();
            assert!(error.contains("--example late_particles"), "{error}");
        }
    }
}
