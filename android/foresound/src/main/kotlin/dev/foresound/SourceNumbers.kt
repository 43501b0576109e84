package dev.foresound

import dev.foresound.Native.SourceNumbers as Numbers
import dev.foresound.Native.SourcePath as Index

/** What a path does between source and listener. */
enum class PathKind {
    /** The straight line, unobstructed. */
    DIRECT,

    /** The straight line, through walls. */
    TRANSMITTED,

    /** Reflected, without diffraction. */
    REFLECTED,

    /** Diffracted at one or two edges, perhaps also reflected. */
    DIFFRACTED,
}

/** A path of a source in a graphics frame. */
class SourcePath internal constructor(numbers: DoubleArray, start: Int) {
    /** Identity across frames, rounded to 53 bits. */
    val id = numbers[start + Index.ID]
    val kind = PathKind.entries[numbers[start + Index.KIND].toInt()]
    val reflections = numbers[start + Index.REFLECTIONS].toInt()
    val delaySeconds = numbers[start + Index.DELAY_S]
    /** Unit vector in world coordinates from the listener to where the path arrives from. */
    val arrival = FloatArray(3) { numbers[start + Index.ARRIVAL + it].toFloat() }
    /** Unit vector in world coordinates from the source along the path. */
    val departure = FloatArray(3) { numbers[start + Index.DEPARTURE + it].toFloat() }
    /** Signed amplitude relative to the free field at 1 m in eight octave bands, from the lowest. */
    val amplitude = FloatArray(8) { numbers[start + Index.AMPLITUDE + it].toFloat() }
}

/** What a graphics frame has of a source. Levels include the source's options and not its gain. */
class SourceNumbers internal constructor(numbers: DoubleArray) {
    val pathCount = numbers[Numbers.PATH_COUNT].toInt()
    /** How much of the straight line is blocked, 0 to 1, times the strength of the source's occlusion. */
    val occlusion = numbers[Numbers.OCCLUSION].toFloat()
    /** Delay from emission to the start of the late reverb; 0 without any. */
    val reverbDelaySeconds = numbers[Numbers.REVERB_DELAY_S].toFloat()
    /** Amplitude factor of the walls on the straight line in eight octave bands: 1 where nothing blocks it. */
    val transmission = FloatArray(8) { numbers[Numbers.TRANSMISSION + it].toFloat() }
    /** Amplitude of the late reverb in eight octave bands, relative to the free field at 1 m. */
    val reverbSend = FloatArray(8) { numbers[Numbers.REVERB_SEND + it].toFloat() }
    /** Reverberation time T60 of the late reverb in eight octave bands; 0 without any. */
    val decaySeconds = FloatArray(8) { numbers[Numbers.DECAY_TIME_S + it].toFloat() }
}
