//! Numbers of surfaces, triangles and edges that belong to instances.
//!
//! The fixed scene counts from 0; a number with the highest bit holds an instance's slot and the index in its part.
//! Numbers do not depend on other instances; those of a removed instance are invalid. One slot more than there are instances
//! has the surfaces that several joined parts have in common ([`super::joined`]).

/// Bit of numbers that are an instance's.
const INSTANCE: u32 = 1 << 31;

/// Bits of the index in the part.
const LOCAL_BITS: u32 = 19;

/// Most surfaces, triangles or edges of a part.
pub const MOST_IN_A_PART: usize = 1 << LOCAL_BITS;

/// Most instances at a time. The last number stays free for [`crate::geometry::bvh::NO_GROUP`].
pub const MOST_INSTANCES: usize = (1 << (31 - LOCAL_BITS)) - 1;

/// Slot of the numbers of common surfaces, and the most of them: the last number is [`crate::geometry::bvh::NO_GROUP`].
const COMMON: usize = MOST_INSTANCES;
pub(crate) const MOST_COMMON: usize = MOST_IN_A_PART - 1;

/// Slot of the fixed part among joined ones: its numbers are its own.
pub(super) const FIXED: usize = u16::MAX as usize;

/// The number of a common surface.
#[inline]
pub(crate) fn common(index: u32) -> u32 {
    global(COMMON, index)
}

/// The index of a common surface, if a surface's number is one.
#[inline]
pub(crate) fn as_common(global: u32) -> Option<u32> {
    let (slot, index) = split(global);
    (is_instance(global) && slot == COMMON).then_some(index)
}

/// The number of a part's element in the instance of a slot.
#[inline]
pub(crate) fn global(slot: usize, local: u32) -> u32 {
    INSTANCE | (slot as u32) << LOCAL_BITS | local
}

/// Slot and number in the part, of a number that is not the fixed scene's.
#[inline]
pub(crate) fn split(global: u32) -> (usize, u32) {
    let slot = (global & !INSTANCE) >> LOCAL_BITS;
    (slot as usize, global & (MOST_IN_A_PART as u32 - 1))
}

/// Whether a number is an instance's.
#[inline]
pub(crate) fn is_instance(global: u32) -> bool {
    global & INSTANCE != 0
}

/// Whether two numbers are of one instance, or both of the fixed scene.
#[inline]
pub(crate) fn is_same_rigid_body(a: u32, b: u32) -> bool {
    match (is_instance(a), is_instance(b)) {
        (true, true) => split(a).0 == split(b).0,
        (a, b) => a == b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::bvh::NO_GROUP;

    #[test]
    fn numbers_split_into_slot_and_index() {
        for (slot, local) in [
            (0, 0),
            (1, 5),
            (MOST_INSTANCES - 1, MOST_IN_A_PART as u32 - 1),
        ] {
            let index = global(slot, local);
            assert!(is_instance(index) && index != NO_GROUP);
            assert_eq!(split(index), (slot, local));
        }
        assert!(split(NO_GROUP).0 >= MOST_INSTANCES);
        assert_eq!(as_common(common(7)), Some(7));
        assert_eq!(as_common(global(MOST_INSTANCES - 1, 7)), None);
        assert!(common(MOST_COMMON as u32 - 1) != NO_GROUP);
        assert!(is_same_rigid_body(3, 7) && is_same_rigid_body(global(2, 3), global(2, 7)));
        assert!(
            !is_same_rigid_body(3, global(0, 3)) && !is_same_rigid_body(global(0, 3), global(1, 3))
        );
    }
}
