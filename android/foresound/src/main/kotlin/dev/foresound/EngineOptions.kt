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
) {
    internal fun numbers(): DoubleArray {
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
        return numbers
    }
}
