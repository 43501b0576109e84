//! The table of functions: names, documentation, parameters and bodies, once for C and Java.
//!
//! `capi` makes the C functions from `shared_functions`, `jni` the natives of `dev.foresound.Native`, which have the C
//! names in camel case without their prefix. Functions of `java_functions` differ in C, because Java passes buffers
//! where C passes pointers; their C counterparts are in `capi`. [`functions`] describes both tables for the C header and
//! `Native.java`, which tests/c_header.rs writes.
//!
//! `unsafe fn` marks C functions with pointers. `name[count]: Kind` is a C array with its length, and one array in Java. A
//! result is stored through a last pointer in C, and returned in Java.

#[cfg(any(feature = "capi", feature = "jni"))]
use super::error::CallError;

pub use super::function::{Function, Parameter, camel_case};
pub use super::kind::*;
#[cfg(feature = "testing")]
pub use super::structures::*;

/// Passes the functions common to C and Java to a macro.
macro_rules! shared_functions {
    ($emit:ident) => {
        $emit! {
            /// Closes a handle of any kind and destroys its object: an engine after its running update, an output after its
            /// threads. Waits for a call that uses the handle. Control thread.
            safe fn foresound_close(handle: Handle) { $crate::bridge::close(handle) }

            /// Writes the default options; `size` is set before. Any thread.
            unsafe fn foresound_options_default(options: Out<Options>) { options.store(Options::default()) }

            /// Creates an engine in free field without sources. `engine` receives the handle of the control half, `renderer`
            /// that of the audio half. Takes some ten milliseconds. Control thread.
            ///
            /// `api_version`: FORESOUND_API_VERSION. `options`: null for the defaults. `hrtf`: content of an HRTF set's file,
            /// baked or SOFA (some seconds); null for the built-in set. Fails with FORESOUND_STATUS_VERSION for another major
            /// version than the library's, FORESOUND_STATUS_BAD_ARGUMENT also for more memory than `max_memory_mib`,
            /// FORESOUND_STATUS_FORMAT for a damaged HRTF set, FORESOUND_STATUS_STATE if the system starts no thread.
            unsafe fn foresound_engine_create(
                api_version: Count, options: In<Options>, hrtf[hrtf_bytes]: OptionalBytes, engine: HandleOut
            ) -> renderer: Handle {
                let handles = engine::create(api_version, &options, hrtf.as_deref())?;
                engine.store(handles.0)?;
                Ok(handles.1)
            }

            /// Replaces the scene. The old one is audible until the first update with the new one. The scene's handle may be
            /// closed afterwards. Control thread.
            safe fn foresound_engine_set_scene(engine: Handle, scene: Handle) { engine::set_scene(engine, scene) }

            /// Gives all surfaces of a material's name, in the scene and in instances, other properties from the next tick on;
            /// audible with the next update. Another scene has its own, and so has an instance that is added later. `material`: null
            /// for a surface that reflects everything. Fails with FORESOUND_STATUS_BAD_ARGUMENT for a name that no surface has. Control thread.
            unsafe fn foresound_engine_set_material(engine: Handle, name: Text, material: In<MaterialOptions>) {
                ENGINES.with(engine, |engine| engine.set_material(&name, &material))
            }

            /// Writes the default options; `size` is set before. Any thread.
            unsafe fn foresound_propagation_options_default(options: Out<PropagationOptions>) {
                options.store(PropagationOptions::default())
            }

            /// Sets the rays and orders of propagation. `options`: null for the defaults. Control thread.
            unsafe fn foresound_engine_set_propagation(engine: Handle, options: In<PropagationOptions>) {
                ENGINES.with(engine, |engine| engine.set_propagation(&options))
            }

            /// Sets the extrapolation of paths, from the next update on. Control thread.
            safe fn foresound_engine_set_predictor(engine: Handle, predictor: Choice<Predictor>) {
                ENGINES.with(engine, |engine| engine.set_predictor(predictor))
            }

            /// Changes the layout, such as when headphones are plugged in or out: sound cross-fades within the next
            /// graphics frame. The number of channels stays: a layout of more channels than the output fails with
            /// FORESOUND_STATUS_BAD_ARGUMENT, as does the binaural one without an HRTF set for the rate. Takes some
            /// milliseconds. Control thread.
            safe fn foresound_engine_set_layout(engine: Handle, layout: Choice<Layout>) {
                ENGINES.with(engine, |engine| Ok(engine.controller().set_layout(layout.choice()?)?))
            }

            /// Changes the HRTF set: binaural sound cross-fades within the next graphics frame. `hrtf`: content of a SOFA
            /// file of the convention SimpleFreeFieldHRIR, or of a baked set at the engine's sample rate; null for the
            /// built-in set. A baked set takes some milliseconds. A SOFA file takes some seconds, in which other calls of
            /// the engine go on: call it on a thread of its own. Fails with FORESOUND_STATUS_FORMAT for a damaged set and
            /// FORESOUND_STATUS_BAD_ARGUMENT for one of another sample rate; the set stays. Any thread but the sound's.
            unsafe fn foresound_engine_set_hrtf(engine: Handle, hrtf[hrtf_bytes]: OptionalBytes) {
                engine::set_hrtf(engine, hrtf.as_deref())
            }

            /// Sets when propagation runs, after the running update. Fails with FORESOUND_STATUS_STATE if the system
            /// starts no thread; the schedule stays. Control thread.
            safe fn foresound_engine_set_schedule(engine: Handle, schedule: Choice<Schedule>) {
                ENGINES.with(engine, |engine| engine.set_schedule(schedule))
            }

            /// Fades to silence within milliseconds and stops the playback positions. Control thread.
            safe fn foresound_engine_pause(engine: Handle) {
                ENGINES.with(engine, |engine| {
                    engine.controller().pause();
                    Ok(())
                })
            }

            /// Continues after foresound_engine_pause. Control thread.
            safe fn foresound_engine_resume(engine: Handle) {
                ENGINES.with(engine, |engine| {
                    engine.controller().resume();
                    Ok(())
                })
            }

            /// Restarts propagation after its failure (FORESOUND_ENGINE_STATE_PROPAGATION_FAILED), after the running
            /// update. Fails with FORESOUND_STATUS_STATE if the system starts no thread; another call tries again.
            /// Control thread.
            safe fn foresound_engine_restart(engine: Handle) {
                ENGINES.with(engine, |engine| Ok(engine.controller().restart()?))
            }

            /// Writes the engine's statistics. Takes microseconds; meant for some ten calls a second. Control thread.
            unsafe fn foresound_engine_statistics(engine: Handle, statistics: Out<EngineStatistics>) {
                statistics.store(ENGINES.with(engine, |engine| Ok(engine.statistics()))?)
            }

            /// Writes the default budget, which has no limit; `size` is set before. Any thread.
            unsafe fn foresound_budget_options_default(options: Out<BudgetOptions>) {
                options.store(BudgetOptions::default())
            }

            /// Sets the budget from the next update on: rays, reflection orders and paths are reduced to meet it. Temperature may
            /// reduce them further unless the level is fixed. `options`: null for no limit. Control thread.
            unsafe fn foresound_engine_set_budget(engine: Handle, options: In<BudgetOptions>) {
                ENGINES.with(engine, |engine| engine.set_budget(&options))
            }

            /// Writes the engine's load and the phone's temperature. Takes microseconds; meant for some ten calls a second.
            /// Control thread.
            unsafe fn foresound_engine_health(engine: Handle, health: Out<EngineHealth>) {
                health.store(ENGINES.with(engine, |engine| Ok(engine.health()))?)
            }

            /// Adds an instance of a part, such as a door, at a pose from the next tick on; `instance` receives its id. A part
            /// is a scene in local coordinates, a hinge at the origin; its handle may be closed afterwards, and instances may
            /// share it. Instances stay when the scene is replaced. `pose_size`: sizeof(ForesoundPose). Fails with
            /// FORESOUND_STATUS_BAD_ARGUMENT for a part of too many triangles, and for too many instances. Control thread.
            unsafe fn foresound_instance_add(engine: Handle, part: Handle, pose[pose_size]: PoseIn) -> instance: Id {
                instances::add(engine, part, &pose)
            }

            /// Adds an instance that stays where it is and is joined with the fixed scene and with all such instances that it touches,
            /// as if they had been built in one piece: floors and walls go on across borders. For chunks of a streamed world; a part
            /// may be shared. Else as foresound_instance_add. foresound_instance_remove removes it. Control thread.
            unsafe fn foresound_instance_add_joined(engine: Handle, part: Handle, pose[pose_size]: PoseIn) -> instance: Id {
                instances::add_joined(engine, part, &pose)
            }

            /// Moves an instance from the next tick on. The orientation is a quaternion of length 1; after an invalid pose the
            /// last valid one stays. `pose_size`: sizeof(ForesoundPose). Fails with FORESOUND_STATUS_BAD_ARGUMENT for one that
            /// was added by foresound_instance_add_joined. Control thread.
            unsafe fn foresound_instance_move(engine: Handle, instance: Id, pose[pose_size]: PoseIn) {
                ENGINES.with(engine, |engine| engine.move_instance(instance, &pose))
            }

            /// Removes an instance from the next tick on. Its id is invalid at once. Control thread.
            safe fn foresound_instance_remove(engine: Handle, instance: Id) {
                ENGINES.with(engine, |engine| engine.remove_instance(instance))
            }

            /// Writes the default options; `size` is set before. Any thread.
            unsafe fn foresound_scene_options_default(options: Out<SceneOptions>) {
                options.store(SceneOptions::default())
            }

            /// Makes a progress, with which another thread follows and cancels the construction of a scene; `progress` receives
            /// its handle. For one construction. Control thread.
            unsafe fn foresound_progress_create() -> progress: Handle { progress::create() }

            /// Writes the share of a scene's construction that is done, 0 to 1. Control thread, also during the construction.
            unsafe fn foresound_progress_read(progress: Handle) -> done: Real { progress::read(progress) }

            /// Cancels a construction: its call returns FORESOUND_STATUS_CANCELLED after the present phase, of four. Control thread.
            safe fn foresound_progress_cancel(progress: Handle) { progress::cancel(progress) }

            /// Builds a scene from a mesh file: OBJ or PLY, and glTF or GLB if the library is built with its feature
            /// `gltf`. The file names materials. Or loads a saved scene, for which `materials_toml`, `options` and
            /// `progress` mean nothing. Else as foresound_scene_from_mesh, also in how it fails, and with
            /// FORESOUND_STATUS_FILE for a file that cannot be read. Takes milliseconds to seconds: a control thread, but
            /// not the one that draws.
            unsafe fn foresound_scene_from_file(
                path: Text, materials_toml: OptionalText, options: In<SceneOptions>, progress: Handle
            ) -> scene: Handle {
                scenes::from_file(&path, materials_toml.as_deref(), &options, progress)
            }

            /// Saves a scene to a file, which foresound_scene_from_file and foresound_scene_from_bytes load in a
            /// twentieth of the time of its construction or less, on any machine. Fails with FORESOUND_STATUS_FILE for a
            /// file that cannot be written. Control thread.
            unsafe fn foresound_scene_save(scene: Handle, path: Text) { scenes::save(scene, &path) }

            /// Loads a saved scene from the bytes of its file. Fails with FORESOUND_STATUS_FORMAT for other bytes, damaged ones
            /// and those of another version. Control thread.
            unsafe fn foresound_scene_from_bytes(bytes[count]: Bytes) -> scene: Handle { scenes::from_bytes(&bytes) }

            /// Writes the properties of a scene. Control thread.
            unsafe fn foresound_scene_info(scene: Handle, info: Out<SceneInfo>) { info.store(scenes::info(scene)?) }

            /// Writes the renderer's latency from geometry to sound in audio frames, without the device's buffer. Does not
            /// disturb foresound_render. Any thread.
            unsafe fn foresound_renderer_latency(renderer: Handle) -> frames: Count { sound::latency_frames(renderer) }

            /// Writes the number of channels that a renderer writes. Any thread.
            unsafe fn foresound_renderer_channels(renderer: Handle) -> channels: Count { sound::channels(renderer) }

            /// Plays a renderer of two channels on the system's device (Oboe on Android, a silent device elsewhere), rendered
            /// `blocks_ahead` blocks ahead (1 to 64) on a thread of its own. Closes the renderer's handle. A device that is
            /// lost or does not open is opened again at growing intervals. Fails with FORESOUND_STATUS_STATE if the system
            /// starts no thread; after FORESOUND_STATUS_BAD_ARGUMENT, also for other channels, the renderer stays open. Control
            /// thread.
            unsafe fn foresound_output_start(renderer: Handle, blocks_ahead: Size) -> output: Handle {
                sound::start_output(renderer, blocks_ahead)
            }

            /// Writes the properties and the state of an output's device. Control thread.
            unsafe fn foresound_output_info(output: Handle, info: Out<OutputInfo>) {
                info.store(sound::output_info(output)?)
            }

            /// Sets the pose of one of several listeners from the next tick on. `listener`: 0 to below the option `listeners`; the
            /// pose of 0 is that of foresound_engine_tick. After an invalid pose the last valid one stays. `pose_size`:
            /// sizeof(ForesoundPose). Control thread.
            unsafe fn foresound_engine_set_listener(engine: Handle, listener: Count, pose[pose_size]: PoseIn) {
                ENGINES.with(engine, |engine| {
                    Ok(engine.controller().set_listener(listener as usize, pose.listener())?)
                })
            }

            /// Adds a silent source at a position in metres; `source` receives its id. Fails with FORESOUND_STATUS_STATE
            /// if the engine has `max_sources` sources. Control thread.
            unsafe fn foresound_source_add(engine: Handle, x_m: Real, y_m: Real, z_m: Real) -> source: Id {
                ENGINES.with(engine, |engine| engine.add_source([x_m, y_m, z_m]))
            }

            /// Takes the numbers of the newest graphics frame that the renderer has, for a mixer of the app's own;
            /// foresound_source_numbers and foresound_source_paths read them. `tick` receives the number of the frame's tick, 0
            /// before the first. The first call makes memory for them; from then on the renderer copies each frame without
            /// waiting. Control thread.
            unsafe fn foresound_engine_take_numbers(engine: Handle) -> tick: Count {
                ENGINES.with(engine, |engine| Ok(engine.take_frame() as u32))
            }

            /// Writes what the frame taken last has of a source; zeros for a source without a slot. Control thread.
            unsafe fn foresound_source_numbers(engine: Handle, source: Id, numbers: Out<SourceNumbers>) {
                numbers.store(ENGINES.with(engine, |engine| engine.source_numbers(source))?)
            }

            /// Removes a source from the next tick on; sound under way fades. Its id is invalid at once and is never given
            /// again: an engine has 1,048,575 ids for each of its `max_sources`. Control thread.
            safe fn foresound_source_remove(engine: Handle, source: Id) {
                ENGINES.with(engine, |engine| engine.remove_source(source))
            }

            /// Writes the default options; `size` is set before. Any thread.
            unsafe fn foresound_source_options_default(options: Out<SourceOptions>) {
                options.store(SourceOptions::default())
            }

            /// Sets a source's options from the next tick on. `options`: null for the defaults. Control thread.
            unsafe fn foresound_source_configure(engine: Handle, source: Id, options: In<SourceOptions>) {
                ENGINES.with(engine, |engine| engine.configure(source, &options))
            }

            /// Sets a source's directivity table from the next tick on: rows of eight levels in dB, one a band, the angles
            /// evenly from the front to the back, both included; 2 to 181 rows of -63 to 60 dB or minus infinity. `levels`:
            /// their number, 8 x rows; 0 for no table. The table is multiplied with the options' directivity. Control thread.
            unsafe fn foresound_source_set_directivity_table(
                engine: Handle, source: Id, levels_db[levels]: Samples
            ) {
                ENGINES.with(engine, |engine| engine.set_directivity_table(source, &levels_db))
            }

            /// Sets a source's distance table from the next tick on, which replaces the options' curve: pairs of a distance in
            /// metres and a linear gain (0 to 1000) at rising distances, 1 to 16 pairs; straight lines between them. `values`:
            /// their number, 2 x pairs; 0 for no table. Control thread.
            unsafe fn foresound_source_set_distance_table(engine: Handle, source: Id, points[values]: Samples) {
                ENGINES.with(engine, |engine| engine.set_distance_table(source, &points))
            }

            /// Sets a source's linear gain, 0 to 1000, from the next tick on. Control thread.
            safe fn foresound_source_set_gain(engine: Handle, source: Id, gain: Real) {
                ENGINES.with(engine, |engine| {
                    Ok(engine.controller().set_source_gain(source_id(source), gain)?)
                })
            }

            /// Mutes (1) or unmutes (0) a source; its playback position advances. Control thread.
            safe fn foresound_source_mute(engine: Handle, source: Id, muted: Flag) {
                ENGINES.with(engine, |engine| {
                    Ok(engine.controller().mute_source(source_id(source), muted)?)
                })
            }

            /// Plays a clip from its beginning, once (0) or in a loop (1). The clip's handle may be closed afterwards. Fails
            /// with FORESOUND_STATUS_BAD_ARGUMENT for a clip at another rate than the engine's. Control thread.
            safe fn foresound_source_play(engine: Handle, source: Id, clip: Handle, looped: Flag) {
                let options = PlayOptions { looped: looped.into(), ..PlayOptions::default() };
                playback::play(engine, source, clip, &options)
            }

            /// Writes the default options; `size` is set before. Any thread.
            unsafe fn foresound_play_options_default(options: Out<PlayOptions>) {
                options.store(PlayOptions::default())
            }

            /// Plays a clip with loop points, from a frame of it, at a frame of the engine. A pause of the source ends;
            /// its pitch stays. `options`: null for the defaults. The clip's handle may be closed afterwards. Fails as
            /// foresound_source_play. Control thread.
            unsafe fn foresound_source_play_clip(engine: Handle, source: Id, clip: Handle, options: In<PlayOptions>) {
                playback::play(engine, source, clip, &options)
            }

            /// Plays a clip once at a position in metres and forgets it: its source is removed when the clip has ended
            /// and its last path has arrived. `source` receives its id. `play` and `options`: null for the defaults. The
            /// id may be used until then, afterwards it gives FORESOUND_STATUS_STALE_SOURCE. Fails as
            /// foresound_source_add and foresound_source_play, and adds nothing then. Control thread.
            unsafe fn foresound_engine_play_once(
                engine: Handle, clip: Handle, x_m: Real, y_m: Real, z_m: Real, play: In<PlayOptions>,
                options: In<SourceOptions>
            ) -> source: Id {
                playback::play_once(engine, clip, [x_m, y_m, z_m], &play, &options)
            }

            /// Writes state and position of a source's clip, as of the last block; of a stream idle. Control thread.
            unsafe fn foresound_source_playback(engine: Handle, source: Id, playback: Out<Playback>) {
                playback.store(ENGINES.with(engine, |engine| engine.playback(source))?)
            }

            /// Pauses (1) or continues (0) a source's clip from the next tick on; fades within 6 ms. Control thread.
            safe fn foresound_source_pause(engine: Handle, source: Id, paused: Flag) {
                ENGINES.with(engine, |engine| {
                    Ok(engine.controller().pause_source(source_id(source), paused)?)
                })
            }

            /// Continues a source's clip at another audio frame of it from the next tick on, with a cross-fade. Fails with
            /// FORESOUND_STATUS_STATE if it plays no clip. Control thread.
            safe fn foresound_source_seek(engine: Handle, source: Id, frame: Count) {
                ENGINES.with(engine, |engine| {
                    Ok(engine.controller().seek_source(source_id(source), frame.into())?)
                })
            }

            /// Sets the speed of a source's clips, 0.125 to 4, from the next tick on: 2 is an octave up. The pitch glides.
            /// Control thread.
            safe fn foresound_source_set_pitch(engine: Handle, source: Id, pitch: Real) {
                ENGINES.with(engine, |engine| {
                    Ok(engine.controller().set_source_pitch(source_id(source), pitch)?)
                })
            }

            /// Ramps a source's linear gain to 0 to 1000 within 0 to 3600 seconds from the next tick on. Control thread.
            safe fn foresound_source_fade_gain(engine: Handle, source: Id, gain: Real, seconds: Real) {
                ENGINES.with(engine, |engine| {
                    Ok(engine.controller().fade_source_gain(source_id(source), gain, seconds)?)
                })
            }

            /// Silences a source and releases its clip or stream. Control thread.
            safe fn foresound_source_stop(engine: Handle, source: Id) {
                ENGINES.with(engine, |engine| Ok(engine.controller().stop(source_id(source))?))
            }

            /// Attaches a stream to a source, through a ring of `capacity` samples (1 to 16,777,216), and writes the handle for
            /// foresound_stream_write. Samples are mono at the engine's rate, 1 being full scale at 1 m; they are not converted.
            /// After a failure the source plays on as before. Control thread.
            unsafe fn foresound_source_stream(engine: Handle, source: Id, capacity: Size) -> stream: Handle {
                engine::stream(engine, source, capacity)
            }

            /// Makes a clip of mono samples at `rate_hz` for engines at `engine_rate_hz` (1,000 to 384,000 Hz), copied and
            /// resampled. A sample of 1 is full scale at 1 m. At most 2^28 samples, 2^26 if they are resampled. Control thread.
            unsafe fn foresound_clip_from_samples(
                samples[count]: Samples, rate_hz: Count, engine_rate_hz: Count
            ) -> clip: Handle {
                clip::from_samples(&samples, 1, rate_hz, engine_rate_hz)
            }

            /// Makes a clip of the bytes of a WAV file (PCM of 8 to 32 bits or float; channels are averaged) for engines
            /// at `engine_rate_hz`. Fails with FORESOUND_STATUS_FORMAT for bytes of another format, else as
            /// foresound_clip_from_samples. Control thread.
            unsafe fn foresound_clip_from_wav(bytes[count]: Bytes, engine_rate_hz: Count) -> clip: Handle {
                clip::from_wav(&bytes, 1, engine_rate_hz)
            }

            /// Makes a clip of two channels, interleaved samples, left first; else as foresound_clip_from_samples. A source with a
            /// position plays their mean, a 2D source both. Control thread.
            unsafe fn foresound_clip_from_stereo(
                samples[count]: Samples, rate_hz: Count, engine_rate_hz: Count
            ) -> clip: Handle {
                clip::from_samples(&samples, 2, rate_hz, engine_rate_hz)
            }

            /// Makes a clip of the first two channels of a WAV file; else as foresound_clip_from_wav. Control thread.
            unsafe fn foresound_clip_from_stereo_wav(bytes[count]: Bytes, engine_rate_hz: Count) -> clip: Handle {
                clip::from_wav(&bytes, 2, engine_rate_hz)
            }

            /// Makes a clip of a first-order sound field in AmbiX form, four interleaved channels W, Y, Z, X in SN3D; else as
            /// foresound_clip_from_samples. A 2D source plays it around the listener, fixed in the world: its front is -z, its
            /// left -x, its top +y. A source with a position plays W. Control thread.
            unsafe fn foresound_clip_from_ambix(
                samples[count]: Samples, rate_hz: Count, engine_rate_hz: Count
            ) -> clip: Handle {
                clip::from_samples(&samples, 4, rate_hz, engine_rate_hz)
            }

            /// Makes a clip of the bytes of a sound file: WAV, or FLAC or Ogg Vorbis if the library is built with its
            /// feature `compressed`. `channels`: 1 for their mean, 2 for the first two, 4 for a sound field in AmbiX
            /// form, for which the file must have four. Fails with FORESOUND_STATUS_FORMAT for other bytes and formats
            /// that the library is built without, else as foresound_clip_from_samples. Control thread.
            unsafe fn foresound_clip_from_file(
                bytes[count]: Bytes, channels: Count, engine_rate_hz: Count
            ) -> clip: Handle {
                clip::from_file(&bytes, channels, engine_rate_hz)
            }
        }
    };
}
#[cfg(any(feature = "capi", feature = "jni"))]
pub(super) use shared_functions;

/// Passes the functions that Java alone has in this form to a macro.
macro_rules! java_functions {
    ($emit:ident) => {
        $emit! {
            /// Version of the interface.
            safe fn foresound_version() -> version: Count { Ok(VERSION) }

            /// Number of open handles, for leak tests.
            safe fn foresound_open_handles() -> handles: Count { Ok($crate::bridge::open_handles() as u32) }

            /// Submits a graphics frame: the listener's pose and `count` sources' poses, {@link #POSE_BYTES} each.
            safe fn foresound_engine_tick(engine: Handle, frame: Buffer, count: Size) {
                let bytes = POSE_BYTES.checked_mul(count + 1);
                frame.check(bytes.ok_or_else(|| CallError::bad("count: exceeds memory"))?)?;
                let pose = |index: usize| Pose::from_bytes(&frame.read(index * POSE_BYTES));
                ENGINES.with(engine, |engine| engine.tick(pose(0).listener(), (1..=count).map(pose)))
            }

            /// Writes the loudest paths of the newest update as {@link ShownPath} lists, as many as fit; returns their number.
            safe fn foresound_engine_paths(engine: Handle, paths: List) -> count: Count {
                let most = paths.length / ShownPath::ELEMENTS;
                let mut list = Vec::new();
                ENGINES.with(engine, |engine| {
                    engine.shown_paths().take(most).for_each(|path| path.write(&mut list));
                    Ok(())
                })?;
                paths.store(&list)?;
                Ok((list.len() / ShownPath::ELEMENTS) as u32)
            }

            /// Writes a source's paths in the frame taken last as {@link SourcePath} lists, as many as fit; returns their number.
            safe fn foresound_source_paths(engine: Handle, source: Id, paths: List) -> count: Count {
                let most = paths.length / SourcePath::ELEMENTS;
                let mut list = Vec::new();
                ENGINES.with(engine, |engine| {
                    engine.source_paths(source)?.take(most).for_each(|path| path.write(&mut list));
                    Ok(())
                })?;
                paths.store(&list)?;
                Ok((list.len() / SourcePath::ELEMENTS) as u32)
            }

            /// Builds a scene from vertices and triangles; the four before the last may be null, and the progress 0.
            safe fn foresound_scene_from_mesh(
                positions: Samples, indices: Indices, triangle_materials: Indices, materials: Texts,
                materials_toml: OptionalText, options: In<SceneOptions>, progress: Handle
            ) -> scene: Handle {
                let (positions, rest) = positions.as_chunks::<3>();
                if !rest.is_empty() {
                    return Err(CallError::bad("positions: pass three coordinates a vertex"));
                }
                let indices = indices.ok_or_else(|| CallError::null("indices"))?;
                let names: Vec<&str> = materials.iter().map(String::as_str).collect();
                let triangle_materials = triangle_materials.unwrap_or_default();
                let toml = materials_toml.as_deref();
                let mesh = TriangleMesh::from_slices(positions, &indices, &names, &triangle_materials)?;
                scenes::from_mesh(&mesh, toml, &options, progress)
            }

            /// Renders interleaved floats of the renderer's channels; returns the number of voices.
            safe fn foresound_render(renderer: Handle, output: BufferOut, frames: Size) -> voices: Count {
                let samples = frames.saturating_mul(sound::channels(renderer)? as usize);
                output.check(samples.saturating_mul(size_of::<f32>()))?;
                let info = sound::render_blocks(renderer, frames, |start, block| {
                    output.write(start, block);
                    Ok(())
                })?;
                Ok(info.voices)
            }

            /// Renders each listener into its own output, one after the other, of interleaved floats; returns the number of voices.
            safe fn foresound_render_listeners(renderer: Handle, output: BufferOut, frames: Size) -> voices: Count {
                let listeners = sound::listeners(renderer)?;
                let samples = frames.saturating_mul(sound::channels(renderer)? as usize);
                let all = samples.saturating_mul(listeners);
                output.check(all.saturating_mul(size_of::<f32>()))?;
                let info = sound::render_listener_blocks(renderer, frames, |start, block| {
                    output.write(start, block);
                })?;
                Ok(info.voices)
            }

            /// Begins a block of frames, at most the option {@code block_frames}, whose sources are rendered apart.
            safe fn foresound_render_begin(renderer: Handle, frames: Size) { source_buses::begin(renderer, frames) }

            /// Renders one source of the block as interleaved floats; returns what the output holds ({@link Bus}). Without a
            /// {@code dry} block what the source plays in the engine.
            safe fn foresound_render_source(
                renderer: Handle, source: Id, dry: OptionalBuffer, output: BufferOut, frames: Size
            ) -> bus: Count {
                let samples = frames.saturating_mul(sound::channels(renderer)? as usize);
                output.check(samples.saturating_mul(size_of::<f32>()))?;
                if let Some(dry) = &dry {
                    dry.check(frames.saturating_mul(size_of::<f32>()))?;
                }
                let read = dry.map(|dry| move |block: &mut [f32]| dry.read_floats(block));
                let write = |block: &[f32]| output.write(0, block);
                Ok(source_buses::copy_source(renderer, source, frames, read, write)?.0)
            }

            /// Ends the block: renders the late reverb and what has no bus of its own; returns the number of voices.
            safe fn foresound_render_reverb(renderer: Handle, output: BufferOut, frames: Size) -> voices: Count {
                let samples = frames.saturating_mul(sound::channels(renderer)? as usize);
                output.check(samples.saturating_mul(size_of::<f32>()))?;
                let write = |block: &[f32]| output.write(0, block);
                Ok(source_buses::copy_reverb(renderer, frames, write)?.voices)
            }

            /// Appends floats to a stream; returns the number that fitted.
            safe fn foresound_stream_write(stream: Handle, samples: Buffer, count: Size) -> written: Count {
                samples.check(count * size_of::<f32>())?;
                let (mut written, mut piece) = (0, [0.0; 256]);
                loop {
                    let piece = &mut piece[..(count - written).min(256)];
                    for (i, sample) in piece.iter_mut().enumerate() {
                        *sample = f32::from_ne_bytes(samples.read(4 * (written + i)));
                    }
                    let fitted = sound::write_stream(stream, piece)?;
                    written += fitted;
                    if fitted < piece.len() || written == count {
                        break Ok(written as u32);
                    }
                }
            }
        }
    };
}
#[cfg(feature = "jni")]
pub(super) use java_functions;

macro_rules! describe {
    ($($(#[doc = $doc:literal])* $safety:ident fn $name:ident(
        $($parameter:ident $([$count:ident])?: $kind:ty),*
    ) $(-> $result:ident: $result_kind:ty)? $body:block)*) => {
        vec![$({
            let mut results: Vec<Parameter> = vec![$(parameter::<$result_kind>(stringify!($result), &[]))?];
            Function {
                docs: &[$($doc),*],
                name: stringify!($name),
                parameters: vec![$(parameter::<$kind>(stringify!($parameter), &[$(stringify!($count))?])),*],
                result: results.pop(),
            }
        }),*]
    };
}

/// Fixes the error type of a body.
#[cfg(any(feature = "capi", feature = "jni"))]
pub(super) fn result<T>(result: Result<T, CallError>) -> Result<T, CallError> {
    result
}

fn parameter<K: Kind>(name: &'static str, count: &[&'static str]) -> Parameter {
    Parameter {
        name,
        count: count.first().copied(),
        c: K::c(),
        java: K::JAVA,
    }
}

/// The functions common to C and Java, and those that Java alone has in this form.
pub fn functions() -> [Vec<Function>; 2] {
    use super::engine::{MaterialOptions, PropagationOptions, SourceOptions};
    use super::enumeration::{Layout, Predictor, Schedule};
    use super::health::{BudgetOptions, EngineHealth};
    use super::numbers::SourceNumbers;
    use super::playback::{PlayOptions, Playback};
    use super::scenes::{SceneInfo, SceneOptions};
    use super::sound::OutputInfo;
    use super::{EngineStatistics, Options};
    [shared_functions!(describe), java_functions!(describe)]
}
