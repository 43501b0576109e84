//! The engine's sound as a stream of Godot's mixer. Godot calls [`ForesoundPlayback::mix_rawptr`] on its audio thread: the renderer
//! neither allocates, locks nor fails there; gdext's own access to the object takes a lock that nobody else holds.

use std::sync::{Mutex, PoisonError};

use foresound::Renderer;
use godot::classes::native::AudioFrame;
use godot::classes::{AudioStream, AudioStreamPlayback, IAudioStream, IAudioStreamPlayback};
use godot::meta::conv::RawPtr;
use godot::prelude::*;

/// Most audio frames that are rendered at once.
const CHUNK_FRAMES: usize = 1024;

/// A stream with one playback, which has the renderer.
#[derive(GodotClass)]
#[class(base = AudioStream, no_init)]
pub(crate) struct ForesoundStream {
    renderer: Mutex<Option<Renderer>>,
    base: Base<AudioStream>,
}

impl ForesoundStream {
    pub(crate) fn of(renderer: Renderer) -> Gd<Self> {
        Gd::from_init_fn(|base| Self {
            renderer: Mutex::new(Some(renderer)),
            base,
        })
    }
}

#[godot_api]
impl IAudioStream for ForesoundStream {
    fn instantiate_playback(&self) -> Option<Gd<AudioStreamPlayback>> {
        let renderer = self
            .renderer
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        let playback = Gd::from_init_fn(|base| ForesoundPlayback {
            renderer,
            is_playing: false,
            block: vec![0.0; 2 * CHUNK_FRAMES],
            base,
        });
        Some(playback.upcast())
    }

    fn get_stream_name(&self) -> GString {
        "Foresound".into()
    }

    fn get_length(&self) -> f64 {
        0.0
    }

    fn is_monophonic(&self) -> bool {
        true
    }
}

/// The renderer in Godot's mixer.
#[derive(GodotClass)]
#[class(base = AudioStreamPlayback, no_init)]
pub(crate) struct ForesoundPlayback {
    renderer: Option<Renderer>,
    is_playing: bool,
    block: Vec<f32>,
    base: Base<AudioStreamPlayback>,
}

#[godot_api]
impl IAudioStreamPlayback for ForesoundPlayback {
    fn start(&mut self, _from_pos: f64) {
        self.is_playing = true;
    }

    fn stop(&mut self) {
        self.is_playing = false;
    }

    fn is_playing(&self) -> bool {
        self.is_playing
    }

    unsafe fn mix_rawptr(
        &mut self,
        buffer: RawPtr<*mut AudioFrame>,
        _rate_scale: f32,
        frames: i32,
    ) -> i32 {
        let count = match usize::try_from(frames) {
            Ok(count) if count > 0 => count,
            _ => return 0,
        };
        // SAFETY: Godot's mixer owns `frames` audio frames there until this call returns.
        let output = unsafe { std::slice::from_raw_parts_mut(buffer.ptr(), count) };
        for part in output.chunks_mut(CHUNK_FRAMES) {
            let block = &mut self.block[..2 * part.len()];
            match &mut self.renderer {
                Some(renderer) if self.is_playing => {
                    renderer.render(block);
                }
                _ => block.fill(0.0),
            }
            for (frame, ears) in part.iter_mut().zip(block.as_chunks::<2>().0) {
                [frame.left, frame.right] = *ears;
            }
        }
        frames
    }
}
