package dev.foresound;

import java.nio.ByteBuffer;

/**
 * The natives of libforesound, registered by its JNI_OnLoad; the Kotlin classes of this package are the public interface.
 * Written from src/bridge by `FORESOUND_WRITE_HEADER=1 cargo test --test c_header`; do not edit.
 *
 * <p>Functions without a comment are those of foresound.h. A failed call throws. Structures are lists of doubles, indexed
 * by the constants of the nested classes; null options are the defaults. Buffers are direct, in native order.
 */
final class Native {
    /** Bytes of a pose in a frame: the source's id, three floats of position, four of orientation. */
    static final int POSE_BYTES = 32;
    /** The version of the interface, for engineCreate. */
    static final int VERSION = 0x00030000;

    /** Why the library is missing; null if it is loaded. */
    private static final Throwable MISSING = NativeLibrary.load();

    private Native() {}

    /** Throws {@link UnavailableException} if the library is missing. */
    static void require() {
        NativeLibrary.require(MISSING);
    }

    static native void close(long handle);
    static native void optionsDefault(double[] options);
    static native long engineCreate(int apiVersion, double[] options, byte[] hrtf, long[] engine);
    static native void engineSetScene(long engine, long scene);
    static native void engineSetMaterial(long engine, String name, double[] material);
    static native void propagationOptionsDefault(double[] options);
    static native void engineSetPropagation(long engine, double[] options);
    static native void engineSetPredictor(long engine, int predictor);
    static native void engineSetLayout(long engine, int layout);
    static native void engineSetHrtf(long engine, byte[] hrtf);
    static native void engineSetSchedule(long engine, int schedule);
    static native void enginePause(long engine);
    static native void engineResume(long engine);
    static native void engineRestart(long engine);
    static native void engineStatistics(long engine, double[] statistics);
    static native void budgetOptionsDefault(double[] options);
    static native void engineSetBudget(long engine, double[] options);
    static native void engineHealth(long engine, double[] health);
    static native int instanceAdd(long engine, long part, float[] pose);
    static native int instanceAddJoined(long engine, long part, float[] pose);
    static native void instanceMove(long engine, int instance, float[] pose);
    static native void instanceRemove(long engine, int instance);
    static native void sceneOptionsDefault(double[] options);
    static native long progressCreate();
    static native float progressRead(long progress);
    static native void progressCancel(long progress);
    static native long sceneFromFile(String path, String materialsToml, double[] options, long progress);
    static native void sceneSave(long scene, String path);
    static native long sceneFromBytes(byte[] bytes);
    static native void sceneInfo(long scene, double[] info);
    static native int rendererLatency(long renderer);
    static native int rendererChannels(long renderer);
    static native long outputStart(long renderer, int blocksAhead);
    static native void outputInfo(long output, double[] info);
    static native void engineSetListener(long engine, int listener, float[] pose);
    static native int sourceAdd(long engine, float xM, float yM, float zM);
    static native int engineTakeNumbers(long engine);
    static native void sourceNumbers(long engine, int source, double[] numbers);
    static native void sourceRemove(long engine, int source);
    static native void sourceOptionsDefault(double[] options);
    static native void sourceConfigure(long engine, int source, double[] options);
    static native void sourceSetDirectivityTable(long engine, int source, float[] levelsDb);
    static native void sourceSetDistanceTable(long engine, int source, float[] points);
    static native void sourceSetGain(long engine, int source, float gain);
    static native void sourceMute(long engine, int source, boolean muted);
    static native void sourcePlay(long engine, int source, long clip, boolean looped);
    static native void playOptionsDefault(double[] options);
    static native void sourcePlayClip(long engine, int source, long clip, double[] options);
    static native int enginePlayOnce(
            long engine, long clip, float xM, float yM, float zM, double[] play, double[] options);
    static native void sourcePlayback(long engine, int source, double[] playback);
    static native void sourcePause(long engine, int source, boolean paused);
    static native void sourceSeek(long engine, int source, int frame);
    static native void sourceSetPitch(long engine, int source, float pitch);
    static native void sourceFadeGain(long engine, int source, float gain, float seconds);
    static native void sourceStop(long engine, int source);
    static native long sourceStream(long engine, int source, int capacity);
    static native long clipFromSamples(float[] samples, int rateHz, int engineRateHz);
    static native long clipFromWav(byte[] bytes, int engineRateHz);
    static native long clipFromStereo(float[] samples, int rateHz, int engineRateHz);
    static native long clipFromStereoWav(byte[] bytes, int engineRateHz);
    static native long clipFromAmbix(float[] samples, int rateHz, int engineRateHz);
    static native long clipFromFile(byte[] bytes, int channels, int engineRateHz);

    /** Version of the interface. */
    static native int version();

    /** Number of open handles, for leak tests. */
    static native int openHandles();

    /** Submits a graphics frame: the listener's pose and `count` sources' poses, {@link #POSE_BYTES} each. */
    static native void engineTick(long engine, ByteBuffer frame, int count);

    /** Writes the loudest paths of the newest update as {@link ShownPath} lists, as many as fit; returns their number. */
    static native int enginePaths(long engine, double[] paths);

    /** Writes a source's paths in the frame taken last as {@link SourcePath} lists, as many as fit; returns their number. */
    static native int sourcePaths(long engine, int source, double[] paths);

    /** Builds a scene from vertices and triangles; the four before the last may be null, and the progress 0. */
    static native long sceneFromMesh(
            float[] positions, int[] indices, int[] triangleMaterials, String[] materials, String materialsToml, double[] options, long progress);

    /** Renders interleaved floats of the renderer's channels; returns the number of voices. */
    static native int render(long renderer, ByteBuffer output, int frames);

    /** Renders each listener into its own output, one after the other, of interleaved floats; returns the number of voices. */
    static native int renderListeners(long renderer, ByteBuffer output, int frames);

    /** Begins a block of frames, at most the option {@code block_frames}, whose sources are rendered apart. */
    static native void renderBegin(long renderer, int frames);

    /** Renders one source of the block as interleaved floats; returns what the output holds ({@link Bus}). Without a {@code dry} block what the source plays in the engine. */
    static native int renderSource(long renderer, int source, ByteBuffer dry, ByteBuffer output, int frames);

    /** Ends the block: renders the late reverb and what has no bus of its own; returns the number of voices. */
    static native int renderReverb(long renderer, ByteBuffer output, int frames);

    /** Appends floats to a stream; returns the number that fitted. */
    static native int streamWrite(long stream, ByteBuffer samples, int count);

    static final class Options {
        static final int LENGTH = 33;
        static final int RATE_HZ = 0;
        static final int BLOCK_FRAMES = 1;
        static final int MAX_SOURCES = 2;
        static final int SOURCE_SLOTS = 3;
        static final int MAX_VOICES = 4;
        static final int FINE_VOICES = 5;
        static final int MAX_PATHS = 6;
        static final int GUIDE_RAYS = 7;
        static final int SOURCE_RAYS = 8;
        static final int DEPTH = 9;
        static final int DIFFRACTION_ORDER = 10;
        static final int SEED = 11;
        static final int SCHEDULE = 12;
        static final int TRACING_THREADS = 13;
        static final int PREDICTOR = 14;
        static final int EVEN_BLOCKS = 15;
        static final int AFFINITY = 16;
        static final int PROPAGATION_CORE = 17;
        static final int AUDIO_CORE = 18;
        static final int HRTF = 19;
        static final int LATE_REVERB = 20;
        static final int LIMITER = 21;
        static final int DEVICE_HINTS = 22;
        static final int SHOWN_PATHS = 23;
        static final int MAX_MEMORY_MIB = 24;
        static final int MIN_DISTANCE_M = 25;
        static final int CEILING_DB = 26;
        static final int FRAME_S = 27;
        static final int MAX_DELAY_S = 28;
        static final int LAYOUT = 29;
        static final int OUTPUT_CHANNELS = 30;
        static final int SOURCE_BUSES = 31;
        static final int LISTENERS = 32;
    }

    static final class SourceOptions {
        static final int LENGTH = 28;
        static final int EFFECTS = 0;
        static final int RADIUS_M = 1;
        static final int ORDER = 2;
        static final int DIRECTIVITY = 3;
        static final int DISTANCE_CURVE = 11;
        static final int DISTANCE_MIN_M = 12;
        static final int DISTANCE_MAX_M = 13;
        static final int DIRECT_GAIN = 14;
        static final int REFLECTIONS_GAIN = 15;
        static final int DIFFRACTION_GAIN = 16;
        static final int LATE_GAIN = 17;
        static final int OCCLUSION = 18;
        static final int TRANSMISSION = 19;
        static final int DOPPLER = 20;
        static final int AIR_ABSORPTION = 21;
        static final int IS_2D = 22;
        static final int PRIORITY = 23;
        static final int EXTENT_M = 24;
        static final int EXTENT_POINTS = 27;
    }

    static final class PropagationOptions {
        static final int LENGTH = 4;
        static final int GUIDE_RAYS = 0;
        static final int SOURCE_RAYS = 1;
        static final int DEPTH = 2;
        static final int DIFFRACTION_ORDER = 3;
    }

    static final class MaterialOptions {
        static final int LENGTH = 24;
        static final int ABSORPTION = 0;
        static final int SCATTERING = 8;
        static final int TRANSMISSION = 16;
    }

    static final class SceneOptions {
        static final int LENGTH = 9;
        static final int UP = 0;
        static final int SCALE = 1;
        static final int TEMPERATURE_C = 2;
        static final int HUMIDITY_PERCENT = 3;
        static final int PRESSURE_KPA = 4;
        static final int MIN_PANEL_M2 = 5;
        static final int MAX_FINITE_PANEL_M2 = 6;
        static final int ACOUSTIC_TOLERANCE_M = 7;
        static final int MAX_TRIANGLES = 8;
    }

    static final class BudgetOptions {
        static final int LENGTH = 5;
        static final int QUALITY_LEVEL = 0;
        static final int FIXED = 1;
        static final int RESERVED = 2;
        static final int UPDATE_S = 3;
        static final int CORE_SHARE = 4;
    }

    static final class SceneInfo {
        static final int LENGTH = 12;
        static final int UNKNOWN_MATERIALS = 0;
        static final int TRIANGLES_IN = 1;
        static final int TRIANGLES = 2;
        static final int SURFACES = 3;
        static final int MEMORY_BYTES = 4;
        static final int SPEED_OF_SOUND_M_S = 5;
        static final int BOUNDS_MIN_M = 6;
        static final int BOUNDS_MAX_M = 9;
    }

    static final class Percentiles {
        static final int LENGTH = 5;
        static final int COUNT = 0;
        static final int P50_S = 1;
        static final int P95_S = 2;
        static final int P999_S = 3;
        static final int WORST_S = 4;
    }

    static final class EngineStatistics {
        static final int LENGTH = 37;
        static final int STATE = 0;
        static final int EXTRAPOLATION_LEVEL = 1;
        static final int PATHS = 2;
        static final int SOURCES = 3;
        static final int QUALITY_LEVEL = 4;
        static final int AUDIO_PRIORITY = 5;
        static final int AUDIO_NICE = 6;
        static final int PROPAGATION = 7;
        static final int EXTRAPOLATION = 12;
        static final int GENERATION = 17;
        static final int BLOCK = 22;
        static final int BLOCKS = 27;
        static final int MISSED_DEADLINES = 28;
        static final int UPDATES = 29;
        static final int TRIMMED_PATHS = 30;
        static final int DROPPED_PATHS = 31;
        static final int UNDERRUN_SAMPLES = 32;
        static final int PROPAGATION_S = 33;
        static final int GRAPHICS_FRAME_S = 34;
        static final int PROPAGATION_CORES = 35;
        static final int AUDIO_CORES = 36;
    }

    static final class EngineHealth {
        static final int LENGTH = 11;
        static final int STATE = 0;
        static final int QUALITY_LEVEL = 1;
        static final int THERMAL_QUALITY_LEVEL = 2;
        static final int THERMAL_STATUS = 3;
        static final int THERMAL_HEADROOM = 4;
        static final int HINTED = 5;
        static final int UNHEARD_SOURCES = 6;
        static final int RAYS = 7;
        static final int SOUND_SHARE = 8;
        static final int PROPAGATION_S = 9;
        static final int GRAPHICS_FRAME_S = 10;
    }

    static final class ShownPath {
        static final int LENGTH = 23;
        static final int SOURCE = 0;
        static final int CORNER_COUNT = 1;
        static final int REFLECTIONS = 2;
        static final int DIFFRACTION_ORDER = 3;
        static final int LEVEL_DB = 4;
        static final int CORNERS_M = 5;
    }

    static final class SourcePath {
        static final int LENGTH = 18;
        static final int ID = 0;
        static final int DELAY_S = 1;
        static final int KIND = 2;
        static final int REFLECTIONS = 3;
        static final int ARRIVAL = 4;
        static final int DEPARTURE = 7;
        static final int AMPLITUDE = 10;
    }

    static final class SourceNumbers {
        static final int LENGTH = 27;
        static final int PATH_COUNT = 0;
        static final int OCCLUSION = 1;
        static final int REVERB_DELAY_S = 2;
        static final int TRANSMISSION = 3;
        static final int REVERB_SEND = 11;
        static final int DECAY_TIME_S = 19;
    }

    static final class PlayOptions {
        static final int LENGTH = 5;
        static final int LOOPED = 0;
        static final int LOOP_START = 1;
        static final int LOOP_END = 2;
        static final int FIRST_FRAME = 3;
        static final int START_AT = 4;
    }

    static final class Playback {
        static final int LENGTH = 3;
        static final int STATE = 0;
        static final int FRAME = 1;
        static final int ENGINE_FRAME = 2;
    }

    static final class RenderInfo {
        static final int LENGTH = 9;
        static final int FRAMES = 0;
        static final int GRAPHICS_FRAMES = 1;
        static final int UPDATES = 2;
        static final int EXTRAPOLATION_LEVEL = 3;
        static final int VOICES = 4;
        static final int DROPPED_PATHS = 5;
        static final int UNDERRUN_SAMPLES = 6;
        static final int MISSED_DEADLINE = 7;
        static final int ENGINE_GONE = 8;
    }

    static final class OutputInfo {
        static final int LENGTH = 17;
        static final int PLAYING = 0;
        static final int RATE_HZ = 1;
        static final int BURST_FRAMES = 2;
        static final int BUFFER_FRAMES = 3;
        static final int EXCLUSIVE = 4;
        static final int LOW_LATENCY = 5;
        static final int DEVICE_API = 6;
        static final int RING_FRAMES = 7;
        static final int OPENED = 8;
        static final int REFUSED = 9;
        static final int LOST = 10;
        static final int STALLED = 11;
        static final int XRUNS = 12;
        static final int MIN_CALLBACK_FRAMES = 13;
        static final int MAX_CALLBACK_FRAMES = 14;
        static final int CALLBACKS = 15;
        static final int UNDERRUN_FRAMES = 16;
    }

    static final class Schedule {
        static final int ASYNCHRONOUS = 0;
        static final int SYNCHRONOUS = 1;
    }

    static final class Predictor {
        static final int HOLD = 0;
        static final int LINEAR = 1;
        static final int GEOMETRIC = 2;
    }

    static final class Affinity {
        static final int SYSTEM = 0;
        static final int FASTEST = 1;
        static final int CHOSEN = 2;
    }

    static final class Hrtf {
        static final int SET = 0;
        static final int NONE = 1;
    }

    static final class Layout {
        static final int BINAURAL = 0;
        static final int STEREO = 1;
        static final int MONO = 2;
        static final int SURROUND51 = 3;
        static final int SURROUND71 = 4;
        static final int SURROUND714 = 5;
        static final int AMBISONICS1 = 6;
        static final int AMBISONICS2 = 7;
        static final int AMBISONICS3 = 8;
    }

    static final class Effect {
        static final int NONE = 0;
        static final int DIRECT = 1;
        static final int REFLECTIONS = 2;
        static final int DIFFRACTION = 4;
        static final int TRANSMISSION = 8;
        static final int LATE_REVERB = 16;
        static final int ALL = 31;
    }

    static final class DistanceCurve {
        static final int PHYSICAL = 0;
        static final int INVERSE = 1;
        static final int LINEAR = 2;
    }

    static final class PathKind {
        static final int DIRECT = 0;
        static final int TRANSMITTED = 1;
        static final int REFLECTED = 2;
        static final int DIFFRACTED = 3;
    }

    static final class PlaybackState {
        static final int IDLE = 0;
        static final int SCHEDULED = 1;
        static final int PLAYING = 2;
        static final int PAUSED = 3;
        static final int FINISHED = 4;
    }

    static final class Bus {
        static final int OWN = 0;
        static final int SHARED = 1;
        static final int SILENT = 2;
    }

    static final class DeviceHint {
        static final int NONE = 0;
        static final int THERMAL = 1;
        static final int PERFORMANCE = 2;
    }

    static final class HintedThread {
        static final int NONE = 0;
        static final int PROPAGATION = 1;
        static final int AUDIO = 2;
    }

    static final class EngineState {
        static final int RUNNING = 0;
        static final int PAUSED = 1;
        static final int PROPAGATION_FAILED = 2;
        static final int RENDERER_GONE = 3;
    }

    static final class ThermalStatus {
        static final int UNKNOWN = -1;
        static final int NONE = 0;
        static final int LIGHT = 1;
        static final int MODERATE = 2;
        static final int SEVERE = 3;
        static final int CRITICAL = 4;
        static final int EMERGENCY = 5;
        static final int SHUTDOWN = 6;
    }

    static final class UpAxis {
        static final int Y = 0;
        static final int Z = 1;
    }

    static final class DeviceApi {
        static final int OTHER = 0;
        static final int AAUDIO = 1;
        static final int OPENSL_ES = 2;
    }

    static final class LogLevel {
        static final int OFF = 0;
        static final int ERROR = 1;
        static final int WARN = 2;
        static final int INFO = 3;
        static final int DEBUG = 4;
    }
}
