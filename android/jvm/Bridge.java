package dev.foresound;

import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.nio.channels.FileChannel;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.Arrays;
import java.util.concurrent.atomic.AtomicInteger;

/**
 * Drives the natives on a host's virtual machine. The first argument is the part: walk SCENE OUT, abuse, cycles N, threads,
 * tick. Prints lines of figures; anything unexpected ends it with an exception.
 */
final class Bridge {
    static final int RATE_HZ = 48_000;

    public static void main(String[] arguments) throws Exception {
        if (arguments[0].equals("missing")) {
            missing();
            return;
        }
        if (Native.version() != Native.VERSION) throw new AssertionError("version " + Native.version());
        switch (arguments[0]) {
            case "walk" -> walk(arguments[1], Path.of(arguments[2]));
            case "abuse" -> abuse();
            case "cycles" -> cycles(Integer.parseInt(arguments[1]));
            case "threads" -> threads();
            case "tick" -> tick();
            default -> throw new IllegalArgumentException(arguments[0]);
        }
        if (Native.openHandles() != 0) throw new AssertionError(Native.openHandles() + " handles are left open");
    }

    /** Without the library: the message has the reason. */
    static void missing() {
        refuses(UnavailableException.class, Native::require);
        var cause = new UnsatisfiedLinkError("no foresound in library path");
        String[] reasons = {
            NativeLibrary.reason(24, java.util.List.of("arm64-v8a"), cause),
            NativeLibrary.reason(34, java.util.List.of("armeabi-v7a", "armeabi"), cause),
            NativeLibrary.reason(34, java.util.List.of("arm64-v8a"), cause),
        };
        String[] words = {"API 26", "armeabi-v7a", "no foresound in library path"};
        for (int i = 0; i < 3; i++) if (!reasons[i].contains(words[i])) throw new AssertionError(reasons[i]);
        System.out.printf("missing: %s%n", reasons[1]);
    }

    static ByteBuffer direct(int bytes) {
        return ByteBuffer.allocateDirect(bytes).order(ByteOrder.nativeOrder());
    }

    static double[] options() {
        double[] options = new double[Native.Options.LENGTH];
        Native.optionsDefault(options);
        options[Native.Options.RATE_HZ] = RATE_HZ;
        return options;
    }

    /** A small engine without a propagation thread. */
    static double[] light() {
        double[] options = options();
        options[Native.Options.BLOCK_FRAMES] = 64;
        options[Native.Options.MAX_SOURCES] = 1;
        options[Native.Options.MAX_VOICES] = 8;
        options[Native.Options.FINE_VOICES] = 1;
        options[Native.Options.MAX_PATHS] = 16;
        options[Native.Options.GUIDE_RAYS] = 1;
        options[Native.Options.SOURCE_RAYS] = 1;
        options[Native.Options.DEPTH] = 0;
        options[Native.Options.SCHEDULE] = Native.Schedule.SYNCHRONOUS;
        options[Native.Options.HRTF] = Native.Hrtf.NONE;
        options[Native.Options.LATE_REVERB] = 0;
        options[Native.Options.MAX_DELAY_S] = 0.01;
        return options;
    }

    static void pose(ByteBuffer frame, int index, int source, float x, float y, float z, float turn) {
        frame.position(index * Native.POSE_BYTES);
        frame.putInt(source).putFloat(x).putFloat(y).putFloat(z);
        frame.putFloat(0).putFloat(turn).putFloat(0).putFloat(1);
    }

    /** Position and orientation of an instance without rotation. */
    static float[] at(float x, float y, float z) {
        return new float[] {x, y, z, 0, 0, 0, 1};
    }

    /** The walk of reference.rs. */
    static void walk(String sceneFile, Path out) throws Exception {
        final int frames = 800, ticks = 90;
        double[] options = options();
        options[Native.Options.GUIDE_RAYS] = 256;
        options[Native.Options.SCHEDULE] = Native.Schedule.SYNCHRONOUS;
        options[Native.Options.FRAME_S] = 1.0 / 60.0;
        long[] handle = new long[1];
        long renderer = Native.engineCreate(Native.VERSION, options, null, handle), engine = handle[0];
        long scene = Native.sceneFromFile(sceneFile, null, null, 0);
        double[] info = new double[Native.SceneInfo.LENGTH];
        Native.sceneInfo(scene, info);
        Native.engineSetScene(engine, scene);
        Native.close(scene);
        float[] signal = new float[2 * RATE_HZ];
        int state = 12_345;
        for (int n = 0; n < signal.length; n++) {
            state = state * 1_664_525 + 1_013_904_223;
            float noise = (float) ((state >>> 16) - 32_768) / 262_144.0f;
            signal[n] = n % 9600 < 8 ? 0.5f : noise;
        }
        long clip = Native.clipFromSamples(signal, RATE_HZ, RATE_HZ);
        int near = Native.sourceAdd(engine, 5.0f, 1.5f, 3.2f);
        int far = Native.sourceAdd(engine, 10.0f, 1.5f, 2.0f);
        Native.sourcePlay(engine, near, clip, true);
        Native.sourcePlay(engine, far, clip, false);
        Native.close(clip);
        Native.sourceSetGain(engine, far, 0.5f);
        float[] panel = {0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0};
        long door = Native.sceneFromMesh(panel, new int[] {0, 1, 2, 0, 2, 3}, null, null, null, null, 0);
        int instance = Native.instanceAdd(engine, door, at(9.0f, 0, 1.0f));
        Native.close(door);
        ByteBuffer frame = direct(2 * Native.POSE_BYTES);
        ByteBuffer block = direct(2 * frames * 4);
        byte[] copy = new byte[block.capacity()];
        int voices = 0;
        try (var file = Files.newOutputStream(out)) {
            for (int tick = 0; tick < ticks; tick++) {
                float part = (float) tick / (float) ticks;
                pose(frame, 0, 1, 12.5f - 6.0f * part, 1.65f, 0.5f + 4.0f * part, 0.5f * part);
                pose(frame, 1, near, 5.0f, 1.5f, 3.25f - part, 0);
                Native.instanceMove(engine, instance, new float[] {9.0f, 0, 1.0f + part, 0, 0.6f, 0, 0.8f});
                Native.engineTick(engine, frame, 1);
                voices = Math.max(voices, Native.render(renderer, block, frames));
                block.get(0, copy);
                file.write(copy);
            }
        }
        double[] statistics = new double[Native.EngineStatistics.LENGTH];
        Native.engineStatistics(engine, statistics);
        Native.close(engine);
        Native.close(renderer);
        System.out.printf("walk triangles %.0f voices %d updates %.0f%n", info[Native.SceneInfo.TRIANGLES], voices, statistics[Native.EngineStatistics.UPDATES]);
        if (voices < 10 || statistics[Native.EngineStatistics.UPDATES] != ticks) throw new AssertionError("too quiet a walk");
    }

    interface Call {
        void run() throws Exception;
    }

    static int refused;

    static void refuses(Class<? extends Throwable> wanted, Call call) {
        try {
            call.run();
        } catch (Throwable thrown) {
            boolean hasWords = thrown.getMessage() != null && thrown.getMessage().length() > 5;
            if (!wanted.isInstance(thrown) || !hasWords) throw new AssertionError(wanted + " wanted", thrown);
            refused++;
            return;
        }
        throw new AssertionError("should have been refused: " + wanted);
    }

    static void abuse() throws Exception {
        final var argument = IllegalArgumentException.class;
        final var state = IllegalStateException.class;
        final var none = NullPointerException.class;
        long[] handle = new long[1];
        final long renderer = Native.engineCreate(Native.VERSION, light(), null, handle), engine = handle[0];
        final int source = Native.sourceAdd(engine, 0, 0, 0);
        final ByteBuffer frame = direct(2 * Native.POSE_BYTES);
        pose(frame, 0, 0, 0, 1, 0, 0);
        pose(frame, 1, source, 1, 1, 0, 0);
        Native.engineTick(engine, frame, 1);
        final ByteBuffer block = direct(512);
        Native.render(renderer, block, 64);
        // Creation.
        refuses(none, () -> Native.engineCreate(Native.VERSION, light(), null, null));
        refuses(argument, () -> Native.engineCreate(Native.VERSION, light(), null, new long[2]));
        refuses(argument, () -> Native.engineCreate(Native.VERSION, new double[3], null, handle));
        // Null options are the defaults.
        Native.close(Native.engineCreate(Native.VERSION, null, null, handle));
        Native.close(handle[0]);
        handle[0] = engine;
        double[] headed = light();
        headed[Native.Options.HRTF] = Native.Hrtf.SET;
        refuses(argument, () -> Native.engineCreate(Native.VERSION, headed, new byte[10], handle));
        for (int field = 0; field < Native.Options.LENGTH; field++) {
            for (double wrong : new double[] {Double.NaN, -1e300, Double.POSITIVE_INFINITY}) {
                double[] options = light();
                options[field] = wrong;
                refuses(argument, () -> Native.engineCreate(Native.VERSION, options, null, new long[1]));
            }
        }
        // Handles of every wrong kind, for every method.
        final long scene = Native.sceneFromMesh(
                new float[] {0, 0, 0, 1, 0, 0, 0, 0, 1}, new int[] {0, 1, 2}, null, null, null, null, 0);
        final long clip = Native.clipFromSamples(new float[100], RATE_HZ, RATE_HZ);
        final long stream = Native.sourceStream(engine, source, 64);
        for (long wrong : new long[] {0, 1, -1, Long.MIN_VALUE, Long.MAX_VALUE, engine ^ 1L << 50}) {
            for (Call call : calls(wrong, source, scene, clip, frame, block)) refuses(state, call);
        }
        for (long wrong : new long[] {engine ^ 1, engine ^ 1L << 40}) {
            for (Call call : engineCalls(wrong, source, scene, clip, frame)) refuses(state, call);
        }
        for (long wrong : new long[] {scene, clip, stream}) {
            for (Call call : engineCalls(wrong, source, scene, clip, frame)) refuses(argument, call);
        }
        refuses(argument, () -> Native.engineSetScene(engine, clip));
        refuses(argument, () -> Native.sourcePlay(engine, source, scene, false));
        refuses(argument, () -> Native.render(engine, block, 64));
        refuses(argument, () -> Native.outputStart(engine, 2));
        refuses(argument, () -> Native.outputInfo(renderer, new double[Native.OutputInfo.LENGTH]));
        // Frames.
        refuses(none, () -> Native.engineTick(engine, null, 0));
        refuses(argument, () -> Native.engineTick(engine, ByteBuffer.allocate(64), 1));
        refuses(argument, () -> Native.engineTick(engine, direct(31), 0));
        refuses(argument, () -> Native.engineTick(engine, frame, 2));
        refuses(argument, () -> Native.engineTick(engine, frame, -1));
        refuses(argument, () -> Native.engineTick(engine, frame, Integer.MAX_VALUE));
        for (float wrong : new float[] {Float.NaN, Float.POSITIVE_INFINITY, -1e30f}) {
            pose(frame, 0, 0, wrong, 0, 0, 0);
            refuses(argument, () -> Native.engineTick(engine, frame, 0));
            pose(frame, 0, 0, 0, 1, 0, 0);
            pose(frame, 1, source, 0, wrong, 0, 0);
            refuses(argument, () -> Native.engineTick(engine, frame, 1));
        }
        pose(frame, 1, source + 7, 0, 0, 0, 0);
        refuses(argument, () -> Native.engineTick(engine, frame, 1));
        pose(frame, 1, source, 0, 0, 0, 0);
        // A misaligned slice of a buffer is valid.
        ByteBuffer askew = direct(100).position(3).slice().order(ByteOrder.nativeOrder());
        pose(askew, 0, 0, 0, 1, 0, 0);
        pose(askew, 1, source, 1, 1, 0, 0);
        Native.engineTick(engine, askew, 1);
        Native.render(renderer, direct(515).position(3).slice(), 64);
        // Sound.
        refuses(none, () -> Native.render(renderer, null, 1));
        refuses(argument, () -> Native.render(renderer, block, 65));
        refuses(argument, () -> Native.render(renderer, block, -5));
        refuses(argument, () -> Native.render(renderer, ByteBuffer.allocate(512), 1));
        refuses(argument, () -> Native.streamWrite(stream, block, 129));
        refuses(none, () -> Native.streamWrite(stream, null, 1));
        if (Native.streamWrite(stream, block, 128) != 64) throw new AssertionError("a ring of 64");
        if (Native.streamWrite(stream, block, 1) != 0) throw new AssertionError("a full ring");
        refuses(argument, () -> Native.sourceStream(engine, source, 0));
        refuses(argument, () -> Native.sourceStream(engine, source, -1));
        refuses(argument, () -> Native.outputStart(renderer, 0));
        // Sources and clips.
        refuses(argument, () -> Native.sourceSetGain(engine, source, Float.NaN));
        refuses(argument, () -> Native.sourceSetGain(engine, source, -1));
        refuses(argument, () -> Native.sourceSetGain(engine, source + 1, 1));
        refuses(argument, () -> Native.sourceAdd(engine, Float.NaN, 0, 0));
        refuses(state, () -> Native.sourceAdd(engine, 0, 0, 0));
        Native.sourceConfigure(engine, source, null);
        refuses(argument, () -> Native.sourceConfigure(engine, source, new double[10]));
        for (int field = 0; field < Native.SourceOptions.LENGTH; field++) {
            double[] options = Arrays.copyOf(new double[] {31, 0, 1}, Native.SourceOptions.LENGTH);
            options[Native.SourceOptions.EXTENT_POINTS] = 4;
            Native.sourceConfigure(engine, source, options);
            options[field] = field == 0 ? 32 : Double.NaN;
            refuses(argument, () -> Native.sourceConfigure(engine, source, options));
        }
        // Instances.
        int instance = Native.instanceAdd(engine, scene, at(0, 0, 0));
        refuses(argument, () -> Native.instanceAdd(engine, scene, at(Float.NaN, 0, 0)));
        refuses(argument, () -> Native.instanceAdd(engine, scene, at(0, 1e30f, 0)));
        refuses(state, () -> Native.instanceAdd(engine, 77, at(0, 0, 0)));
        refuses(argument, () -> Native.instanceAddJoined(engine, scene, at(Float.NaN, 0, 0)));
        refuses(state, () -> Native.instanceAddJoined(engine, 77, at(0, 0, 0)));
        int joined = Native.instanceAddJoined(engine, scene, at(0, 0, 0));
        refuses(argument, () -> Native.instanceMove(engine, joined, new float[] {1, 0, 0, 0, 0, 0, 1}));
        Native.instanceRemove(engine, joined);
        refuses(argument, () -> Native.instanceAdd(engine, clip, at(0, 0, 0)));
        refuses(argument, () -> Native.instanceMove(engine, instance + 1, new float[] {0, 0, 0, 0, 0, 0, 1}));
        refuses(argument, () -> Native.instanceMove(engine, -1, new float[] {0, 0, 0, 0, 0, 0, 1}));
        refuses(argument, () -> Native.instanceMove(engine, instance, new float[] {Float.NaN, 0, 0, 0, 0, 0, 1}));
        refuses(argument, () -> Native.instanceMove(engine, instance, new float[] {0, 0, 0, 0, 0, 0, 0}));
        refuses(argument, () -> Native.instanceMove(engine, instance, new float[] {0, 0, 0, 0, 0, 3, 4}));
        refuses(none, () -> Native.instanceMove(engine, instance, null));
        refuses(argument, () -> Native.instanceMove(engine, instance, new float[6]));
        refuses(argument, () -> Native.instanceRemove(engine, instance + 0x10000));
        Native.instanceRemove(engine, instance);
        refuses(argument, () -> Native.instanceRemove(engine, instance));
        refuses(none, () -> Native.clipFromSamples(null, 48_000, 48_000));
        refuses(argument, () -> Native.clipFromSamples(new float[] {Float.NaN}, 48_000, 48_000));
        refuses(argument, () -> Native.clipFromSamples(new float[1], -1, 48_000));
        refuses(none, () -> Native.clipFromWav(null, 48_000));
        refuses(argument, () -> Native.clipFromWav(new byte[100], 48_000));
        final long slow = Native.clipFromSamples(new float[9], 1000, 44_100);
        refuses(argument, () -> Native.sourcePlay(engine, source, slow, true));
        Native.close(slow);
        // Scenes.
        float[] corners = {0, 0, 0, 1, 0, 0, 0, 0, 1};
        refuses(none, () -> Native.sceneFromMesh(null, new int[3], null, null, null, null, 0));
        refuses(none, () -> Native.sceneFromMesh(corners, null, null, null, null, null, 0));
        refuses(argument, () -> Native.sceneFromMesh(new float[8], new int[3], null, null, null, null, 0));
        refuses(argument, () -> Native.sceneFromMesh(corners, new int[] {0, 1, 3}, null, null, null, null, 0));
        refuses(argument, () -> Native.sceneFromMesh(corners, new int[] {0, 1, -1}, null, null, null, null, 0));
        refuses(argument, () -> Native.sceneFromMesh(corners, new int[] {0, 1}, null, null, null, null, 0));
        refuses(argument, () -> Native.sceneFromMesh(new float[0], new int[0], null, null, null, null, 0));
        refuses(none, () -> Native.sceneFromMesh(
                corners, new int[] {0, 1, 2}, new int[1], new String[] {null}, null, null, 0));
        refuses(argument, () -> Native.sceneFromMesh(
                corners, new int[] {0, 1, 2}, new int[] {5}, new String[] {"a"}, null, null, 0));
        refuses(argument, () -> Native.sceneFromMesh(corners, new int[] {0, 1, 2}, null, null, "[what", null, 0));
        refuses(argument, () -> Native.sceneFromMesh(
                corners, new int[] {0, 1, 2}, null, null, null, new double[] {0, 1, -500, 50, 100, 0.5, 40, -1, 1e6}, 0));
        refuses(none, () -> Native.sceneFromFile(null, null, null, 0));
        refuses(java.io.IOException.class, () -> Native.sceneFromFile("/no/such\u0000 file \ud83d\ude00.obj", null, null, 0));
        refuses(argument, () -> Native.sceneInfo(scene, new double[1]));
        refuses(none, () -> Native.sceneInfo(scene, null));
        refuses(argument, () -> Native.engineSetPropagation(engine, new double[] {0, 1, 0, 0}));
        refuses(argument, () -> Native.engineSetPropagation(engine, new double[] {1, 1, -1, 0}));
        refuses(argument, () -> Native.engineSetPropagation(engine, new double[] {1, 1, 1, 3}));
        refuses(argument, () -> Native.engineSetPropagation(engine, new double[3]));
        refuses(argument, () -> Native.engineSetPredictor(engine, 3));
        refuses(argument, () -> Native.engineSetPredictor(engine, -1));
        refuses(argument, () -> Native.engineSetSchedule(engine, 2));
        refuses(argument, () -> Native.sourceSetDirectivityTable(engine, source, new float[17]));
        refuses(argument, () -> Native.sourceSetDirectivityTable(engine, source, new float[8]));
        refuses(none, () -> Native.sourceSetDirectivityTable(engine, source, null));
        Native.sourceSetDirectivityTable(engine, source, new float[16]);
        refuses(argument, () -> Native.sourceSetDistanceTable(engine, source, new float[3]));
        refuses(argument, () -> Native.sourceSetDistanceTable(engine, source, new float[] {2, 1, 1, 1}));
        refuses(none, () -> Native.sourceSetDistanceTable(engine, source, null));
        Native.sourceSetDistanceTable(engine, source, new float[] {1, 1, 8, 0.5f});
        Native.sourceSetDistanceTable(engine, source, new float[0]);
        refuses(state, () -> Native.engineCreate(Native.VERSION + 0x10000, light(), null, new long[1]));
        long progress = Native.progressCreate();
        if (Native.progressRead(progress) != 0) throw new AssertionError("nothing is done");
        Native.progressCancel(progress);
        refuses(java.util.concurrent.CancellationException.class,
                () -> Native.sceneFromMesh(corners, new int[] {0, 1, 2}, null, null, null, null, progress));
        Native.close(progress);
        refuses(state, () -> Native.progressRead(progress));
        refuses(argument, () -> Native.progressCancel(scene));
        // More names than a frame of local references holds.
        String[] names = new String[200];
        for (int i = 0; i < names.length; i++) names[i] = "material " + i;
        Native.close(Native.sceneFromMesh(corners, new int[] {0, 1, 2}, new int[] {199}, names, null, null, 0));
        // Memory that may not be written to.
        refuses(argument, () -> Native.render(renderer, block.asReadOnlyBuffer(), 64));
        Path file = Files.createTempFile("foresound", ".raw");
        Files.write(file, new byte[8192]);
        try (var channel = FileChannel.open(file)) {
            ByteBuffer mapped = channel.map(FileChannel.MapMode.READ_ONLY, 0, 8192);
            refuses(argument, () -> Native.render(renderer, mapped, 64));
        }
        Files.delete(file);
        // Budget, health and paths.
        Native.engineSetBudget(engine, null);
        refuses(argument, () -> Native.engineSetBudget(engine, new double[3]));
        for (double[] wrong : new double[][] {
            {6, 0, 0, 0, 0}, {300, 0, 0, 0, 0}, {-1, 0, 0, 0, 0}, {0, 2, 0, 0, 0}, {0, 0, 1, 0, 0}, {0, 0, 0, Double.NaN, 0},
            {0, 0, 0, -1, 0}, {0, 0, 0, 1e300, 0}, {0, 0, 0, 0, Double.NaN}, {0, 0, 0, 0, -0.5},
            {0, 0, 0, 0, Double.POSITIVE_INFINITY},
        }) refuses(argument, () -> Native.engineSetBudget(engine, wrong));
        Native.engineSetBudget(engine, new double[] {5, 1, 0, 0.02, 0.5});
        refuses(none, () -> Native.engineHealth(engine, null));
        refuses(argument, () -> Native.engineHealth(engine, new double[1]));
        refuses(none, () -> Native.enginePaths(engine, null));
        refuses(none, () -> Native.sourcePaths(engine, source, null));
        refuses(none, () -> Native.sourceNumbers(engine, source, null));
        refuses(argument, () -> Native.sourceNumbers(engine, source, new double[1]));
        if (Native.engineTakeNumbers(engine) != 0) throw new AssertionError("a frame before the first");
        Native.sourceNumbers(engine, source, new double[Native.SourceNumbers.LENGTH]);
        if (Native.sourcePaths(engine, source, new double[0]) != 0) throw new AssertionError("a path in no array");
        if (Native.enginePaths(engine, new double[Native.ShownPath.LENGTH - 1]) != 0) throw new AssertionError("a path in a short array");
        // The host's silent device.
        long output = Native.outputStart(renderer, 2);
        refuses(state, () -> Native.render(renderer, block, 1));
        double[] info = new double[Native.OutputInfo.LENGTH];
        for (int i = 0; i < 100 && info[Native.OutputInfo.CALLBACKS] == 0; i++) {
            Thread.sleep(50);
            Native.outputInfo(output, info);
        }
        boolean plays = info[Native.OutputInfo.PLAYING] == 1 && info[Native.OutputInfo.RATE_HZ] == RATE_HZ;
        if (!plays || info[Native.OutputInfo.OPENED] != 1) throw new AssertionError(Arrays.toString(info));
        for (long open : new long[] {output, stream, clip, scene, engine}) {
            Native.close(open);
            refuses(state, () -> Native.close(open));
        }
        for (Call call : engineCalls(engine, source, scene, clip, frame)) refuses(state, call);
        System.out.printf("abuse refused %d%n", refused);
    }

    /** Every method that takes an engine. */
    static Call[] engineCalls(long engine, int source, long scene, long clip, ByteBuffer frame) {
        return new Call[] {
            () -> Native.engineTick(engine, frame, 0),
            () -> Native.engineSetScene(engine, scene),
            () -> Native.engineSetPropagation(engine, new double[] {1, 1, 1, 1}),
            () -> Native.engineSetPredictor(engine, 0),
            () -> Native.engineSetSchedule(engine, 0),
            () -> Native.sourceSetDirectivityTable(engine, source, new float[16]),
            () -> Native.enginePause(engine),
            () -> Native.engineResume(engine),
            () -> Native.engineRestart(engine),
            () -> Native.engineStatistics(engine, new double[Native.EngineStatistics.LENGTH]),
            () -> Native.engineSetBudget(engine, new double[Native.BudgetOptions.LENGTH]),
            () -> Native.engineHealth(engine, new double[Native.EngineHealth.LENGTH]),
            () -> Native.enginePaths(engine, new double[Native.ShownPath.LENGTH]),
            () -> Native.sourcePlayClip(engine, source, clip, null),
            () -> Native.enginePlayOnce(engine, clip, 0, 0, 0, null, null),
            () -> Native.sourcePlayback(engine, source, new double[Native.Playback.LENGTH]),
            () -> Native.sourcePause(engine, source, true),
            () -> Native.sourceSeek(engine, source, 0),
            () -> Native.sourceSetPitch(engine, source, 1),
            () -> Native.sourceFadeGain(engine, source, 1, 1),
            () -> Native.engineTakeNumbers(engine),
            () -> Native.engineSetMaterial(engine, "wood", null),
            () -> Native.sourceNumbers(engine, source, new double[Native.SourceNumbers.LENGTH]),
            () -> Native.sourcePaths(engine, source, new double[Native.SourcePath.LENGTH]),
            () -> Native.sourceSetDistanceTable(engine, source, new float[0]),
            () -> Native.sourceAdd(engine, 0, 0, 0),
            () -> Native.sourceRemove(engine, source),
            () -> Native.sourceConfigure(engine, source, new double[Native.SourceOptions.LENGTH]),
            () -> Native.instanceAdd(engine, scene, at(0, 0, 0)),
            () -> Native.instanceAddJoined(engine, scene, at(0, 0, 0)),
            () -> Native.instanceMove(engine, 0, at(0, 0, 0)),
            () -> Native.instanceRemove(engine, 0),
            () -> Native.sourceSetGain(engine, source, 1),
            () -> Native.sourceMute(engine, source, true),
            () -> Native.sourcePlay(engine, source, clip, true),
            () -> Native.sourceStop(engine, source),
            () -> Native.sourceStream(engine, source, 10),
        };
    }

    /** Every method that takes a handle. */
    static Call[] calls(long wrong, int source, long scene, long clip, ByteBuffer frame, ByteBuffer block) {
        Call[] engine = engineCalls(wrong, source, scene, clip, frame);
        Call[] rest = {
            () -> Native.close(wrong),
            () -> Native.sceneInfo(wrong, new double[Native.SceneInfo.LENGTH]),
            () -> Native.streamWrite(wrong, block, 1),
            () -> Native.render(wrong, block, 1),
            () -> Native.rendererLatency(wrong),
            () -> Native.outputStart(wrong, 2),
            () -> Native.outputInfo(wrong, new double[Native.OutputInfo.LENGTH]),
        };
        Call[] all = Arrays.copyOf(engine, engine.length + rest.length);
        System.arraycopy(rest, 0, all, engine.length, rest.length);
        return all;
    }

    static long residentKilobytes() throws Exception {
        for (String line : Files.readAllLines(Path.of("/proc/self/status"))) {
            if (line.startsWith("VmRSS:")) return Long.parseLong(line.replaceAll("[^0-9]", ""));
        }
        throw new AssertionError("no VmRSS");
    }

    /** Creates and closes clips and scenes, and an engine now and then. */
    static void cycles(int count) throws Exception {
        float[] samples = new float[64];
        float[] corners = {0, 0, 0, 1, 0, 0, 0, 0, 1};
        int[] indices = {0, 1, 2};
        long[] handle = new long[1];
        long before = 0;
        int engines = 0, scenes = 0;
        for (int n = 0; n < count; n++) {
            // A tenth to warm up: heaps grow to their size.
            if (n == count / 10) before = residentKilobytes();
            long clip = Native.clipFromSamples(samples, RATE_HZ, RATE_HZ);
            Native.close(clip);
            try {
                Native.close(clip);
                throw new AssertionError("closed twice");
            } catch (IllegalStateException closed) {
                // Expected.
            }
            if (n % 50 == 0) {
                Native.close(Native.sceneFromMesh(corners, indices, null, null, null, null, 0));
                scenes++;
            }
            if (n % 500 == 0) {
                long renderer = Native.engineCreate(Native.VERSION, light(), null, handle);
                Native.close(n % 1000 == 0 ? handle[0] : renderer);
                Native.close(n % 1000 == 0 ? renderer : handle[0]);
                engines++;
            }
        }
        long grown = residentKilobytes() - before;
        System.out.printf("cycles clips %d scenes %d engines %d grown_kB %d%n", count, scenes, engines, grown);
        // A leak of 64 bytes a clip is 5.8 MB. Java's own heap has been touched before.
        if (grown > 4_000) throw new AssertionError("memory grows");
    }

    /** Eight threads on one engine, one of which closes it during the others' calls. */
    static void threads() throws Exception {
        for (int round = 0; round < 10; round++) {
            double[] options = light();
            options[Native.Options.MAX_SOURCES] = 16;
            options[Native.Options.SCHEDULE] = round % 2;
            long[] handle = new long[1];
            long renderer = Native.engineCreate(Native.VERSION, options, null, handle), engine = handle[0];
            int source = Native.sourceAdd(engine, 0, 1, 0);
            AtomicInteger done = new AtomicInteger(), refusals = new AtomicInteger();
            Thread[] threads = new Thread[8];
            for (int t = 0; t < threads.length; t++) {
                final int own = t;
                threads[t] = new Thread(() -> {
                    ByteBuffer frame = direct(64), block = direct(512);
                    double[] numbers = new double[Native.EngineStatistics.LENGTH];
                    for (int n = 0; n < 300; n++) {
                        try {
                            switch ((own + n) % 6) {
                                case 0, 1 -> {
                                    pose(frame, 0, 0, n * 0.01f, 1, 0, 0);
                                    pose(frame, 1, source, 0, 1, 0, 0);
                                    Native.engineTick(engine, frame, 1);
                                }
                                case 2 -> Native.render(renderer, block, 64);
                                case 3 -> Native.engineStatistics(engine, numbers);
                                case 4 -> Native.sourceRemove(engine, Native.sourceAdd(engine, 1, 1, 1));
                                default -> Native.sourceSetGain(engine, source, 0.5f);
                            }
                            done.incrementAndGet();
                        } catch (IllegalStateException busyOrClosed) {
                            refusals.incrementAndGet();
                        }
                        if (own == 0 && n == 250) Native.close(engine);
                    }
                });
            }
            for (Thread thread : threads) thread.start();
            for (Thread thread : threads) thread.join();
            Native.close(renderer);
            if (done.get() + refusals.get() != 2400 || done.get() < 100)
                throw new AssertionError(done + " done, " + refusals + " refused");
            if (round == 9) System.out.printf("threads calls %d refused %d%n", done.get(), refusals.get());
        }
    }

    /** Sixteen sources a frame: time of a tick, and Java's allocations in it. */
    static void tick() throws Exception {
        double[] options = options();
        options[Native.Options.GUIDE_RAYS] = 64;
        options[Native.Options.SOURCE_RAYS] = 16;
        long[] handle = new long[1];
        long renderer = Native.engineCreate(Native.VERSION, options, null, handle), engine = handle[0];
        final int sources = 16;
        ByteBuffer frame = direct((sources + 1) * Native.POSE_BYTES);
        int[] ids = new int[sources];
        for (int i = 0; i < sources; i++) ids[i] = Native.sourceAdd(engine, i, 1.5f, -5);
        final int warm = 30_000, count = 20_000;
        long[] times = new long[count];
        var threads = (com.sun.management.ThreadMXBean) java.lang.management.ManagementFactory.getThreadMXBean();
        long allocated = 0;
        threads.getCurrentThreadAllocatedBytes();
        for (int n = -warm; n < count; n++) {
            if (n == 0) allocated = threads.getCurrentThreadAllocatedBytes();
            long started = System.nanoTime();
            pose(frame, 0, 0, 0.001f * (n & 1023), 1.6f, 0, 0);
            for (int i = 0; i < sources; i++) pose(frame, i + 1, ids[i], i, 1.5f, -5 + 0.001f * (n & 1023), 0);
            Native.engineTick(engine, frame, sources);
            if (n >= 0) times[n] = System.nanoTime() - started;
        }
        allocated = threads.getCurrentThreadAllocatedBytes() - allocated;
        Native.close(engine);
        Native.close(renderer);
        Arrays.sort(times);
        System.out.printf(
                "tick sources %d p50_us %.2f p95_us %.2f p99_us %.2f worst_us %.1f java_bytes_a_frame %.4f%n",
                sources, times[count / 2] * 1e-3, times[count * 95 / 100] * 1e-3, times[count * 99 / 100] * 1e-3,
                times[count - 1] * 1e-3, (double) allocated / count);
        // The measurement itself allocates once.
        if (allocated > 2000) throw new AssertionError(allocated + " bytes");
    }
}
