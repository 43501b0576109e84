package dev.foresound

/** When propagation runs. */
enum class Schedule { ASYNCHRONOUS, SYNCHRONOUS }

/** How paths go on between updates. */
enum class Predictor { HOLD, LINEAR, BEST }

/** Where the engine's threads run. Android's own advice is to leave it to the system. */
enum class Affinity { SYSTEM, FASTEST_CORES }

/** What an engine is made for. What is null is the library's default. */
class EngineOptions(
    /** That of the device, `AudioManager.PROPERTY_OUTPUT_SAMPLE_RATE`, keeps the shortest way: 44,100 or 48,000 Hz. */
    val rateHz: Int = 48_000,
    val maxSources: Int = 16,
    val blockFrames: Int? = null,
    val maxVoices: Int? = null,
    val guideRays: Int? = null,
    val sourceRays: Int? = null,
    /** Highest reflection order, 0 to 4. */
    val depth: Int? = null,
    val schedule: Schedule = Schedule.ASYNCHRONOUS,
    val predictor: Predictor? = null,
    val affinity: Affinity = Affinity.SYSTEM,
    /** Seconds of a graphics frame; null measures the ticks. */
    val frameSeconds: Double? = null,
    /** A baked head-related set; null takes the built-in one. */
    val hrtf: ByteArray? = null,
    /** Whether detail goes down while the phone is about to throttle (API 30 and later). */
    val thermal: Boolean = true,
    /** Whether the system is told how long the threads' work takes (performance hints, API 33 and later). */
    val hints: Boolean = true,
    /** Most paths that [Engine.paths] gives, 0 to 16,384. */
    val shownPaths: Int = 0,
) {
    init {
        require(maxSources in 1..MOST_SOURCES) { "maxSources: $maxSources is outside 1 to $MOST_SOURCES" }
        require(shownPaths in 0..MOST_PATHS) { "shownPaths: $shownPaths is outside 0 to $MOST_PATHS" }
    }

    internal fun numbers(): DoubleArray {
        Native.require()
        val numbers = DoubleArray(Native.OPTIONS)
        Native.optionDefaults(numbers)
        numbers[0] = rateHz.toDouble()
        blockFrames?.let { numbers[1] = it.toDouble() }
        numbers[2] = maxSources.toDouble()
        maxVoices?.let { numbers[3] = it.toDouble() }
        guideRays?.let { numbers[6] = it.toDouble() }
        sourceRays?.let { numbers[7] = it.toDouble() }
        depth?.let { numbers[8] = it.toDouble() }
        numbers[10] = schedule.ordinal.toDouble()
        predictor?.let { numbers[11] = it.ordinal.toDouble() }
        numbers[12] = affinity.ordinal.toDouble()
        frameSeconds?.let { numbers[20] = it }
        numbers[22] = (if (thermal) 1.0 else 0.0) + (if (hints) 2.0 else 0.0)
        numbers[23] = shownPaths.toDouble()
        return numbers
    }

    private companion object {
        const val MOST_SOURCES = 256
        const val MOST_PATHS = 16_384
    }
}
