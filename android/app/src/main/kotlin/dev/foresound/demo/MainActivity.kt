package dev.foresound.demo

import android.app.Activity
import android.media.AudioAttributes
import android.media.AudioFocusRequest
import android.media.AudioManager
import android.os.Bundle
import android.util.Log
import android.view.Choreographer
import android.widget.TextView
import dev.foresound.Affinity
import dev.foresound.Clip
import dev.foresound.Engine
import dev.foresound.EngineOptions
import dev.foresound.Scene
import java.io.File
import kotlinx.coroutines.CoroutineScope
import kotlinx.coroutines.Dispatchers
import kotlinx.coroutines.SupervisorJob
import kotlinx.coroutines.cancel
import kotlinx.coroutines.delay
import kotlinx.coroutines.launch
import kotlinx.coroutines.withContext

/**
 * Walks through the doorway scene past a voice and shows what the engine says of itself. With the extra `benchmark` it
 * adds sources, 1 to 16, and writes a line of CSV for each number; `affinity fastest` pins threads.
 */
class MainActivity : Activity(), Choreographer.FrameCallback {
    private val scope = CoroutineScope(SupervisorJob() + Dispatchers.Main)
    private lateinit var text: TextView
    private lateinit var audio: AudioManager
    private lateinit var focus: AudioFocusRequest
    private var engine: Engine? = null
    private var beganNanos = 0L
    private val tickNanos = LongArray(3600)
    private var ticks = 0

    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        text = TextView(this).also { setContentView(it) }
        audio = getSystemService(AudioManager::class.java)
        val attributes = AudioAttributes.Builder()
            .setUsage(AudioAttributes.USAGE_GAME)
            .setContentType(AudioAttributes.CONTENT_TYPE_SONIFICATION)
            .build()
        focus = AudioFocusRequest.Builder(AudioManager.AUDIOFOCUS_GAIN)
            .setAudioAttributes(attributes)
            .setOnAudioFocusChangeListener { change ->
                if (change == AudioManager.AUDIOFOCUS_GAIN) engine?.resume() else engine?.pause()
            }
            .build()
        scope.launch { play() }
    }

    private suspend fun play() {
        val rate = audio.getProperty(AudioManager.PROPERTY_OUTPUT_SAMPLE_RATE)?.toIntOrNull()
        // The head-related sets that are built in have these two rates; Oboe converts to any other.
        val options = EngineOptions(
            rateHz = if (rate == 44_100) 44_100 else 48_000,
            affinity = if (intent.getStringExtra("affinity") == "fastest") Affinity.FASTEST_CORES else Affinity.SYSTEM,
        )
        val made = withContext(Dispatchers.Default) { Engine(options) }
        engine = made
        Scene.fromAsset(this, "doorway.obj").use { made.setScene(it) }
        val clip = Clip.fromAsset(this, "voice01.wav", made.rateHz)
        made.addSource(5f, 1.5f, 3.2f).play(clip, looped = true)
        if (audio.requestAudioFocus(focus) == AudioManager.AUDIOFOCUS_REQUEST_GRANTED) made.start()
        Choreographer.getInstance().postFrameCallback(this)
        scope.launch { made.statisticsFlow().collect { report() } }
        if (intent.getBooleanExtra("benchmark", false)) benchmark(made, clip)
    }

    override fun doFrame(nanos: Long) {
        val engine = engine ?: return
        if (beganNanos == 0L) beganNanos = nanos
        // To and fro in twenty seconds.
        val phase = ((nanos - beganNanos) / 20e9 % 1.0).toFloat()
        val part = 1f - Math.abs(2f * phase - 1f)
        engine.listener.set(12.5f - 6f * part, 1.65f, 0.5f + 4f * part)
        val started = System.nanoTime()
        engine.tick()
        tickNanos[ticks++ % tickNanos.size] = System.nanoTime() - started
        Choreographer.getInstance().postFrameCallback(this)
    }

    private fun report() {
        val engine = engine ?: return
        val now = engine.statistics()
        val out = engine.outputReport()
        val lines = buildString {
            appendLine("${now.state}, ${now.paths} paths, L ${now.level}")
            appendLine("update ${milli(now.propagation.p50S)} ms, worst ${milli(now.propagation.worstS)}")
            appendLine("block ${milli(now.block.p50S)} ms, worst ${milli(now.block.worstS)}, ${now.missedDeadlines} missed")
            if (out != null) {
                appendLine("device ${out.rateHz} Hz, burst ${out.burstFrames}, buffer ${out.bufferFrames}")
                appendLine("exclusive ${out.exclusive}, low latency ${out.lowLatency}, interface ${out.nativeInterface}")
                appendLine("asks for ${out.leastFrames} to ${out.mostFrames}, ${out.xruns} gaps, ${out.starvedFrames} starved")
                append("opened ${out.opened}, refused ${out.refused}, lost ${out.lost}, stalled ${out.stalled}")
            }
        }
        text.text = lines
        Log.i("foresound", lines.replace('\n', ';'))
    }

    private suspend fun benchmark(engine: Engine, clip: Clip) {
        val file = File(filesDir, "benchmark.csv")
        file.writeText("sources,update_p50_ms,update_p95_ms,block_p50_ms,block_worst_ms,tick_p50_us,missed\n")
        for (sources in 1..16) {
            if (sources > 1) engine.addSource(4f + 0.6f * sources, 1.5f, 3f).play(clip, looped = true)
            ticks = 0
            delay(10_000)
            // Percentiles are since the engine began; what the newest number of sources adds shows in the p95.
            val now = engine.statistics()
            val times = tickNanos.copyOf(minOf(ticks, tickNanos.size)).sorted()
            val tick = times.getOrElse(times.size / 2) { 0L } * 1e-3
            file.appendText(
                "$sources,${milli(now.propagation.p50S)},${milli(now.propagation.p95S)}," +
                    "${milli(now.block.p50S)},${milli(now.block.worstS)},$tick,${now.missedDeadlines}\n",
            )
        }
        Log.i("foresound", "benchmark done: ${file.path}")
    }

    private fun milli(seconds: Double) = "%.2f".format(java.util.Locale.ROOT, seconds * 1e3)

    override fun onStart() {
        super.onStart()
        engine?.resume()
    }

    override fun onStop() {
        engine?.pause()
        super.onStop()
    }

    override fun onDestroy() {
        scope.cancel()
        Choreographer.getInstance().removeFrameCallback(this)
        audio.abandonAudioFocusRequest(focus)
        // Closing waits for an update; a thread of its own does not hold the window up.
        engine?.let { closing -> Thread { closing.close() }.start() }
        engine = null
        super.onDestroy()
    }
}
