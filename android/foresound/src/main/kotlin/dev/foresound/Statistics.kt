package dev.foresound

import dev.foresound.Native.EngineStatistics as Index

/** State of an engine. */
enum class EngineState {
    RUNNING,
    PAUSED,
    /** Sound continues with the last paths; call [Engine.restart]. */
    PROPAGATION_FAILED,
    /** The renderer was closed: create another engine. */
    RENDERER_GONE,
}

/** Percentiles of durations in seconds; zeros without a measurement. */
class Percentiles internal constructor(numbers: DoubleArray, start: Int) {
    /** Number of measurements. */
    val count = numbers[start + Native.Percentiles.COUNT].toLong()
    /** Median in seconds. */
    val p50S = numbers[start + Native.Percentiles.P50_S]
    /** Exceeded by one of twenty, in seconds. */
    val p95S = numbers[start + Native.Percentiles.P95_S]
    /** Exceeded by one of a thousand, in seconds. */
    val p999S = numbers[start + Native.Percentiles.P999_S]
    /** Longest in seconds. */
    val worstS = numbers[start + Native.Percentiles.WORST_S]
}

/** Statistics of an engine. Counts are since its creation. */
class Statistics internal constructor(numbers: DoubleArray) {
    /** State of the engine. */
    val state = EngineState.entries[numbers[Index.STATE].toInt()]
    /** Graphics frames that an update lasts (the paper's L); at 0 every frame has an update of its own. */
    val extrapolationLevel = numbers[Index.EXTRAPOLATION_LEVEL].toInt()
    /** Paths in the update in use. */
    val paths = numbers[Index.PATHS].toInt()
    /** Number of sources. */
    val sources = numbers[Index.SOURCES].toInt()
    /** Quality level in use, 0 full detail to 5 the coarsest. */
    val qualityLevel = numbers[Index.QUALITY_LEVEL].toInt()
    /** Durations of propagation updates. */
    val propagation = Percentiles(numbers, Index.PROPAGATION)
    /** Durations of extrapolation a graphics frame. */
    val extrapolation = Percentiles(numbers, Index.EXTRAPOLATION)
    /** Durations of generation a block. */
    val generation = Percentiles(numbers, Index.GENERATION)
    /** Durations of whole blocks. */
    val block = Percentiles(numbers, Index.BLOCK)
    /** Render calls. */
    val blocks = numbers[Index.BLOCKS].toLong()
    /** Blocks that took longer than the duration of their sound. */
    val missedDeadlines = numbers[Index.MISSED_DEADLINES].toLong()
    /** Propagation updates in use so far. */
    val updates = numbers[Index.UPDATES].toLong()
    /** The quietest paths, dropped beyond the limit of an update. */
    val trimmedPaths = numbers[Index.TRIMMED_PATHS].toLong()
    /** Paths without a voice. */
    val droppedPaths = numbers[Index.DROPPED_PATHS].toLong()
    /** Samples missing from streams at their time. */
    val underrunSamples = numbers[Index.UNDERRUN_SAMPLES].toLong()
    /** Duration of the update in use, in seconds. */
    val propagationS = numbers[Index.PROPAGATION_S]
    /** Time between graphics frames in seconds. */
    val graphicsFrameS = numbers[Index.GRAPHICS_FRAME_S]
    /** Cores allowed for the propagation thread, a bit each. */
    val propagationCores = numbers[Index.PROPAGATION_CORES].toLong()
    /** Cores allowed for the audio thread, a bit each. */
    val soundCores = numbers[Index.AUDIO_CORES].toLong()
    /** Real-time priority of the audio thread; 0 outside that class. */
    val soundPriority = numbers[Index.AUDIO_PRIORITY].toInt()
    /** Niceness of the audio thread, -20 to 19. */
    val soundNice = numbers[Index.AUDIO_NICE].toInt()
}
