/* Foresound: real-time ray-traced sound. The C interface, for C, C++ and engines with C bindings.
 *
 * Written from src/bridge by `FORESOUND_WRITE_HEADER=1 cargo test --test c_header`; do not edit.
 *
 * Handles. Engines, renderers, scenes, clips, streams and outputs are 64-bit numbers, never 0, closed with
 * foresound_close. A closed handle, another kind's or an arbitrary number is an error and never undefined behaviour.
 *
 * Threads. The audio thread is the one that renders. Any other thread is a control thread; control functions wait for
 * each other if they use the same handle. Functions for the audio thread say so (foresound_render, foresound_stream_write):
 * they never wait and never allocate.
 *
 * Units. Metres, seconds, Hz, linear gain; right-handed coordinates, +y up. An audio frame is one sample a channel; a
 * graphics frame is the app's tick. Sources and instances have 32-bit ids, never 0.
 *
 * Pointers. A pointer is the address of a variable of its type, or of an array with the length of the parameter after it.
 * It need not be valid after the call. Texts are UTF-8 with a terminating zero. Null is an error (FORESOUND_STATUS_NULL)
 * except for an array of length 0 and where the function's description allows it.
 *
 * Errors. Functions return a ForesoundStatus; foresound_last_error has the message. After a failure, results are 0, which is
 * no handle and no id. These can come from every function, and its description does not repeat them; it says what else can:
 *
 *     FORESOUND_STATUS_NULL            a pointer is null that needs a value
 *     FORESOUND_STATUS_BAD_ARGUMENT    a value is outside its stated range or not finite, a `size` or text is invalid
 *     FORESOUND_STATUS_CLOSED          a handle was closed or is none
 *     FORESOUND_STATUS_WRONG_KIND      a handle is of another kind
 *     FORESOUND_STATUS_STALE_SOURCE    a source was removed, or a one-shot has ended
 *     FORESOUND_STATUS_STALE_INSTANCE  an instance was removed
 *     FORESOUND_STATUS_BUSY            functions of the audio thread: another thread uses the handle
 *     FORESOUND_STATUS_FULL            functions that give a handle: 4,096 of its kind are open
 *     FORESOUND_STATUS_PANIC           a defect of the library; close the handle
 *
 * Structures. A structure begins with its size in this header; the library reads and writes no more than that:
 *
 *     ForesoundOptions options = FORESOUND_OPTIONS_INIT;
 *
 * The initialiser has the size and this header's defaults; foresound_..._default has the library's, for languages without
 * macros: set `size` before. A newer library uses its defaults for fields that an older caller's header lacks; an older
 * library ignores a newer caller's further fields, and sets them to 0 where it writes. Elements of arrays (ForesoundPose,
 * ForesoundShownPath) have no size; functions take it beside the array: pass sizeof. stability.md says what may change.
 */

#ifndef FORESOUND_H
#define FORESOUND_H

#include <stddef.h>
#include <stdint.h>

/* The version of this header, for foresound_engine_create. */
#define FORESOUND_API_VERSION 0x00030000u

/* Exported from the shared library. Define FORESOUND_STATIC before this header if the library is linked statically. */
#ifndef FORESOUND_API
#if defined(_WIN32) && !defined(FORESOUND_STATIC)
#define FORESOUND_API __declspec(dllimport)
#elif defined(__GNUC__)
#define FORESOUND_API __attribute__((visibility("default")))
#else
#define FORESOUND_API
#endif
#endif

/* Initial values of structures: their size and this header's defaults. */
#define FORESOUND_OPTIONS_INIT {sizeof(ForesoundOptions), 44100u, 256u, 16u, 0u, 1024u, 256u, 2048u, 1024u, 128u, \
    4u, 2u, 1u, FORESOUND_SCHEDULE_ASYNCHRONOUS, 2u, FORESOUND_PREDICTOR_GEOMETRIC, 1u, FORESOUND_AFFINITY_SYSTEM, \
    0u, 0u, FORESOUND_HRTF_SET, 1u, 1u, 3u, 0u, 1024u, 0.3f, -0.3f, 0.0, 1.0, FORESOUND_LAYOUT_BINAURAL, 0u, 0u, 1u}
#define FORESOUND_SOURCE_OPTIONS_INIT {sizeof(ForesoundSourceOptions), 31u, 0.0f, 1.0f, {0.0f, 0.0f, 0.0f, 0.0f, \
    0.0f, 0.0f, 0.0f, 0.0f}, FORESOUND_DISTANCE_CURVE_PHYSICAL, 1.0f, 100.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, \
    1.0f, 1.0f, 0u, 128u, {0.0f, 0.0f, 0.0f}, 16u}
#define FORESOUND_PROPAGATION_OPTIONS_INIT {sizeof(ForesoundPropagationOptions), 1024u, 128u, 4u, 2u}
#define FORESOUND_MATERIAL_OPTIONS_INIT {sizeof(ForesoundMaterialOptions), {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, \
    0.0f, 0.0f}, {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f}}
#define FORESOUND_SCENE_OPTIONS_INIT {sizeof(ForesoundSceneOptions), FORESOUND_UP_AXIS_Y, 1.0f, 20.0f, 50.0f, \
    101.325f, 0.5f, 40.0f, -1.0f, 4194304u}
#define FORESOUND_BUDGET_OPTIONS_INIT {sizeof(ForesoundBudgetOptions), 0u, 0u, 0u, 0.0, 0.0}
#define FORESOUND_SCENE_INFO_INIT {sizeof(ForesoundSceneInfo), 0u, 0u, 0u, 0u, 0u, 0.0, {0.0f, 0.0f, 0.0f}, {0.0f, \
    0.0f, 0.0f}}
#define FORESOUND_ENGINE_STATISTICS_INIT {sizeof(ForesoundEngineStatistics), FORESOUND_ENGINE_STATE_RUNNING, 0u, \
    0u, 0u, 0u, 0, 0, {0u, 0.0, 0.0, 0.0, 0.0}, {0u, 0.0, 0.0, 0.0, 0.0}, {0u, 0.0, 0.0, 0.0, 0.0}, {0u, 0.0, 0.0, \
    0.0, 0.0}, 0u, 0u, 0u, 0u, 0u, 0u, 0.0, 0.0, 0u, 0u}
#define FORESOUND_ENGINE_HEALTH_INIT {sizeof(ForesoundEngineHealth), FORESOUND_ENGINE_STATE_RUNNING, 0u, 0u, \
    FORESOUND_THERMAL_STATUS_NONE, 0.0f, 0u, 0u, 0u, 0.0, 0.0, 0.0}
#define FORESOUND_SOURCE_NUMBERS_INIT {sizeof(ForesoundSourceNumbers), 0u, 0.0f, 0.0f, {0.0f, 0.0f, 0.0f, 0.0f, \
    0.0f, 0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, \
    0.0f, 0.0f}}
#define FORESOUND_PLAY_OPTIONS_INIT {sizeof(ForesoundPlayOptions), 0u, 0u, 0u, 0u, 0u}
#define FORESOUND_PLAYBACK_INIT {sizeof(ForesoundPlayback), FORESOUND_PLAYBACK_STATE_IDLE, 0u, 0u}
#define FORESOUND_RENDER_INFO_INIT {sizeof(ForesoundRenderInfo), 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u}
#define FORESOUND_OUTPUT_INFO_INIT {sizeof(ForesoundOutputInfo), 0u, 0u, 0u, 0u, 0u, 0u, \
    FORESOUND_DEVICE_API_OTHER, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u}


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
  // The caller's header is of another major version than the library.
  FORESOUND_STATUS_VERSION = 13,
  // The call was cancelled.
  FORESOUND_STATUS_CANCELLED = 14,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundStatus ForesoundStatus;
#else
typedef int32_t ForesoundStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// When propagation runs.
enum ForesoundSchedule
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Continuously, on a thread of its own.
  FORESOUND_SCHEDULE_ASYNCHRONOUS = 0,
  // Within every tick.
  FORESOUND_SCHEDULE_SYNCHRONOUS = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundSchedule ForesoundSchedule;
#else
typedef uint32_t ForesoundSchedule;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Extrapolation of paths between updates.
enum ForesoundPredictor
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Paths stay as the update had them.
  FORESOUND_PREDICTOR_HOLD = 0,
  // Delays and amplitudes go on along lines.
  FORESOUND_PREDICTOR_LINEAR = 1,
  // Paths are computed anew for the poses of graphics frames. The default; `best` on the command line.
  FORESOUND_PREDICTOR_GEOMETRIC = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundPredictor ForesoundPredictor;
#else
typedef uint32_t ForesoundPredictor;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Cores of an engine's threads.
enum ForesoundAffinity
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // The system chooses.
  FORESOUND_AFFINITY_SYSTEM = 0,
  // The two fastest.
  FORESOUND_AFFINITY_FASTEST = 1,
  // Those that the options name.
  FORESOUND_AFFINITY_CHOSEN = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundAffinity ForesoundAffinity;
#else
typedef uint32_t ForesoundAffinity;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What turns paths into two ears.
enum ForesoundHrtf
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // The HRTF set passed at creation, else the built-in one.
  FORESOUND_HRTF_SET = 0,
  // None: both ears receive the same signal.
  FORESOUND_HRTF_NONE = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundHrtf ForesoundHrtf;
#else
typedef uint32_t ForesoundHrtf;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Channels of the output and their order.
enum ForesoundLayout
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Two ears, for headphones.
  FORESOUND_LAYOUT_BINAURAL = 0,
  // Left and right by amplitude panning, for loudspeakers such as a phone's.
  FORESOUND_LAYOUT_STEREO = 1,
  // One channel; the first two of more have it equally.
  FORESOUND_LAYOUT_MONO = 2,
  // Six channels: left, right, centre, LFE (silent), left and right surround.
  FORESOUND_LAYOUT_SURROUND51 = 3,
  // Eight channels: left, right, centre, LFE (silent), left and right back, left and right side.
  FORESOUND_LAYOUT_SURROUND71 = 4,
  // Twelve channels: those of 7.1, then top front left and right, top back left and right.
  FORESOUND_LAYOUT_SURROUND714 = 5,
  // Four channels of Ambisonics of order 1: AmbiX, order ACN, normalisation SN3D.
  FORESOUND_LAYOUT_AMBISONICS1 = 6,
  // Nine channels of Ambisonics of order 2.
  FORESOUND_LAYOUT_AMBISONICS2 = 7,
  // Sixteen channels of Ambisonics of order 3.
  FORESOUND_LAYOUT_AMBISONICS3 = 8,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundLayout ForesoundLayout;
#else
typedef uint32_t ForesoundLayout;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// State of an engine.
enum ForesoundEngineState
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Running.
  FORESOUND_ENGINE_STATE_RUNNING = 0,
  // Paused.
  FORESOUND_ENGINE_STATE_PAUSED = 1,
  // Propagation failed; sound continues with the last paths. Call foresound_engine_restart.
  FORESOUND_ENGINE_STATE_PROPAGATION_FAILED = 2,
  // The renderer was closed. Create another engine.
  FORESOUND_ENGINE_STATE_RENDERER_GONE = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundEngineState ForesoundEngineState;
#else
typedef uint32_t ForesoundEngineState;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// The system's thermal status.
enum ForesoundThermalStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Unknown.
  FORESOUND_THERMAL_STATUS_UNKNOWN = -1,
  // No throttling.
  FORESOUND_THERMAL_STATUS_NONE = 0,
  // Light.
  FORESOUND_THERMAL_STATUS_LIGHT = 1,
  // Moderate.
  FORESOUND_THERMAL_STATUS_MODERATE = 2,
  // Severe.
  FORESOUND_THERMAL_STATUS_SEVERE = 3,
  // Critical.
  FORESOUND_THERMAL_STATUS_CRITICAL = 4,
  // Emergency.
  FORESOUND_THERMAL_STATUS_EMERGENCY = 5,
  // Shutdown.
  FORESOUND_THERMAL_STATUS_SHUTDOWN = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundThermalStatus ForesoundThermalStatus;
#else
typedef int32_t ForesoundThermalStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Upward axis of a file.
enum ForesoundUpAxis
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // +y.
  FORESOUND_UP_AXIS_Y = 0,
  // +z.
  FORESOUND_UP_AXIS_Z = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundUpAxis ForesoundUpAxis;
#else
typedef uint32_t ForesoundUpAxis;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// System library of a sound device.
enum ForesoundDeviceApi
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Another, or none.
  FORESOUND_DEVICE_API_OTHER = 0,
  // AAudio.
  FORESOUND_DEVICE_API_AAUDIO = 1,
  // OpenSL ES.
  FORESOUND_DEVICE_API_OPENSL_ES = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundDeviceApi ForesoundDeviceApi;
#else
typedef uint32_t ForesoundDeviceApi;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Level by distance. It scales all sound of a source; delays and the levels of its paths relative to each other stay.
enum ForesoundDistanceCurve
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // One over the distance, 1 at 1 m.
  FORESOUND_DISTANCE_CURVE_PHYSICAL = 0,
  // 1 up to the minimum distance, the minimum over the distance beyond it, constant from the maximum distance on.
  FORESOUND_DISTANCE_CURVE_INVERSE = 1,
  // 1 up to the minimum distance, falling linearly to 0 at the maximum distance.
  FORESOUND_DISTANCE_CURVE_LINEAR = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundDistanceCurve ForesoundDistanceCurve;
#else
typedef uint32_t ForesoundDistanceCurve;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// State of a source's clip.
enum ForesoundPlaybackState
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // No clip was played, or it was stopped.
  FORESOUND_PLAYBACK_STATE_IDLE = 0,
  // A clip waits for the audio thread, or for its start.
  FORESOUND_PLAYBACK_STATE_SCHEDULED = 1,
  // A clip plays.
  FORESOUND_PLAYBACK_STATE_PLAYING = 2,
  // A clip is paused.
  FORESOUND_PLAYBACK_STATE_PAUSED = 3,
  // A clip has played to its end.
  FORESOUND_PLAYBACK_STATE_FINISHED = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundPlaybackState ForesoundPlaybackState;
#else
typedef uint32_t ForesoundPlaybackState;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What a path does between source and listener.
enum ForesoundPathKind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // The straight line, unobstructed.
  FORESOUND_PATH_KIND_DIRECT = 0,
  // The straight line, through walls.
  FORESOUND_PATH_KIND_TRANSMITTED = 1,
  // Reflected, without diffraction.
  FORESOUND_PATH_KIND_REFLECTED = 2,
  // Diffracted at one or two edges, perhaps also reflected.
  FORESOUND_PATH_KIND_DIFFRACTED = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundPathKind ForesoundPathKind;
#else
typedef uint32_t ForesoundPathKind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What a source's output holds (foresound_render_source).
enum ForesoundBus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // The source's paths.
  FORESOUND_BUS_OWN = 0,
  // The source shares a slot, or has no position: it is heard in foresound_render_reverb's output. What it left in a slot of
  // its own fades out here.
  FORESOUND_BUS_SHARED = 1,
  // The source is not heard: masked by others, or the engine is paused. What it left in a slot of its own fades out here.
  FORESOUND_BUS_SILENT = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundBus ForesoundBus;
#else
typedef uint32_t ForesoundBus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Gravity of a message; as a limit, the least grave messages that are passed on.
enum ForesoundLogLevel
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // No message.
  FORESOUND_LOG_LEVEL_OFF = 0,
  // Something failed.
  FORESOUND_LOG_LEVEL_ERROR = 1,
  // Something is worse than it could be.
  FORESOUND_LOG_LEVEL_WARN = 2,
  // What was chosen and found.
  FORESOUND_LOG_LEVEL_INFO = 3,
  // Details.
  FORESOUND_LOG_LEVEL_DEBUG = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundLogLevel ForesoundLogLevel;
#else
typedef uint32_t ForesoundLogLevel;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Parts of a source's sound, bits to be added.
enum ForesoundEffect
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // No sound.
  FORESOUND_EFFECT_NONE = 0,
  // The direct path.
  FORESOUND_EFFECT_DIRECT = 1,
  // Reflections.
  FORESOUND_EFFECT_REFLECTIONS = 2,
  // Diffraction.
  FORESOUND_EFFECT_DIFFRACTION = 4,
  // Transmission through walls.
  FORESOUND_EFFECT_TRANSMISSION = 8,
  // Late reverb.
  FORESOUND_EFFECT_LATE_REVERB = 16,
  // All of them.
  FORESOUND_EFFECT_ALL = 31,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundEffect ForesoundEffect;
#else
typedef uint32_t ForesoundEffect;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Exchange with a phone's system, bits to be added.
enum ForesoundDeviceHint
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // None.
  FORESOUND_DEVICE_HINT_NONE = 0,
  // Heat lowers the quality level.
  FORESOUND_DEVICE_HINT_THERMAL = 1,
  // Threads report their durations to the system.
  FORESOUND_DEVICE_HINT_PERFORMANCE = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundDeviceHint ForesoundDeviceHint;
#else
typedef uint32_t ForesoundDeviceHint;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Threads with a performance hint session, bits that are added.
enum ForesoundHintedThread
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // None.
  FORESOUND_HINTED_THREAD_NONE = 0,
  // The propagation thread.
  FORESOUND_HINTED_THREAD_PROPAGATION = 1,
  // The audio thread.
  FORESOUND_HINTED_THREAD_AUDIO = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum ForesoundHintedThread ForesoundHintedThread;
#else
typedef uint32_t ForesoundHintedThread;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Settings of an engine. Begin with FORESOUND_OPTIONS_INIT or foresound_options_default, then change fields.
typedef struct ForesoundOptions {
  // Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
  uint32_t size;
  // Sample rate in Hz: 44,100 or 48,000 with the built-in HRTF set.
  uint32_t rate_hz;
  // Audio frames a block, 32 to 4,096.
  uint32_t block_frames;
  // Maximum number of sources, 1 to 4,096.
  uint32_t max_sources;
  // Sources with a slot of their own, 1 to 256; 0: as many as `max_sources`, at most 256. Beyond it neighbours share a
  // slot, and sources that others mask are silent (`unheard_sources` of ForesoundEngineHealth). Cost and memory grow with
  // slots.
  uint32_t source_slots;
  // Maximum number of paths rendered at once, 1 to 16,384.
  uint32_t max_voices;
  // How many of the paths rendered at once, the loudest, are rendered in full detail. The others use a shorter form of
  // the HRTF set.
  uint32_t fine_voices;
  // Maximum number of paths of one update, 1 to 16,384.
  uint32_t max_paths;
  // Rays from the listener an update, 1 to 65,536.
  uint32_t guide_rays;
  // Rays from each source an update, 1 to 65,536.
  uint32_t source_rays;
  // Maximum reflection order, 0 to 4.
  uint32_t depth;
  // Maximum number of edges that a path is diffracted at, 0 to 2.
  uint32_t diffraction_order;
  // Seed of the ray directions.
  uint32_t seed;
  // When propagation runs.
  ForesoundSchedule schedule;
  // Threads of an update in the synchronous schedule, the calling one included, 1 to 64.
  uint32_t tracing_threads;
  // Extrapolation of paths between updates.
  ForesoundPredictor predictor;
  // 1: the work of a graphics frame is spread over the blocks until the next one; 0: the first block does all of it.
  uint32_t even_blocks;
  // Cores of the engine's threads. By default they are not pinned.
  ForesoundAffinity affinity;
  // Core of the propagation thread, if `affinity` is FORESOUND_AFFINITY_CHOSEN.
  uint32_t propagation_core;
  // Core of the audio thread, if `affinity` is FORESOUND_AFFINITY_CHOSEN.
  uint32_t audio_core;
  // What turns paths into two ears.
  ForesoundHrtf hrtf;
  // 1: with late reverb; 0: without.
  uint32_t late_reverb;
  // 1: with limiter; 0: without.
  uint32_t limiter;
  // Exchange with a phone's system, a sum of ForesoundDeviceHint. Without effect where the system lacks the functions.
  uint32_t device_hints;
  // Maximum number of paths that foresound_engine_paths returns, 0 to 16,384.
  uint32_t shown_paths;
  // Maximum memory of the engine in MiB, without scenes and sounds; an engine of more is refused. Counted with the
  // longest delay lines, 32 bytes x `rate_hz` x `max_delay_s` a slot; at first they are of 0.15 s, and grow with the paths.
  uint32_t max_memory_mib;
  // Distance in metres below which a source gets no louder.
  float min_distance_m;
  // Ceiling of the limiter in dB re full scale, -60 to 0.
  float ceiling_db;
  // Time from one graphics frame to the next (not of an audio frame) in seconds, 0.001 to 1, for rendering at another
  // speed than real time; 0: measured from the ticks, for games.
  double frame_s;
  // Maximum path delay in seconds, 0.01 to 10.
  double max_delay_s;
  // Layout of the output at first.
  ForesoundLayout layout;
  // Channels of the output, constant while the layout may change, to 16; 0: those that `layout` has.
  uint32_t output_channels;
  // 1: sources can be rendered apart (foresound_render_source), for a mixer of the game's own; 0: not.
  uint32_t source_buses;
  // Listeners, 1 to 4: for a split screen or spectators (foresound_engine_set_listener, foresound_render_listeners).
  uint32_t listeners;
} ForesoundOptions;

// Properties of a material in octave bands, from the lowest: shares of energy, 0 to 1.
typedef struct ForesoundMaterialOptions {
  // Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
  uint32_t size;
  // Share of the incident energy that is not reflected, what passes through included.
  float absorption[8];
  // Share of the reflected energy outside the specular direction.
  float scattering[8];
  // Share of the incident energy behind the surface, at most the absorption.
  float transmission[8];
} ForesoundMaterialOptions;

// Rays and orders of propagation. Begin with FORESOUND_PROPAGATION_OPTIONS_INIT or
// foresound_propagation_options_default, then change fields.
typedef struct ForesoundPropagationOptions {
  // Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
  uint32_t size;
  // Rays from the listener an update, 1 to 65,536.
  uint32_t guide_rays;
  // Rays from each source an update, 1 to 65,536.
  uint32_t source_rays;
  // Maximum reflection order, 0 to 4.
  uint32_t depth;
  // Maximum number of edges that a path is diffracted at, 0 to 2.
  uint32_t diffraction_order;
} ForesoundPropagationOptions;

// Percentiles of durations in seconds; zeros without a measurement. Part of other structures: never changes.
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
  // Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
  uint32_t size;
  // State of the engine.
  ForesoundEngineState state;
  // Graphics frames that an update lasts (the paper's L); at 0 every frame has an update of its own.
  uint32_t extrapolation_level;
  // Paths in the update in use.
  uint32_t paths;
  // Number of sources.
  uint32_t sources;
  // Quality level in use, 0 full detail to 5 the coarsest.
  uint32_t quality_level;
  // Real-time priority of the audio thread; 0 outside that class.
  int32_t audio_priority;
  // Niceness of the audio thread, -20 to 19.
  int32_t audio_nice;
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
  uint64_t audio_cores;
} ForesoundEngineStatistics;

// Budget of an engine. Begin with FORESOUND_BUDGET_OPTIONS_INIT or foresound_budget_options_default, then change fields.
typedef struct ForesoundBudgetOptions {
  // Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
  uint32_t size;
  // Finest quality level in use: 0 full detail to 5 the coarsest.
  uint32_t quality_level;
  // 1: that level exactly, regardless of load and temperature; else 0.
  uint32_t fixed;
  // 0.
  uint32_t reserved;
  // Maximum duration of a propagation update in seconds, 0.0001 to 10; 0: no limit.
  double update_s;
  // Maximum share of one core for propagation and sound together, 0.05 to 2; 0: no limit.
  double core_share;
} ForesoundBudgetOptions;

// Load of an engine and temperature of the phone.
typedef struct ForesoundEngineHealth {
  // Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
  uint32_t size;
  // State of the engine.
  ForesoundEngineState state;
  // Quality level in use, 0 full detail to 5 the coarsest.
  uint32_t quality_level;
  // Finest quality level allowed by the temperature; 0 if unknown.
  uint32_t thermal_quality_level;
  // The system's thermal status.
  ForesoundThermalStatus thermal_status;
  // The system's thermal headroom: 1 is severe throttling; -1 if unknown.
  float thermal_headroom;
  // Threads with a performance hint session, a sum of ForesoundHintedThread.
  uint32_t hinted;
  // Sources without a slot in the newest tick, as nothing of them would be heard: they play nothing, are below -100 dB re
  // full scale, or are masked, with less than a millionth (-60 dB) of the energy of all sources at the listener. 0 while
  // there are as many slots as sources.
  uint32_t unheard_sources;
  // Rays cast by the newest update.
  uint64_t rays;
  // Share of one core used by sound.
  double sound_share;
  // Duration of the newest update in seconds.
  double propagation_s;
  // Time between graphics frames in seconds.
  double graphics_frame_s;
} ForesoundEngineHealth;

// Position and orientation of a listener, a source or an instance.
//
// An element of an array, whose element size the functions take: a newer pose is longer.
//
// Metres, right-handed, +y up. The orientation rotates local coordinates (+x right, +y up, -z ahead) into the world's: a
// quaternion x, y, z, w of length 1. A listener's and a source's are normalised; four zeros of a source are (0, 0, 0, 1).
typedef struct ForesoundPose {
  // Id of the source; ignored for listeners and instances.
  uint32_t source;
  // Position in metres.
  float position_m[3];
  // Quaternion x, y, z, w; (0, 0, 0, 1) faces -z.
  float orientation[4];
} ForesoundPose;

// Settings of a scene. Begin with FORESOUND_SCENE_OPTIONS_INIT or foresound_scene_options_default, then change fields.
typedef struct ForesoundSceneOptions {
  // Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
  uint32_t size;
  // Upward axis of a file.
  ForesoundUpAxis up;
  // Metres a unit of a file, above zero.
  float scale;
  // Air temperature in degrees Celsius.
  float temperature_c;
  // Relative humidity in percent.
  float humidity_percent;
  // Static pressure in kPa.
  float pressure_kpa;
  // Least area in m² of a connected plane panel that reflects like a mirror; smaller ones block and scatter.
  float min_panel_m2;
  // Largest area in m² of a panel whose free edges limit its reflection; 0: none.
  float max_finite_panel_m2;
  // Distance in metres from a common plane within which corners of neighbouring triangles are roughness of one plane
  // surface, 0 to 0.5; -1: an eighth of the wavelength at 1 kHz.
  float acoustic_tolerance_m;
  // Maximum number of triangles; a mesh with more is refused.
  uint32_t max_triangles;
} ForesoundSceneOptions;

// Properties of a scene.
typedef struct ForesoundSceneInfo {
  // Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
  uint32_t size;
  // Materials that no table defines; they have the default's properties.
  uint32_t unknown_materials;
  // Triangles of the mesh.
  uint64_t triangles_in;
  // Triangles kept: finite, with an area.
  uint64_t triangles;
  // Plane surfaces that they form.
  uint64_t surfaces;
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
  // Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
  uint32_t size;
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
  // System library of the device.
  ForesoundDeviceApi device_api;
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
  uint32_t min_callback_frames;
  // Maximum audio frames of a callback.
  uint32_t max_callback_frames;
  // Callbacks.
  uint64_t callbacks;
  // Audio frames that were not rendered in time.
  uint64_t underrun_frames;
} ForesoundOutputInfo;

// What a graphics frame has of a source. Levels include the source's options and not its gain.
typedef struct ForesoundSourceNumbers {
  // Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
  uint32_t size;
  // Number of its paths.
  uint32_t path_count;
  // How much of the straight line is blocked, 0 to 1, times the strength of the source's occlusion.
  float occlusion;
  // Delay from emission to the start of the late reverb in seconds; 0 without any.
  float reverb_delay_s;
  // Amplitude factor of the walls on the straight line in each octave band: 1 where nothing blocks it.
  float transmission[8];
  // Amplitude of the late reverb in each octave band: root of its whole energy, relative to the free field at 1 m.
  float reverb_send[8];
  // Reverberation time T60 of the late reverb in seconds in each octave band; 0 without any.
  float decay_time_s[8];
} ForesoundSourceNumbers;

// Settings of a source. Begin with FORESOUND_SOURCE_OPTIONS_INIT or foresound_source_options_default, then change fields.
typedef struct ForesoundSourceOptions {
  // Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
  uint32_t size;
  // Computed parts, a sum of ForesoundEffect.
  uint32_t effects;
  // Radius in metres within which the source gets no louder; 0: the engine's.
  float radius_m;
  // Exponent of the directivity, 0 to 64.
  float order;
  // Directivity in each octave band, from the lowest: 0 omnidirectional, 0.5 cardioid, 1 dipole.
  float directivity[8];
  // Level by distance, unless the source has a distance table.
  ForesoundDistanceCurve distance_curve;
  // Distance of full level in metres, for the inverse and the linear curve.
  float distance_min_m;
  // Distance in metres from which the level is constant (inverse curve) or 0 (linear curve), at most 1e6.
  float distance_max_m;
  // Linear gain of the direct path, 0 to 1000.
  float direct_gain;
  // Linear gain of reflected paths, 0 to 1000.
  float reflections_gain;
  // Linear gain of diffracted paths, 0 to 1000.
  float diffraction_gain;
  // Linear gain of the late reverb, 0 to 1000.
  float late_gain;
  // Strength of occlusion, 0 to 1; 1 is physics. At 0 the direct path is as loud as if nothing were in its way.
  float occlusion;
  // Linear gain of a direct path through walls, 0 to 4; 1 is physics.
  float transmission;
  // Factor of the delay of direct sound, 0 to 4, whose change is the Doppler shift; 1 is physics. Other sound keeps its
  // delay after the direct sound.
  float doppler;
  // Strength of the air's absorption along paths, 0 to 1; 1 is physics.
  float air_absorption;
  // 1: heard without a position, propagation and late reverb, such as music; stereo clips keep their channels.
  uint32_t is_2d;
  // 0 to 255: with more sources than slots, those of higher priority get slots of their own first.
  uint32_t priority;
  // Semi-axes in metres of an ellipsoid around the source along its x, y and z, 0 to 1000; all 0: a point. A wide source
  // sounds from points on the ellipsoid, of which a share may be hidden.
  float extent_m[3];
  // Number of those points, 4 to 32.
  uint32_t extent_points;
} ForesoundSourceOptions;

// How a clip plays. Begin with FORESOUND_PLAY_OPTIONS_INIT or foresound_play_options_default, then change fields.
typedef struct ForesoundPlayOptions {
  // Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
  uint32_t size;
  // 1: the clip repeats; 0: it plays once.
  uint32_t looped;
  // Audio frame of the clip at which its loop starts.
  uint32_t loop_start;
  // Audio frame of the clip at which its loop ends, excluded; 0: the clip's end.
  uint32_t loop_end;
  // Audio frame of the clip to start from.
  uint64_t first_frame;
  // Audio frame of the engine at which it starts (ForesoundPlayback); earlier ones start at once.
  uint64_t start_at;
} ForesoundPlayOptions;

// State and position of a source's clip.
typedef struct ForesoundPlayback {
  // Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
  uint32_t size;
  // The state.
  ForesoundPlaybackState state;
  // Position in the clip in audio frames.
  uint64_t frame;
  // Audio frames that the engine has rendered: the clock of `start_at`.
  uint64_t engine_frame;
} ForesoundPlayback;

// A path as a polyline from source to listener. An element of an array, whose element size foresound_engine_paths takes.
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

// A path of a source in a graphics frame. An element of an array, whose element size foresound_source_paths takes.
typedef struct ForesoundSourcePath {
  // Identity of the path across frames; in Java rounded to 53 bits.
  uint64_t id;
  // Delay from the source to the listener in seconds.
  double delay_s;
  // What the path does on its way.
  ForesoundPathKind kind;
  // Number of reflections.
  uint32_t reflections;
  // Unit vector in world coordinates from the listener to where the path arrives from.
  float arrival[3];
  // Unit vector in world coordinates from the source along the path; zero for a path of no length.
  float departure[3];
  // Signed amplitude relative to the free field at 1 m in each octave band, from the lowest.
  float amplitude[8];
} ForesoundSourcePath;

// Result of one foresound_render.
typedef struct ForesoundRenderInfo {
  // Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
  uint32_t size;
  // Audio frames written.
  uint32_t frames;
  // Graphics frames consumed.
  uint32_t graphics_frames;
  // Propagation updates consumed.
  uint32_t updates;
  // Graphics frames that an update lasts (the paper's L); at 0 every frame has an update of its own.
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

// Receives a message: one line in UTF-8, valid during the call. `user` is the pointer passed to foresound_set_log.
typedef void (*ForesoundLogCallback)(void *user, ForesoundLogLevel level, const char *message);

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Closes a handle of any kind and destroys its object: an engine after its running update, an output after its
// threads. Waits for a call that uses the handle. Control thread.
FORESOUND_API ForesoundStatus foresound_close(uint64_t handle);

// Writes the default options; `size` is set before. Any thread.
FORESOUND_API ForesoundStatus foresound_options_default(struct ForesoundOptions *options);

// Creates an engine in free field without sources. `engine` receives the handle of the control half, `renderer`
// that of the audio half. Takes some ten milliseconds. Control thread.
//
// `api_version`: FORESOUND_API_VERSION. `options`: null for the defaults. `hrtf`: content of an HRTF set's file,
// baked or SOFA (some seconds); null for the built-in set. Fails with FORESOUND_STATUS_VERSION for another major
// version than the library's, FORESOUND_STATUS_BAD_ARGUMENT also for more memory than `max_memory_mib`,
// FORESOUND_STATUS_FORMAT for a damaged HRTF set, FORESOUND_STATUS_STATE if the system starts no thread.
FORESOUND_API
ForesoundStatus foresound_engine_create(uint32_t api_version,
                                        const struct ForesoundOptions *options,
                                        const uint8_t *hrtf,
                                        size_t hrtf_bytes,
                                        uint64_t *engine,
                                        uint64_t *renderer);

// Replaces the scene. The old one is audible until the first update with the new one. The scene's handle may be
// closed afterwards. Control thread.
FORESOUND_API ForesoundStatus foresound_engine_set_scene(uint64_t engine, uint64_t scene);

// Gives all surfaces of a material's name, in the scene and in instances, other properties from the next tick on;
// audible with the next update. Another scene has its own, and so has an instance that is added later. `material`: null
// for a surface that reflects everything. Fails with FORESOUND_STATUS_BAD_ARGUMENT for a name that no surface has. Control thread.
FORESOUND_API
ForesoundStatus foresound_engine_set_material(uint64_t engine,
                                              const char *name,
                                              const struct ForesoundMaterialOptions *material);

// Writes the default options; `size` is set before. Any thread.
FORESOUND_API ForesoundStatus foresound_propagation_options_default(struct ForesoundPropagationOptions *options);

// Sets the rays and orders of propagation. `options`: null for the defaults. Control thread.
FORESOUND_API
ForesoundStatus foresound_engine_set_propagation(uint64_t engine,
                                                 const struct ForesoundPropagationOptions *options);

// Sets the extrapolation of paths, from the next update on. Control thread.
FORESOUND_API ForesoundStatus foresound_engine_set_predictor(uint64_t engine, ForesoundPredictor predictor);

// Changes the layout, such as when headphones are plugged in or out: sound cross-fades within the next
// graphics frame. The number of channels stays: a layout of more channels than the output fails with
// FORESOUND_STATUS_BAD_ARGUMENT, as does the binaural one without an HRTF set for the rate. Takes some
// milliseconds. Control thread.
FORESOUND_API ForesoundStatus foresound_engine_set_layout(uint64_t engine, ForesoundLayout layout);

// Changes the HRTF set: binaural sound cross-fades within the next graphics frame. `hrtf`: content of a SOFA
// file of the convention SimpleFreeFieldHRIR, or of a baked set at the engine's sample rate; null for the
// built-in set. A baked set takes some milliseconds. A SOFA file takes some seconds, in which other calls of
// the engine go on: call it on a thread of its own. Fails with FORESOUND_STATUS_FORMAT for a damaged set and
// FORESOUND_STATUS_BAD_ARGUMENT for one of another sample rate; the set stays. Any thread but the sound's.
FORESOUND_API ForesoundStatus foresound_engine_set_hrtf(uint64_t engine, const uint8_t *hrtf, size_t hrtf_bytes);

// Sets when propagation runs, after the running update. Fails with FORESOUND_STATUS_STATE if the system
// starts no thread; the schedule stays. Control thread.
FORESOUND_API ForesoundStatus foresound_engine_set_schedule(uint64_t engine, ForesoundSchedule schedule);

// Fades to silence within milliseconds and stops the playback positions. Control thread.
FORESOUND_API ForesoundStatus foresound_engine_pause(uint64_t engine);

// Continues after foresound_engine_pause. Control thread.
FORESOUND_API ForesoundStatus foresound_engine_resume(uint64_t engine);

// Restarts propagation after its failure (FORESOUND_ENGINE_STATE_PROPAGATION_FAILED), after the running
// update. Fails with FORESOUND_STATUS_STATE if the system starts no thread; another call tries again.
// Control thread.
FORESOUND_API ForesoundStatus foresound_engine_restart(uint64_t engine);

// Writes the engine's statistics. Takes microseconds; meant for some ten calls a second. Control thread.
FORESOUND_API
ForesoundStatus foresound_engine_statistics(uint64_t engine,
                                            struct ForesoundEngineStatistics *statistics);

// Writes the default budget, which has no limit; `size` is set before. Any thread.
FORESOUND_API ForesoundStatus foresound_budget_options_default(struct ForesoundBudgetOptions *options);

// Sets the budget from the next update on: rays, reflection orders and paths are reduced to meet it. Temperature may
// reduce them further unless the level is fixed. `options`: null for no limit. Control thread.
FORESOUND_API
ForesoundStatus foresound_engine_set_budget(uint64_t engine,
                                            const struct ForesoundBudgetOptions *options);

// Writes the engine's load and the phone's temperature. Takes microseconds; meant for some ten calls a second.
// Control thread.
FORESOUND_API ForesoundStatus foresound_engine_health(uint64_t engine, struct ForesoundEngineHealth *health);

// Adds an instance of a part, such as a door, at a pose from the next tick on; `instance` receives its id. A part
// is a scene in local coordinates, a hinge at the origin; its handle may be closed afterwards, and instances may
// share it. Instances stay when the scene is replaced. `pose_size`: sizeof(ForesoundPose). Fails with
// FORESOUND_STATUS_BAD_ARGUMENT for a part of too many triangles, and for too many instances. Control thread.
FORESOUND_API
ForesoundStatus foresound_instance_add(uint64_t engine,
                                       uint64_t part,
                                       const struct ForesoundPose *pose,
                                       size_t pose_size,
                                       uint32_t *instance);

// Adds an instance that stays where it is and is joined with the fixed scene and with all such instances that it touches,
// as if they had been built in one piece: floors and walls go on across borders. For chunks of a streamed world; a part
// may be shared. Else as foresound_instance_add. foresound_instance_remove removes it. Control thread.
FORESOUND_API
ForesoundStatus foresound_instance_add_joined(uint64_t engine,
                                              uint64_t part,
                                              const struct ForesoundPose *pose,
                                              size_t pose_size,
                                              uint32_t *instance);

// Moves an instance from the next tick on. The orientation is a quaternion of length 1; after an invalid pose the
// last valid one stays. `pose_size`: sizeof(ForesoundPose). Fails with FORESOUND_STATUS_BAD_ARGUMENT for one that
// was added by foresound_instance_add_joined. Control thread.
FORESOUND_API
ForesoundStatus foresound_instance_move(uint64_t engine,
                                        uint32_t instance,
                                        const struct ForesoundPose *pose,
                                        size_t pose_size);

// Removes an instance from the next tick on. Its id is invalid at once. Control thread.
FORESOUND_API ForesoundStatus foresound_instance_remove(uint64_t engine, uint32_t instance);

// Writes the default options; `size` is set before. Any thread.
FORESOUND_API ForesoundStatus foresound_scene_options_default(struct ForesoundSceneOptions *options);

// Makes a progress, with which another thread follows and cancels the construction of a scene; `progress` receives
// its handle. For one construction. Control thread.
FORESOUND_API ForesoundStatus foresound_progress_create(uint64_t *progress);

// Writes the share of a scene's construction that is done, 0 to 1. Control thread, also during the construction.
FORESOUND_API ForesoundStatus foresound_progress_read(uint64_t progress, float *done);

// Cancels a construction: its call returns FORESOUND_STATUS_CANCELLED after the present phase, of four. Control thread.
FORESOUND_API ForesoundStatus foresound_progress_cancel(uint64_t progress);

// Builds a scene from a mesh file: OBJ or PLY, and glTF or GLB if the library is built with its feature
// `gltf`. The file names materials. Or loads a saved scene, for which `materials_toml`, `options` and
// `progress` mean nothing. Else as foresound_scene_from_mesh, also in how it fails, and with
// FORESOUND_STATUS_FILE for a file that cannot be read. Takes milliseconds to seconds: a control thread, but
// not the one that draws.
FORESOUND_API
ForesoundStatus foresound_scene_from_file(const char *path,
                                          const char *materials_toml,
                                          const struct ForesoundSceneOptions *options,
                                          uint64_t progress,
                                          uint64_t *scene);

// Saves a scene to a file, which foresound_scene_from_file and foresound_scene_from_bytes load in a
// twentieth of the time of its construction or less, on any machine. Fails with FORESOUND_STATUS_FILE for a
// file that cannot be written. Control thread.
FORESOUND_API ForesoundStatus foresound_scene_save(uint64_t scene, const char *path);

// Loads a saved scene from the bytes of its file. Fails with FORESOUND_STATUS_FORMAT for other bytes, damaged ones
// and those of another version. Control thread.
FORESOUND_API ForesoundStatus foresound_scene_from_bytes(const uint8_t *bytes, size_t count, uint64_t *scene);

// Writes the properties of a scene. Control thread.
FORESOUND_API ForesoundStatus foresound_scene_info(uint64_t scene, struct ForesoundSceneInfo *info);

// Writes the renderer's latency from geometry to sound in audio frames, without the device's buffer. Does not
// disturb foresound_render. Any thread.
FORESOUND_API ForesoundStatus foresound_renderer_latency(uint64_t renderer, uint32_t *frames);

// Writes the number of channels that a renderer writes. Any thread.
FORESOUND_API ForesoundStatus foresound_renderer_channels(uint64_t renderer, uint32_t *channels);

// Plays a renderer of two channels on the system's device (Oboe on Android, a silent device elsewhere), rendered
// `blocks_ahead` blocks ahead (1 to 64) on a thread of its own. Closes the renderer's handle. A device that is
// lost or does not open is opened again at growing intervals. Fails with FORESOUND_STATUS_STATE if the system
// starts no thread; after FORESOUND_STATUS_BAD_ARGUMENT, also for other channels, the renderer stays open. Control
// thread.
FORESOUND_API ForesoundStatus foresound_output_start(uint64_t renderer, size_t blocks_ahead, uint64_t *output);

// Writes the properties and the state of an output's device. Control thread.
FORESOUND_API ForesoundStatus foresound_output_info(uint64_t output, struct ForesoundOutputInfo *info);

// Sets the pose of one of several listeners from the next tick on. `listener`: 0 to below the option `listeners`; the
// pose of 0 is that of foresound_engine_tick. After an invalid pose the last valid one stays. `pose_size`:
// sizeof(ForesoundPose). Control thread.
FORESOUND_API
ForesoundStatus foresound_engine_set_listener(uint64_t engine,
                                              uint32_t listener,
                                              const struct ForesoundPose *pose,
                                              size_t pose_size);

// Adds a silent source at a position in metres; `source` receives its id. Fails with FORESOUND_STATUS_STATE
// if the engine has `max_sources` sources. Control thread.
FORESOUND_API ForesoundStatus foresound_source_add(uint64_t engine, float x_m, float y_m, float z_m, uint32_t *source);

// Takes the numbers of the newest graphics frame that the renderer has, for a mixer of the app's own;
// foresound_source_numbers and foresound_source_paths read them. `tick` receives the number of the frame's tick, 0
// before the first. The first call makes memory for them; from then on the renderer copies each frame without
// waiting. Control thread.
FORESOUND_API ForesoundStatus foresound_engine_take_numbers(uint64_t engine, uint32_t *tick);

// Writes what the frame taken last has of a source; zeros for a source without a slot. Control thread.
FORESOUND_API
ForesoundStatus foresound_source_numbers(uint64_t engine,
                                         uint32_t source,
                                         struct ForesoundSourceNumbers *numbers);

// Removes a source from the next tick on; sound under way fades. Its id is invalid at once and is never given
// again: an engine has 1,048,575 ids for each of its `max_sources`. Control thread.
FORESOUND_API ForesoundStatus foresound_source_remove(uint64_t engine, uint32_t source);

// Writes the default options; `size` is set before. Any thread.
FORESOUND_API ForesoundStatus foresound_source_options_default(struct ForesoundSourceOptions *options);

// Sets a source's options from the next tick on. `options`: null for the defaults. Control thread.
FORESOUND_API
ForesoundStatus foresound_source_configure(uint64_t engine,
                                           uint32_t source,
                                           const struct ForesoundSourceOptions *options);

// Sets a source's directivity table from the next tick on: rows of eight levels in dB, one a band, the angles
// evenly from the front to the back, both included; 2 to 181 rows of -63 to 60 dB or minus infinity. `levels`:
// their number, 8 x rows; 0 for no table. The table is multiplied with the options' directivity. Control thread.
FORESOUND_API
ForesoundStatus foresound_source_set_directivity_table(uint64_t engine,
                                                       uint32_t source,
                                                       const float *levels_db,
                                                       size_t levels);

// Sets a source's distance table from the next tick on, which replaces the options' curve: pairs of a distance in
// metres and a linear gain (0 to 1000) at rising distances, 1 to 16 pairs; straight lines between them. `values`:
// their number, 2 x pairs; 0 for no table. Control thread.
FORESOUND_API
ForesoundStatus foresound_source_set_distance_table(uint64_t engine,
                                                    uint32_t source,
                                                    const float *points,
                                                    size_t values);

// Sets a source's linear gain, 0 to 1000, from the next tick on. Control thread.
FORESOUND_API ForesoundStatus foresound_source_set_gain(uint64_t engine, uint32_t source, float gain);

// Mutes (1) or unmutes (0) a source; its playback position advances. Control thread.
FORESOUND_API ForesoundStatus foresound_source_mute(uint64_t engine, uint32_t source, uint32_t muted);

// Plays a clip from its beginning, once (0) or in a loop (1). The clip's handle may be closed afterwards. Fails
// with FORESOUND_STATUS_BAD_ARGUMENT for a clip at another rate than the engine's. Control thread.
FORESOUND_API ForesoundStatus foresound_source_play(uint64_t engine, uint32_t source, uint64_t clip, uint32_t looped);

// Writes the default options; `size` is set before. Any thread.
FORESOUND_API ForesoundStatus foresound_play_options_default(struct ForesoundPlayOptions *options);

// Plays a clip with loop points, from a frame of it, at a frame of the engine. A pause of the source ends;
// its pitch stays. `options`: null for the defaults. The clip's handle may be closed afterwards. Fails as
// foresound_source_play. Control thread.
FORESOUND_API
ForesoundStatus foresound_source_play_clip(uint64_t engine,
                                           uint32_t source,
                                           uint64_t clip,
                                           const struct ForesoundPlayOptions *options);

// Plays a clip once at a position in metres and forgets it: its source is removed when the clip has ended
// and its last path has arrived. `source` receives its id. `play` and `options`: null for the defaults. The
// id may be used until then, afterwards it gives FORESOUND_STATUS_STALE_SOURCE. Fails as
// foresound_source_add and foresound_source_play, and adds nothing then. Control thread.
FORESOUND_API
ForesoundStatus foresound_engine_play_once(uint64_t engine,
                                           uint64_t clip,
                                           float x_m,
                                           float y_m,
                                           float z_m,
                                           const struct ForesoundPlayOptions *play,
                                           const struct ForesoundSourceOptions *options,
                                           uint32_t *source);

// Writes state and position of a source's clip, as of the last block; of a stream idle. Control thread.
FORESOUND_API
ForesoundStatus foresound_source_playback(uint64_t engine,
                                          uint32_t source,
                                          struct ForesoundPlayback *playback);

// Pauses (1) or continues (0) a source's clip from the next tick on; fades within 6 ms. Control thread.
FORESOUND_API ForesoundStatus foresound_source_pause(uint64_t engine, uint32_t source, uint32_t paused);

// Continues a source's clip at another audio frame of it from the next tick on, with a cross-fade. Fails with
// FORESOUND_STATUS_STATE if it plays no clip. Control thread.
FORESOUND_API ForesoundStatus foresound_source_seek(uint64_t engine, uint32_t source, uint32_t frame);

// Sets the speed of a source's clips, 0.125 to 4, from the next tick on: 2 is an octave up. The pitch glides.
// Control thread.
FORESOUND_API ForesoundStatus foresound_source_set_pitch(uint64_t engine, uint32_t source, float pitch);

// Ramps a source's linear gain to 0 to 1000 within 0 to 3600 seconds from the next tick on. Control thread.
FORESOUND_API ForesoundStatus foresound_source_fade_gain(uint64_t engine, uint32_t source, float gain, float seconds);

// Silences a source and releases its clip or stream. Control thread.
FORESOUND_API ForesoundStatus foresound_source_stop(uint64_t engine, uint32_t source);

// Attaches a stream to a source, through a ring of `capacity` samples (1 to 16,777,216), and writes the handle for
// foresound_stream_write. Samples are mono at the engine's rate, 1 being full scale at 1 m; they are not converted.
// After a failure the source plays on as before. Control thread.
FORESOUND_API
ForesoundStatus foresound_source_stream(uint64_t engine,
                                        uint32_t source,
                                        size_t capacity,
                                        uint64_t *stream);

// Makes a clip of mono samples at `rate_hz` for engines at `engine_rate_hz` (1,000 to 384,000 Hz), copied and
// resampled. A sample of 1 is full scale at 1 m. At most 2^28 samples, 2^26 if they are resampled. Control thread.
FORESOUND_API
ForesoundStatus foresound_clip_from_samples(const float *samples,
                                            size_t count,
                                            uint32_t rate_hz,
                                            uint32_t engine_rate_hz,
                                            uint64_t *clip);

// Makes a clip of the bytes of a WAV file (PCM of 8 to 32 bits or float; channels are averaged) for engines
// at `engine_rate_hz`. Fails with FORESOUND_STATUS_FORMAT for bytes of another format, else as
// foresound_clip_from_samples. Control thread.
FORESOUND_API
ForesoundStatus foresound_clip_from_wav(const uint8_t *bytes,
                                        size_t count,
                                        uint32_t engine_rate_hz,
                                        uint64_t *clip);

// Makes a clip of two channels, interleaved samples, left first; else as foresound_clip_from_samples. A source with a
// position plays their mean, a 2D source both. Control thread.
FORESOUND_API
ForesoundStatus foresound_clip_from_stereo(const float *samples,
                                           size_t count,
                                           uint32_t rate_hz,
                                           uint32_t engine_rate_hz,
                                           uint64_t *clip);

// Makes a clip of the first two channels of a WAV file; else as foresound_clip_from_wav. Control thread.
FORESOUND_API
ForesoundStatus foresound_clip_from_stereo_wav(const uint8_t *bytes,
                                               size_t count,
                                               uint32_t engine_rate_hz,
                                               uint64_t *clip);

// Makes a clip of a first-order sound field in AmbiX form, four interleaved channels W, Y, Z, X in SN3D; else as
// foresound_clip_from_samples. A 2D source plays it around the listener, fixed in the world: its front is -z, its
// left -x, its top +y. A source with a position plays W. Control thread.
FORESOUND_API
ForesoundStatus foresound_clip_from_ambix(const float *samples,
                                          size_t count,
                                          uint32_t rate_hz,
                                          uint32_t engine_rate_hz,
                                          uint64_t *clip);

// Makes a clip of the bytes of a sound file: WAV, or FLAC or Ogg Vorbis if the library is built with its
// feature `compressed`. `channels`: 1 for their mean, 2 for the first two, 4 for a sound field in AmbiX
// form, for which the file must have four. Fails with FORESOUND_STATUS_FORMAT for other bytes and formats
// that the library is built without, else as foresound_clip_from_samples. Control thread.
FORESOUND_API
ForesoundStatus foresound_clip_from_file(const uint8_t *bytes,
                                         size_t count,
                                         uint32_t channels,
                                         uint32_t engine_rate_hz,
                                         uint64_t *clip);

// Version of this interface: 65,536 x major + 256 x minor + patch. Another major number than
// FORESOUND_API_VERSION's is incompatible, and foresound_engine_create refuses it. Any thread.
FORESOUND_API uint32_t foresound_version(void);

// Message of this thread's last failed call: one line in UTF-8, the cause and the remedy. Valid until the thread's next
// failure; empty before the first. Never null; not to be freed. Functions of the audio thread leave no
// message. Any thread.
FORESOUND_API const char *foresound_last_error(void);

// Submits a graphics frame: the listener's pose, and the poses of the sources that moved. Meant for one call a frame;
// never waits for propagation or sound, except that the synchronous schedule runs propagation in it. After an invalid pose
// (FORESOUND_STATUS_BAD_ARGUMENT: not finite, beyond 1,000 km, an orientation of no length) or an unknown source
// (FORESOUND_STATUS_STALE_SOURCE) it fails, and the frame is submitted with the last valid poses. `sources`: null if none.
// `pose_size`: sizeof(ForesoundPose). Control thread.
FORESOUND_API
ForesoundStatus foresound_engine_tick(uint64_t engine,
                                      const struct ForesoundPose *listener,
                                      const struct ForesoundPose *sources,
                                      size_t source_count,
                                      size_t pose_size);

// Writes the loudest paths of the newest update, in no order, as many as fit, and their number. At most the option
// `shown_paths` of them are available. `path_size`: sizeof(ForesoundShownPath). Control thread.
FORESOUND_API
ForesoundStatus foresound_engine_paths(uint64_t engine,
                                       struct ForesoundShownPath *paths,
                                       size_t path_size,
                                       size_t capacity,
                                       size_t *count);

// Writes a source's paths in the frame taken last (foresound_engine_take_numbers), by identity, as many as fit, and their
// number. `path_size`: sizeof(ForesoundSourcePath). Control thread.
FORESOUND_API
ForesoundStatus foresound_source_paths(uint64_t engine,
                                       uint32_t source,
                                       struct ForesoundSourcePath *paths,
                                       size_t path_size,
                                       size_t capacity,
                                       size_t *count);

// Builds a scene from triangles: three coordinates a vertex in metres, +y up, and three indices a triangle. With
// materials: their names, and one index into them a triangle; without: null and zero. `materials_toml`: the text of a
// materials file, or null. `options`: null for the defaults. `progress`: a handle of foresound_progress_create, or 0. Fails
// with FORESOUND_STATUS_FORMAT for a mesh or a materials file that is invalid, FORESOUND_STATUS_BAD_ARGUMENT for an option out of
// range, FORESOUND_STATUS_CANCELLED after foresound_progress_cancel. Takes milliseconds to seconds: a control thread, but not
// the one that draws.
FORESOUND_API
ForesoundStatus foresound_scene_from_mesh(const float *positions_m,
                                          size_t vertex_count,
                                          const uint32_t *indices,
                                          size_t index_count,
                                          const uint32_t *triangle_materials,
                                          const char *const *material_names,
                                          size_t material_count,
                                          const char *materials_toml,
                                          const struct ForesoundSceneOptions *options,
                                          uint64_t progress,
                                          uint64_t *scene);

// Renders `frames` audio frames of interleaved stereo into `output`; silence on failure. An engine of another number of
// channels than two fails with FORESOUND_STATUS_BAD_ARGUMENT: use foresound_render_channels. `info`: null if unused. One thread at
// a time a renderer; a second concurrent call gets FORESOUND_STATUS_BUSY. Multiples of the engine's block size are the most
// efficient. Audio thread: wait-free, without allocation, without a message.
//
// `output` has 2 x `frames` elements.
FORESOUND_API
ForesoundStatus foresound_render(uint64_t renderer,
                                 float *output,
                                 size_t frames,
                                 struct ForesoundRenderInfo *info);

// Renders `frames` audio frames of `channels` interleaved channels into `output`, as foresound_render; `channels` is the
// number of the engine (foresound_renderer_channels), another one gets FORESOUND_STATUS_BAD_ARGUMENT and silence. Audio
// thread: wait-free, without allocation, without a message.
//
// `output` has `channels` x `frames` elements.
FORESOUND_API
ForesoundStatus foresound_render_channels(uint64_t renderer,
                                          float *output,
                                          uint32_t channels,
                                          size_t frames,
                                          struct ForesoundRenderInfo *info);

// Appends as many of `count` samples to a stream as fit; `written` (null if unused) receives their number. Samples are
// mono at the engine's rate, 1 being full scale at 1 m; they are not converted. Fails with FORESOUND_STATUS_STATE once the
// stream has no reader. Any one thread at a time, the audio thread included: wait-free, without allocation, without a message.
FORESOUND_API
ForesoundStatus foresound_stream_write(uint64_t stream,
                                       const float *samples,
                                       size_t count,
                                       size_t *written);

// Begins a block of `frames` audio frames, 1 to the option `block_frames` (else FORESOUND_STATUS_BAD_ARGUMENT), whose sources are
// rendered apart: for a game with a mixer of its own, in place of foresound_render. Then call foresound_render_source for each
// source and foresound_render_reverb once: the sum of their outputs is what foresound_render renders, without its limiter. Needs
// the option `source_buses` (else FORESOUND_STATUS_STATE). One thread at a time a renderer. Audio thread: wait-free, without
// allocation, without a message.
FORESOUND_API
ForesoundStatus foresound_render_begin(uint64_t renderer,
                                       size_t frames);

// Renders one source of the block into `output`: `frames` audio frames of interleaved `channels`, those of the engine
// (foresound_renderer_channels); silence on failure. Its paths, without the late reverb. `dry`: the block's mono samples of the
// source, 1 being the pressure at 1 m, or null for what the source plays in the engine. `bus` (null if unused) receives
// what the output holds. Once a source and block; a source that is not rendered is in foresound_render_reverb's output. A
// source that was removed, or that no graphics frame has yet, fails with FORESOUND_STATUS_STALE_SOURCE; a second call for it, or
// one outside a block, with FORESOUND_STATUS_STATE; other frames or channels than the block's with FORESOUND_STATUS_BAD_ARGUMENT.
// Audio thread: as foresound_render_begin.
//
// `dry` has `frames` elements, `output` `channels` x `frames`.
FORESOUND_API
ForesoundStatus foresound_render_source(uint64_t renderer,
                                        uint32_t source,
                                        const float *dry,
                                        float *output,
                                        uint32_t channels,
                                        size_t frames,
                                        ForesoundBus *bus);

// Ends the block: renders the late reverb of all sources into `output`, and with it everything without a bus of its own in this
// block: sources that were not rendered, that share slots (with more sources than slots) or have no position, and the
// fading sound of removed ones. Silence on failure: FORESOUND_STATUS_STATE outside a block, FORESOUND_STATUS_BAD_ARGUMENT for other
// channels or frames than the block's; a wrong number of frames ends the block too. `info`: null if unused; of the whole block.
// Audio thread: as foresound_render_begin.
//
// `output` has `channels` x `frames` elements.
FORESOUND_API
ForesoundStatus foresound_render_reverb(uint64_t renderer,
                                        float *output,
                                        uint32_t channels,
                                        size_t frames,
                                        struct ForesoundRenderInfo *info);

// Renders each of several listeners into its own part of `output`, one after the other: `listeners` times `frames` audio frames of
// interleaved `channels`, the option `listeners` and the engine's channels (else FORESOUND_STATUS_BAD_ARGUMENT); silence on
// failure. foresound_render gives their mix, for listeners at one pair of loudspeakers. `info`: null if unused. Audio thread: as
// foresound_render.
//
// `output` has `listeners` x `channels` x `frames` elements.
FORESOUND_API
ForesoundStatus foresound_render_listeners(uint64_t renderer,
                                           float *output,
                                           uint32_t listeners,
                                           uint32_t channels,
                                           size_t frames,
                                           struct ForesoundRenderInfo *info);

// Passes the library's messages up to a level to a function, for the whole process; null: none, but for the system's log on
// Android. The function is called from any thread but the audio thread, from several at once, until this function is called
// again and has returned; it must return and must not call foresound_set_log. FORESOUND_STATUS_STATE in a Rust program with a
// logger of its own. Control thread.
FORESOUND_API
ForesoundStatus foresound_set_log(ForesoundLogLevel level,
                                  ForesoundLogCallback callback,
                                  void *user);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* FORESOUND_H */
