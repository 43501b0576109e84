package dev.foresound

import dev.foresound.Native.PlayOptions as Options
import dev.foresound.Native.Playback as Index

/** How a clip plays. */
class PlayOptions @JvmOverloads constructor(
    /** Whether it repeats. */
    var looped: Boolean = false,
    /** Audio frames of the clip between which it repeats, the end excluded; an end of 0 is the clip's. */
    var loopStart: Int = 0,
    var loopEnd: Int = 0,
    /** Audio frame of the clip to start from. */
    var firstFrame: Int = 0,
    /** Audio frame of the engine at which it starts ([Playback.engineFrame]); earlier ones start at once. */
    var startAt: Long = 0,
) {
    internal fun numbers(): DoubleArray {
        val numbers = DoubleArray(Options.LENGTH)
        numbers[Options.LOOPED] = if (looped) 1.0 else 0.0
        numbers[Options.LOOP_START] = loopStart.toDouble()
        numbers[Options.LOOP_END] = loopEnd.toDouble()
        numbers[Options.FIRST_FRAME] = firstFrame.toDouble()
        numbers[Options.START_AT] = startAt.toDouble()
        return numbers
    }
}

/** State of a source's clip. */
enum class PlaybackState {
    /** No clip was played, or it was stopped. */
    IDLE,

    /** A clip waits for the audio thread, or for its start. */
    SCHEDULED,

    /** A clip plays. */
    PLAYING,

    /** A clip is paused. */
    PAUSED,

    /** A clip has played to its end. */
    FINISHED,
}

/** State and position of a source's clip. */
class Playback internal constructor(numbers: DoubleArray) {
    val state = PlaybackState.entries[numbers[Index.STATE].toInt()]
    /** Position in the clip in audio frames. */
    val frame = numbers[Index.FRAME].toLong()
    /** Audio frames that the engine has rendered: the clock of [PlayOptions.startAt]. */
    val engineFrame = numbers[Index.ENGINE_FRAME].toLong()
}
