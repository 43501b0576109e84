package dev.foresound

import android.content.Context
import java.io.File
import kotlinx.coroutines.CoroutineDispatcher
import kotlinx.coroutines.Dispatchers

/**
 * Mono samples for engines of one sample rate, resampled while loading. Any thread. Loading suspends on a dispatcher.
 * Sources continue to play a closed clip.
 */
class Clip private constructor(handle: Long) : Resource(handle) {
    companion object {
        /** From a WAV file: PCM of 8 to 32 bits or float; channels are averaged. */
        suspend fun fromFile(
            file: File,
            engineRateHz: Int,
            dispatcher: CoroutineDispatcher = Dispatchers.IO,
        ): Clip = load(dispatcher, ::Clip) { Native.clipFromWav(file.readBytes(), engineRateHz) }

        /** From a WAV file among the app's assets. */
        suspend fun fromAsset(
            context: Context,
            name: String,
            engineRateHz: Int,
            dispatcher: CoroutineDispatcher = Dispatchers.IO,
        ): Clip = load(dispatcher, ::Clip) {
            Native.clipFromWav(openAsset(context, name).use { it.readBytes() }, engineRateHz)
        }

        /** From samples at [rateHz]; 1 is full scale at 1 m. */
        suspend fun fromSamples(
            samples: FloatArray,
            rateHz: Int,
            engineRateHz: Int,
            dispatcher: CoroutineDispatcher = Dispatchers.Default,
        ): Clip = load(dispatcher, ::Clip) { Native.clipFromSamples(samples, rateHz, engineRateHz) }
    }
}
