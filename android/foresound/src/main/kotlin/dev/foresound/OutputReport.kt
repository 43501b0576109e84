package dev.foresound

import dev.foresound.Native.OutputInfo as Index

/** System library of a sound device. */
enum class DeviceApi { OTHER, AAUDIO, OPENSL_ES }

/** Properties and state of the audio device. */
class OutputReport internal constructor(numbers: DoubleArray) {
    /** False while a lost device is to be opened again. */
    val playing = numbers[Index.PLAYING] != 0.0
    /** Granted sample rate in Hz. */
    val rateHz = numbers[Index.RATE_HZ].toInt()
    /** Audio frames of the device's burst. */
    val burstFrames = numbers[Index.BURST_FRAMES].toInt()
    /** Audio frames of the device's buffer. */
    val bufferFrames = numbers[Index.BUFFER_FRAMES].toInt()
    /** Whether the device is in exclusive mode. */
    val exclusive = numbers[Index.EXCLUSIVE] != 0.0
    /** Whether the device is in low-latency mode. */
    val lowLatency = numbers[Index.LOW_LATENCY] != 0.0
    /** System library of the device. */
    val deviceApi = DeviceApi.entries[numbers[Index.DEVICE_API].toInt()]
    /** Latency of the ring buffer in audio frames. */
    val ringFrames = numbers[Index.RING_FRAMES].toInt()
    /** Successful attempts to open a device. */
    val opened = numbers[Index.OPENED].toInt()
    /** Failed attempts to open a device. */
    val refused = numbers[Index.REFUSED].toInt()
    /** Disconnections of the device. */
    val lost = numbers[Index.LOST].toInt()
    /** Times that the device stopped its callbacks and was closed. */
    val stalled = numbers[Index.STALLED].toInt()
    /** Underruns counted by the device since it was opened. */
    val xruns = numbers[Index.XRUNS].toInt()
    /** Minimum audio frames of a callback. */
    val minCallbackFrames = numbers[Index.MIN_CALLBACK_FRAMES].toInt()
    /** Maximum audio frames of a callback. */
    val maxCallbackFrames = numbers[Index.MAX_CALLBACK_FRAMES].toInt()
    /** Number of callbacks. */
    val callbacks = numbers[Index.CALLBACKS].toLong()
    /** Audio frames that were not rendered in time. */
    val underrunFrames = numbers[Index.UNDERRUN_FRAMES].toLong()
}
