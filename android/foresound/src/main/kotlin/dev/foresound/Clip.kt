package dev.foresound

import android.content.Context
import java.io.File
import kotlinx.coroutines.CoroutineDispatcher
import kotlinx.coroutines.Dispatchers

/**
 * Samples of one channel, two, or a sound field, for engines of one sample rate, resampled while loading. Any thread. The functions `from...` suspend on a
 * dispatcher, the functions `load...` block. Sources continue to play a closed clip.
 */
class Clip private constructor(handle: Long) : Resource(handle) {
    companion object {
        /** From a WAV file: PCM of 8 to 32 bits or float; channels are averaged. Blocks. */
        @JvmStatic
        fun loadFile(file: File, engineRateHz: Int): Clip = loadWav(file.readBytes(), engineRateHz)

        /** From a WAV file among the app's assets. Blocks. */
        @JvmStatic
        fun loadAsset(context: Context, name: String, engineRateHz: Int): Clip =
            loadWav(openAsset(context, name).use { it.readBytes() }, engineRateHz)

        /** From the content of a WAV file. Blocks. */
        @JvmStatic
        fun loadWav(bytes: ByteArray, engineRateHz: Int): Clip {
            Native.require()
            return Clip(Native.clipFromWav(bytes, engineRateHz))
        }

        /** From samples at [rateHz]; 1 is full scale at 1 m. Blocks. */
        @JvmStatic
        fun loadSamples(samples: FloatArray, rateHz: Int, engineRateHz: Int): Clip {
            Native.require()
            return Clip(Native.clipFromSamples(samples, rateHz, engineRateHz))
        }

        /** The first two channels of the content of a WAV file. A source with a position plays their mean. Blocks. */
        @JvmStatic
        fun loadStereoWav(bytes: ByteArray, engineRateHz: Int): Clip {
            Native.require()
            return Clip(Native.clipFromStereoWav(bytes, engineRateHz))
        }

        /** From interleaved samples of two channels at [rateHz], left first. Blocks. */
        @JvmStatic
        fun loadStereoSamples(samples: FloatArray, rateHz: Int, engineRateHz: Int): Clip {
            Native.require()
            return Clip(Native.clipFromStereo(samples, rateHz, engineRateHz))
        }

        /**
         * From interleaved samples of a first-order sound field in AmbiX form, W, Y, Z, X in SN3D, at [rateHz]. A 2D source plays it
         * around the listener, fixed in the world: its front is -z, its left -x, its top +y. A source with a position plays W.
         * Blocks.
         */
        @JvmStatic
        fun loadAmbix(samples: FloatArray, rateHz: Int, engineRateHz: Int): Clip {
            Native.require()
            return Clip(Native.clipFromAmbix(samples, rateHz, engineRateHz))
        }

        /**
         * From the content of a WAV file, or of a FLAC or Ogg Vorbis file if the library is built with its feature `compressed`.
         * [channels]: 1 for their mean, 2 for the first two, 4 for a sound field as of [loadAmbix]. Blocks.
         */
        @JvmStatic
        @JvmOverloads
        fun loadBytes(bytes: ByteArray, engineRateHz: Int, channels: Int = 1): Clip {
            Native.require()
            return Clip(Native.clipFromFile(bytes, channels, engineRateHz))
        }

        /** As [loadFile], on a dispatcher. */
        suspend fun fromFile(
            file: File,
            engineRateHz: Int,
            dispatcher: CoroutineDispatcher = Dispatchers.IO,
        ): Clip = load(dispatcher) { loadFile(file, engineRateHz) }

        /** As [loadAsset], on a dispatcher. */
        suspend fun fromAsset(
            context: Context,
            name: String,
            engineRateHz: Int,
            dispatcher: CoroutineDispatcher = Dispatchers.IO,
        ): Clip = load(dispatcher) { loadAsset(context, name, engineRateHz) }

        /** As [loadSamples], on a dispatcher. */
        suspend fun fromSamples(
            samples: FloatArray,
            rateHz: Int,
            engineRateHz: Int,
            dispatcher: CoroutineDispatcher = Dispatchers.Default,
        ): Clip = load(dispatcher) { loadSamples(samples, rateHz, engineRateHz) }
    }
}
