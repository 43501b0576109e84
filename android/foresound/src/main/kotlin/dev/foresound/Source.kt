package dev.foresound

import java.nio.ByteBuffer

/** Position in metres (right-handed, +y up) and orientation, a quaternion; (0, 0, 0, 1) faces -z. */
internal class Pose {
    private val floats = floatArrayOf(0f, 0f, 0f, 0f, 0f, 0f, 1f)

    fun move(x: Float, y: Float, z: Float) {
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

/** The listener. One thread at a time; changes take effect with the next [Engine.tick]. */
class Listener internal constructor() {
    internal val pose = Pose()

    /** Moves the centre of the head, in metres. */
    fun set(x: Float, y: Float, z: Float) = pose.move(x, y, z)

    /** Rotates the head by a quaternion; (0, 0, 0, 1) faces -z. */
    fun turn(x: Float, y: Float, z: Float, w: Float) = pose.turn(x, y, z, w)
}

/**
 * A sound source. One thread at a time; changes take effect with the next [Engine.tick]. Throws
 * [IllegalArgumentException] once it is closed.
 */
class Source internal constructor(
    private val engine: Engine,
    internal val id: Int,
    x: Float,
    y: Float,
    z: Float,
) : AutoCloseable {
    internal val pose = Pose().apply { move(x, y, z) }
    private var moved = false

    /** Moves it, in metres. */
    fun set(x: Float, y: Float, z: Float) {
        pose.move(x, y, z)
        moved = true
    }

    /** Rotates it by a quaternion; (0, 0, 0, 1) faces -z. Audible with [SourceOptions.directivity]. */
    fun turn(x: Float, y: Float, z: Float, w: Float) {
        pose.turn(x, y, z, w)
        moved = true
    }

    internal fun takeMoved(): Boolean = moved.also { moved = false }

    /** Sets its options. */
    fun configure(options: SourceOptions) = engine.configure(id, options.numbers())

    /**
     * Sets its directivity table: rows of levels in dB in eight octave bands, the angles evenly from the front to the back,
     * both included; 2 to 181 rows of -63 to 60 dB or minus infinity. No row: no table. The table is multiplied with
     * [SourceOptions.directivity].
     */
    fun setDirectivityTable(rowsDb: List<FloatArray>) {
        require(rowsDb.all { it.size == 8 }) { "rowsDb: a row has eight bands" }
        engine.setDirectivityTable(id, FloatArray(8 * rowsDb.size) { rowsDb[it / 8][it % 8] })
    }

    /** Sets its linear gain, 0 to 1000. */
    fun setGain(gain: Float) = engine.setGain(id, gain)

    /** Mutes or unmutes it; its playback position advances. */
    fun mute(muted: Boolean) = engine.mute(id, muted)

    /** Plays a clip from its beginning; [clip] may be closed then. */
    @JvmOverloads
    fun play(clip: Clip, looped: Boolean = false) = engine.play(id, clip, looped)

    /** Attaches a stream through a ring buffer of [capacity] samples (1 to 16,777,216). */
    fun stream(capacity: Int): SampleStream = SampleStream(engine.stream(id, capacity))

    /** Silences it and releases its clip or stream. */
    fun stop() = engine.stop(id)

    /** Removes it; sound under way fades. Idempotent. */
    override fun close() = engine.remove(this)
}

/** Settings of a source. */
class SourceOptions @JvmOverloads constructor(
    /** Computed parts of its sound. */
    var direct: Boolean = true,
    var reflections: Boolean = true,
    var diffraction: Boolean = true,
    var transmission: Boolean = true,
    var lateReverb: Boolean = true,
    /** Radius in metres within which it gets no louder; 0: the engine's. */
    var radiusM: Float = 0f,
    /** In eight octave bands from the lowest: 0 omnidirectional, 0.5 cardioid, 1 dipole. */
    var directivity: FloatArray = FloatArray(8),
    /** Exponent of the directivity, 0 to 64. */
    var order: Float = 1f,
) {
    internal fun numbers(): DoubleArray {
        require(directivity.size == 8) { "directivity has ${directivity.size} bands instead of 8" }
        val effects = listOf(
            direct to Native.Effect.DIRECT,
            reflections to Native.Effect.REFLECTIONS,
            diffraction to Native.Effect.DIFFRACTION,
            transmission to Native.Effect.TRANSMISSION,
            lateReverb to Native.Effect.LATE_REVERB,
        )
        val bits = effects.sumOf { (on, bit) -> if (on) bit else 0 }
        val numbers = DoubleArray(Native.SourceOptions.LENGTH)
        numbers[Native.SourceOptions.EFFECTS] = bits.toDouble()
        numbers[Native.SourceOptions.RADIUS_M] = radiusM.toDouble()
        numbers[Native.SourceOptions.ORDER] = order.toDouble()
        directivity.forEachIndexed { band, weight -> numbers[Native.SourceOptions.DIRECTIVITY + band] = weight.toDouble() }
        return numbers
    }
}

/** The writing end of a stream of mono samples. One thread at a time, an audio callback included: writing never waits. */
class SampleStream internal constructor(private val handle: Long) : AutoCloseable {
    private val handles = Cleaner.watch(this, Handles(handle))

    /**
     * Appends as many of [count] floats in native order from a direct buffer as fit; returns their number. Throws
     * [IllegalStateException] once the source was removed or plays another signal.
     */
    fun write(samples: ByteBuffer, count: Int): Int = Native.streamWrite(handle, samples, count)

    override fun close() {
        handles.close()
        Cleaner.forget(handles)
    }
}

/** The slot of a source's id, which is in its lowest twelve bits. */
internal fun slotOf(id: Int): Int = id and 0xfff
