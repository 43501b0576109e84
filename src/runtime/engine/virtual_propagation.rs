//! Propagation on a virtual clock.
//!
//! Control side; replaces the propagation thread. An update begins in a tick, with the poses of that tick, and is sent a
//! given number of ticks later; the next one begins then. The first update is sent at once. A jump drops the update under way;
//! those that follow take their shares of the given number of ticks (`UpdateKind::share`).

use super::messages::UpdateMessage;
use super::worker::Worker;
use crate::runtime::pipeline::update_timing::delay_frames;

impl Worker {
    /// One tick: sends the update that is due, begins the next.
    pub(super) fn virtual_tick(&mut self) {
        let Some(mut arrivals) = self.virtual_arrivals.take() else {
            return;
        };
        self.collect_poses();
        let overtaken = |(_, message): &mut (u64, Box<UpdateMessage>)| self.is_overtaken(message);
        if let Some((_, message)) = arrivals.pending.take_if(overtaken) {
            self.drop_overtaken(message);
        }
        let due = |(at, _): &mut (u64, Box<UpdateMessage>)| *at <= arrivals.tick;
        if let Some((_, message)) = arrivals.pending.take_if(due) {
            self.send(message);
        }
        if arrivals.pending.is_none() {
            let share = self.next_share();
            let delay = delay_frames(share, arrivals.delay().into());
            if let Some(message) = self.compute(Some(arrivals.time_of(delay))) {
                match arrivals.updates {
                    0 => self.send(message),
                    _ => arrivals.pending = Some((arrivals.tick + delay, message)),
                }
                arrivals.updates += 1;
            }
        }
        arrivals.tick += 1;
        self.virtual_arrivals = Some(arrivals);
    }
}
