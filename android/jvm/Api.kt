package dev.foresound

import android.content.Context
import java.io.File
import java.io.IOException
import java.nio.ByteBuffer
import java.nio.ByteOrder
import kotlinx.coroutines.Dispatchers
import kotlinx.coroutines.async
import kotlinx.coroutines.flow.take
import kotlinx.coroutines.flow.toList
import kotlinx.coroutines.launch
import kotlinx.coroutines.runBlocking

private inline fun <reified E : Throwable> refuses(call: () -> Unit) {
    try {
        call()
    } catch (thrown: Throwable) {
        check(thrown is E && (thrown.message ?: "").length > 5) { "$thrown instead of ${E::class}" }
        return
    }
    error("no exception: ${E::class}")
}

/** Sources rendered apart, for a mixer of the app's own. */
private fun sourcesApart() {
    val options = EngineOptions(
        maxSources = 2,
        blockFrames = 800,
        guideRays = 16,
        sourceRays = 16,
        schedule = Schedule.SYNCHRONOUS,
        frameSeconds = 1.0 / 60.0,
        sourceBuses = true,
    )
    fun direct(floats: Int) = ByteBuffer.allocateDirect(4 * floats).order(ByteOrder.nativeOrder())
    fun loudest(buffer: ByteBuffer) = (0 until 1600).maxOf { Math.abs(buffer.getFloat(4 * it)) }
    val (dry, bus, rest) = Triple(direct(800), direct(1600), direct(1600))
    for (n in 0 until 800) dry.putFloat(4 * n, Math.sin(0.05 * n).toFloat())
    Engine(options).use { engine ->
        val near = engine.addSource(0f, 0f, -2f)
        refuses<IllegalStateException> { engine.renderReverb(rest, 800) }
        refuses<IllegalArgumentException> { engine.beginBlock(801) }
        for (frame in 0 until 10) {
            engine.tick()
            engine.beginBlock(800)
            if (frame >= 5) {
                check(engine.renderSource(near, dry, bus, 800) == Bus.OWN)
                refuses<IllegalStateException> { engine.renderSource(near, dry, bus, 800) }
                refuses<IllegalArgumentException> { engine.renderSource(near, dry, bus, 799) }
                refuses<IllegalArgumentException> { engine.renderSource(near, direct(4), bus, 800) }
            }
            engine.renderReverb(rest, 800)
        }
        engine.beginBlock(800)
        check(engine.renderSource(near, null, bus, 800) == Bus.OWN && loudest(bus) > 0f)
        engine.renderReverb(rest, 800)
    }
    Engine(EngineOptions(maxSources = 1)).use { engine ->
        refuses<IllegalStateException> { engine.beginBlock(64) }
    }
}

/** A pose that is refused costs neither the graphics frame nor what has moved in it. */
private fun refusedListener() {
    val options = EngineOptions(
        maxSources = 1,
        guideRays = 16,
        sourceRays = 16,
        schedule = Schedule.SYNCHRONOUS,
        frameSeconds = 1.0 / 60.0,
        listeners = 2,
    )
    val buffer = ByteBuffer.allocateDirect(2 * 800 * 4).order(ByteOrder.nativeOrder())
    Engine(options).use { engine ->
        val source = engine.addSource(0f, 0f, -2f)
        engine.tick()
        engine.takeNumbers()
        source.set(0f, 0f, -200f)
        engine.listeners[1].set(Float.NaN, 0f, 0f)
        refuses<IllegalArgumentException> { engine.tick() }
        repeat(3) { engine.render(buffer, 800) }
        check(engine.takeNumbers() == 2) { "the frame is lost" }
        check(source.paths().single().delaySeconds > 0.5) { "the source has not moved" }
    }
}

/** A one-shot is moved until its end; what the game does with it afterwards disturbs nothing, and its slot serves another one. */
private fun followedOneShot() {
    val options = EngineOptions(
        maxSources = 1,
        guideRays = 16,
        sourceRays = 16,
        schedule = Schedule.SYNCHRONOUS,
        frameSeconds = 1.0 / 60.0,
        maxDelaySeconds = 0.05,
    )
    val buffer = ByteBuffer.allocateDirect(2 * 800 * 4).order(ByteOrder.nativeOrder())
    Engine(options).use { engine ->
        fun frame() {
            engine.tick()
            engine.render(buffer, 800)
        }
        val clip = Clip.loadStereoSamples(FloatArray(16_000) { 0.1f }, 48_000, 48_000)
        val first = engine.playOnce(clip, 0f, 0f, -2f)
        frame()
        first.set(0f, 0f, -10f)
        frame()
        engine.takeNumbers()
        frame()
        engine.takeNumbers()
        check(first.paths().single().delaySeconds > 0.02) { "the one-shot has not moved" }
        check(first.playback().state == PlaybackState.PLAYING)
        // Its end: the clip's ten frames, its paths and the late reverb.
        repeat(120) {
            first.set(0f, 0f, -10f - it)
            frame()
        }
        check(engine.statistics().sources == 0)
        refuses<IllegalArgumentException> { first.setGain(1f) }
        val second = engine.playOnce(clip, 0f, 0f, -2f, PlayOptions(looped = true))
        first.set(0f, 0f, -5f)
        first.close()
        frame()
        check(engine.statistics().sources == 1)
        second.close()
        frame()
        check(engine.statistics().sources == 0)
        val third = engine.playOnce(clip, 0f, 0f, -2f)
        repeat(120) { frame() }
        third.set(0f, 0f, -5f)
        frame()
        third.close()
        clip.close()
    }
}

/** A handle that fails leaves none of the others open, and does not end the thread that closes forgotten objects. */
private fun failingHandles() {
    val closed = Native.progressCreate()
    Native.close(closed)
    val open = Native.progressCreate()
    refuses<IllegalStateException> { Handles(closed, open).close() }
    refuses<IllegalStateException> { Native.close(open) }
    for (handle in listOf(closed, Native.progressCreate())) {
        Cleaner.watch(Any(), Handles(handle))
        for (n in 0 until 20) {
            System.gc()
            Thread.sleep(10)
        }
    }
}

/** Calls every function of the Kotlin interface on a host. One argument: the folder of the repository's assets. */
fun main(arguments: Array<String>) = runBlocking(Dispatchers.Default) {
    val context = Context(File(arguments[0]))
    val options = EngineOptions(
        rateHz = 48_000,
        maxSources = 4,
        guideRays = 64,
        depth = 2,
        schedule = Schedule.SYNCHRONOUS,
        predictor = Predictor.GEOMETRIC,
        frameSeconds = 1.0 / 60.0,
        shownPaths = 40,
    )
    refuses<IllegalArgumentException> { EngineOptions(maxSources = -1) }
    refuses<IllegalArgumentException> { EngineOptions(maxSources = Int.MAX_VALUE) }
    refuses<IllegalArgumentException> { EngineOptions(shownPaths = -1) }
    refuses<IllegalArgumentException> { Engine(EngineOptions(rateHz = -1)).close() }
    refuses<IllegalArgumentException> { Engine(EngineOptions(frameSeconds = Double.NaN)).close() }
    refuses<IOException> { Scene.fromAsset(context, "scenes/no_such.obj").close() }
    refuses<IOException> { Clip.fromAsset(context, "no_such.wav", 48_000).close() }
    var last = 0
    Engine(options).use { engine ->
        val scene = async { Scene.fromAsset(context, "scenes/doorway.obj") }
        val clip = async { Clip.fromAsset(context, "speech/voice01.wav", engine.rateHz) }
        scene.await().use {
            check(it.info.triangles > 100 && it.info.boundsMaxM[0] > 10)
            engine.setScene(it)
        }
        val voice = engine.addSource(5f, 1.5f, 3f)
        clip.await().use { voice.play(it, looped = true) }
        voice.configure(SourceOptions(lateReverb = false, directivity = FloatArray(8) { 0.5f }))
        refuses<IllegalArgumentException> { voice.configure(SourceOptions(occlusion = 2f)) }
        refuses<IllegalArgumentException> { voice.configure(SourceOptions(priority = 256)) }
        refuses<IllegalArgumentException> { voice.configure(SourceOptions(extentM = floatArrayOf(1f, -1f, 0f))) }
        refuses<IllegalArgumentException> { voice.configure(SourceOptions(extentPoints = 3)) }
        voice.configure(SourceOptions(extentM = floatArrayOf(0.5f, 0.3f, 2f)))
        refuses<IllegalArgumentException> {
            voice.configure(SourceOptions(distanceCurve = DistanceCurve.LINEAR, distanceMinM = 9f, distanceMaxM = 3f))
        }
        refuses<IllegalArgumentException> { voice.setDistanceTable(listOf(2f to 1f, 1f to 1f)) }
        voice.setDistanceTable(listOf(1f to 1f, 20f to 0.5f))
        voice.setGain(0.8f)
        val buffer = ByteBuffer.allocateDirect(2 * 800 * 4).order(ByteOrder.nativeOrder())
        check(engine.takeNumbers() == 0 && voice.numbers().pathCount == 0)
        refuses<IllegalArgumentException> { voice.paths(-1) }
        var loudest = 0f
        for (frame in 0 until 30) {
            engine.listener.set(6.5f, 1.6f, 2f + 0.02f * frame)
            engine.listener.turn(0f, 0.1f, 0f, 1f)
            voice.set(5f, 1.5f, 3f - 0.01f * frame)
            engine.tick()
            last = engine.render(buffer, 800)
            for (n in 0 until 1600) loudest = maxOf(loudest, Math.abs(buffer.getFloat(4 * n)))
        }
        check(loudest > 1e-3f) { "silent: $loudest" }
        check(voice.playback().state == PlaybackState.PLAYING && voice.playback().engineFrame == 24_000L) { "${voice.playback().engineFrame}" }
        refuses<IllegalArgumentException> { voice.setPitch(9f) }
        refuses<IllegalArgumentException> { voice.fadeGain(1f, -1f) }
        Clip.loadStereoSamples(FloatArray(2000) { 0.1f }, 48_000, 48_000).use { short ->
            refuses<IllegalArgumentException> { voice.play(short, PlayOptions(looped = true, loopStart = 5, loopEnd = 5)) }
            refuses<IllegalArgumentException> { voice.play(short, PlayOptions(firstFrame = 1001)) }
            engine.playOnce(short, 5f, 1.5f, 3f)
        }
        voice.fadeGain(0.8f, 0.1f)
        val half = FloatArray(8) { 0.5f }
        refuses<IllegalArgumentException> { engine.setMaterial("no such material", half, half, half) }
        refuses<IllegalArgumentException> { engine.setMaterial("concrete", half, half, FloatArray(8) { 0.9f }) }
        check(engine.takeNumbers() >= 28)
        val numbers = voice.numbers()
        val arrivals = voice.paths()
        check(numbers.pathCount == arrivals.size && arrivals.count { it.kind <= PathKind.TRANSMITTED } == 1) { "$arrivals" }
        check(arrivals.all { it.delaySeconds > 0 && Math.abs(it.arrival.sumOf { x -> (x * x).toDouble() } - 1) < 1e-3 })
        val now = engine.statistics()
        check(now.state == EngineState.RUNNING && now.updates == 30L && now.sources == 2) { "${now.updates} ${now.sources}" } // the voice and the one-shot

        val lines = engine.paths()
        check(lines.size in 2..40 && lines.all { it.corners.size in 6..18 && it.corners.size % 3 == 0 }) { "$lines" }
        val direct = lines.single { it.reflections == 0 && it.diffractionOrder == 0 }
        check(Math.abs(direct.corners[2] - 2.71f) < 1e-4 && Math.abs(direct.corners[3] - 6.5f) < 1e-4)
        val health = engine.health()
        check(health.qualityLevel == 0 && health.thermalHeadroom == null && health.thermalStatus == null && health.rays > 64)
        engine.setBudget(Budget(qualityLevel = 3, fixed = true))
        engine.tick()
        check(engine.health().qualityLevel == 3) { "${engine.health().qualityLevel}" }
        refuses<IllegalArgumentException> { engine.setBudget(Budget(qualityLevel = -1)) }
        refuses<IllegalArgumentException> { engine.setBudget(Budget(updateSeconds = Double.NaN)) }
        refuses<IllegalArgumentException> { engine.setBudget(Budget(updateSeconds = 0.0)) }
        engine.setBudget(Budget())

        // At most ten a second at any requested rate: a busy machine is slower, never faster.
        val began = System.nanoTime()
        val readings = engine.statisticsFlow(periodMillis = 1).take(3).toList()
        val took = (System.nanoTime() - began) * 1e-6
        check(readings.size == 3 && took >= 200) { "$took ms" }

        val door = Scene.fromMesh(
            floatArrayOf(0f, 0f, 0f, 2f, 0f, 0f, 2f, 2f, 0f, 0f, 2f, 0f),
            intArrayOf(0, 1, 2, 0, 2, 3),
        ).use { engine.addInstance(it, 5.5f, 0.5f, 3.6f) }
        fun loudestDb(): Float {
            engine.tick()
            engine.render(buffer, 800)
            return engine.paths().maxOf { it.levelDb }
        }
        door.turn(0f, 0.6f, 0f, 0.8f)
        val shutDb = loudestDb()
        door.set(5.5f, 0.5f, 50f)
        val openDb = loudestDb()
        check(shutDb < openDb - 3) { "$shutDb dB with the door shut, $openDb dB with it open" }
        refuses<IllegalArgumentException> { door.turn(0f, 3f, 0f, 4f) }
        refuses<IllegalArgumentException> { door.set(Float.NaN, 0f, 0f) }
        door.close()
        door.close()
        refuses<IllegalArgumentException> { door.set(0f, 0f, 0f) }

        val stream = voice.stream(64)
        check(stream.write(buffer, 100) == 64)
        voice.stop()
        engine.tick()
        engine.render(buffer, 800)
        stream.close()
        stream.close()
        voice.mute(true)
        voice.close()
        voice.close()
        refuses<IllegalArgumentException> { voice.setGain(1f) }
        refuses<IOException> { Scene.fromFile(File("/no/such.obj")).close() }
        refuses<IllegalArgumentException> { Scene.fromMesh(FloatArray(9), intArrayOf(0, 1, 5)).close() }
        refuses<IllegalArgumentException> { engine.setPropagation(0, 0, 0) }
        repeat(3) { engine.addSource(0f, 1f, 0f) } // the fourth is the one-shot: nothing was rendered since
        refuses<IllegalStateException> { engine.addSource(0f, 1f, 0f) }

        // Cancelled loads leave no handle open.
        repeat(20) { n ->
            val load = launch { Scene.fromAsset(context, "scenes/doorway.obj").close() }
            if (n % 2 == 0) Thread.sleep(1)
            load.cancel()
            load.join()
        }

        engine.pause()
        check(engine.statistics().state == EngineState.PAUSED)
        engine.resume()
        engine.start()
        refuses<IllegalStateException> { engine.start() }
        refuses<IllegalStateException> { engine.render(buffer, 1) }
        val report = checkNotNull(engine.outputReport())
        check(report.ringFrames == 2 * 256)
        val watch = launch { engine.statisticsFlow().collect { } }
        engine.close()
        // The flow ends by itself.
        watch.join()
        refuses<IllegalStateException> { engine.tick() }
    }
    sourcesApart()
    refusedListener()
    followedOneShot()
    failingHandles()
    // A cancelled load may end a moment later.
    for (n in 0 until 100) if (Native.openHandles() != 0) Thread.sleep(50)
    check(Native.openHandles() == 0) { "${Native.openHandles()} handles are left open" }
    println("kotlin voices $last")
}
