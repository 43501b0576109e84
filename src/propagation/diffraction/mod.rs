//! Diffraction: sound that bends around edges.
pub mod complex;
pub mod transition;
pub mod wedge;
