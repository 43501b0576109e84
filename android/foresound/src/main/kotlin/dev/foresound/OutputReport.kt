package dev.foresound

import dev.foresound.Native.OutputInfo as Index

/** System library of a sound device. */
enum class DeviceApi { OTHER, AAUDIO, OPENSL_ES }

/** Properties and state of the audio device. */
class OutputReport internal constructor(numbers: DoubleArray) {
    /** False while a lost device is to be opened again. */
    val playing = numbers[Index.PLAYING] != 0.0
    val rateHz = numbers[Index.RATE_HZ].toInt()
    val burstFrames = numbers[Index.BURST_FRAMES].toInt()
    val bufferFrames = numbers[Index.BUFFER_FRAMES].toInt()
    val exclusive = numbers[Index.EXCLUSIVE] != 0.0
    val lowLatency = numbers[Index.LOW_LATENCY] != 0.0
    val deviceApi = DeviceApi.entries[numbers[Index.DEVICE_API].toInt()]
    /** Latency of the ring buffer in audio frames. */
    val ringFrames = numbers[Index.RING_FRAMES].toInt()
    val opened = numbers[Index.OPENED].toInt()
    val refused = numbers[Index.REFUSED].toInt()
    val lost = numbers[Index.LOST].toInt()
    val stalled = numbers[Index.STALLED].toInt()
    /** Underruns counted by the device since it was opened. */
    val xruns = numbers[Index.XRUNS].toInt()
    /** Least and most audio frames of a callback. */
    val minCallbackFrames = numbers[Index.MIN_CALLBACK_FRAMES].toInt()
    val maxCallbackFrames = numbers[Index.MAX_CALLBACK_FRAMES].toInt()
    val callbacks = numbers[Index.CALLBACKS].toLong()
    /** Audio frames that were not rendered in time. */
    val underrunFrames = numbers[Index.UNDERRUN_FRAMES].toLong()
}
