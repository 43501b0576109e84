//! Positions of listener and sources in the last graphics frames, with their times.
//!
//! Control side. The controller collects the graphics frames that propagation has not taken yet; propagation appends them
//! to its own. Bounded: the oldest frame gives way.

use std::collections::VecDeque;

use glam::Vec3;

use crate::scene::{ListenerPose, SourceId, SourcePose};

/// Graphics frames kept: what [`super::motion_model`] uses at most.
pub(crate) const HISTORY_FRAMES: usize = 65;

/// Graphics frames whose mean duration counts.
const MEAN_FRAMES: usize = 8;

/// Share of a graphics frame by which equal times may differ.
const SAME_TIME: f64 = 1e-3;

/// Positions in one graphics frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct PoseFrame {
    pub(crate) time_s: f64,
    pub(crate) listener: Vec3,
    sources: Vec<(SourceId, Vec3)>,
}

impl PoseFrame {
    /// Position of a source; `index` is where it probably is in the list.
    pub(crate) fn source(&self, id: SourceId, index: usize) -> Option<Vec3> {
        let likely = self.sources.get(index).filter(|(other, _)| *other == id);
        let found = likely.or_else(|| self.sources.iter().find(|(other, _)| *other == id));
        found.map(|(_, position)| *position)
    }

    fn copy_from(&mut self, other: &Self) {
        (self.time_s, self.listener) = (other.time_s, other.listener);
        self.sources.clone_from(&other.sources);
    }
}

/// The last graphics frames.
#[derive(Debug, Default)]
pub(crate) struct PoseHistory {
    /// Newest first.
    frames: VecDeque<PoseFrame>,
    spare: Vec<PoseFrame>,
}

impl PoseHistory {
    /// Adds a graphics frame; its time is in seconds. A time that does not rise begins the history anew.
    pub(crate) fn push(&mut self, time_s: f64, listener: &ListenerPose, sources: &[SourcePose]) {
        let frame = self.make_room(time_s);
        (frame.time_s, frame.listener) = (time_s, listener.position);
        frame.sources.clear();
        let positions = sources.iter().map(|pose| (pose.id, pose.position));
        frame.sources.extend(positions);
    }

    /// Adds the graphics frames of a later history.
    pub(crate) fn append(&mut self, later: &Self) {
        for frame in later.frames.iter().rev() {
            self.make_room(frame.time_s).copy_from(frame);
        }
    }

    /// Forgets all graphics frames.
    pub(crate) fn clear(&mut self) {
        self.spare.extend(self.frames.drain(..));
    }

    /// The graphics frame `age` frames before the newest.
    pub(crate) fn get(&self, age: usize) -> Option<&PoseFrame> {
        self.frames.get(age)
    }

    /// Mean seconds between the last graphics frames; `None` before the second.
    pub(crate) fn frame_s(&self) -> Option<f64> {
        let count = MEAN_FRAMES.min(self.frames.len().checked_sub(1)?);
        let passed_s = self.frames[0].time_s - self.frames[count].time_s;
        (count > 0).then(|| passed_s / count as f64)
    }

    /// A position so many graphics frames of [`Self::frame_s`] ago, interpolated; `None` before the oldest.
    pub(crate) fn position(
        &self,
        age: f64,
        position: impl Fn(&PoseFrame) -> Option<Vec3>,
    ) -> Option<Vec3> {
        let frame_s = self.frame_s()?;
        let time_s = self.frames[0].time_s - age * frame_s;
        let is_later = |frame: &&PoseFrame| frame.time_s > time_s + SAME_TIME * frame_s;
        let later = self.frames.iter().take_while(is_later).count();
        let (frame, later) = (self.get(later)?, later.checked_sub(1));
        let at = position(frame)?;
        let past_s = time_s - frame.time_s;
        let Some(later) = later.filter(|_| past_s > SAME_TIME * frame_s) else {
            return Some(at);
        };
        let later = &self.frames[later];
        let share = past_s / (later.time_s - frame.time_s);
        Some(at.lerp(position(later)?, share as f32))
    }

    fn make_room(&mut self, time_s: f64) -> &mut PoseFrame {
        let newest = self.frames.front();
        if newest.is_some_and(|newest| time_s.is_nan() || time_s <= newest.time_s) {
            self.clear();
        }
        let oldest = (self.frames.len() >= HISTORY_FRAMES).then(|| self.frames.pop_back());
        let frame = oldest.flatten().or_else(|| self.spare.pop());
        self.frames.push_front(frame.unwrap_or_default());
        &mut self.frames[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(times: impl IntoIterator<Item = u32>) -> PoseHistory {
        let mut history = PoseHistory::default();
        for time in times {
            let source = SourcePose::at(SourceId::new(3, 1), Vec3::Y * time as f32);
            let listener = ListenerPose::facing(Vec3::X * time as f32, 0.0);
            history.push(f64::from(time), &listener, &[source]);
        }
        history
    }

    fn times(history: &PoseHistory) -> Vec<u32> {
        let each = (0..).map_while(|age| history.get(age));
        each.map(|frame| frame.time_s as u32).collect()
    }

    #[test]
    fn the_oldest_frames_give_way() {
        let mut all = history(0..100);
        assert_eq!(times(&all), (35..100).rev().collect::<Vec<_>>());
        all.append(&history(100..103));
        assert_eq!(times(&all), (38..103).rev().collect::<Vec<_>>());
        let frame = all.get(1).expect("101");
        assert_eq!(frame.listener, Vec3::X * 101.0);
        let found = |id| frame.source(id, 0);
        assert_eq!(found(SourceId::new(3, 1)), Some(Vec3::Y * 101.0));
        assert_eq!(found(SourceId::new(3, 2)), None);
    }

    #[test]
    fn a_time_that_does_not_rise_begins_anew() {
        assert_eq!(times(&history([1, 2, 5, 5, 6])), [6, 5]);
    }
}
