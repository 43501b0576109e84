//! C calls of clips, of mixes and materials, and of sources rendered apart, with arbitrary values.

use std::ffi::CString;
use std::ptr;

use foresound::bridge::capi::*;
use foresound::bridge::engine::{MaterialOptions, SourceOptions};
use foresound::bridge::enumeration::{Bus, DistanceCurve};
use foresound::bridge::numbers::{SourceNumbers, SourcePath};
use foresound::bridge::playback::{PlayOptions, Playback};
use foresound::bridge::sound::RenderInfo;
use foresound::bridge::{Pose, Status};

use super::c_calls::{World, succeeds};

fn play_options(world: &mut World) -> PlayOptions {
    let small = |world: &mut World| [0, 1, 7, 24, 25, u32::MAX][world.bytes.below(6)];
    let mut options = PlayOptions::default();
    match world.bytes.below(6) {
        0 => {}
        1 => options.looped = small(world),
        2 => {
            (options.looped, options.loop_start) = (1, small(world));
            options.loop_end = small(world);
        }
        3 => options.first_frame = small(world).into(),
        4 => options.start_at = world.bytes.long() % 4000,
        _ => options.size = small(world),
    }
    options
}

/// A clip, and what may be done to it while it plays.
pub(super) fn play(world: &mut World) {
    let (engine, source) = (world.engine(), world.source());
    let status = match world.bytes.below(8) {
        0 | 1 => {
            let samples = [world.bytes.number(); 48];
            let mut clip = 0;
            // SAFETY: addresses of twice 24 samples and of a variable.
            let status = unsafe {
                foresound_clip_from_stereo(samples.as_ptr(), 48, 16_000, 16_000, &raw mut clip)
            };
            if succeeds(status) {
                world.made(clip);
            }
            let options = play_options(world);
            match world.bytes.below(2) {
                // SAFETY: the address of a structure.
                0 => unsafe {
                    foresound_source_play_clip(engine, source, clip, &raw const options)
                },
                _ => {
                    let [x_m, y_m, z_m] = world.bytes.numbers();
                    let (play, own) = (&raw const options, ptr::null());
                    let mut once = 0;
                    // SAFETY: the addresses of a structure and of a variable; a null pointer for the defaults.
                    let status = unsafe {
                        foresound_engine_play_once(
                            engine,
                            clip,
                            x_m,
                            y_m,
                            z_m,
                            play,
                            own,
                            &raw mut once,
                        )
                    };
                    if status == Status::Ok {
                        world.sources.push(once);
                    }
                    status
                }
            }
        }
        2 => {
            let mut playback = Playback::default();
            // SAFETY: the address of a structure.
            unsafe { foresound_source_playback(engine, source, &raw mut playback) }
        }
        3 => foresound_source_pause(engine, source, world.bytes.byte().into()),
        4 => foresound_source_seek(engine, source, world.bytes.word() % 64),
        5 => foresound_source_set_pitch(engine, source, world.bytes.number()),
        6 => {
            let [gain, seconds] = world.bytes.numbers();
            foresound_source_fade_gain(engine, source, gain, seconds)
        }
        _ => foresound_source_play(engine, source, world.any(), world.bytes.byte().into()),
    };
    succeeds(status);
}

/// Mixes of sources, materials, and the numbers of frames.
pub(super) fn mix(world: &mut World) {
    let (engine, source) = (world.engine(), world.source());
    let status = match world.bytes.below(5) {
        4 => {
            let (listener, pose) = (world.bytes.below(5) as u32, world.pose());
            // SAFETY: the address of a pose.
            unsafe {
                foresound_engine_set_listener(engine, listener, &raw const pose, size_of::<Pose>())
            }
        }
        0 => {
            let mut options = SourceOptions {
                distance_curve: DistanceCurve(world.bytes.below(5) as u32),
                ..SourceOptions::default()
            };
            let number = world.bytes.number();
            match world.bytes.below(13) {
                0 => options.direct_gain = number,
                1 => options.reflections_gain = number,
                2 => options.diffraction_gain = number,
                3 => options.late_gain = number,
                4 => options.occlusion = number,
                5 => options.transmission = number,
                6 => options.doppler = number,
                7 => options.air_absorption = number,
                8 => options.distance_min_m = number,
                9 => options.distance_max_m = number,
                10 => options.is_2d = number as u32,
                11 => options.priority = number as u32,
                _ => options.is_2d = 1,
            }
            // SAFETY: the address of a structure.
            unsafe { foresound_source_configure(engine, source, &raw const options) }
        }
        1 => {
            let points: [f32; 6] = world.bytes.numbers();
            let count = [0, 2, 3, 6][world.bytes.below(4)];
            // SAFETY: the address of as many values or more.
            unsafe { foresound_source_set_distance_table(engine, source, points.as_ptr(), count) }
        }
        2 => {
            let length = world.bytes.below(12);
            let name = match world.bytes.below(3) {
                0 => CString::new(world.bytes.take(length)).unwrap_or_default(),
                1 => c"default".into(),
                _ => c"concrete".into(),
            };
            let options = MaterialOptions {
                absorption: [world.bytes.number(); 8],
                scattering: [world.bytes.number(); 8],
                transmission: [world.bytes.number(); 8],
                ..MaterialOptions::default()
            };
            // SAFETY: the addresses of a terminated text and of a structure.
            unsafe { foresound_engine_set_material(engine, name.as_ptr(), &raw const options) }
        }
        _ => {
            let (mut tick, mut count) = (0, 0);
            let mut numbers = SourceNumbers::default();
            let mut paths = [const { std::mem::MaybeUninit::<SourcePath>::zeroed() }; 8];
            // SAFETY: the addresses of variables, and of memory for eight paths.
            unsafe {
                succeeds(foresound_engine_take_numbers(engine, &raw mut tick));
            }
            // SAFETY: the address of a structure.
            unsafe {
                succeeds(foresound_source_numbers(engine, source, &raw mut numbers));
            }
            let size = size_of::<SourcePath>() - world.bytes.below(2) * 8;
            let most = world.bytes.below(9).min(8);
            // SAFETY: the addresses of memory for eight paths and of a variable.
            unsafe {
                foresound_source_paths(
                    engine,
                    source,
                    paths.as_mut_ptr().cast(),
                    size,
                    most,
                    &raw mut count,
                )
            }
        }
    };
    succeeds(status);
}

/// One call of a block whose sources are rendered apart; mostly in order, with blocks of one size.
pub(super) fn apart(world: &mut World) {
    let renderer = world.handle(|world| &world.renderers);
    let frames = match world.bytes.byte() {
        200.. => [0usize, 1, 63, 65, 4097, usize::MAX][world.bytes.below(6)],
        _ => 64,
    };
    let mut channels = 0;
    // SAFETY: the address of a variable.
    if !succeeds(unsafe { foresound_renderer_channels(renderer, &raw mut channels) }) {
        channels = 2;
    }
    let count = frames.min(5000);
    let mut output = vec![f32::NAN; channels as usize * count];
    let dry = vec![world.bytes.number(); count];
    let begun = foresound_render_begin(renderer, frames);
    assert_ne!(begun, Status::Panic);
    let mut bus = Bus(9);
    for _ in 0..world.bytes.below(4) {
        let source = world.source();
        let dry = match world.bytes.byte() {
            200.. => ptr::null(),
            _ => dry.as_ptr(),
        };
        // SAFETY: addresses of as many samples as the lengths say, and of a variable.
        let status = unsafe {
            let output = output.as_mut_ptr();
            foresound_render_source(renderer, source, dry, output, channels, count, &raw mut bus)
        };
        assert_ne!(status, Status::Panic);
        assert!(output.iter().all(|sample| sample.is_finite()), "{output:?}");
        assert!(status != Status::Ok || bus.0 <= 2);
    }
    if world.bytes.byte() > 220 {
        let listeners = world.bytes.below(6) as u32;
        let mut all = vec![f32::NAN; listeners as usize * output.len()];
        let mut info = RenderInfo::default();
        // SAFETY: addresses of as many samples as the numbers say, and of a structure.
        let status = unsafe {
            let all = all.as_mut_ptr();
            foresound_render_listeners(renderer, all, listeners, channels, count, &raw mut info)
        };
        assert_ne!(status, Status::Panic);
        // Numbers that no engine has are refused before the output is looked at.
        let is_possible = (1..=4).contains(&listeners);
        assert!(!is_possible || all.iter().all(|sample| sample.is_finite()));
    }
    output.fill(f32::NAN);
    if world.bytes.byte() < 200 {
        let mut info = RenderInfo::default();
        // SAFETY: addresses of as many samples as the lengths say, and of a structure.
        let status = unsafe {
            let output = output.as_mut_ptr();
            foresound_render_reverb(renderer, output, channels, count, &raw mut info)
        };
        assert_ne!(status, Status::Panic);
        assert!(output.iter().all(|sample| sample.is_finite()), "{output:?}");
    }
}
