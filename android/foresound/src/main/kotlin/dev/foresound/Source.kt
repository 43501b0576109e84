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

    /** Position and orientation. */
    fun floats(): FloatArray = floats

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
    /** Whether the engine removes it at the end of its clip ([Engine.playOnce]). */
    internal val isOneShot: Boolean = false,
) : AutoCloseable {
    /**
     * Its index among the engine's sources, 0 to [EngineOptions.maxSources] - 1: [ShownPath.sourceSlot] of its paths. No two open
     * sources have the same; a later source may have that of a closed one. Constant. It is not one of the slots that
     * [EngineOptions.sourceSlots] counts.
     */
    val slot: Int
        get() = slotOf(id)

    internal val pose = Pose().apply { move(x, y, z) }
    private var moved = false

    /** Moves it, in metres. */
    fun set(x: Float, y: Float, z: Float) {
        pose.move(x, y, z)
        moved = true
    }

    /** Rotates it by a quaternion, which is normalised; (0, 0, 0, 1) and four zeros face -z. Audible with [SourceOptions.directivity]. */
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

    /**
     * Sets its distance table, which replaces [SourceOptions.distanceCurve]: pairs of a distance in metres and a linear gain (0 to
     * 1000) at rising distances, 1 to 16 pairs; straight lines between them. No pair: no table.
     */
    fun setDistanceTable(points: List<Pair<Float, Float>>) =
        engine.setDistanceTable(id, FloatArray(2 * points.size) { points[it / 2].toList()[it % 2] })

    /** What the frame that [Engine.takeNumbers] took has of it; zeros without a slot. */
    fun numbers(): SourceNumbers = engine.numbers(id)

    /** Its paths in the frame that [Engine.takeNumbers] took, at most [most]. */
    @JvmOverloads
    fun paths(most: Int = 256): List<SourcePath> {
        require(most in 0..65_536) { "most: $most is outside 0 to 65536" }
        return engine.paths(id, most)
    }

    /** Sets its linear gain, 0 to 1000. */
    fun setGain(gain: Float) = engine.setGain(id, gain)

    /** Mutes or unmutes it; its playback position advances. */
    fun mute(muted: Boolean) = engine.mute(id, muted)

    /** Plays a clip from its beginning; [clip] may be closed then. */
    @JvmOverloads
    fun play(clip: Clip, looped: Boolean = false) = engine.play(id, clip, looped)

    /** Plays a clip with loop points, from a frame of it, at a frame of the engine; [clip] may be closed then. */
    fun play(clip: Clip, options: PlayOptions) = engine.play(id, clip, options.numbers())

    /** State and position of its clip, as of the last block. */
    fun playback(): Playback = engine.playback(id)

    /** Pauses its clip from the next tick on, or continues it; fades within 6 ms. */
    fun pause(paused: Boolean) = engine.pause(id, paused)

    /** Continues its clip at another audio frame of it, with a cross-fade. */
    fun seek(frame: Int) = engine.seek(id, frame)

    /** Sets the speed of its clips, 0.125 to 4: 2 is an octave up. The pitch glides. */
    fun setPitch(pitch: Float) = engine.setPitch(id, pitch)

    /** Ramps its linear gain to 0 to 1000 within 0 to 3600 seconds. */
    fun fadeGain(gain: Float, seconds: Float) = engine.fadeGain(id, gain, seconds)

    /**
     * Attaches a stream through a ring buffer of [capacity] samples (1 to 16,777,216). Samples are mono at the engine's
     * rate, 1 being full scale at 1 m; they are not converted.
     */
    fun stream(capacity: Int): SampleStream = SampleStream(engine.stream(id, capacity))

    /** Silences it and releases its clip or stream. */
    fun stop() = engine.stop(id)

    /** Removes it; sound under way fades. Idempotent. */
    override fun close() = engine.remove(this)
}

/** Level by distance. It scales all sound of a source; delays and the levels of its paths relative to each other stay. */
enum class DistanceCurve {
    /** One over the distance, 1 at 1 m. */
    PHYSICAL,

    /** 1 up to the minimum distance, the minimum over the distance beyond it, constant from the maximum distance on. */
    INVERSE,

    /** 1 up to the minimum distance, falling linearly to 0 at the maximum distance. */
    LINEAR,
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
    /** Level by distance, unless the source has a distance table. */
    var distanceCurve: DistanceCurve = DistanceCurve.PHYSICAL,
    /** Distance of full level in metres, for the inverse and the linear curve. */
    var distanceMinM: Float = 1f,
    /** Distance in metres from which the level is constant (inverse curve) or 0 (linear curve). */
    var distanceMaxM: Float = 100f,
    /** Linear gains of the parts of its sound, 0 to 1000. */
    var directGain: Float = 1f,
    var reflectionsGain: Float = 1f,
    var diffractionGain: Float = 1f,
    var lateGain: Float = 1f,
    /** Strength of occlusion, 0 to 1; 1 is physics. At 0 the direct path is as loud as if nothing were in its way. */
    var occlusion: Float = 1f,
    /** Linear gain of a direct path through walls, 0 to 4; 1 is physics. */
    var transmissionGain: Float = 1f,
    /** Factor of the delay of direct sound, 0 to 4, whose change is the Doppler shift; 1 is physics. */
    var doppler: Float = 1f,
    /** Strength of the air's absorption along paths, 0 to 1; 1 is physics. */
    var airAbsorption: Float = 1f,
    /** Heard without a position, propagation and late reverb, such as music; stereo clips keep their channels. */
    var is2d: Boolean = false,
    /** 0 to 255: with more sources than slots, those of higher priority get slots of their own first. */
    var priority: Int = 128,
    /**
     * Semi-axes in metres of an ellipsoid around the source along its x, y and z, 0 to 1000: three equal ones are a sphere, one a
     * line such as a river, all 0 a point. A wide source sounds from points on the ellipsoid, of which a share may be hidden.
     */
    var extentM: FloatArray = FloatArray(3),
    /** Number of those points, 4 to 32. */
    var extentPoints: Int = 16,
) {
    internal fun numbers(): DoubleArray {
        require(extentM.size == 3) { "extentM has ${extentM.size} semi-axes instead of 3" }
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
        numbers[Native.SourceOptions.DISTANCE_CURVE] = distanceCurve.ordinal.toDouble()
        numbers[Native.SourceOptions.DISTANCE_MIN_M] = distanceMinM.toDouble()
        numbers[Native.SourceOptions.DISTANCE_MAX_M] = distanceMaxM.toDouble()
        numbers[Native.SourceOptions.DIRECT_GAIN] = directGain.toDouble()
        numbers[Native.SourceOptions.REFLECTIONS_GAIN] = reflectionsGain.toDouble()
        numbers[Native.SourceOptions.DIFFRACTION_GAIN] = diffractionGain.toDouble()
        numbers[Native.SourceOptions.LATE_GAIN] = lateGain.toDouble()
        numbers[Native.SourceOptions.OCCLUSION] = occlusion.toDouble()
        numbers[Native.SourceOptions.TRANSMISSION] = transmissionGain.toDouble()
        numbers[Native.SourceOptions.DOPPLER] = doppler.toDouble()
        numbers[Native.SourceOptions.AIR_ABSORPTION] = airAbsorption.toDouble()
        numbers[Native.SourceOptions.IS_2D] = if (is2d) 1.0 else 0.0
        numbers[Native.SourceOptions.PRIORITY] = priority.toDouble()
        numbers[Native.SourceOptions.EXTENT_POINTS] = extentPoints.toDouble()
        extentM.forEachIndexed { axis, metres -> numbers[Native.SourceOptions.EXTENT_M + axis] = metres.toDouble() }
        directivity.forEachIndexed { band, weight -> numbers[Native.SourceOptions.DIRECTIVITY + band] = weight.toDouble() }
        return numbers
    }
}

/**
 * The writing end of a stream. Samples are mono at the engine's rate ([Engine.rateHz]), 1 being full scale at 1 m; they are not
 * converted. One thread at a time, an audio callback included: writing never waits.
 */
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
