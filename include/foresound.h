/* Foresound: real-time ray-traced sound. The C interface, for C, C++ and engines with C bindings.
 *
 * Written from src/bridge by `FORESOUND_WRITE_HEADER=1 cargo test --test c_header`; do not edit.
 *
 * Handles. Engines, renderers, scenes, clips, streams and outputs are 64-bit numbers, never 0, closed with
 * foresound_close. A closed handle, another kind's or an arbitrary number is an error and never undefined behaviour.
 *
 * Threads. The audio thread is the one that renders. Any other thread is a control thread; control functions wait for
 * each other if they use the same handle. foresound_render and foresound_stream_write are for the audio thread: they never
 * wait and never allocate.
 *
 * Units. Metres, seconds, Hz, linear gain; right-handed coordinates, +y up. An audio frame is one sample a channel; a
 * graphics frame is the app's tick. Sources and instances have 32-bit ids.
 *
 * Pointers. A pointer is the address of a variable of its type, or of an array with the length of the parameter after it.
 * It need not be valid after the call. Texts are UTF-8 with a terminating zero. Null is an error (FORESOUND_STATUS_NULL)
 * except for an array of length 0 and where the function's description allows it.
 *
 * Errors. Functions return a ForesoundStatus; foresound_last_error has the message. After a failure, results are 0 (handles,
 * counts) or UINT32_MAX (ids).
 *
 * Options. Structures begin with their size: fill them with the defaults (foresound_..._default), then change fields. A
 * newer library uses the defaults for fields that an older caller's header lacks.
 */

#ifndef FORESOUND_H
#define FORESOUND_H

#include <stddef.h>
#include <stdint.h>

/* The version of this header; compare with foresound_version. */
#define FORESOUND_API_VERSION 0x00020000u

// Result of every call.
enum ForesoundStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Success.
  FORESOUND_STATUS_OK = 0,
  // A number, size or text is out of range.
  FORESOUND_STATUS_BAD_ARGUMENT = 1,
  // A pointer or reference is null where a value is required.
  FORESOUND_STATUS_NULL = 2,
  // The handle was closed or never existed.
  FORESOUND_STATUS_CLOSED = 3,
  // The handle is of another kind.
  FORESOUND_STATUS_WRONG_KIND = 4,
  // Another thread is using the handle; audio calls do not wait.
  FORESOUND_STATUS_BUSY = 5,
  // A file cannot be read.
  FORESOUND_STATUS_FILE = 6,
  // The content of a file or mesh is invalid.
  FORESOUND_STATUS_FORMAT = 7,
  // The source was removed or never added.
  FORESOUND_STATUS_STALE_SOURCE = 8,
  // The call is not possible in the engine's present state.
  FORESOUND_STATUS_STATE = 9,
  // Too many handles are open.
  FORESOUND_STATUS_FULL = 10,
  // A defect of the library was caught. The handle accepts nothing but foresound_close from now on.
  FORESOUND_STATUS_PANIC = 11,
  // The instance was removed or never added.
  FORESOUND_STATUS_STALE_INSTANCE = 12,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundStatus ForesoundStatus;
#else
typedef int32_t ForesoundStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Settings of an engine. Fill it with the defaults, then change fields.
typedef struct ForesoundOptions {
  // Bytes of this structure in the caller's version of the header: fields beyond keep their defaults.
  uint32_t size;
  // Sample rate in Hz: 44,100 or 48,000 with the built-in HRTF set.
  uint32_t rate_hz;
  // Audio frames a block, 32 to 4,096.
  uint32_t block_frames;
  // Maximum number of sources, 1 to 256.
  uint32_t max_sources;
  // Maximum number of paths rendered at once, 1 to 16,384.
  uint32_t max_voices;
  // The loudest of them are rendered in full detail: their number.
  uint32_t fine_voices;
  // Maximum number of paths of one update, 1 to 16,384.
  uint32_t max_paths;
  // Rays from the listener an update, 1 to 65,536.
  uint32_t guide_rays;
  // Rays from each source an update, 1 to 65,536.
  uint32_t source_rays;
  // Maximum reflection order, 0 to 4.
  uint32_t depth;
  // Seed of the ray directions.
  uint32_t seed;
  // 0: propagation on its own thread; 1: within every tick.
  uint32_t schedule;
  // Extrapolation of paths between updates: 0 hold, 1 linear, 2 geometric.
  uint32_t predictor;
  // Cores: 0 chosen by the system, 1 the two fastest, 2 those of the next two fields.
  uint32_t affinity;
  // Core of the propagation thread, if `affinity` is 2.
  uint32_t propagation_core;
  // Core of the audio thread, if `affinity` is 2.
  uint32_t sound_core;
  // 0: the HRTF set passed at creation, else the built-in one; 1: none, both ears receive the same signal.
  uint32_t hrtf;
  // 1: with late reverb; 0: without.
  uint32_t late_reverb;
  // 1: with limiter; 0: without.
  uint32_t limiter;
  // Distance in metres below which a source gets no louder.
  float min_distance_m;
  // Ceiling of the limiter in dB re full scale, -60 to 0.
  float ceiling_db;
  // Duration of a graphics frame in seconds, 0.001 to 1; 0: measured from the ticks.
  double frame_s;
  // Maximum path delay in seconds, 0.01 to 10.
  double max_delay_s;
  // Exchange with a phone's system, a sum of bits: 1 heat lowers the quality level, 2 performance hints. Without
  // effect where the system lacks the functions.
  uint32_t device_hints;
  // Maximum number of paths that foresound_engine_paths returns, 0 to 16,384.
  uint32_t shown_paths;
  // Maximum memory of the engine in MiB, without scenes and sounds; an engine of more is refused. Most of it is
  // 32 bytes x `rate_hz` x `max_delay_s` for each of `max_sources`.
  uint32_t max_memory_mib;
} ForesoundOptions;

// Percentiles of durations in seconds; zeros without a measurement.
typedef struct ForesoundPercentiles {
  // Number of measurements.
  uint64_t count;
  // 50th percentile.
  double p50_s;
  // 95th percentile.
  double p95_s;
  // 99.9th percentile.
  double p999_s;
  // Maximum.
  double worst_s;
} ForesoundPercentiles;

// Statistics of an engine. Counts are since its creation.
typedef struct ForesoundEngineStatistics {
  // 0 running, 1 paused, 2 propagation failed (restart), 3 the renderer was closed (create another engine).
  uint32_t state;
  // Extrapolation level L in use.
  uint32_t extrapolation_level;
  // Paths in the update in use.
  uint32_t paths;
  // Number of sources.
  uint32_t sources;
  // Durations of propagation updates.
  struct ForesoundPercentiles propagation;
  // Durations of extrapolation a graphics frame.
  struct ForesoundPercentiles extrapolation;
  // Durations of generation a block.
  struct ForesoundPercentiles generation;
  // Durations of whole render calls.
  struct ForesoundPercentiles block;
  // Render calls.
  uint64_t blocks;
  // Render calls that took longer than the duration of their sound.
  uint64_t missed_deadlines;
  // Propagation updates in use so far.
  uint64_t updates;
  // The quietest paths, dropped beyond the limit of an update.
  uint64_t trimmed_paths;
  // Paths without a voice.
  uint64_t dropped_paths;
  // Samples missing from streams at their time.
  uint64_t underrun_samples;
  // Duration of the update in use, in seconds.
  double propagation_s;
  // Time between graphics frames in seconds.
  double graphics_frame_s;
  // Cores allowed for the propagation thread, a bit each.
  uint64_t propagation_cores;
  // Cores allowed for the audio thread, a bit each.
  uint64_t sound_cores;
  // Real-time priority of the audio thread; 0 outside that class.
  int32_t sound_priority;
  // Niceness of the audio thread, -20 to 19.
  int32_t sound_nice;
} ForesoundEngineStatistics;

// Budget of an engine. Fill it with the defaults, then change fields.
typedef struct ForesoundBudgetOptions {
  // Bytes of this structure in the caller's version of the header: fields beyond keep their defaults.
  uint32_t size;
  // Finest quality level in use: 0 full detail to 5 the coarsest.
  uint32_t quality_level;
  // 1: that level exactly, regardless of load and temperature; else 0.
  uint32_t fixed;
  // Maximum duration of a propagation update in seconds, 0.0001 to 10; 0: no limit.
  double update_s;
  // Maximum share of one core for propagation and sound together, 0.05 to 2; 0: no limit.
  double core_share;
} ForesoundBudgetOptions;

// Load of an engine and temperature of the phone.
typedef struct ForesoundEngineHealth {
  // 0 running, 1 paused, 2 propagation failed (restart), 3 the renderer was closed (create another engine).
  uint32_t state;
  // Quality level in use, 0 full detail to 5 the coarsest.
  uint32_t quality_level;
  // Finest quality level allowed by the temperature; 0 if unknown.
  uint32_t thermal_quality_level;
  // The system's thermal status: 0 none, 1 light, 2 moderate, 3 severe, 4 critical, 5 emergency, 6 shutdown; -1 if
  // unknown.
  int32_t thermal_status;
  // The system's thermal headroom: 1 is severe throttling; -1 if unknown.
  float thermal_headroom;
  // Threads with a performance hint session, a sum of bits: 1 propagation, 2 sound.
  uint32_t hinted;
  // Sources that louder ones mask, if there are more sources than slots.
  uint32_t unheard_sources;
  // Rays cast by the newest update.
  uint32_t rays;
  // Share of one core used by sound.
  double sound_share;
  // Duration of the newest update in seconds.
  double propagation_s;
  // Time between graphics frames in seconds.
  double graphics_frame_s;
} ForesoundEngineHealth;

// Position and orientation of a listener, a source or an instance.
//
// Metres, right-handed, +y up. The orientation rotates local coordinates (+x right, +y up, -z ahead) into the world's: a
// quaternion x, y, z, w of length 1.
typedef struct ForesoundPose {
  // Id of the source; ignored for listeners and instances.
  uint32_t source;
  // Position in metres.
  float position_m[3];
  // Quaternion x, y, z, w; (0, 0, 0, 1) faces -z.
  float orientation[4];
} ForesoundPose;

// Settings of a scene. Fill it with the defaults, then change fields.
typedef struct ForesoundSceneOptions {
  // Bytes of this structure in the caller's version of the header: fields beyond keep their defaults.
  uint32_t size;
  // Up axis of a file: 0 for +y, 1 for +z.
  uint32_t up;
  // Metres a unit of a file, above zero.
  float scale;
  // Air temperature in degrees Celsius.
  float temperature_c;
  // Relative humidity in percent.
  float humidity_percent;
  // Static pressure in kPa.
  float pressure_kpa;
} ForesoundSceneOptions;

// Properties of a scene.
typedef struct ForesoundSceneInfo {
  // Triangles of the mesh.
  uint64_t triangles_in;
  // Triangles kept: finite, with an area.
  uint64_t triangles;
  // Plane surfaces that they form.
  uint64_t surfaces;
  // Materials that no table defines; they have the default's properties.
  uint64_t unknown_materials;
  // Memory of the scene in bytes.
  uint64_t memory_bytes;
  // Speed of sound in m/s.
  double speed_of_sound_m_s;
  // Minimum coordinates in metres.
  float bounds_min_m[3];
  // Maximum coordinates in metres.
  float bounds_max_m[3];
} ForesoundSceneInfo;

// Properties and state of a device.
typedef struct ForesoundOutputInfo {
  // 1 playing, 0 closed and to be opened again.
  uint32_t playing;
  // Granted sample rate in Hz.
  uint32_t rate_hz;
  // Audio frames of the device's burst.
  uint32_t burst_frames;
  // Audio frames of the device's buffer.
  uint32_t buffer_frames;
  // 1 in exclusive mode.
  uint32_t exclusive;
  // 1 in low-latency mode.
  uint32_t low_latency;
  // 1 AAudio, 2 OpenSL ES, 0 neither.
  uint32_t interface;
  // Latency of the ring buffer in audio frames.
  uint32_t ring_frames;
  // Successful attempts to open a device.
  uint32_t opened;
  // Failed attempts to open a device.
  uint32_t refused;
  // Disconnections of the device.
  uint32_t lost;
  // Times that the device stopped its callbacks and was closed.
  uint32_t stalled;
  // Underruns counted by the device since it was opened.
  uint32_t xruns;
  // Minimum audio frames of a callback.
  uint32_t least_frames;
  // Maximum audio frames of a callback.
  uint32_t most_frames;
  // Callbacks.
  uint64_t callbacks;
  // Audio frames that were not rendered in time.
  uint64_t underrun_frames;
} ForesoundOutputInfo;

// Settings of a source. Fill it with the defaults, then change fields.
typedef struct ForesoundSourceOptions {
  // Bytes of this structure in the caller's version of the header: fields beyond keep their defaults.
  uint32_t size;
  // Computed parts, a sum of bits: 1 direct, 2 reflections, 4 diffraction, 8 transmission, 16 late reverb.
  uint32_t effects;
  // Radius in metres within which the source gets no louder; 0: the engine's.
  float radius_m;
  // Exponent of the directivity, 0 to 64.
  float order;
  // Directivity in each octave band, from the lowest: 0 omnidirectional, 0.5 cardioid, 1 dipole.
  float directivity[8];
} ForesoundSourceOptions;

// A path as a polyline from source to listener.
typedef struct ForesoundShownPath {
  // Id of the source.
  uint32_t source;
  // Corners in use, both ends included.
  uint32_t corner_count;
  // Number of reflections.
  uint32_t reflections;
  // Number of diffractions.
  uint32_t diffraction_order;
  // Level in dB re the free field at 1 m.
  float level_db;
  // Corners in metres.
  float corners_m[6][3];
} ForesoundShownPath;

// Result of one foresound_render.
typedef struct ForesoundRenderInfo {
  // Audio frames written.
  uint32_t frames;
  // Graphics frames consumed.
  uint32_t graphics_frames;
  // Propagation updates consumed.
  uint32_t updates;
  // Extrapolation level L in use.
  uint32_t extrapolation_level;
  // Voices, fading ones included.
  uint32_t voices;
  // Paths without a voice.
  uint32_t dropped_paths;
  // Samples missing from streams at their time.
  uint32_t underrun_samples;
  // 1 if the call took longer than the duration of its sound.
  uint32_t missed_deadline;
  // 1 if the engine was closed: sound continues with the last poses.
  uint32_t engine_gone;
} ForesoundRenderInfo;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Closes a handle of any kind and destroys its object: an engine after its running update, an output after its
// threads. Waits for a call that uses the handle. Control thread.
ForesoundStatus foresound_close(uint64_t handle);

// Writes the default options. Any thread.
ForesoundStatus foresound_options_default(struct ForesoundOptions *options);

// Creates an engine in free field without sources. `engine` receives the handle of the control half, `renderer`
// that of the audio half. Takes some ten milliseconds. Control thread.
//
// `options`: null for the defaults. `hrtf`: content of an HRTF set's file; null for the built-in set.
ForesoundStatus foresound_engine_create(const struct ForesoundOptions *options,
                                        const uint8_t *hrtf,
                                        size_t hrtf_bytes,
                                        uint64_t *engine,
                                        uint64_t *renderer);

// Replaces the scene. The old one is audible until the first update with the new one. The scene's handle may be
// closed afterwards. Control thread.
ForesoundStatus foresound_engine_set_scene(uint64_t engine, uint64_t scene);

// Sets the rays of propagation from the listener and from each source (1 to 65,536) and the maximum reflection
// order (0 to 4). Control thread.
ForesoundStatus foresound_engine_set_propagation(uint64_t engine,
                                                 uint32_t guide_rays,
                                                 uint32_t source_rays,
                                                 uint32_t depth);

// Fades to silence within milliseconds and stops the playback positions. Control thread.
ForesoundStatus foresound_engine_pause(uint64_t engine);

// Continues after foresound_engine_pause. Control thread.
ForesoundStatus foresound_engine_resume(uint64_t engine);

// Restarts propagation after its failure (state 2), after the running update. Control thread.
ForesoundStatus foresound_engine_restart(uint64_t engine);

// Writes the engine's statistics. Takes microseconds; meant for some ten calls a second. Control thread.
ForesoundStatus foresound_engine_statistics(uint64_t engine, struct ForesoundEngineStatistics *statistics);

// Writes the default budget, which has no limit. Any thread.
ForesoundStatus foresound_budget_options_default(struct ForesoundBudgetOptions *options);

// Sets the budget from the next update on: rays, reflection orders and paths are reduced to meet it. Temperature may
// reduce them further unless the level is fixed. `options`: null for no limit. Control thread.
ForesoundStatus foresound_engine_set_budget(uint64_t engine, const struct ForesoundBudgetOptions *options);

// Writes the engine's load and the phone's temperature. Takes microseconds; meant for some ten calls a second.
// Control thread.
ForesoundStatus foresound_engine_health(uint64_t engine, struct ForesoundEngineHealth *health);

// Adds an instance of a part, such as a door, at a pose from the next tick on; `instance` receives its id. A part is
// a scene in local coordinates, a hinge at the origin; its handle may be closed afterwards, and instances may
// share it. Instances stay when the scene is replaced. Control thread.
ForesoundStatus foresound_instance_add(uint64_t engine,
                                       uint64_t part,
                                       const struct ForesoundPose *pose,
                                       uint32_t *instance);

// Moves an instance from the next tick on. The orientation is a quaternion of length 1; after an invalid pose the
// last valid one stays. Control thread.
ForesoundStatus foresound_instance_move(uint64_t engine, uint32_t instance, const struct ForesoundPose *pose);

// Removes an instance from the next tick on. Its id is invalid at once. Control thread.
ForesoundStatus foresound_instance_remove(uint64_t engine, uint32_t instance);

// Writes the default options. Any thread.
ForesoundStatus foresound_scene_options_default(struct ForesoundSceneOptions *options);

// Builds a scene from an OBJ file, whose `usemtl` names materials. Else as foresound_scene_from_mesh.
ForesoundStatus foresound_scene_from_file(const char *path,
                                          const char *materials_toml,
                                          const struct ForesoundSceneOptions *options,
                                          uint64_t *scene);

// Writes the properties of a scene. Control thread.
ForesoundStatus foresound_scene_info(uint64_t scene, struct ForesoundSceneInfo *info);

// Writes the renderer's latency from geometry to sound in audio frames, without the device's buffer. Does not
// disturb foresound_render. Any thread.
ForesoundStatus foresound_renderer_latency(uint64_t renderer, uint32_t *frames);

// Plays a renderer on the system's device (Oboe on Android, a silent device elsewhere), rendered `blocks_ahead`
// blocks ahead (1 to 64) on a thread of its own. Closes the renderer's handle. A device that is lost or does not
// open is opened again at growing intervals. Control thread.
ForesoundStatus foresound_output_start(uint64_t renderer, size_t blocks_ahead, uint64_t *output);

// Writes the properties and the state of an output's device. Control thread.
ForesoundStatus foresound_output_info(uint64_t output, struct ForesoundOutputInfo *info);

// Adds a silent source at a position in metres; `source` receives its id. Control thread.
ForesoundStatus foresound_source_add(uint64_t engine, float x_m, float y_m, float z_m, uint32_t *source);

// Removes a source from the next tick on; sound under way fades. Its id is invalid at once and is never given
// again: an engine has 1,048,576 ids for each of its `max_sources`. Control thread.
ForesoundStatus foresound_source_remove(uint64_t engine, uint32_t source);

// Writes the default options. Any thread.
ForesoundStatus foresound_source_options_default(struct ForesoundSourceOptions *options);

// Sets a source's options from the next tick on. `options`: null for the defaults. Control thread.
ForesoundStatus foresound_source_configure(uint64_t engine,
                                           uint32_t source,
                                           const struct ForesoundSourceOptions *options);

// Sets a source's linear gain, 0 to 1000, from the next tick on. Control thread.
ForesoundStatus foresound_source_set_gain(uint64_t engine, uint32_t source, float gain);

// Mutes (1) or unmutes (0) a source; its playback position advances. Control thread.
ForesoundStatus foresound_source_mute(uint64_t engine, uint32_t source, uint32_t muted);

// Plays a clip from its beginning, once (0) or in a loop (1). The clip's handle may be closed afterwards. Control
// thread.
ForesoundStatus foresound_source_play(uint64_t engine, uint32_t source, uint64_t clip, uint32_t looped);

// Silences a source and releases its clip or stream. Control thread.
ForesoundStatus foresound_source_stop(uint64_t engine, uint32_t source);

// Attaches a stream to a source, through a ring buffer of `capacity` samples (1 to 16,777,216); `stream` receives
// the handle for foresound_stream_write. After a failure the source plays on as before. Control thread.
ForesoundStatus foresound_source_stream(uint64_t engine, uint32_t source, size_t capacity, uint64_t *stream);

// Makes a clip of mono samples at `rate_hz` for engines at `engine_rate_hz` (1,000 to 384,000 Hz), copied and
// resampled. A sample of 1 is full scale at 1 m. Control thread.
ForesoundStatus foresound_clip_from_samples(const float *samples,
                                            size_t count,
                                            uint32_t rate_hz,
                                            uint32_t engine_rate_hz,
                                            uint64_t *clip);

// Makes a clip of the bytes of a WAV file (PCM of 8 to 32 bits or float; channels are averaged) for engines at
// `engine_rate_hz`. Control thread.
ForesoundStatus foresound_clip_from_wav(const uint8_t *bytes, size_t count, uint32_t engine_rate_hz, uint64_t *clip);

// Version of this interface: 65,536 x major + 256 x minor + patch. Another major number than
// FORESOUND_API_VERSION's is incompatible. Any thread.
uint32_t foresound_version(void);

// Message of this thread's last failed call: one line in UTF-8, the cause and the remedy. Valid until the thread's next
// failure; empty before the first. Never null; not to be freed. foresound_render and foresound_stream_write leave no
// message. Any thread.
const char *foresound_last_error(void);

// Submits a graphics frame: the listener's pose, and the poses of the sources that moved. Meant for one call a frame;
// never waits for propagation or sound, except that the synchronous schedule runs propagation in it. After an invalid pose
// or an unknown source it fails, and the frame is submitted with the last valid poses. `sources`: null if none. Control
// thread.
ForesoundStatus foresound_engine_tick(uint64_t engine,
                                      const struct ForesoundPose *listener,
                                      const struct ForesoundPose *sources,
                                      size_t source_count);

// Writes the loudest paths of the newest update, in no order, as many as fit, and their number. At most the option
// `shown_paths` of them are available. Control thread.
ForesoundStatus foresound_engine_paths(uint64_t engine,
                                       struct ForesoundShownPath *paths,
                                       size_t capacity,
                                       size_t *count);

// Builds a scene from triangles: three coordinates a vertex in metres, +y up, and three indices a triangle. With
// materials: their names, and one index into them a triangle; without: null and zero. `materials_toml`: the text of a
// materials file, or null. `options`: null for the defaults. Takes milliseconds to seconds: a control thread, but not the
// one that draws.
ForesoundStatus foresound_scene_from_mesh(const float *positions_m,
                                          size_t vertex_count,
                                          const uint32_t *indices,
                                          size_t index_count,
                                          const uint32_t *triangle_materials,
                                          const char *const *material_names,
                                          size_t material_count,
                                          const char *materials_toml,
                                          const struct ForesoundSceneOptions *options,
                                          uint64_t *scene);

// Renders `frames` audio frames of interleaved stereo into `output`; silence on failure. `info`: null if unused. One thread
// at a time a renderer; a second concurrent call gets FORESOUND_STATUS_BUSY. Multiples of the engine's block size are the
// most efficient. Audio thread: wait-free, without allocation, without a message.
//
// `output` has 2 x `frames` elements.
ForesoundStatus foresound_render(uint64_t renderer,
                                 float *output,
                                 size_t frames,
                                 struct ForesoundRenderInfo *info);

// Appends as many of `count` samples to a stream as fit; `written` (null if unused) receives their number. Fails with
// FORESOUND_STATUS_STATE once the stream has no reader. Any one thread at a time, the audio thread included: wait-free,
// without allocation, without a message.
ForesoundStatus foresound_stream_write(uint64_t stream, const float *samples, size_t count, size_t *written);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* FORESOUND_H */
