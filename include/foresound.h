/* Foresound: real-time ray-traced sound. The C interface, for C, C++ and engines that speak either.
 *
 * Made from src/bridge by `FORESOUND_WRITE_HEADER=1 cargo test --test c_header`; do not edit.
 *
 * Handles. Engines, renderers, scenes, clips, streams and outputs are 64-bit numbers, never 0, closed with
 * foresound_close. A closed handle, another kind's, or any number at all is an error and never a crash.
 *
 * Threads. Each function says which threads may call it; "the audio thread" is whichever makes sound. Calls on one
 * handle from several threads wait for each other, but for foresound_render and foresound_stream_write, which never
 * wait and never allocate.
 *
 * Units. Metres, seconds, Hz, pressure ratios; right-handed, +y up. An audio frame is one sample a channel; a graphics
 * frame is the app's tick.
 *
 * Errors. Every call returns a ForesoundStatus; foresound_last_error has the words. What a call was to give is 0 if it
 * fails.
 *
 * Options. Structures begin with their size: fill them with the defaults (foresound_..._default), then change fields.
 * A library that is newer than its caller keeps the defaults of what the caller does not know.
 */

#ifndef FORESOUND_H
#define FORESOUND_H

#include <stddef.h>
#include <stdint.h>

/* The interface that this header describes, as foresound_version gives it. */
#define FORESOUND_API_VERSION 0x00010200u

// Result of every call.
enum ForesoundStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Done.
  FORESOUND_STATUS_OK = 0,
  // A number, size or text that cannot be.
  FORESOUND_STATUS_BAD_ARGUMENT = 1,
  // A null pointer or reference where there has to be something.
  FORESOUND_STATUS_NULL = 2,
  // A handle that was closed, or never was one.
  FORESOUND_STATUS_CLOSED = 3,
  // A handle of something else.
  FORESOUND_STATUS_WRONG_KIND = 4,
  // Another thread is using the handle; sound calls do not wait.
  FORESOUND_STATUS_BUSY = 5,
  // A file that cannot be read.
  FORESOUND_STATUS_FILE = 6,
  // A file or mesh whose content is wrong.
  FORESOUND_STATUS_FORMAT = 7,
  // A source that was removed or never added.
  FORESOUND_STATUS_STALE_SOURCE = 8,
  // Not possible in the engine's present state.
  FORESOUND_STATUS_STATE = 9,
  // Too many handles are open.
  FORESOUND_STATUS_FULL = 10,
  // A defect of the library was caught. The handle answers nothing but close from now on.
  FORESOUND_STATUS_PANIC = 11,
  // An instance that was removed or never added.
  FORESOUND_STATUS_STALE_INSTANCE = 12,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundStatus ForesoundStatus;
#else
typedef int32_t ForesoundStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What an engine is made for. Fill it with the defaults first, then change what is to differ.
typedef struct ForesoundOptions {
  // Bytes of this structure, as the caller knows it: what lies beyond takes its default.
  uint32_t size;
  // Sample rate in Hz: 44,100 or 48,000 with the built-in head.
  uint32_t rate_hz;
  // Audio frames a block, 32 to 4,096.
  uint32_t block_frames;
  // Most sources, 1 to 256.
  uint32_t max_sources;
  // Most paths that sound at once, 1 to 16,384.
  uint32_t max_voices;
  // Of those, the loudest that are rendered in full detail.
  uint32_t fine_voices;
  // Most paths of one update, 1 to 16,384.
  uint32_t max_paths;
  // Rays from the listener an update, 1 to 65,536.
  uint32_t guide_rays;
  // Rays from each source an update, 1 to 65,536.
  uint32_t source_rays;
  // Highest reflection order, 0 to 4.
  uint32_t depth;
  // Seed of the rays.
  uint32_t seed;
  // 0: propagation on a thread of its own; 1: within every tick.
  uint32_t schedule;
  // Paths between updates: 0 held, 1 linear (the paper's), 2 best.
  uint32_t predictor;
  // Cores: 0 as the system likes, 1 the fastest two, 2 those of the next two fields.
  uint32_t affinity;
  // Core of the propagation thread, where `affinity` is 2.
  uint32_t propagation_core;
  // Core of the sound thread, where `affinity` is 2.
  uint32_t sound_core;
  // 0: the given head-related set, else the built-in one; 1: none, both ears hear alike.
  uint32_t head;
  // Whether the late reverb runs: 0 or 1.
  uint32_t late;
  // Whether the output is limited: 0 or 1.
  uint32_t limiter;
  // Distance in metres below which a source gets no louder.
  float nearest_m;
  // Ceiling of the limiter in dB re full scale, -60 to 0.
  float ceiling_db;
  // Seconds of a graphics frame, 0.001 to 1; 0 measures the ticks.
  double frame_s;
  // Longest path delay in seconds, 0.01 to 10.
  double max_delay_s;
  // What is asked of a phone's system and told to it, a sum of bits: 1 heat lowers detail, 2 performance hints. Nothing
  // where the system has no such functions.
  uint32_t manners;
  // Most paths that foresound_engine_paths gives, 0 to 16,384.
  uint32_t shown_paths;
} ForesoundOptions;

// Where something is, and which way it faces.
//
// Metres, right-handed, +y up. The orientation turns the thing's own coordinates (+x right, +y up, -z ahead) into the
// world's: a quaternion as x, y, z, w of about length 1.
typedef struct ForesoundPose {
  // Which source; not looked at for the listener and for instances.
  uint32_t source;
  // Position in metres.
  float position_m[3];
  // Quaternion x, y, z, w; (0, 0, 0, 1) faces -z.
  float orientation[4];
} ForesoundPose;

// Percentiles of times, in seconds; zeros of nothing.
typedef struct ForesoundPercentiles {
  // How many times were counted.
  uint64_t count;
  // The median.
  double p50_s;
  // 95 of 100 are no longer.
  double p95_s;
  // 999 of 1000 are no longer.
  double p999_s;
  // The longest.
  double worst_s;
} ForesoundPercentiles;

// A look at an engine. Counts are since it began.
typedef struct ForesoundEngineStatistics {
  // 0 running, 1 paused, 2 propagation has failed (restart), 3 the renderer was closed (make another engine).
  uint32_t state;
  // Extrapolation level L in use.
  uint32_t level;
  // Paths in the update in use.
  uint32_t paths;
  // Sources.
  uint32_t sources;
  // Times of propagation updates.
  struct ForesoundPercentiles propagation;
  // Times of extrapolation a graphics frame.
  struct ForesoundPercentiles extrapolation;
  // Times of generation a block.
  struct ForesoundPercentiles generation;
  // Times of whole render calls.
  struct ForesoundPercentiles block;
  // Render calls.
  uint64_t blocks;
  // Render calls that took longer than what they rendered lasts.
  uint64_t missed_deadlines;
  // Updates that were taken.
  uint64_t updates;
  // Paths left out beyond the limit of an update, the quietest.
  uint64_t trimmed_paths;
  // Paths without a voice.
  uint64_t dropped_paths;
  // Samples that streams were late with.
  uint64_t starved_samples;
  // Time of the update in use, in seconds.
  double propagation_s;
  // Time between the graphics frames that are heard, in seconds.
  double graphics_frame_s;
  // Cores that the propagation thread may run on, a bit each.
  uint64_t propagation_cores;
  // Cores that the sound thread may run on, a bit each.
  uint64_t sound_cores;
  // Real-time priority of the sound thread, 0 outside that class.
  int32_t sound_priority;
  // Niceness of the sound thread, -20 to 19.
  int32_t sound_nice;
} ForesoundEngineStatistics;

// What an engine may spend. Fill it with the defaults first, then change what is to differ.
typedef struct ForesoundBudgetOptions {
  // Bytes of this structure, as the caller knows it: what lies beyond takes its default.
  uint32_t size;
  // Most detail: 0 everything to 5 the least.
  uint32_t least_tier;
  // 1 holds that tier exactly, whatever the budget and the phone's heat say; else 0.
  uint32_t fixed;
  // Not used; 0.
  uint32_t reserved;
  // Longest time of a propagation update in seconds, 0.0001 to 10; 0 is no limit.
  double update_s;
  // Share of one core for propagation and sound together, 0.05 to 2; 0 is no limit.
  double core_share;
} ForesoundBudgetOptions;

// How an engine bears its load, and the phone its heat.
typedef struct ForesoundEngineHealth {
  // 0 running, 1 paused, 2 propagation has failed (restart), 3 the renderer was closed (make another engine).
  uint32_t state;
  // Tier of detail in force, 0 everything to 5 the least.
  uint32_t tier;
  // Least tier because of heat, 0 where the system says nothing.
  uint32_t thermal_tier;
  // The system's thermal status: 0 none, 1 light, 2 moderate, 3 severe, 4 critical, 5 emergency, 6 shutdown; -1 where it
  // says nothing.
  int32_t thermal_status;
  // The system's forecast of heat: 1 is severe throttling; -1 where it says nothing.
  float thermal_headroom;
  // Threads whose work the system is told of (performance hints), a sum of bits: 1 propagation, 2 sound.
  uint32_t hinted;
  // Sources that others mask, where there are more than slots.
  uint32_t unheard_sources;
  // Most rays of the newest update, as they were cast.
  uint32_t rays;
  // Share of a core that sound takes lately.
  double sound_share;
  // Time of the newest update in seconds.
  double propagation_s;
  // Time between the graphics frames that are heard, in seconds.
  double graphics_frame_s;
} ForesoundEngineHealth;

// A path of sound as a line with corners, from source to listener.
typedef struct ForesoundShownPath {
  // The source's number.
  uint32_t source;
  // How many of the corners count, both ends among them.
  uint32_t corner_count;
  // Reflections.
  uint32_t reflections;
  // Edges that it bends around.
  uint32_t bends;
  // Level in dB relative to the free field at 1 m.
  float level_db;
  // Corners in metres.
  float corners_m[6][3];
} ForesoundShownPath;

// How a scene is made. Fill it with the defaults first, then change what is to differ.
typedef struct ForesoundSceneOptions {
  // Bytes of this structure, as the caller knows it: what lies beyond takes its default.
  uint32_t size;
  // Upward axis of a file: 0 for +y, 1 for +z.
  uint32_t up;
  // Metres a unit of a file, above zero.
  float scale;
  // Temperature of the air in degrees Celsius.
  float temperature_c;
  // Relative humidity in percent.
  float humidity_percent;
  // Static pressure in kPa.
  float pressure_kpa;
} ForesoundSceneOptions;

// What became of a mesh.
typedef struct ForesoundSceneInfo {
  // Triangles that came.
  uint64_t triangles_in;
  // Triangles that stay.
  uint64_t triangles;
  // Plane surfaces that they make up.
  uint64_t surfaces;
  // Materials whose name no table knows.
  uint64_t unknown_materials;
  // Memory that the scene occupies, in bytes.
  uint64_t memory_bytes;
  // Speed of sound in m/s.
  double speed_of_sound_m_s;
  // Least coordinates in metres.
  float bounds_min_m[3];
  // Greatest coordinates in metres.
  float bounds_max_m[3];
} ForesoundSceneInfo;

// What one call of [`render`] did.
typedef struct ForesoundRenderInfo {
  // Audio frames written.
  uint32_t frames;
  // Graphics frames taken.
  uint32_t graphics_frames;
  // Propagation updates taken.
  uint32_t updates;
  // Extrapolation level L in force.
  uint32_t level;
  // Voices that live or fade.
  uint32_t voices;
  // Paths without a voice.
  uint32_t dropped_paths;
  // Samples that streams were late with.
  uint32_t starved_samples;
  // 1 if it took longer than what it rendered lasts.
  uint32_t missed_deadline;
  // 1 if the engine was closed: sound goes on with the last poses.
  uint32_t engine_gone;
} ForesoundRenderInfo;

// What a device granted, and how it goes.
typedef struct ForesoundOutputInfo {
  // 0 closed and to be tried again, 1 playing.
  uint32_t playing;
  // Granted rate in Hz.
  uint32_t rate_hz;
  // Audio frames that the device takes at once.
  uint32_t burst_frames;
  // Audio frames of the device's buffer.
  uint32_t buffer_frames;
  // 1 if nobody else uses the device.
  uint32_t exclusive;
  // 1 if the low-latency way was granted.
  uint32_t low_latency;
  // 1 AAudio, 2 OpenSL ES, 0 neither.
  uint32_t interface;
  // Audio frames that the ring adds to the latency.
  uint32_t ring_frames;
  // Times that a device was opened.
  uint32_t opened;
  // Times that opening failed.
  uint32_t refused;
  // Times that the device was lost: unplugged, taken, died.
  uint32_t lost;
  // Times that the device stopped asking and was closed for it.
  uint32_t stalled;
  // Gaps that the device itself has counted since it was opened.
  uint32_t xruns;
  // Least audio frames that the device has asked for at once.
  uint32_t least_frames;
  // Most audio frames that the device has asked for at once.
  uint32_t most_frames;
  // Calls of the device.
  uint64_t callbacks;
  // Audio frames that were not ready in time.
  uint64_t starved_frames;
} ForesoundOutputInfo;

// What a source is like. Fill it with the defaults first, then change what is to differ.
typedef struct ForesoundSourceOptions {
  // Bytes of this structure, as the caller knows it: what lies beyond takes its default.
  uint32_t size;
  // What is computed of it, a sum of bits: 1 direct, 2 reflections, 4 diffraction, 8 transmission, 16 late reverb.
  uint32_t effects;
  // Radius in metres within which it gets no louder; 0 as the engine has it.
  float radius_m;
  // Exponent of the directivity, 0 to 64.
  float order;
  // Directivity in each band, from the lowest: 0 sounds all around, 0.5 is a cardioid, 1 a dipole.
  float directivity[8];
} ForesoundSourceOptions;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Version of this interface: 65,536 x major + 256 x minor + patch. Another major number than
// FORESOUND_API_VERSION's is another interface. Any thread.
uint32_t foresound_version(void);

// What the last call on this thread that failed had to say: one line in UTF-8, what is wrong and what to do.
// Stays until the next failure on the same thread; empty before the first. Never null, not to be freed.
// The audio calls foresound_render and foresound_stream_write leave no text.
const char *foresound_last_error(void);

// Closes any handle and ends what it stands for. An engine waits for the update under way, an output for its
// threads. Any thread but the audio thread; waits for a call that is using the handle.
ForesoundStatus foresound_close(uint64_t handle);

// The default options. Call it before changing any.
//
// Pointers:
// `options` is the address of such a structure.
ForesoundStatus foresound_options_default(struct ForesoundOptions *options);

// Makes an engine in open air without sources, and gives the handles of its two halves: `engine` for the app,
// `renderer` for the thread that makes sound. Takes some ten milliseconds. Any thread but the audio thread.
//
// `options` may be null for the defaults. `hrtf` are the bytes of a baked head-related set, or null for the one that is
// built in.
//
// Pointers:
// `options` is null or the address of such a structure, `hrtf` of `hrtf_bytes` bytes, the others of variables.
ForesoundStatus foresound_engine_create(const struct ForesoundOptions *options,
                                        const uint8_t *hrtf,
                                        size_t hrtf_bytes,
                                        uint64_t *engine,
                                        uint64_t *renderer);

// Hands over one graphics frame: where the listener is, and where those sources are that have moved.
// Call it once a frame. Never waits for propagation or sound, but in the synchronous schedule it is the propagation.
// With a pose that cannot be or a source that is gone it fails, and the frame goes out with the last good poses.
// Any thread but the audio thread; calls on one engine wait for each other.
//
// Pointers:
// `listener` is the address of a pose, `sources` of `source_count` poses or null for none.
ForesoundStatus foresound_engine_tick(uint64_t engine,
                                      const struct ForesoundPose *listener,
                                      const struct ForesoundPose *sources,
                                      size_t source_count);

// Replaces the scene. The old one is heard until the new one's first update is there. The scene's handle may be closed
// at once. Any thread but the audio thread.
ForesoundStatus foresound_engine_set_scene(uint64_t engine, uint64_t scene);

// Sets rays and depth of propagation. Any thread but the audio thread.
ForesoundStatus foresound_engine_set_propagation(uint64_t engine,
                                                 uint32_t guide_rays,
                                                 uint32_t source_rays,
                                                 uint32_t depth);

// Fades to silence within milliseconds; sounds stand still. Any thread but the audio thread.
ForesoundStatus foresound_engine_pause(uint64_t engine);

// Goes on where foresound_engine_pause stopped. Any thread but the audio thread.
ForesoundStatus foresound_engine_resume(uint64_t engine);

// Starts propagation anew after it has failed (state 2). Waits for the update under way. Any thread but the audio
// thread.
ForesoundStatus foresound_engine_restart(uint64_t engine);

// What the engine tells about itself. Some microseconds: ten times a second are plenty. Any thread but the audio thread.
//
// Pointers:
// `statistics` is the address of such a structure.
ForesoundStatus foresound_engine_statistics(uint64_t engine,
                                            struct ForesoundEngineStatistics *statistics);

// The default budget: no limit. Call it before changing any.
//
// Pointers:
// `options` is the address of such a structure.
ForesoundStatus foresound_budget_options_default(struct ForesoundBudgetOptions *options);

// Says what the engine may spend, from the next update on: it gives up rays, orders and paths to keep to it. Heat may
// lower the detail further, unless the tier is fixed. Any thread but the audio thread.
//
// Pointers:
// `options` is the address of such a structure, or null for no limit.
ForesoundStatus foresound_engine_set_budget(uint64_t engine, const struct ForesoundBudgetOptions *options);

// How the engine bears its load, and the phone its heat. Some microseconds: ten times a second are plenty. Any thread
// but the audio thread.
//
// Pointers:
// `health` is the address of such a structure.
ForesoundStatus foresound_engine_health(uint64_t engine, struct ForesoundEngineHealth *health);

// The loudest paths of the newest update for a picture, in no order: as many as there are and fit, and their number. The
// option `shown_paths` says how many are kept; none are unless it is set. Any thread but the audio thread.
//
// Pointers:
// `paths` is the address of `capacity` such structures, `count` of a variable.
ForesoundStatus foresound_engine_paths(uint64_t engine,
                                       struct ForesoundShownPath *paths,
                                       size_t capacity,
                                       size_t *count);

// Adds an instance of a part, such as a door, at a pose from the next tick on, and gives its number. A part is a scene
// of its own in coordinates of its own, the hinge at the origin; its handle may be closed at once, and several instances
// may share it. Instances stay when the scene is replaced. Any thread but the audio thread.
//
// Pointers:
// `pose` is the address of a pose, whose source is not looked at, `instance` of a variable.
ForesoundStatus foresound_instance_add(uint64_t engine,
                                       uint64_t part,
                                       const struct ForesoundPose *pose,
                                       uint32_t *instance);

// Moves an instance from the next tick on. The orientation is a quaternion of length 1; with a pose that cannot be the
// last good one is kept. Any thread but the audio thread.
//
// Pointers:
// `pose` is the address of a pose, whose source is not looked at.
ForesoundStatus foresound_instance_move(uint64_t engine, uint32_t instance, const struct ForesoundPose *pose);

// Removes an instance from the next tick on. Its number is stale at once. Any thread but the audio thread.
ForesoundStatus foresound_instance_remove(uint64_t engine, uint32_t instance);

// The default options. Call it before changing any.
//
// Pointers:
// `options` is the address of such a structure.
ForesoundStatus foresound_scene_options_default(struct ForesoundSceneOptions *options);

// Builds a scene from triangles: `vertex_count` times three coordinates in metres, +y up, and `index_count` indices,
// three a triangle. With materials: their names, and one index into them a triangle; without, all null and zero.
// `materials_toml` is the text of a materials file, or null. Takes as long as a tree over the triangles does, so not the
// thread that draws, and never the audio thread.
//
// Pointers:
// The pointers are the addresses of as many values as the counts say, texts end with a zero, `scene` is the address of a
// variable.
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

// Builds a scene from an OBJ file; `usemtl` names its materials. Else as foresound_scene_from_mesh.
//
// Pointers:
// The texts end with a zero, `scene` is the address of a variable.
ForesoundStatus foresound_scene_from_file(const char *path,
                                          const char *materials_toml,
                                          const struct ForesoundSceneOptions *options,
                                          uint64_t *scene);

// What became of a scene's mesh. Any thread but the audio thread.
//
// Pointers:
// `info` is the address of such a structure.
ForesoundStatus foresound_scene_info(uint64_t scene, struct ForesoundSceneInfo *info);

// Renders `frames` audio frames of interleaved stereo over `output`; silence if it fails.
// For the audio thread: wait-free, allocates nothing, leaves no text. One thread at a time a renderer; another one that
// comes meanwhile gets FORESOUND_STATUS_BUSY. Multiples of the engine's block fit best.
//
// Pointers:
// `output` is the address of 2 x `frames` floats, `info` of such a structure or null.
ForesoundStatus foresound_render(uint64_t renderer, float *output, size_t frames, struct ForesoundRenderInfo *info);

// Appends as many samples to a stream as fit and gives their number; what does not fit is the caller's to keep.
// Any one thread at a time, the audio thread too: wait-free, allocates nothing, leaves no text. Fails with
// FORESOUND_STATUS_STATE once nobody reads the stream any more.
//
// Pointers:
// `samples` is the address of `count` samples, `written` of a variable or null.
ForesoundStatus foresound_stream_write(uint64_t stream, const float *samples, size_t count, size_t *written);

// Audio frames by which sound is late against the geometry, without the device's own buffer. Any thread but the audio
// thread.
//
// Pointers:
// `frames` is the address of a variable.
ForesoundStatus foresound_renderer_latency(uint64_t renderer, uint32_t *frames);

// Plays a renderer on the system's device (Oboe on Android, elsewhere a device that nobody hears), rendered
// `blocks_ahead` blocks ahead (1 to 64) on a thread of its own. The renderer's handle is closed by it. A device that is lost or does
// not open is opened again, farther and farther apart. Any thread but the audio thread.
//
// Pointers:
// `output` is the address of a variable.
ForesoundStatus foresound_output_start(uint64_t renderer,
                                       size_t blocks_ahead,
                                       uint64_t *output);

// What the device granted, and how it goes. Any thread but the audio thread.
//
// Pointers:
// `info` is the address of such a structure.
ForesoundStatus foresound_output_info(uint64_t output, struct ForesoundOutputInfo *info);

// Adds a silent source and gives its number. Any thread but the audio thread.
//
// Pointers:
// `source` is the address of a variable.
ForesoundStatus foresound_source_add(uint64_t engine, float x_m, float y_m, float z_m, uint32_t *source);

// Removes a source from the next tick on: what it has sent fades. Its number is stale at once and never another
// source's. Any thread but the audio thread.
ForesoundStatus foresound_source_remove(uint64_t engine, uint32_t source);

// The default options. Call it before changing any.
//
// Pointers:
// `options` is the address of such a structure.
ForesoundStatus foresound_source_options_default(struct ForesoundSourceOptions *options);

// Says what a source is like, from the next tick on. Any thread but the audio thread.
//
// Pointers:
// `options` is the address of such a structure, or null for the defaults.
ForesoundStatus foresound_source_configure(uint64_t engine,
                                           uint32_t source,
                                           const struct ForesoundSourceOptions *options);

// Sets a source's gain, a pressure ratio from 0 to 1000, from the next tick on. Any thread but the audio thread.
ForesoundStatus foresound_source_set_gain(uint64_t engine, uint32_t source, float gain);

// Silences a source (any number but 0) or lets it be heard again; its sound goes on unheard. Any thread but the audio
// thread.
ForesoundStatus foresound_source_mute(uint64_t engine, uint32_t source, uint32_t muted);

// Plays a clip from its beginning, once (0) or for ever. The clip's handle may be closed at once. Any thread but the
// audio thread.
ForesoundStatus foresound_source_play(uint64_t engine, uint32_t source, uint64_t clip, uint32_t looped);

// Silences a source and lets go of its clip or stream. Any thread but the audio thread.
ForesoundStatus foresound_source_stop(uint64_t engine, uint32_t source);

// Plays what is written to a stream from now on, through a ring for `capacity` samples (1 to 16,777,216); gives the
// stream's handle. Any thread but the audio thread.
//
// Pointers:
// `stream` is the address of a variable.
ForesoundStatus foresound_source_stream(uint64_t engine, uint32_t source, size_t capacity, uint64_t *stream);

// Makes a clip of mono samples at `rate_hz` for engines at `engine_rate_hz`; 1 is the pressure at 1 m. The samples are
// copied, and converted if the rates differ. Any thread but the audio thread.
//
// Pointers:
// `samples` is the address of `count` samples, `clip` of a variable.
ForesoundStatus foresound_clip_from_samples(const float *samples,
                                            size_t count,
                                            uint32_t rate_hz,
                                            uint32_t engine_rate_hz,
                                            uint64_t *clip);

// Makes a clip of the bytes of a WAV file (PCM of 8 to 32 bits or float; channels are averaged) for engines at
// `engine_rate_hz`. Any thread but the audio thread.
//
// Pointers:
// `bytes` is the address of `count` bytes, `clip` of a variable.
ForesoundStatus foresound_clip_from_wav(const uint8_t *bytes, size_t count, uint32_t engine_rate_hz, uint64_t *clip);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* FORESOUND_H */
