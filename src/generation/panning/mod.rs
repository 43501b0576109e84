//! Layouts of the output and their panning laws.
//!
//! A panning law is a table: the gains of all channels for a grid of directions. An HRTF set is such a table too, with a
//! delay an ear and shared filters after it. Generation has one path for all of them.

pub(crate) mod ambisonics;
pub(crate) mod angle;
pub(crate) mod direction_table;
pub(crate) mod layout;
pub(crate) mod loudspeakers;
