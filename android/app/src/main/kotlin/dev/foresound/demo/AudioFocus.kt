package dev.foresound.demo

import android.content.Context
import android.media.AudioAttributes
import android.media.AudioFocusRequest
import android.media.AudioManager
import dev.foresound.Engine

/**
 * Pauses an engine while another app has the audio focus or the app is not visible, and resumes it afterwards. Meant to be
 * copied: focus and lifecycle belong to the app. Main thread.
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

    /** The device's own rate if a built-in HRTF set has it, which avoids conversion. */
    val rateHz: Int
        get() {
            val own = audio.getProperty(AudioManager.PROPERTY_OUTPUT_SAMPLE_RATE)?.toIntOrNull()
            return if (own == 44_100) 44_100 else 48_000
        }

    /** Call after creating an engine. */
    fun begin() {
        if (visible) onStart()
    }

    /** Call from `onStart`. */
    fun onStart() {
        visible = true
        if (!focused) focused = audio.requestAudioFocus(request) == AudioManager.AUDIOFOCUS_REQUEST_GRANTED
        settle()
    }

    /** Call from `onStop`: in the background Android may mute the app without notice. */
    fun onStop() {
        visible = false
        settle()
    }

    /** Call from `onDestroy`. */
    fun close() {
        audio.abandonAudioFocusRequest(request)
    }

    /** Forgets a closed engine. */
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
