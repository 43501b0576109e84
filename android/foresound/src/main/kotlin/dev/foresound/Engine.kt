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
 * An engine: renders the sound of sources in a scene at a listener.
 *
 * Threads: any, except the app's audio callbacks; calls on one engine wait for each other. Audio callbacks may call [render],
 * [renderListeners], [beginBlock], [renderSource], [renderReverb] and [SampleStream.write] only, which never wait. Creation and
 * closing take milliseconds: not for the main thread. Propagation and sound run on the library's threads, which are not attached to
 * the virtual machine.
 *
 * A forgotten engine is closed some time after its last use. Functions throw [IllegalStateException] once the engine is closed,
 * and [IllegalArgumentException] for values out of range, with the remedy in the message.
 *
 * ```
 * Engine(EngineOptions(rateHz = deviceRate)).use { engine ->
 *     Scene.fromAsset(context, "hall.obj").use { engine.setScene(it) }
 *     val fountain = engine.addSource(1f, 1.5f, -4f)
 *     Clip.fromAsset(context, "fountain.wav", engine.rateHz).use { fountain.play(it, looped = true) }
 *     engine.start()
 *     // every frame:
 *     engine.listener.set(x, y, z)
 *     engine.tick()
 * }
 * ```
 */
class Engine @JvmOverloads constructor(options: EngineOptions = EngineOptions()) : AutoCloseable {
    /** Sample rate in Hz, which clips need too. */
    val rateHz: Int = options.rateHz

    private val handle: Long
    private val rendererHandle: Long
    private val handles: Handles
    private var output = 0L
    private var playing = false
    private val playbackNumbers = DoubleArray(Native.Playback.LENGTH)
    private val pathNumbers = DoubleArray(options.shownPaths * Native.ShownPath.LENGTH)
    private val sources = arrayOfNulls<Source>(options.maxSources)
    private val frame: ByteBuffer =
        ByteBuffer.allocateDirect((options.maxSources + 1) * Native.POSE_BYTES).order(ByteOrder.nativeOrder())

    /** The listener, whose pose takes effect with the next [tick]. */
    val listener = Listener()

    /** All listeners, [listener] first: as many as [EngineOptions.listeners]. */
    val listeners: List<Listener> = listOf(listener) + List(options.listeners - 1) { Listener() }

    /** Channels of what [render] writes, constant. */
    val channels: Int

    init {
        val engine = LongArray(1)
        rendererHandle = Native.engineCreate(Native.VERSION, options.numbers(), options.hrtf, engine)
        handle = engine[0]
        channels = Native.rendererChannels(rendererHandle)
        handles = Cleaner.watch(this, Handles(rendererHandle, handle))
    }

    /** Adds a silent source at a position in metres. Throws [IllegalStateException] beyond `maxSources`. */
    @Synchronized
    fun addSource(x: Float, y: Float, z: Float): Source {
        val id = Native.sourceAdd(handle, x, y, z)
        return Source(this, id, x, y, z).also { sources[slotOf(id)] = it }
    }

    @Synchronized
    internal fun remove(source: Source) {
        val slot = slotOf(source.id)
        if (sources[slot] !== source) return
        sources[slot] = null
        if (source.isOneShot && hasEnded(source.id)) return
        Native.sourceRemove(handle, source.id)
    }

    /** Whether a source was removed by the engine. */
    private fun hasEnded(id: Int): Boolean = try {
        Native.sourcePlayback(handle, id, playbackNumbers)
        false
    } catch (removed: IllegalArgumentException) {
        true
    }

    /**
     * Submits one graphics frame: the listener and the sources that moved since the last one. Meant for one call a frame
     * from the thread that draws: it does not wait for propagation or sound and does not allocate. Throws
     * [IllegalArgumentException] for a pose that is not finite or beyond 1,000 km; the frame is submitted nevertheless, with the last
     * good poses.
     */
    @Synchronized
    fun tick() {
        frame.clear()
        listener.pose.write(frame, 0)
        var count = 0
        for (source in sources) {
            if (source == null || !source.takeMoved()) continue
            if (source.isOneShot && hasEnded(source.id)) {
                sources[slotOf(source.id)] = null
                continue
            }
            source.pose.write(frame, source.id)
            count++
        }
        var refused: RuntimeException? = null
        for (index in 1 until listeners.size) {
            try {
                Native.engineSetListener(handle, index, listeners[index].pose.floats())
            } catch (failure: RuntimeException) {
                // The frame goes out in any case: what has moved is written once.
                refused = refused ?: failure
            }
        }
        try {
            Native.engineTick(handle, frame, count)
        } catch (failure: RuntimeException) {
            refused = refused ?: failure
        }
        if (refused != null) throw refused
    }

    /** Replaces the scene; the old one is audible until the first update with the new one. [scene] may be closed then. */
    fun setScene(scene: Scene) = Native.engineSetScene(handle, scene.handle)

    /**
     * Sets the rays from the listener and from each source, the maximum reflection order (0 to 4), and the maximum number of
     * edges that a path is diffracted at (0 to 2).
     */
    @JvmOverloads
    fun setPropagation(guideRays: Int, sourceRays: Int, depth: Int, diffractionOrder: Int = 2) {
        val numbers = DoubleArray(Native.PropagationOptions.LENGTH)
        numbers[Native.PropagationOptions.GUIDE_RAYS] = guideRays.toDouble()
        numbers[Native.PropagationOptions.SOURCE_RAYS] = sourceRays.toDouble()
        numbers[Native.PropagationOptions.DEPTH] = depth.toDouble()
        numbers[Native.PropagationOptions.DIFFRACTION_ORDER] = diffractionOrder.toDouble()
        Native.engineSetPropagation(handle, numbers)
    }

    /** Sets the extrapolation of paths, from the next update on. */
    fun setPredictor(predictor: Predictor) = Native.engineSetPredictor(handle, predictor.number)

    /**
     * Changes the layout, such as when headphones are plugged in or out (`AudioManager.registerAudioDeviceCallback`): sound
     * cross-fades within the next graphics frame. Throws [IllegalArgumentException] for a layout of more channels than the
     * output has.
     */
    fun setLayout(layout: Layout) = Native.engineSetLayout(handle, layout.number)

    /**
     * Changes the HRTF set to the content of a SOFA file (SimpleFreeFieldHRIR), or of a baked set at [rateHz]; null is the
     * built-in set. Sound cross-fades. A SOFA file takes some seconds: call it on a background thread; other calls go on.
     */
    fun setHrtf(hrtf: ByteArray?) = Native.engineSetHrtf(handle, hrtf)

    /** Sets when propagation runs, after the running update. */
    fun setSchedule(schedule: Schedule) = Native.engineSetSchedule(handle, schedule.number)

    /**
     * Plays on the system's device, rendered [blocksAhead] blocks ahead (1 to 64). Once an engine. The library reopens a
     * device that is lost or does not open.
     */
    @Synchronized
    @JvmOverloads
    fun start(blocksAhead: Int = 2) {
        check(!playing) { "the engine plays already; use pause and resume" }
        output = Native.outputStart(rendererHandle, blocksAhead)
        handles.replace(0, output)
        playing = true
    }

    /**
     * Renders [frames] audio frames of [channels] interleaved channels into a direct buffer of floats in native order, for
     * apps with an audio callback; returns the number of voices. One thread at a time; never waits. Not after [start].
     */
    fun render(buffer: ByteBuffer, frames: Int): Int = Native.render(rendererHandle, buffer, frames)

    /**
     * Renders [frames] audio frames for each of [listeners] into its own part of the buffer, one after the other; else as
     * [render], which gives their mix.
     */
    fun renderListeners(buffer: ByteBuffer, frames: Int): Int = Native.renderListeners(rendererHandle, buffer, frames)

    /**
     * Begins a block of [frames] audio frames, at most [EngineOptions.blockFrames], whose sources are rendered apart, for an app
     * with a mixer of its own: then [renderSource] for each, and [renderReverb] once. The sum of their outputs is what [render]
     * renders, without its limiter. Throws [IllegalStateException] without [EngineOptions.sourceBuses]. One thread at a time;
     * never waits. Not after [start].
     */
    fun beginBlock(frames: Int) = Native.renderBegin(rendererHandle, frames)

    /**
     * Renders one source of the block: the [dry] block's mono samples, or without one what the source plays, into [output] of
     * [channels] interleaved channels. Both are direct buffers of floats in native order. Once a source and block; a source
     * that is not rendered is in [renderReverb]'s output. Throws [IllegalArgumentException] for a source that no graphics frame has
     * yet, and [IllegalStateException] out of order.
     */
    fun renderSource(source: Source, dry: ByteBuffer?, output: ByteBuffer, frames: Int): Bus =
        Bus.entries[Native.renderSource(rendererHandle, source.id, dry, output, frames)]

    /** Ends the block: renders the late reverb and everything without a bus of its own; returns the number of voices. */
    fun renderReverb(output: ByteBuffer, frames: Int): Int = Native.renderReverb(rendererHandle, output, frames)

    /** Fades to silence within milliseconds and stops the playback positions, as on loss of audio focus or window. */
    fun pause() = Native.enginePause(handle)

    /** Continues after [pause]. */
    fun resume() = Native.engineResume(handle)

    /** Restarts propagation after [EngineState.PROPAGATION_FAILED]. */
    fun restart() = Native.engineRestart(handle)

    /** Statistics since the engine's creation. Takes microseconds. */
    fun statistics(): Statistics {
        val numbers = DoubleArray(Native.EngineStatistics.LENGTH)
        Native.engineStatistics(handle, numbers)
        return Statistics(numbers)
    }

    /**
     * Statistics every [periodMillis], at least 100, until the engine is closed; queried on [dispatcher].
     */
    fun statisticsFlow(
        periodMillis: Long = 500,
        dispatcher: CoroutineDispatcher = Dispatchers.Default,
    ): Flow<Statistics> = flow {
        while (true) {
            val now = try {
                statistics()
            } catch (gone: IllegalStateException) {
                if (handles.areClosed) return@flow
                throw gone
            }
            emit(now)
            delay(periodMillis.coerceAtLeast(SHORTEST_PERIOD_MILLIS))
        }
    }.flowOn(dispatcher)

    /** Sets the budget from the next update on: rays, reflection orders and paths are reduced to meet it. */
    fun setBudget(budget: Budget) = Native.engineSetBudget(handle, budget.numbers())

    /** Load of the engine and temperature of the phone. */
    fun health(): Health {
        val numbers = DoubleArray(Native.EngineHealth.LENGTH)
        Native.engineHealth(handle, numbers)
        return Health(numbers)
    }

    /** The loudest paths of the newest update for display, at most [EngineOptions.shownPaths], in no order. */
    @Synchronized
    fun paths(): List<ShownPath> {
        val count = Native.enginePaths(handle, pathNumbers)
        return List(count) { ShownPath(pathNumbers, it * Native.ShownPath.LENGTH) }
    }

    /** Properties and state of the device; `null` before [start]. */
    @Synchronized
    fun outputReport(): OutputReport? {
        if (!playing) return null
        val numbers = DoubleArray(Native.OutputInfo.LENGTH)
        Native.outputInfo(output, numbers)
        return OutputReport(numbers)
    }

    /**
     * Adds an instance of a moving part of the scene, such as a door, at a position in metres, from the next [tick] on.
     * [part] is a scene in local coordinates, a door's hinge at the origin; it may be closed then, and instances may share
     * it. Instances stay when the scene is replaced.
     */
    fun addInstance(part: Scene, x: Float, y: Float, z: Float): Instance {
        val pose = floatArrayOf(x, y, z, 0f, 0f, 0f, 1f)
        return Instance(this, Native.instanceAdd(handle, part.handle, pose), pose)
    }

    /**
     * Adds an instance that stays where it is and is joined with the fixed scene and with all such instances that it touches, as
     * if they had been built in one piece: a chunk of a streamed world, in its own coordinates, at a position in metres, from the
     * next [tick] on. [part] may be closed then. The instance is closed to remove it; moving it is an error.
     */
    fun addJoinedInstance(part: Scene, x: Float, y: Float, z: Float): Instance {
        val pose = floatArrayOf(x, y, z, 0f, 0f, 0f, 1f)
        return Instance(this, Native.instanceAddJoined(handle, part.handle, pose), pose)
    }

    internal fun move(id: Int, pose: FloatArray) = Native.instanceMove(handle, id, pose)

    internal fun removeInstance(id: Int) = Native.instanceRemove(handle, id)

    internal fun setDirectivityTable(id: Int, levelsDb: FloatArray) =
        Native.sourceSetDirectivityTable(handle, id, levelsDb)

    /**
     * Takes the numbers of the newest graphics frame that the renderer has, for a mixer of the app's own; [Source.numbers] and
     * [Source.paths] read them. Returns the number of the frame's tick, 0 before the first. The first call begins their copying.
     */
    fun takeNumbers(): Int = Native.engineTakeNumbers(handle)

    internal fun numbers(id: Int): SourceNumbers {
        val numbers = DoubleArray(Native.SourceNumbers.LENGTH)
        Native.sourceNumbers(handle, id, numbers)
        return SourceNumbers(numbers)
    }

    internal fun paths(id: Int, most: Int): List<SourcePath> {
        val numbers = DoubleArray(most * Native.SourcePath.LENGTH)
        val count = Native.sourcePaths(handle, id, numbers)
        return List(count) { SourcePath(numbers, it * Native.SourcePath.LENGTH) }
    }

    /**
     * Plays a clip once at a position in metres and forgets it: its source is removed when the clip has ended and its last path has
     * arrived. [clip] may be closed then. The source that is returned may be ignored; until its end it can be moved, faded and
     * closed, afterwards [Source.set], [Source.turn] and [Source.close] do nothing and its other functions throw
     * [IllegalArgumentException].
     */
    @Synchronized
    @JvmOverloads
    fun playOnce(
        clip: Clip,
        x: Float,
        y: Float,
        z: Float,
        play: PlayOptions = PlayOptions(),
        options: SourceOptions = SourceOptions(),
    ): Source {
        val id = Native.enginePlayOnce(handle, clip.handle, x, y, z, play.numbers(), options.numbers())
        return Source(this, id, x, y, z, isOneShot = true).also { sources[slotOf(id)] = it }
    }

    internal fun play(id: Int, clip: Clip, options: DoubleArray) =
        Native.sourcePlayClip(handle, id, clip.handle, options)

    internal fun playback(id: Int): Playback {
        val numbers = DoubleArray(Native.Playback.LENGTH)
        Native.sourcePlayback(handle, id, numbers)
        return Playback(numbers)
    }

    internal fun pause(id: Int, paused: Boolean) = Native.sourcePause(handle, id, paused)

    internal fun seek(id: Int, frame: Int) = Native.sourceSeek(handle, id, frame)

    internal fun setPitch(id: Int, pitch: Float) = Native.sourceSetPitch(handle, id, pitch)

    internal fun fadeGain(id: Int, gain: Float, seconds: Float) = Native.sourceFadeGain(handle, id, gain, seconds)

    /**
     * Gives all surfaces of a material's name, in the scene and in instances, other properties in eight octave bands from the next
     * tick on: shares of energy, 0 to 1. [absorption] counts what passes through too. Another scene has its own, and so has an
     * instance that is added later.
     */
    fun setMaterial(name: String, absorption: FloatArray, scattering: FloatArray, transmission: FloatArray) {
        val bands = listOf(absorption, scattering, transmission)
        require(bands.all { it.size == 8 }) { "a property has eight bands" }
        Native.engineSetMaterial(handle, name, DoubleArray(24) { bands[it / 8][it % 8].toDouble() })
    }

    internal fun setDistanceTable(id: Int, points: FloatArray) = Native.sourceSetDistanceTable(handle, id, points)

    internal fun configure(id: Int, options: DoubleArray) = Native.sourceConfigure(handle, id, options)

    internal fun setGain(id: Int, gain: Float) = Native.sourceSetGain(handle, id, gain)

    internal fun mute(id: Int, muted: Boolean) = Native.sourceMute(handle, id, muted)

    internal fun play(id: Int, clip: Clip, looped: Boolean) = Native.sourcePlay(handle, id, clip.handle, looped)

    internal fun stop(id: Int) = Native.sourceStop(handle, id)

    internal fun stream(id: Int, capacity: Int): Long = Native.sourceStream(handle, id, capacity)

    /** Stops sound and threads, after the running propagation update. Idempotent. */
    @Synchronized
    override fun close() {
        handles.close()
        Cleaner.forget(handles)
    }

    private companion object {
        const val SHORTEST_PERIOD_MILLIS = 100L
    }
}
