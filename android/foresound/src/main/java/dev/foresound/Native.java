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

    /** Why the library is missing; null if it is loaded. */
    private static final Throwable MISSING = NativeLibrary.load();

    private Native() {}

    /** Throws {@link UnavailableException} if the library is missing. */
    static void require() {
        NativeLibrary.require(MISSING);
    }

    static native void close(long handle);
    static native void optionsDefault(double[] options);
    static native long engineCreate(double[] options, byte[] hrtf, long[] engine);
    static native void engineSetScene(long engine, long scene);
    static native void engineSetPropagation(long engine, int guideRays, int sourceRays, int depth);
    static native void enginePause(long engine);
    static native void engineResume(long engine);
    static native void engineRestart(long engine);
    static native void engineStatistics(long engine, double[] statistics);
    static native void budgetOptionsDefault(double[] options);
    static native void engineSetBudget(long engine, double[] options);
    static native void engineHealth(long engine, double[] health);
    static native int instanceAdd(long engine, long part, float[] pose);
    static native void instanceMove(long engine, int instance, float[] pose);
    static native void instanceRemove(long engine, int instance);
    static native void sceneOptionsDefault(double[] options);
    static native long sceneFromFile(String path, String materialsToml, double[] options);
    static native void sceneInfo(long scene, double[] info);
    static native int rendererLatency(long renderer);
    static native long outputStart(long renderer, int blocksAhead);
    static native void outputInfo(long output, double[] info);
    static native int sourceAdd(long engine, float xM, float yM, float zM);
    static native void sourceRemove(long engine, int source);
    static native void sourceOptionsDefault(double[] options);
    static native void sourceConfigure(long engine, int source, double[] options);
    static native void sourceSetGain(long engine, int source, float gain);
    static native void sourceMute(long engine, int source, boolean muted);
    static native void sourcePlay(long engine, int source, long clip, boolean looped);
    static native void sourceStop(long engine, int source);
    static native long sourceStream(long engine, int source, int capacity);
    static native long clipFromSamples(float[] samples, int rateHz, int engineRateHz);
    static native long clipFromWav(byte[] bytes, int engineRateHz);

    /** Version of the interface. */
    static native int version();

    /** Number of open handles, for leak tests. */
    static native int openHandles();

    /** Submits a graphics frame: the listener's pose and `count` sources' poses, {@link #POSE_BYTES} each. */
    static native void engineTick(long engine, ByteBuffer frame, int count);

    /** Writes the loudest paths of the newest update as {@link ShownPath} lists, as many as fit; returns their number. */
    static native int enginePaths(long engine, double[] paths);

    /** Builds a scene from vertices and triangles; the last four may be null. */
    static native long sceneFromMesh(
            float[] positions, int[] indices, int[] triangleMaterials, String[] materials, String materialsToml, double[] options);

    /** Renders interleaved stereo floats; returns the number of voices. */
    static native int render(long renderer, ByteBuffer output, int frames);

    /** Appends floats to a stream; returns the number that fitted. */
    static native int streamWrite(long stream, ByteBuffer samples, int count);

    static final class Options {
        static final int LENGTH = 25;
        static final int RATE_HZ = 0;
        static final int BLOCK_FRAMES = 1;
        static final int MAX_SOURCES = 2;
        static final int MAX_VOICES = 3;
        static final int FINE_VOICES = 4;
        static final int MAX_PATHS = 5;
        static final int GUIDE_RAYS = 6;
        static final int SOURCE_RAYS = 7;
        static final int DEPTH = 8;
        static final int SEED = 9;
        static final int SCHEDULE = 10;
        static final int PREDICTOR = 11;
        static final int AFFINITY = 12;
        static final int PROPAGATION_CORE = 13;
        static final int SOUND_CORE = 14;
        static final int HRTF = 15;
        static final int LATE_REVERB = 16;
        static final int LIMITER = 17;
        static final int MIN_DISTANCE_M = 18;
        static final int CEILING_DB = 19;
        static final int FRAME_S = 20;
        static final int MAX_DELAY_S = 21;
        static final int DEVICE_HINTS = 22;
        static final int SHOWN_PATHS = 23;
        static final int MAX_MEMORY_MIB = 24;
    }

    static final class SourceOptions {
        static final int LENGTH = 11;
        static final int EFFECTS = 0;
        static final int RADIUS_M = 1;
        static final int ORDER = 2;
        static final int DIRECTIVITY = 3;
    }

    static final class SceneOptions {
        static final int LENGTH = 5;
        static final int UP = 0;
        static final int SCALE = 1;
        static final int TEMPERATURE_C = 2;
        static final int HUMIDITY_PERCENT = 3;
        static final int PRESSURE_KPA = 4;
    }

    static final class BudgetOptions {
        static final int LENGTH = 4;
        static final int QUALITY_LEVEL = 0;
        static final int FIXED = 1;
        static final int UPDATE_S = 2;
        static final int CORE_SHARE = 3;
    }

    static final class SceneInfo {
        static final int LENGTH = 12;
        static final int TRIANGLES_IN = 0;
        static final int TRIANGLES = 1;
        static final int SURFACES = 2;
        static final int UNKNOWN_MATERIALS = 3;
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
        static final int LENGTH = 36;
        static final int STATE = 0;
        static final int EXTRAPOLATION_LEVEL = 1;
        static final int PATHS = 2;
        static final int SOURCES = 3;
        static final int PROPAGATION = 4;
        static final int EXTRAPOLATION = 9;
        static final int GENERATION = 14;
        static final int BLOCK = 19;
        static final int BLOCKS = 24;
        static final int MISSED_DEADLINES = 25;
        static final int UPDATES = 26;
        static final int TRIMMED_PATHS = 27;
        static final int DROPPED_PATHS = 28;
        static final int UNDERRUN_SAMPLES = 29;
        static final int PROPAGATION_S = 30;
        static final int GRAPHICS_FRAME_S = 31;
        static final int PROPAGATION_CORES = 32;
        static final int SOUND_CORES = 33;
        static final int SOUND_PRIORITY = 34;
        static final int SOUND_NICE = 35;
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
        static final int INTERFACE = 6;
        static final int RING_FRAMES = 7;
        static final int OPENED = 8;
        static final int REFUSED = 9;
        static final int LOST = 10;
        static final int STALLED = 11;
        static final int XRUNS = 12;
        static final int LEAST_FRAMES = 13;
        static final int MOST_FRAMES = 14;
        static final int CALLBACKS = 15;
        static final int UNDERRUN_FRAMES = 16;
    }
}
