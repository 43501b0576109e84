//! Where the sound goes.

use bevy_app::App;
#[cfg(feature = "play")]
use bevy_ecs::prelude::*;
use foresound::device::NullDevice;
use foresound::{EngineSettings, Renderer};

/// Where the sound goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Output {
    /// The system's default device, opened again when it is lost.
    #[cfg(feature = "play")]
    #[default]
    Device,
    /// Nowhere, in real time: servers, tests.
    #[cfg_attr(not(feature = "play"), default)]
    Null,
    /// Wherever the app wants: it takes [`AppRenderer`].
    App,
}

/// The audio half of the engine, with [`Output::App`]: a non-send resource (`NonSendMut<AppRenderer>`). Give it to the app's own
/// audio callback, such as a node of another mixer.
pub struct AppRenderer(pub Option<Renderer>);

/// Keeps a null device alive.
struct Silent(#[expect(dead_code, reason = "renders until it is dropped")] NullDevice);

#[cfg(feature = "play")]
struct Playing {
    supervisor: foresound::device::Supervisor<foresound::device::CpalBackend>,
    began: std::time::Instant,
}

/// Starts an output.
pub(crate) fn start(
    app: &mut App,
    output: Output,
    mut renderer: Renderer,
    settings: &EngineSettings,
) -> foresound::Result<()> {
    let (rate_hz, block_frames) = (settings.generation.rate_hz, settings.block_frames);
    match output {
        #[cfg(feature = "play")]
        Output::Device => {
            use foresound::device::{CpalBackend, NullDeviceSettings, Supervisor};
            let null_device = NullDeviceSettings {
                rate_hz,
                block_frames,
                affinity: settings.affinity,
            };
            let fill = move |block: &mut [f32]| {
                renderer.render(block);
            };
            let backend = CpalBackend::new(rate_hz);
            app.insert_non_send(Playing {
                supervisor: Supervisor::new(backend, fill, Some(null_device)),
                began: std::time::Instant::now(),
            });
            app.add_systems(bevy_app::Last, poll);
        }
        Output::Null => {
            let device =
                NullDevice::start(rate_hz, block_frames, settings.affinity, move |block| {
                    renderer.render(block);
                })?;
            app.insert_non_send(Silent(device));
        }
        Output::App => {
            app.insert_non_send(AppRenderer(Some(renderer)));
        }
    }
    Ok(())
}

/// Opens the device, and a lost one again.
#[cfg(feature = "play")]
fn poll(mut device: NonSendMut<Playing>) {
    let time_s = device.began.elapsed().as_secs_f64();
    device.supervisor.poll(time_s);
}
