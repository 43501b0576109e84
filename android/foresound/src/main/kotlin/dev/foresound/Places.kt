package dev.foresound

import java.nio.ByteBuffer

/** Position in metres (right-handed, +y up) and orientation, a quaternion that turns the front from -z. */
internal class Pose {
    private val floats = floatArrayOf(0f, 0f, 0f, 0f, 0f, 0f, 1f)

    fun place(x: Float, y: Float, z: Float) {
        floats[0] = x
        floats[1] = y
        floats[2] = z
    }

    fun turn(x: Float, y: Float, z: Float, w: Float) {
        floats[3] = x
        floats[4] = y
        floats[5] = z
        floats[6] = w
    }

    fun write(frame: ByteBuffer, id: Int) {
        frame.putInt(id)
        for (float in floats) frame.putFloat(float)
    }
}

/** The listener's head. Any one thread at a time; heard from the next [Engine.tick] on. */
class Listener internal constructor() {
    internal val pose = Pose()

    /** Moves the head's centre, in metres. */
    fun set(x: Float, y: Float, z: Float) = pose.place(x, y, z)

    /** Turns the head by a quaternion; (0, 0, 0, 1) looks along -z. */
    fun turn(x: Float, y: Float, z: Float, w: Float) = pose.turn(x, y, z, w)
}

/**
 * A source of sound. Any one thread at a time; poses are heard from the next [Engine.tick] on. Throws
 * [IllegalArgumentException] once it is closed.
 */
class Source internal constructor(
    private val engine: Engine,
    internal val id: Int,
    x: Float,
    y: Float,
    z: Float,
) : AutoCloseable {
    internal val pose = Pose().apply { place(x, y, z) }
    private var moved = false

    /** Moves it, in metres. */
    fun set(x: Float, y: Float, z: Float) {
        pose.place(x, y, z)
        moved = true
    }

    /** Turns it by a quaternion; (0, 0, 0, 1) faces -z. Heard with [SourceOptions.directivity]. */
    fun turn(x: Float, y: Float, z: Float, w: Float) {
        pose.turn(x, y, z, w)
        moved = true
    }

    internal fun takeMoved(): Boolean = moved.also { moved = false }

    /** Says what it is like. */
    fun configure(options: SourceOptions) = engine.configure(id, options.numbers())

    /** Sets its gain, a pressure ratio from 0 to 1000. */
    fun setGain(gain: Float) = engine.setGain(id, gain)

    /** Silences it, or lets it be heard again; its sound goes on unheard. */
    fun mute(muted: Boolean) = engine.mute(id, muted)

    /** Plays a clip from its beginning; [clip] may be closed then. */
    fun play(clip: Clip, looped: Boolean = false) = engine.play(id, clip, looped)

    /** Plays what is written to the result from now on, through a ring for [capacity] samples. */
    fun stream(capacity: Int): SampleStream = SampleStream(engine.stream(id, capacity))

    /** Silences it and lets go of its clip or stream. */
    fun stop() = engine.stop(id)

    /** Removes it; what it has sent fades. Closing twice is nothing. */
    override fun close() = engine.remove(this)
}

/** What a source is like. */
class SourceOptions(
    /** Which parts of its sound are computed. */
    val direct: Boolean = true,
    val reflections: Boolean = true,
    val diffraction: Boolean = true,
    val transmission: Boolean = true,
    val late: Boolean = true,
    /** Radius in metres within which it gets no louder; 0 as the engine has it. */
    val radiusM: Float = 0f,
    /** Eight bands from the lowest: 0 sounds all around, 0.5 is a cardioid, 1 a dipole. */
    val directivity: FloatArray = FloatArray(8),
    /** Exponent of the directivity, 0 to 64. */
    val order: Float = 1f,
) {
    internal fun numbers(): DoubleArray {
        require(directivity.size == 8) { "directivity has ${directivity.size} bands, not 8" }
        val effects = listOf(direct, reflections, diffraction, transmission, late)
        val bits = effects.foldIndexed(0) { bit, sum, on -> if (on) sum or (1 shl bit) else sum }
        return doubleArrayOf(bits.toDouble(), radiusM.toDouble(), order.toDouble()) +
            directivity.map { it.toDouble() }
    }
}

/** The app's end of a stream of mono samples. One thread at a time, an audio callback too: writing waits for nothing. */
class SampleStream internal constructor(private val handle: Long) : AutoCloseable {
    private var closed = false

    /**
     * Appends [count] floats in native order from a direct buffer, as many as fit, and gives their number. Throws
     * [IllegalStateException] once the source has other sound or is gone.
     */
    fun write(samples: ByteBuffer, count: Int): Int = Native.writeStream(handle, samples, count)

    override fun close() {
        if (closed) return
        closed = true
        Native.close(handle)
    }
}
