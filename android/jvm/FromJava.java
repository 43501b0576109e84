import dev.foresound.*;
import java.io.File;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.util.Arrays;
import java.util.Collections;

/**
 * The Kotlin interface from Java: constructors with fewer arguments, properties, loaders that block, progress from another
 * thread, and objects that are forgotten. One argument: the folder of the repository's assets.
 */
public final class FromJava {
    private FromJava() {}

    /** An engine that plays a clip in a scene, of which only the engine is kept. */
    private static float render(File assets) throws Exception {
        EngineOptions options = new EngineOptions(48_000, 4);
        options.setSchedule(Schedule.SYNCHRONOUS);
        options.setGuideRays(64);
        options.setSourceSlots(2);
        options.setLimiter(false);
        options.setFrameSeconds(1.0 / 60.0);
        float loudest = 0;
        try (Engine engine = new Engine(options)) {
            SceneOptions weather = new SceneOptions();
            weather.setTemperatureC(-10f);
            weather.setHumidityPercent(80f);
            try (Scene scene = Scene.loadFile(new File(assets, "scenes/doorway.obj"), null, weather)) {
                // 331.3 + 0.606 x -10 m/s, to half a metre.
                if (Math.abs(scene.getInfo().getSpeedOfSoundMS() - 325.3) > 0.5) throw new AssertionError("the weather is not in force");
                engine.setScene(scene);
            }
            SceneOptions large = new SceneOptions(UpAxis.Z, 2f);
            try (Scene scene = Scene.loadFile(new File(assets, "scenes/doorway.obj"), null, large)) {
                if (scene.getInfo().getTriangles() < 100) throw new AssertionError("no triangles");
            }
            Source voice = engine.addSource(5f, 1.5f, 3f);
            try (Clip clip = Clip.loadFile(new File(assets, "speech/voice01.wav"), engine.getRateHz())) {
                voice.play(clip, true);
            }
            voice.setDirectivityTable(Arrays.asList(new float[8], new float[8]));
            voice.setDirectivityTable(Collections.emptyList());
            engine.setPropagation(32, 16, 2);
            engine.setPredictor(Predictor.LINEAR);
            engine.setBudget(new Budget(0.02));
            engine.getListener().set(6.5f, 1.6f, 2f);
            ByteBuffer block = ByteBuffer.allocateDirect(2 * 800 * 4).order(ByteOrder.nativeOrder());
            for (int frame = 0; frame < 30; frame++) {
                engine.tick();
                engine.render(block, 800);
                for (int n = 0; n < 1600; n++) loudest = Math.max(loudest, Math.abs(block.getFloat(4 * n)));
            }
        }
        return loudest;
    }

    /** Cancelled by another thread. */
    private static void cancelled(File assets) throws Exception {
        try (Progress progress = new Progress()) {
            new Thread(progress::cancel).start();
            while (true) {
                try (Scene scene = Scene.loadFile(new File(assets, "scenes/doorway.obj"), null, new SceneOptions(), progress)) {
                    if (progress.getDone() != 1f) throw new AssertionError("a scene at " + progress.getDone());
                } catch (java.util.concurrent.CancellationException ended) {
                    return;
                }
            }
        }
    }

    /** Objects without a reference: their handles are closed some time later. */
    private static void forget() {
        for (int n = 0; n < 20; n++) {
            Clip.loadSamples(new float[100], 48_000, 48_000);
            new Engine(new EngineOptions(48_000, 1)).addSource(0f, 1f, 0f).stream(64);
        }
    }

    public static void main(String[] arguments) throws Exception {
        File assets = new File(arguments[0]);
        float loudest = render(assets);
        if (!(loudest > 1e-3f)) throw new AssertionError("silent: " + loudest);
        cancelled(assets);
        forget();
        int open = OpenHandles.count();
        for (int n = 0; n < 100 && open > 0; n++) {
            System.gc();
            Thread.sleep(50);
            open = OpenHandles.count();
        }
        if (open > 0) throw new AssertionError(open + " handles of forgotten objects are open");
        System.out.println("java: loaders, options, cancellation; 60 forgotten objects closed");
    }
}
