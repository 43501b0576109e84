//! Counts listeners and sources in spaces that the late field leaves out. Own.

/// Updates that somebody has to be outside of the field before it is made anew: a camera may pass through a wall.
const UPDATES_OUTSIDE: u32 = 16;

/// Number of those outside of the field, and for how long.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Outsiders {
    /// Least number of them since the field was last made for them: it could not take them in.
    known: usize,
    /// Updates with more.
    updates: u32,
}

impl Outsiders {
    /// Whether so many of them require another field.
    pub(super) fn are_due(&mut self, count: usize) -> bool {
        self.known = self.known.min(count);
        if count == self.known {
            self.updates = 0;
            return false;
        }
        self.updates += 1;
        if self.updates < UPDATES_OUTSIDE {
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
    fn those_who_stay_outside_are_reported_once() {
        let mut outsiders = Outsiders::default();
        let mut reports =
            |count, updates| (0..updates).filter(|_| outsiders.are_due(count)).count();
        assert_eq!(reports(1, UPDATES_OUTSIDE - 1), 0);
        assert_eq!(reports(0, 1), 0);
        assert_eq!(reports(1, 100), 1);
        assert_eq!(reports(2, 100), 1);
        assert_eq!(reports(1, 100), 0);
        assert_eq!(reports(2, 100), 1);
    }
}
