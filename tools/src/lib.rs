//! Stands outside and measures; nothing inside knows of it.
//!
//! Host only. Sound in ([`clip`]), figures of merit ([`si_snr`], [`ssim`] on [`mel`] spectrograms) and pictures
//! ([`spectrogram_figure`], [`top_view`]) on a [`canvas`] of our own.

pub mod axis;
pub mod canvas;
pub mod cells;
pub mod clicks;
pub mod clip;
pub mod colormap;
pub mod edge_figure;
pub mod floor_plan;
pub mod lettering;
pub mod listener_path;
pub mod mel;
pub mod open_space;
pub mod paper;
pub mod pesq;
mod plan_ground;
pub mod playback;
pub mod report;
pub mod room_parameters;
pub mod scores;
pub mod si_snr;
pub mod spectrogram_figure;
pub mod ssim;
pub mod talk;
pub mod top_view;
pub mod validate;

pub use canvas::Canvas;
pub use clip::{Clip, load_clip};
pub use colormap::{Colormap, Colour};
pub use mel::{LogMel, MelAnalyser};
pub use spectrogram_figure::SpectrogramFigure;
pub use top_view::TopView;
