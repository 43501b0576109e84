package dev.foresound

import android.content.Context
import java.io.File
import kotlinx.coroutines.CoroutineDispatcher
import kotlinx.coroutines.Dispatchers
import kotlinx.coroutines.withContext

/**
 * Mono samples for engines of one rate; others are converted while loading. Any thread. Loading suspends on a dispatcher
 * of its own.
 */
class Clip private constructor(internal val handle: Long) : AutoCloseable {
    private var closed = false

    /** Lets go of it; sources that play it keep it. Closing twice is nothing. */
    @Synchronized
    override fun close() {
        if (closed) return
        closed = true
        Native.close(handle)
    }

    companion object {
        /** From a WAV file: PCM of 8 to 32 bits or float; channels are averaged. */
        suspend fun fromFile(
            file: File,
            engineRateHz: Int,
            dispatcher: CoroutineDispatcher = Dispatchers.IO,
        ): Clip = load(dispatcher) { Native.clipFromWav(file.readBytes(), engineRateHz) }

        /** From a WAV file among the app's assets. */
        suspend fun fromAsset(
            context: Context,
            name: String,
            engineRateHz: Int,
            dispatcher: CoroutineDispatcher = Dispatchers.IO,
        ): Clip = load(dispatcher) {
            Native.clipFromWav(openAsset(context, name).use { it.readBytes() }, engineRateHz)
        }

        /** From samples at [rateHz]; 1 is the pressure at 1 m. */
        suspend fun fromSamples(
            samples: FloatArray,
            rateHz: Int,
            engineRateHz: Int,
            dispatcher: CoroutineDispatcher = Dispatchers.Default,
        ): Clip = load(dispatcher) { Native.clipFromSamples(samples, rateHz, engineRateHz) }

        private suspend fun load(dispatcher: CoroutineDispatcher, make: () -> Long): Clip {
            Native.require()
            var made: Clip? = null
            try {
                return withContext(dispatcher) { Clip(make()).also { made = it } }
            } catch (ended: Throwable) {
                made?.close()
                throw ended
            }
        }
    }
}
