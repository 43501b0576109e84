//! Measuring the library: sounds ([`clip`]), figures of merit ([`si_snr`], [`ssim`] on [`mel`] spectrograms), laws
//! ([`validate`]), pictures ([`spectrogram_figure`], [`top_view`]) and the report. Host only.

pub mod cells;
pub mod chart;
pub mod clicks;
pub mod clip;
pub mod cut;
pub mod decay_figure;
pub mod edge_figure;
pub mod floor_plan;
pub mod fnv;
pub mod listener_path;
pub mod mel;
pub mod mel_map;
pub mod motion;
pub mod open_space;
pub mod paper;
pub mod pesq;
pub mod plan_ground;
pub mod playback;
pub mod report;
pub mod room_parameters;
pub mod scores;
pub mod settling;
pub mod si_snr;
pub mod spectrogram_figure;
pub mod ssim;
pub mod talk;
pub mod top_view;
pub mod validate;

pub use chart::Picture;
pub use clip::{Clip, load_clip};
pub use mel::{LogMel, MelAnalyser};
pub use spectrogram_figure::SpectrogramFigure;
pub use top_view::TopView;
