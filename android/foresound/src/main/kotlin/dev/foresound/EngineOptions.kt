package dev.foresound

import dev.foresound.Native.Options as Index

/** When propagation runs. */
enum class Schedule { ASYNCHRONOUS, SYNCHRONOUS }

/** Extrapolation of paths between updates. */
enum class Predictor { HOLD, LINEAR, GEOMETRIC }

/** Cores of the engine's threads. Android advises to leave the choice to the system. */
enum class Affinity { SYSTEM, FASTEST_CORES }

/** Settings of an engine. Null is the library's default. */
class EngineOptions(
    /** 44,100 or 48,000 Hz. The device's (`AudioManager.PROPERTY_OUTPUT_SAMPLE_RATE`) has the lowest latency. */
    val rateHz: Int = 48_000,
    val maxSources: Int = 16,
    val blockFrames: Int? = null,
    val maxVoices: Int? = null,
    val guideRays: Int? = null,
    val sourceRays: Int? = null,
    /** Maximum reflection order, 0 to 4. */
    val depth: Int? = null,
    val schedule: Schedule = Schedule.ASYNCHRONOUS,
    val predictor: Predictor? = null,
    val affinity: Affinity = Affinity.SYSTEM,
    /** Duration of a graphics frame in seconds; null: measured from the ticks. */
    val frameSeconds: Double? = null,
    /** Content of an HRTF set's file; null is the built-in set. */
    val hrtf: ByteArray? = null,
    /** Whether imminent thermal throttling lowers the quality level (API 30 and later). */
    val thermal: Boolean = true,
    /** Whether the threads report their durations to the system (performance hints, API 33 and later). */
    val hints: Boolean = true,
    /** Maximum number of paths that [Engine.paths] returns, 0 to 16,384. */
    val shownPaths: Int = 0,
    /** Maximum memory of the engine in MiB, without scenes and sounds; an engine of more is refused. */
    val maxMemoryMib: Int? = null,
) {
    init {
        require(maxSources in 1..MAX_SOURCES) { "maxSources: $maxSources is outside 1 to $MAX_SOURCES" }
        require(shownPaths in 0..MAX_PATHS) { "shownPaths: $shownPaths is outside 0 to $MAX_PATHS" }
    }

    internal fun numbers(): DoubleArray {
        Native.require()
        val numbers = DoubleArray(Index.LENGTH)
        Native.optionsDefault(numbers)
        numbers[Index.RATE_HZ] = rateHz.toDouble()
        blockFrames?.let { numbers[Index.BLOCK_FRAMES] = it.toDouble() }
        numbers[Index.MAX_SOURCES] = maxSources.toDouble()
        maxVoices?.let { numbers[Index.MAX_VOICES] = it.toDouble() }
        guideRays?.let { numbers[Index.GUIDE_RAYS] = it.toDouble() }
        sourceRays?.let { numbers[Index.SOURCE_RAYS] = it.toDouble() }
        depth?.let { numbers[Index.DEPTH] = it.toDouble() }
        numbers[Index.SCHEDULE] = schedule.ordinal.toDouble()
        predictor?.let { numbers[Index.PREDICTOR] = it.ordinal.toDouble() }
        numbers[Index.AFFINITY] = affinity.ordinal.toDouble()
        frameSeconds?.let { numbers[Index.FRAME_S] = it }
        numbers[Index.DEVICE_HINTS] = (if (thermal) 1.0 else 0.0) + (if (hints) 2.0 else 0.0)
        numbers[Index.SHOWN_PATHS] = shownPaths.toDouble()
        maxMemoryMib?.let { numbers[Index.MAX_MEMORY_MIB] = it.toDouble() }
        return numbers
    }

    private companion object {
        const val MAX_SOURCES = 256
        const val MAX_PATHS = 16_384
    }
}
