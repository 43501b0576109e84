//! Whether a ray's reflections so far are those of a discrete path over a curved surface.
//!
//! The same paths as those of [`crate::propagation::curved_reflection`]: their energy is not late energy.

use crate::scene::Scene;

/// A ray's reflections since its first one at a curved surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CurvedPrefix {
    /// No discrete path.
    None,
    /// At a curved surface of this index, which may follow again.
    Once(u32),
    /// Then at a plane that mirrors the surface's shape onto itself.
    Between(u32),
    /// Twice at a curved surface.
    Twice,
    /// Nothing may follow.
    Ended,
}

impl CurvedPrefix {
    /// Whether the last reflection is one of a discrete path.
    pub(super) fn is_discrete(self) -> bool {
        self != Self::None
    }

    /// After a reflection at a curved surface, with its number where only panels came before.
    pub(super) fn at_curved(self, scene: &Scene, index: u32, first: Option<usize>) -> Self {
        match (self, first) {
            (_, Some(0 | 1)) if scene.is_combined(index) => Self::Once(index),
            (_, Some(0)) => Self::Ended,
            (Self::Once(last) | Self::Between(last), None) if last == index => Self::Twice,
            _ => Self::None,
        }
    }

    /// After a reflection at a panel.
    pub(super) fn at_panel(self, scene: &Scene, surface: u32) -> Self {
        match self {
            Self::Once(index) => {
                let curved = &scene.curved_surfaces()[index as usize];
                match curved.is_preserved_by(scene.surface(surface)) {
                    true => Self::Between(index),
                    false => Self::Ended,
                }
            }
            Self::Twice => Self::Ended,
            Self::None | Self::Between(_) | Self::Ended => Self::None,
        }
    }
}
