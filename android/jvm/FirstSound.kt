package dev.foresound.guide

import android.content.Context
import dev.foresound.Clip
import dev.foresound.Engine
import dev.foresound.EngineOptions
import dev.foresound.Instance
import dev.foresound.Scene
import dev.foresound.Source
import kotlin.math.cos
import kotlin.math.sin

/**
 * A hall with a fountain and a door. [deviceRate] is `AudioManager.PROPERTY_OUTPUT_SAMPLE_RATE`, null if the device has none.
 * The built-in HRTF set has 44,100 and 48,000 Hz; for other devices the system converts.
 */
class Hall(deviceRate: Int?) : AutoCloseable {
    private val engine = Engine(EngineOptions(rateHz = if (deviceRate == 44_100) 44_100 else 48_000))
    private lateinit var fountain: Source
    private lateinit var door: Instance

    /** Once. Files are read on other threads. */
    suspend fun open(context: Context, doorCorners: FloatArray, doorTriangles: IntArray) {
        Scene.fromAsset(context, "hall.obj").use { engine.setScene(it) }
        fountain = engine.addSource(1f, 1.5f, -4f)
        Clip.fromAsset(context, "fountain.wav", engine.rateHz).use { fountain.play(it, looped = true) }
        door = Scene.fromMesh(doorCorners, doorTriangles).use { engine.addInstance(it, 7f, 0f, 3f) }
        engine.start()
    }

    /** Every frame, on the thread that draws. */
    fun frame(x: Float, y: Float, z: Float, doorAngle: Float) {
        engine.listener.set(x, y, z)
        door.turn(0f, sin(doorAngle / 2), 0f, cos(doorAngle / 2))
        engine.tick()
    }

    /** On loss of audio focus and in onStop. */
    fun pause() = engine.pause()

    fun resume() = engine.resume()

    override fun close() = engine.close()
}
