//! A picture of the window in a file: `--screenshot FILE.png SECONDS`.
//!
//! Bevy leaves out of a frame what it still compiles shaders for, tens of seconds in software. A picture is taken when none is
//! compiled any more, and is looked at: what shows the background in half of its pixels is no picture of a hall, and another is
//! taken.

use bevy::prelude::*;
use bevy::render::render_resource::PipelineCache;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured, save_to_disk};
use bevy::render::{ExtractSchedule, MainWorld, RenderApp};
use foresound_bevy::Foresound;

/// Behind everything.
pub(crate) const BACKGROUND: Color = Color::srgb(0.02, 0.02, 0.03);
/// No channel of the background is larger, of 255, with what rounding and dithering add.
const BACKGROUND_MAX: u8 = 12;
/// Frames without a shader that is compiled: what a frame draws first begins to compile in it.
const SETTLED_FRAMES: u32 = 5;
/// Gives up after so long.
const PATIENCE_S: f32 = 900.0;

/// What the command line asks for, and how far it is.
#[derive(Resource)]
pub(crate) struct Picture {
    /// A PNG file.
    pub(crate) file: String,
    /// Seconds of walking before it is taken, at least.
    pub(crate) after_s: f32,
    settled_frames: u32,
    is_asked_for: bool,
}

impl Picture {
    pub(crate) fn new(file: String, after_s: f32) -> Self {
        Self {
            file,
            after_s,
            settled_frames: 0,
            is_asked_for: false,
        }
    }
}

/// Adds what takes the picture and ends the app.
pub(crate) fn plugin(app: &mut App) {
    app.add_systems(Update, take.run_if(resource_exists::<Foresound>));
    if let Some(render) = app.get_sub_app_mut(RenderApp) {
        render.add_systems(ExtractSchedule, count_settled_frames);
    }
}

fn count_settled_frames(mut main: ResMut<MainWorld>, cache: Res<PipelineCache>) {
    if let Some(mut picture) = main.get_resource_mut::<Picture>() {
        let is_settled = cache.waiting_pipelines().next().is_none();
        picture.settled_frames = if is_settled {
            picture.settled_frames + 1
        } else {
            0
        };
    }
}

fn take(
    time: Res<Time<Real>>,
    mut picture: ResMut<Picture>,
    mut engine: ResMut<Foresound>,
    mut commands: Commands,
    mut exit: MessageWriter<AppExit>,
) {
    if time.elapsed_secs() > PATIENCE_S {
        error!("no picture of the hall in {PATIENCE_S} s");
        exit.write(AppExit::error());
    }
    let is_ready = time.elapsed_secs() > picture.after_s
        && picture.settled_frames >= SETTLED_FRAMES
        && engine.paths().next().is_some();
    if is_ready && !picture.is_asked_for {
        picture.is_asked_for = true;
        commands
            .spawn(Screenshot::primary_window())
            .observe(captured);
    }
}

fn captured(
    capture: On<ScreenshotCaptured>,
    mut picture: ResMut<Picture>,
    mut exit: MessageWriter<AppExit>,
) {
    let is_drawn = capture.image.data.as_deref().is_some_and(is_drawn);
    if !is_drawn {
        picture.is_asked_for = false;
        picture.settled_frames = 0;
        return;
    }
    let file = picture.file.clone();
    save_to_disk(file.clone())(capture);
    exit.write(if std::path::Path::new(&file).is_file() {
        AppExit::Success
    } else {
        AppExit::error()
    });
}

/// Whether less than half of the pixels, of four bytes each with opacity last, are background.
fn is_drawn(pixels: &[u8]) -> bool {
    let is_something = |pixel: &&[u8]| pixel[..3].iter().any(|channel| *channel > BACKGROUND_MAX);
    let drawn = pixels.chunks_exact(4).filter(is_something).count();
    2 * drawn > pixels.len() / 4
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn background_and_lines_alone_are_no_picture() {
        let [red, green, blue, _] = BACKGROUND.to_srgba().to_u8_array();
        assert!([red, green, blue].iter().all(|c| *c < BACKGROUND_MAX));
        let background = [red, green, blue, 255].repeat(100);
        assert!(!is_drawn(&[0, 0, 0, 255].repeat(100)));
        assert!(!is_drawn(&background));
        let mut lines = background.clone();
        lines[..4 * 20].copy_from_slice(&[255, 200, 50, 255].repeat(20));
        assert!(!is_drawn(&lines));
        let mut walls = background;
        walls[..4 * 60].copy_from_slice(&[40, 30, 20, 255].repeat(60));
        assert!(is_drawn(&walls));
    }
}
