package dev.foresound

/** How an engine is. */
enum class EngineState {
    RUNNING,
    PAUSED,
    /** Sound goes on with the last paths; [Engine.restart] helps. */
    PROPAGATION_FAILED,
    /** Nobody makes sound of it any more: make another engine. */
    RENDERER_GONE,
}

/** Percentiles of times, in seconds; zeros of nothing. */
class Percentiles internal constructor(numbers: DoubleArray, at: Int) {
    val count = numbers[at].toLong()
    val p50S = numbers[at + 1]
    val p95S = numbers[at + 2]
    val p999S = numbers[at + 3]
    val worstS = numbers[at + 4]
}

/** A look at an engine. Counts are since it began. */
class Statistics internal constructor(numbers: DoubleArray) {
    val state = EngineState.entries[numbers[0].toInt()]
    /** Extrapolation level L in use. */
    val level = numbers[1].toInt()
    /** Paths in the update in use. */
    val paths = numbers[2].toInt()
    val sources = numbers[3].toInt()
    /** Times of propagation updates. */
    val propagation = Percentiles(numbers, 4)
    /** Times of extrapolation a graphics frame. */
    val extrapolation = Percentiles(numbers, 9)
    /** Times of generation a block. */
    val generation = Percentiles(numbers, 14)
    /** Times of whole blocks. */
    val block = Percentiles(numbers, 19)
    val blocks = numbers[24].toLong()
    /** Blocks that took longer than they last. */
    val missedDeadlines = numbers[25].toLong()
    val updates = numbers[26].toLong()
    /** Paths left out beyond the limit of an update, the quietest. */
    val trimmedPaths = numbers[27].toLong()
    /** Paths without a voice. */
    val droppedPaths = numbers[28].toLong()
    /** Samples that streams were late with. */
    val starvedSamples = numbers[29].toLong()
    /** Time of the update in use. */
    val propagationS = numbers[30]
    /** Time between the graphics frames that are heard. */
    val graphicsFrameS = numbers[31]
    /** Cores that the propagation thread may run on, a bit each. */
    val propagationCores = numbers[32].toLong()
    /** Cores that the sound thread may run on, a bit each. */
    val soundCores = numbers[33].toLong()
    /** Real-time priority of the sound thread, 0 outside that class. */
    val soundPriority = numbers[34].toInt()
    /** Niceness of the sound thread. */
    val soundNice = numbers[35].toInt()
}

/** What a device granted, and how it goes. */
class OutputReport internal constructor(numbers: DoubleArray) {
    /** False while a lost device waits to be opened again. */
    val playing = numbers[0] != 0.0
    val rateHz = numbers[1].toInt()
    val burstFrames = numbers[2].toInt()
    val bufferFrames = numbers[3].toInt()
    val exclusive = numbers[4] != 0.0
    val lowLatency = numbers[5] != 0.0
    /** 1 AAudio, 2 OpenSL ES, 0 neither. */
    val nativeInterface = numbers[6].toInt()
    /** Audio frames that the ring adds to the latency. */
    val ringFrames = numbers[7].toInt()
    val opened = numbers[8].toInt()
    val refused = numbers[9].toInt()
    val lost = numbers[10].toInt()
    val stalled = numbers[11].toInt()
    /** Gaps that the device has counted since it was opened. */
    val xruns = numbers[12].toInt()
    val leastFrames = numbers[13].toInt()
    val mostFrames = numbers[14].toInt()
    val callbacks = numbers[15].toLong()
    /** Audio frames that were not ready in time. */
    val starvedFrames = numbers[16].toLong()
}
