package dev.foresound

import java.nio.ByteBuffer
import java.nio.ByteOrder
import kotlinx.coroutines.CoroutineDispatcher
import kotlinx.coroutines.Dispatchers
import kotlinx.coroutines.delay
import kotlinx.coroutines.flow.Flow
import kotlinx.coroutines.flow.flow
import kotlinx.coroutines.flow.flowOn

/**
 * An engine: sources and a listener in a scene, and the sound of it.
 *
 * Threads: any, but not an audio callback of your own; calls on one engine wait for each other. Create and close it
 * off the main thread, both take milliseconds. Propagation and sound run on threads of the library's own and never
 * meet the virtual machine.
 *
 * Everything throws [IllegalStateException] once the engine is closed, and [IllegalArgumentException] for numbers that
 * cannot be, with a text that says what to do.
 *
 * ```
 * Engine(EngineOptions(rateHz = deviceRate)).use { engine ->
 *     engine.setScene(Scene.fromAsset(context, "hall.obj"))
 *     val fountain = engine.addSource(1f, 1.5f, -4f)
 *     fountain.play(Clip.fromAsset(context, "fountain.wav", engine.rateHz), looped = true)
 *     engine.start()
 *     // every frame:
 *     engine.listener.set(x, y, z)
 *     engine.tick()
 * }
 * ```
 */
class Engine(options: EngineOptions = EngineOptions()) : AutoCloseable {
    /** Sample rate in Hz; clips are made for it. */
    val rateHz: Int = options.rateHz

    private val handle: Long
    private val rendererHandle: Long
    private var output = 0L
    private var playing = false
    private var closed = false
    private val pathFloats = FloatArray(options.shownPaths * Native.PATH_FLOATS)
    private val sources = arrayOfNulls<Source>(options.maxSources)
    private val frame: ByteBuffer =
        ByteBuffer.allocateDirect((options.maxSources + 1) * Native.POSE_BYTES).order(ByteOrder.nativeOrder())

    /** Where the listener is, from the next [tick] on. */
    val listener = Listener()

    init {
        val handles = LongArray(2)
        Native.create(options.numbers(), options.hrtf, handles)
        handle = handles[0]
        rendererHandle = handles[1]
    }

    /** Adds a silent source at a place in metres. Throws [IllegalStateException] if there are `maxSources` already. */
    @Synchronized
    fun addSource(x: Float, y: Float, z: Float): Source {
        val id = Native.addSource(handle, x, y, z)
        return Source(this, id, x, y, z).also { sources[id and 0xffff] = it }
    }

    @Synchronized
    internal fun remove(source: Source) {
        val slot = source.id and 0xffff
        if (sources[slot] !== source) return
        sources[slot] = null
        Native.removeSource(handle, source.id)
    }

    /**
     * Hands over one graphics frame: listener and every source that has moved since the last one. Call it once a frame,
     * best from the thread that draws: it waits for nothing and allocates nothing.
     */
    @Synchronized
    fun tick() {
        frame.clear()
        listener.pose.write(frame, 0)
        var count = 0
        for (source in sources) {
            if (source != null && source.takeMoved()) {
                source.pose.write(frame, source.id)
                count++
            }
        }
        Native.tick(handle, frame, count)
    }

    /** Replaces the scene; the old one is heard until the new one's first update is there. [scene] may be closed then. */
    fun setScene(scene: Scene) = Native.setScene(handle, scene.handle)

    /** Sets what propagation may spend: rays from the listener and from each source, and the highest order (0 to 4). */
    fun setPropagation(guideRays: Int, sourceRays: Int, depth: Int) =
        Native.setPropagation(handle, guideRays, sourceRays, depth)

    /**
     * Plays on the system's device, rendered [blocksAhead] blocks ahead (1 to 64). Once an engine. A device that is lost,
     * or does not open, is opened again by the library.
     */
    @Synchronized
    fun start(blocksAhead: Int = 2) {
        check(!playing) { "the engine plays already; pause and resume it" }
        output = Native.startOutput(rendererHandle, blocksAhead)
        playing = true
    }

    /**
     * Renders [frames] audio frames of interleaved stereo into a direct buffer of floats in native order, for apps that
     * play sound themselves; gives the number of voices. One thread at a time; never waits. Not after [start].
     */
    fun render(buffer: ByteBuffer, frames: Int): Int = Native.render(rendererHandle, buffer, frames)

    /** Fades to silence within milliseconds; sounds stand still. Call it when the app loses audio focus or its window. */
    fun pause() = Native.pause(handle)

    /** Goes on where [pause] stopped. */
    fun resume() = Native.resume(handle)

    /** Starts propagation anew after [EngineState.PROPAGATION_FAILED]. */
    fun restart() = Native.restart(handle)

    /** A look at the engine. */
    fun statistics(): Statistics {
        val numbers = DoubleArray(Native.STATISTICS)
        Native.statistics(handle, numbers)
        return Statistics(numbers)
    }

    /**
     * Looks at the engine now and then, at most ten times a second, until it is closed; collect it on any thread. The
     * looks themselves happen on [dispatcher].
     */
    fun statisticsFlow(
        periodMillis: Long = 500,
        dispatcher: CoroutineDispatcher = Dispatchers.Default,
    ): Flow<Statistics> = flow {
        while (true) {
            val now = try {
                statistics()
            } catch (gone: IllegalStateException) {
                if (closed) return@flow
                throw gone
            }
            emit(now)
            delay(periodMillis.coerceAtLeast(SHORTEST_PERIOD_MILLIS))
        }
    }.flowOn(dispatcher)

    /** Says what the engine may spend, from the next update on: it gives up rays, orders and paths to keep to it. */
    fun setBudget(budget: Budget) = Native.setBudget(handle, budget.numbers())

    /** How the engine bears its load, and the phone its heat. */
    fun health(): Health {
        val numbers = DoubleArray(Native.HEALTH)
        Native.health(handle, numbers)
        return Health(numbers)
    }

    /** The loudest paths of the newest update for a picture, [EngineOptions.shownPaths] at most, in no order. */
    @Synchronized
    fun paths(): List<ShownPath> {
        val count = Native.paths(handle, pathFloats)
        return List(count) { ShownPath(pathFloats, it * Native.PATH_FLOATS) }
    }

    /** What the device granted, and how it goes; `null` before [start]. */
    @Synchronized
    fun outputReport(): OutputReport? {
        if (!playing) return null
        val numbers = DoubleArray(Native.OUTPUT_INFO)
        Native.outputInfo(output, numbers)
        return OutputReport(numbers)
    }

    /**
     * Adds an instance of a part of the scene that moves, such as a door, at a place in metres, from the next [tick] on.
     * [part] is a scene of its own in coordinates of its own, a door's hinge at their origin; it may be closed then, and
     * several instances may share it. Instances stay when the scene is replaced.
     */
    fun addInstance(part: Scene, x: Float, y: Float, z: Float): Instance =
        Instance(this, Native.addInstance(handle, part.handle, x, y, z), x, y, z)

    internal fun move(id: Int, pose: FloatArray) =
        Native.moveInstance(handle, id, pose[0], pose[1], pose[2], pose[3], pose[4], pose[5], pose[6])

    internal fun removeInstance(id: Int) = Native.removeInstance(handle, id)

    internal fun configure(id: Int, options: DoubleArray) = Native.configureSource(handle, id, options)

    internal fun setGain(id: Int, gain: Float) = Native.setGain(handle, id, gain)

    internal fun mute(id: Int, muted: Boolean) = Native.mute(handle, id, muted)

    internal fun play(id: Int, clip: Clip, looped: Boolean) = Native.play(handle, id, clip.handle, looped)

    internal fun stop(id: Int) = Native.stop(handle, id)

    internal fun stream(id: Int, capacity: Int): Long = Native.stream(handle, id, capacity)

    /** Ends sound and threads, after the propagation update under way. Closing twice is nothing. */
    @Synchronized
    override fun close() {
        if (closed) return
        closed = true
        Native.close(if (playing) output else rendererHandle)
        Native.close(handle)
    }

    private companion object {
        const val SHORTEST_PERIOD_MILLIS = 100L
    }
}
