//! Table of sources. Entries have generations, so a stale handle is an error and never refers to another source.
//!
//! Control side. A handle is never given again: an entry has 1,048,575 generations, from 1 on, and is out of use after the
//! last. Free entries are used in turn. A handle's bits are never 0.

use std::collections::VecDeque;
use std::sync::Arc;

use glam::Vec3;

use crate::error::{Error, Result};
use crate::runtime::engine::playback::{PlayState, Playback, PlaybackCell, check_pitch};
use crate::runtime::engine::slot_release::{PlaybackProgress, SlotRelease};
use crate::runtime::engine::source_virtualization::VirtualSource;
use crate::scene::{SourceId, SourcePose, SourceSettings};

/// Settings of one source.
#[derive(Debug, Clone, Copy)]
struct SourceState {
    pose: SourcePose,
    gain: f32,
    muted: bool,
    /// Whether it has samples.
    plays: bool,
    /// Time at which a ramp of the gain ends, in seconds.
    ramp_end_s: f64,
    play: PlayState,
    /// Number of the clip that was played last, 0 for none.
    serial: u32,
    /// When that clip was found finished.
    finished_s: Option<f64>,
    /// Whether the source is removed after its clip.
    is_one_shot: bool,
}

#[derive(Debug)]
struct SourceEntry {
    cell: Arc<PlaybackCell>,
    generation: u32,
    state: Option<SourceState>,
    release: SlotRelease,
}

impl SourceEntry {
    fn virtual_source(&self, time_s: f64) -> Option<VirtualSource> {
        let state = self.state?;
        Some(VirtualSource {
            pose: state.pose,
            gain: if state.muted { 0.0 } else { state.gain },
            ramp_s: (state.ramp_end_s - time_s).max(0.0) as f32,
            plays: state.plays,
            play: state.play,
        })
    }
}

/// All sources.
#[derive(Debug)]
pub(super) struct SourceTable {
    slots: Vec<SourceEntry>,
    free: VecDeque<u16>,
    /// Entries whose generations are used up.
    used_up: usize,
    /// Clips played so far.
    serials: u32,
    /// Time of the present graphics frame.
    time_s: f64,
}

/// Longest ramp of a gain in seconds.
const MAX_RAMP_S: f32 = 3600.0;

/// Greatest coordinate in metres: beyond it squared distances lose all precision.
const MAX_COORDINATE_M: f32 = 1e6;

/// Rejects positions that are not finite or too far out.
pub(super) fn check_position(name: &str, position: Vec3) -> Result<()> {
    if position.abs().cmple(Vec3::splat(MAX_COORDINATE_M)).all() {
        return Ok(());
    }
    let problem = format!("{position} is no position");
    let advice = "give metres below 1e6 in magnitude; the last good position is kept";
    Err(Error::setting(name, problem, advice))
}

fn stale(id: SourceId) -> Error {
    Error::StaleSource {
        slot: id.slot(),
        generation: id.generation(),
    }
}

impl SourceTable {
    pub(super) fn new(slots: usize) -> Self {
        Self {
            slots: (0..slots)
                .map(|_| SourceEntry {
                    generation: 1,
                    cell: Arc::default(),
                    state: None,
                    release: SlotRelease::Free,
                })
                .collect(),
            free: (0..slots as u16).collect(),
            used_up: 0,
            serials: 0,
            time_s: 0.0,
        }
    }

    pub(super) fn add(&mut self, position: Vec3) -> Result<SourceId> {
        check_position("position", position)?;
        let Some(index) = self.free.pop_front() else {
            let problem = format!("all {} sources are in use", self.slots.len());
            let advice = match self.used_up {
                0 => "remove one, or raise max_sources",
                _ => "make another engine: this one has had a million sources a slot",
            };
            return Err(Error::engine(problem, advice));
        };
        let slot = &mut self.slots[usize::from(index)];
        let id = SourceId::new(index, slot.generation);
        slot.state = Some(SourceState {
            pose: SourcePose::at(id, position),
            gain: 1.0,
            muted: false,
            plays: false,
            ramp_end_s: 0.0,
            play: PlayState::default(),
            serial: 0,
            finished_s: None,
            is_one_shot: false,
        });
        Ok(id)
    }

    /// Removes a source from graphics frame `tick` on.
    pub(super) fn remove(&mut self, id: SourceId, tick: u64) -> Result<()> {
        self.state_mut(id)?;
        let slot = &mut self.slots[id.slot()];
        slot.state = None;
        slot.release = SlotRelease::RemovedAt(tick);
        if slot.generation < SourceId::LAST_GENERATION {
            slot.generation += 1;
            self.free.push_back(id.slot() as u16);
        } else {
            self.used_up += 1;
        }
        Ok(())
    }

    pub(super) fn move_to(&mut self, id: SourceId, position: Vec3) -> Result<()> {
        let state = self.state_mut(id)?;
        check_position("position", position)?;
        state.pose.position = position;
        Ok(())
    }

    /// Sets position, normalised orientation and settings.
    pub(super) fn pose(&mut self, pose: &SourcePose) -> Result<()> {
        let state = self.state_mut(pose.id)?;
        check_position("position", pose.position)?;
        let normalized = pose.normalized().ok_or_else(|| {
            let problem = format!("{} is no orientation", pose.orientation);
            let advice = "give a unit quaternion; the last good pose is kept";
            Error::setting("orientation", problem, advice)
        })?;
        pose.settings.check()?;
        state.pose = normalized;
        Ok(())
    }

    pub(super) fn configure(&mut self, id: SourceId, settings: SourceSettings) -> Result<()> {
        let state = self.state_mut(id)?;
        settings.check()?;
        state.pose.settings = settings;
        Ok(())
    }

    pub(super) fn settings(&self, id: SourceId) -> Result<SourceSettings> {
        Ok(self.state(id)?.pose.settings)
    }

    pub(super) fn set_muted(&mut self, id: SourceId, muted: bool) -> Result<()> {
        self.state_mut(id)?.muted = muted;
        Ok(())
    }

    pub(super) fn set_plays(&mut self, id: SourceId, plays: bool) -> Result<()> {
        let state = self.state_mut(id)?;
        (state.plays, state.serial, state.finished_s) = (plays, 0, None);
        Ok(())
    }

    /// Notes a new clip; returns its number and the cell of its state.
    pub(super) fn play(&mut self, id: SourceId) -> Result<(u32, Arc<PlaybackCell>)> {
        self.check(id)?;
        // 0 is none.
        self.serials = self.serials.checked_add(1).unwrap_or(1);
        let serial = self.serials;
        let state = self.state_mut(id)?;
        (state.plays, state.serial, state.finished_s) = (true, serial, None);
        state.play.is_paused = false;
        Ok((serial, Arc::clone(&self.slots[id.slot()].cell)))
    }

    /// Removes a source after its clip.
    pub(super) fn set_one_shot(&mut self, id: SourceId) -> Result<()> {
        self.state_mut(id)?.is_one_shot = true;
        Ok(())
    }

    /// State and position of a source's clip.
    pub(super) fn playback(&self, id: SourceId) -> Result<Playback> {
        let serial = self.state(id)?.serial;
        Ok(self.slots[id.slot()].cell.load(serial))
    }

    pub(super) fn set_paused(&mut self, id: SourceId, is_paused: bool) -> Result<()> {
        self.state_mut(id)?.play.is_paused = is_paused;
        Ok(())
    }

    pub(super) fn set_pitch(&mut self, id: SourceId, pitch: f32) -> Result<()> {
        let state = self.state_mut(id)?;
        check_pitch(pitch)?;
        state.play.pitch = pitch;
        Ok(())
    }

    pub(super) fn seek(&mut self, id: SourceId, frame: u64) -> Result<()> {
        let state = self.state_mut(id)?;
        if state.serial == 0 {
            let advice = "play a clip first; a stream has no position";
            return Err(Error::engine("the source plays no clip", advice));
        }
        let play = &mut state.play;
        play.seek = play.seek.checked_add(1).unwrap_or(1);
        (play.seek_serial, play.seek_to) = (state.serial, frame);
        (state.plays, state.finished_s) = (true, None);
        Ok(())
    }

    /// Begins a graphics frame: clips that finished `tail_s` ago end, and the sources of one-shots too, which are returned in
    /// `ended`.
    pub(super) fn begin_frame(&mut self, time_s: f64, tail_s: f64, ended: &mut Vec<SourceId>) {
        self.time_s = time_s;
        ended.clear();
        for entry in &mut self.slots {
            let Some(state) = entry.state.as_mut().filter(|state| state.serial > 0) else {
                continue;
            };
            let last_seek = state.play.seek_of(state.serial);
            if !entry.cell.has_finished([state.serial, last_seek]) {
                continue;
            }
            let since_s = *state.finished_s.get_or_insert(time_s);
            if time_s - since_s >= tail_s {
                state.plays = false;
                if state.is_one_shot {
                    ended.push(state.pose.id);
                }
            }
        }
    }

    /// Sets a gain that is reached in `seconds`.
    pub(super) fn set_gain(&mut self, id: SourceId, gain: f32, seconds: f32) -> Result<()> {
        let now_s = self.time_s;
        let state = self.state_mut(id)?;
        if !(0.0..=MAX_RAMP_S).contains(&seconds) {
            let problem = format!("{seconds} s is out of range");
            let advice = "choose a value from 0 to 3600";
            return Err(Error::setting("seconds", problem, advice));
        }
        if !(0.0..=1e3).contains(&gain) {
            let advice = "give a linear gain from 0 to 1000";
            return Err(Error::setting("gain", format!("{gain} is no gain"), advice));
        }
        state.gain = gain;
        state.ramp_end_s = now_s + f64::from(seconds);
        Ok(())
    }

    pub(super) fn check(&self, id: SourceId) -> Result<()> {
        self.state(id).map(drop)
    }

    fn state(&self, id: SourceId) -> Result<&SourceState> {
        let slot = self.slots.get(id.slot());
        slot.filter(|slot| slot.generation == id.generation())
            .and_then(|slot| slot.state.as_ref())
            .ok_or_else(|| stale(id))
    }

    fn state_mut(&mut self, id: SourceId) -> Result<&mut SourceState> {
        let slot = self.slots.get_mut(id.slot());
        slot.filter(|slot| slot.generation == id.generation())
            .and_then(|slot| slot.state.as_mut())
            .ok_or_else(|| stale(id))
    }

    /// Number of sources.
    pub(super) fn count(&self) -> usize {
        self.slots.len() - self.free.len() - self.used_up
    }

    /// All sources, by index.
    pub(super) fn iter(&self) -> impl Iterator<Item = VirtualSource> + Clone + '_ {
        let virtual_source = |entry: &SourceEntry| entry.virtual_source(self.time_s);
        self.slots.iter().filter_map(virtual_source)
    }

    /// Updates the release of all entries.
    pub(super) fn advance_releases(&mut self, progress: &PlaybackProgress, release_s: f64) {
        for slot in &mut self.slots {
            slot.release.advance(progress, release_s);
        }
    }

    /// All sources except those in a slot that is releasing its last source.
    pub(super) fn iter_released(&self) -> impl Iterator<Item = VirtualSource> + Clone + '_ {
        let rested = |slot: &&SourceEntry| slot.release == SlotRelease::Free;
        let virtual_source = |entry: &SourceEntry| entry.virtual_source(self.time_s);
        self.slots.iter().filter(rested).filter_map(virtual_source)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_handle_is_given_twice() {
        let mut table = SourceTable::new(1);
        for n in 1..=u64::from(SourceId::LAST_GENERATION) {
            let id = table.add(Vec3::ZERO).expect("is free");
            assert_eq!((id.slot(), u64::from(id.generation())), (0, n));
            table.remove(id, n).expect("is there");
        }
        assert_eq!(table.count(), 0);
        let error = table.add(Vec3::ZERO).expect_err("is used up").to_string();
        assert!(error.contains("another engine"), "{error}");
    }

    #[test]
    fn a_slots_next_source_waits_for_the_fade_out() {
        let mut table = SourceTable::new(1);
        let first = table.add(Vec3::ZERO).expect("is free");
        let ids = |table: &mut SourceTable, placed: u64, time_s: f64| -> Vec<SourceId> {
            let progress = PlaybackProgress {
                tick: 9,
                applied_tick: placed,
                time_s,
            };
            table.advance_releases(&progress, 0.15);
            table.iter_released().map(|source| source.pose.id).collect()
        };
        // A source in an unused slot starts at once.
        assert_eq!(ids(&mut table, 0, 0.0), [first]);
        table.remove(first, 4).expect("is there");
        let second = table.add(Vec3::ONE).expect("is free again");
        assert!(ids(&mut table, 3, 2.0).is_empty());
        assert!(ids(&mut table, 4, 3.0).is_empty());
        assert!(ids(&mut table, 9, 3.149).is_empty());
        assert_eq!(ids(&mut table, 9, 3.151), [second]);
        // The source exists meanwhile.
        assert_eq!(table.iter().count(), 1);
        assert!(table.check(second).is_ok());
    }
}
