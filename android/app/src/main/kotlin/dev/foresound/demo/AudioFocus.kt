package dev.foresound.demo

import android.content.Context
import android.media.AudioAttributes
import android.media.AudioFocusRequest
import android.media.AudioManager
import dev.foresound.Engine

/**
 * Pauses an engine when another app takes the sound or nobody sees ours, and goes on after. To be copied: focus and
 * lifecycle are the app's. Main thread.
 */
class AudioFocus(context: Context, private val engine: () -> Engine?) {
    private val audio: AudioManager = context.getSystemService(AudioManager::class.java)
    private var visible = false
    private var focused = false
    private var started = false
    private val request: AudioFocusRequest = AudioFocusRequest.Builder(AudioManager.AUDIOFOCUS_GAIN)
        .setAudioAttributes(
            AudioAttributes.Builder()
                .setUsage(AudioAttributes.USAGE_GAME)
                .setContentType(AudioAttributes.CONTENT_TYPE_SONIFICATION)
                .build(),
        )
        .setOnAudioFocusChangeListener { change ->
            focused = change == AudioManager.AUDIOFOCUS_GAIN
            settle()
        }
        .build()

    /** The device's own rate where the built-in heads have it, so that nothing is converted on the way. */
    val rateHz: Int
        get() {
            val own = audio.getProperty(AudioManager.PROPERTY_OUTPUT_SAMPLE_RATE)?.toIntOrNull()
            return if (own == 44_100) 44_100 else 48_000
        }

    /** Once an engine is there. */
    fun begin() {
        if (visible) onStart()
    }

    /** Of `onStart`. */
    fun onStart() {
        visible = true
        if (!focused) focused = audio.requestAudioFocus(request) == AudioManager.AUDIOFOCUS_REQUEST_GRANTED
        settle()
    }

    /** Of `onStop`: in the background Android may mute us without a word. */
    fun onStop() {
        visible = false
        settle()
    }

    /** Of `onDestroy`. */
    fun close() {
        audio.abandonAudioFocusRequest(request)
    }

    /** Forgets an engine that is closed. */
    fun forget() {
        started = false
    }

    private fun settle() {
        val engine = engine() ?: return
        if (visible && focused) {
            if (!started) engine.start()
            started = true
            engine.resume()
        } else {
            engine.pause()
        }
    }
}
