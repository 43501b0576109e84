package dev.foresound.demo

import android.app.Activity
import android.content.Intent
import android.os.Bundle
import android.util.Log
import android.view.Choreographer
import android.widget.Button
import android.widget.LinearLayout
import android.widget.TextView
import dev.foresound.Affinity
import dev.foresound.Clip
import dev.foresound.Engine
import dev.foresound.EngineOptions
import dev.foresound.Scene
import dev.foresound.UnavailableException
import java.io.IOException
import java.util.Locale
import kotlinx.coroutines.CoroutineScope
import kotlinx.coroutines.Dispatchers
import kotlinx.coroutines.Job
import kotlinx.coroutines.SupervisorJob
import kotlinx.coroutines.cancel
import kotlinx.coroutines.cancelAndJoin
import kotlinx.coroutines.launch
import kotlinx.coroutines.withContext

/**
 * Walks through the benchmark scenes with voices and shows the paths and the engine's statistics. Extras: `scene`
 * NAME, `sources` 1 to 16, `affinity fastest`.
 */
class MainActivity : Activity(), Choreographer.FrameCallback {
    private val scope = CoroutineScope(SupervisorJob() + Dispatchers.Main)
    private lateinit var text: TextView
    private lateinit var view: PathView
    private lateinit var focus: AudioFocus
    private var engine: Engine? = null
    private var layout: SceneLayout? = null
    private var walk: Job? = null
    private var beganNanos = 0L
    private var lastNanos = 0L
    private var frameS = 0.0
    private var frames = 0

    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        text = TextView(this)
        view = PathView(this)
        focus = AudioFocus(this) { engine }
        val buttons = LinearLayout(this)
        for (name in SCENES) buttons.addView(button(name) { begin(name) })
        buttons.addView(button("benchmark") { startActivity(Intent(this, BenchmarkActivity::class.java)) })
        val column = LinearLayout(this)
        column.orientation = LinearLayout.VERTICAL
        column.addView(buttons)
        column.addView(text)
        column.addView(view)
        setContentView(column)
        begin(intent.getStringExtra("scene") ?: SCENES[0])
        Choreographer.getInstance().postFrameCallback(this)
    }

    private fun button(name: String, pressed: () -> Unit) = Button(this).also {
        it.text = name
        it.setOnClickListener { pressed() }
    }

    private fun begin(name: String) {
        val before = walk
        walk = scope.launch {
            before?.cancelAndJoin()
            close()
            text.text = name
            try {
                play(name)
            } catch (missing: IOException) {
                text.text = missing.message
            } catch (missing: UnavailableException) {
                text.text = missing.message
            }
        }
    }

    private suspend fun play(name: String) {
        val sceneLayout = SceneLayout(withContext(Dispatchers.IO) { assets.open("$name.toml").use { it.reader().readText() } })
        val options = EngineOptions(
            rateHz = focus.rateHz,
            affinity = if (intent.getStringExtra("affinity") == "fastest") Affinity.FASTEST else Affinity.SYSTEM,
            shownPaths = SHOWN_PATHS,
        )
        val made = withContext(Dispatchers.Default) { Engine(options) }
        engine = made
        val count = intent.getIntExtra("sources", 4).coerceIn(1, sceneLayout.sources.size)
        Scene.fromAsset(this, "$name.obj").use {
            made.setScene(it)
            view.show(it.info, sceneLayout.sources.take(count))
        }
        for ((number, position) in sceneLayout.sources.take(count).withIndex()) {
            val voice = String.format(Locale.ROOT, "voice%02d.wav", number + 1)
            Clip.fromAsset(this, voice, made.rateHz).use {
                made.addSource(position[0], position[1], position[2]).play(it, looped = true)
            }
        }
        layout = sceneLayout
        beganNanos = 0L
        focus.begin()
        made.statisticsFlow().collect { report(made) }
    }

    override fun doFrame(nanos: Long) {
        Choreographer.getInstance().postFrameCallback(this)
        val (engine, layout) = Pair(engine ?: return, layout ?: return)
        if (beganNanos == 0L) beganNanos = nanos
        val ear = layout.listenerAt((nanos - beganNanos) * 1e-9)
        engine.listener.set(ear[0], ear[1], ear[2])
        engine.tick()
        if (lastNanos != 0L) frameS += 0.05 * ((nanos - lastNanos) * 1e-9 - frameS)
        lastNanos = nanos
        if (frames++ % FRAMES_A_PICTURE == 0) view.update(engine.paths(), ear)
    }

    private fun report(engine: Engine) {
        val now = engine.statistics()
        val health = engine.health()
        val out = engine.outputReport()
        val lines = buildString {
            appendLine("${now.state}, ${now.sources} sources, ${now.paths} paths, ${health.rays} rays")
            appendLine("${one(1 / maxOf(frameS, 1e-3))} FPS, T_SPS ${milli(health.propagationS)} ms, L ${now.extrapolationLevel}, quality level ${health.qualityLevel}")
            appendLine("update ${milli(now.propagation.p50S)} ms, p95 ${milli(now.propagation.p95S)}, worst ${milli(now.propagation.worstS)}")
            appendLine("block ${milli(now.block.p50S)} ms, worst ${milli(now.block.worstS)}, ${now.missedDeadlines} missed")
            appendLine("heat ${health.thermalHeadroom}, status ${health.thermalStatus}, hints ${health.hintsPropagation} ${health.hintsSound}")
            if (out != null) {
                appendLine("device ${out.rateHz} Hz, burst ${out.burstFrames}, buffer ${out.bufferFrames}, playing ${out.playing}")
                appendLine("exclusive ${out.exclusive}, low latency ${out.lowLatency}, ${out.deviceApi}")
                appendLine("callbacks of ${out.minCallbackFrames} to ${out.maxCallbackFrames} frames, ${out.xruns} xruns, ${out.underrunFrames} underrun frames")
                append("opened ${out.opened}, refused ${out.refused}, lost ${out.lost}, stalled ${out.stalled}")
            }
        }
        text.text = lines
        Log.i("foresound", lines.replace('\n', ';'))
    }

    private fun milli(seconds: Double) = String.format(Locale.ROOT, "%.2f", seconds * 1e3)

    private fun one(number: Double) = String.format(Locale.ROOT, "%.1f", number)

    /** Closing waits for an update; a separate thread keeps the window responsive. */
    private fun close() {
        engine?.let { closing -> Thread { closing.close() }.start() }
        engine = null
        layout = null
        focus.forget()
    }

    override fun onStart() {
        super.onStart()
        focus.onStart()
    }

    override fun onStop() {
        focus.onStop()
        super.onStop()
    }

    override fun onDestroy() {
        scope.cancel()
        Choreographer.getInstance().removeFrameCallback(this)
        close()
        focus.close()
        super.onDestroy()
    }

    private companion object {
        val SCENES = listOf("concert_hall", "bootcamp", "angrybot")
        const val SHOWN_PATHS = 200
        const val FRAMES_A_PICTURE = 4
    }
}
