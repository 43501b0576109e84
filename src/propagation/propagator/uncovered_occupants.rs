//! Counts occupants, listeners and sources, of spaces that the late field leaves out. Own.

/// Updates with an occupant of a space that is left out, before the field is made anew: a camera may pass through a wall.
const UPDATES_UNCOVERED: u32 = 16;

/// Number of occupants outside of the field, and for how long.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct UncoveredOccupants {
    /// Least number since the field was last made for its occupants: making it again would not cover them.
    known: usize,
    /// Updates with more.
    updates: u32,
}

impl UncoveredOccupants {
    /// Whether so many occupants outside of it require another field.
    pub(super) fn require_renewal(&mut self, count: usize) -> bool {
        self.known = self.known.min(count);
        if count == self.known {
            self.updates = 0;
            return false;
        }
        self.updates += 1;
        if self.updates < UPDATES_UNCOVERED {
            return false;
        }
        *self = Self {
            known: count,
            updates: 0,
        };
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn occupants_that_stay_uncovered_are_reported_once() {
        let mut occupants = UncoveredOccupants::default();
        let mut reports = |count, updates| {
            (0..updates)
                .filter(|_| occupants.require_renewal(count))
                .count()
        };
        assert_eq!(reports(1, UPDATES_UNCOVERED - 1), 0);
        assert_eq!(reports(0, 1), 0);
        assert_eq!(reports(1, 100), 1);
        assert_eq!(reports(2, 100), 1);
        assert_eq!(reports(1, 100), 0);
        assert_eq!(reports(2, 100), 1);
    }
}
