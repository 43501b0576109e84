//! Stands outside and measures; nothing inside knows of it.
//!
//! Host only. Sound in ([`clip`]), figures of merit ([`si_snr`], [`ssim`] on [`mel`] spectrograms) and pictures.

pub mod clip;
pub mod mel;
pub mod si_snr;
pub mod ssim;

pub use clip::{Clip, load_clip};
pub use mel::{LogMel, MelAnalyser};
