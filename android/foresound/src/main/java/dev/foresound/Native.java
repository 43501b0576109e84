package dev.foresound;

import java.io.IOException;
import java.nio.ByteBuffer;
import java.util.Arrays;
import java.util.List;

/**
 * The natives of libforesound, registered by its JNI_OnLoad; the Kotlin classes of this package are the face of it.
 *
 * Handles are numbers above zero. A closed or foreign one throws, whatever it is given to. Lists of numbers have the
 * order of the C structures in foresound.h, without their sizes.
 */
final class Native {
    static final int OPTIONS = 24;
    static final int STATISTICS = 36;
    static final int SCENE_INFO = 12;
    static final int OUTPUT_INFO = 17;
    static final int SOURCE_OPTIONS = 11;
    static final int BUDGET = 4;
    static final int HEALTH = 11;
    /** Floats of a path in a picture: source, corners, reflections, bends, level, three coordinates for each of six corners. */
    static final int PATH_FLOATS = 23;
    /** Bytes of a pose in a frame: source, three of position, four of orientation. */
    static final int POSE_BYTES = 32;

    /** Oldest Android that the library is built for. */
    static final int OLDEST_API = 26;
    /** What the library is built for. */
    static final List<String> ABIS = Arrays.asList("arm64-v8a", "x86_64");

    /** Why there is no library; null if there is one. */
    private static final Throwable MISSING = load();

    private Native() {}

    private static Throwable load() {
        try {
            System.loadLibrary("foresound");
            return null;
        } catch (LinkageError | SecurityException missing) {
            return missing;
        }
    }

    /** Throws, with the reason, where there is no library. */
    static void require() {
        if (MISSING != null) throw new UnavailableException(reason(api(), abis(), MISSING), MISSING);
    }

    /** Why a device has no library, and what to do. */
    static String reason(int api, List<String> abis, Throwable missing) {
        if (api > 0 && api < OLDEST_API) {
            return "libforesound.so needs Android 8.0 (API " + OLDEST_API + ") and this is API " + api
                    + "; play without it there, or raise minSdk";
        }
        if (!abis.isEmpty() && ABIS.stream().noneMatch(abis::contains)) {
            return "libforesound.so is built for " + ABIS + " and this device runs " + abis
                    + "; play without it there, or add the ABI to cargo-ndk.toml";
        }
        return "libforesound.so cannot be loaded: " + missing.getMessage()
                + "; look whether the APK has it under lib/ and no abiFilters or splits leave it out";
    }

    /** API level of this Android; 0 elsewhere. By name, since a host has no such class. */
    private static int api() {
        try {
            return Class.forName("android.os.Build$VERSION").getField("SDK_INT").getInt(null);
        } catch (ReflectiveOperationException host) {
            return 0;
        }
    }

    /** What this Android runs; nothing elsewhere. */
    private static List<String> abis() {
        try {
            return Arrays.asList((String[]) Class.forName("android.os.Build").getField("SUPPORTED_ABIS").get(null));
        } catch (ReflectiveOperationException host) {
            return List.of();
        }
    }

    static native int version();

    static native int openHandles();

    static native void close(long handle);

    static native void optionDefaults(double[] options);

    /** Handles of engine and renderer into the two places of {@code handles}; {@code hrtf} may be null. */
    static native void create(double[] options, byte[] hrtf, long[] handles);

    /** The listener's pose and those of {@code sources} sources, in a direct buffer in native order. */
    static native void tick(long engine, ByteBuffer frame, int sources);

    static native void setScene(long engine, long scene);

    static native void setPropagation(long engine, int guideRays, int sourceRays, int depth);

    static native void pause(long engine);

    static native void resume(long engine);

    static native void restart(long engine);

    static native void statistics(long engine, double[] numbers);

    static native void setBudget(long engine, double[] budget);

    static native void health(long engine, double[] numbers);

    /** As many whole paths as there are and fit; gives their number. */
    static native int paths(long engine, float[] paths);

    /** All but the first two may be null. */
    static native long sceneFromMesh(
            float[] positions,
            int[] indices,
            int[] triangleMaterials,
            String[] materials,
            String materialsToml,
            double[] options);

    /** All but the first may be null. */
    static native long sceneFromFile(String path, String materialsToml, double[] options) throws IOException;

    static native void sceneInfo(long scene, double[] numbers);

    static native int addSource(long engine, float x, float y, float z);

    static native void removeSource(long engine, int source);

    static native void configureSource(long engine, int source, double[] options);

    /** An instance of a part, a scene of its own, not turned; gives its number. */
    static native int addInstance(long engine, long part, float x, float y, float z);

    /** To a place, turned by a quaternion. */
    static native void moveInstance(
            long engine, int instance, float x, float y, float z, float turnX, float turnY, float turnZ, float turnW);

    static native void removeInstance(long engine, int instance);

    static native void setGain(long engine, int source, float gain);

    static native void mute(long engine, int source, boolean muted);

    static native void play(long engine, int source, long clip, boolean looped);

    static native void stop(long engine, int source);

    static native long stream(long engine, int source, int capacity);

    static native long clipFromSamples(float[] samples, int rateHz, int engineRateHz);

    static native long clipFromWav(byte[] bytes, int engineRateHz);

    /** Floats in native order from a direct buffer; gives how many fitted. */
    static native int writeStream(long stream, ByteBuffer samples, int count);

    /** Interleaved stereo floats in native order into a direct buffer; gives the number of voices. */
    static native int render(long renderer, ByteBuffer output, int frames);

    static native int latency(long renderer);

    static native long startOutput(long renderer, int blocksAhead);

    static native void outputInfo(long output, double[] numbers);
}
