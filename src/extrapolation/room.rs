//! Room for a list, whose memory is there before the sound thread writes to it.
//!
//! Control side; allocates. A system gives memory page by page when it is first written to, and whoever writes waits for
//! it: thousands of candidates are some hundred pages, each as long as a dozen of them take.

use std::hint::black_box;
use std::mem::MaybeUninit;

/// Bytes from one place that is written to the next; no system has smaller pages.
const STRIDE: usize = 4096;

/// Makes room for `most` entries besides those that are there, and has the system give all of its memory.
pub(super) fn make_room<T>(list: &mut Vec<T>, most: usize) {
    list.reserve_exact(most);
    // Otherwise a compiler may ask for zeros instead, which are given page by page again.
    let room = black_box(list.spare_capacity_mut());
    let step = (STRIDE / size_of::<T>().max(1)).max(1);
    for place in room.iter_mut().step_by(step) {
        *place = MaybeUninit::zeroed();
    }
    if let Some(last) = room.last_mut() {
        *last = MaybeUninit::zeroed();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_room_and_what_was_there_stays() {
        let mut list = vec![3u64, 5];
        make_room(&mut list, 10_000);
        assert!(list.capacity() >= 10_002);
        assert_eq!(list, [3, 5]);
        let mut large: Vec<[u8; 9_000]> = Vec::new();
        make_room(&mut large, 3);
        assert!(large.is_empty() && large.capacity() >= 3);
        make_room(&mut Vec::<()>::new(), 3);
    }
}
