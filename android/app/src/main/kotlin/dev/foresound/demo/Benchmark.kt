package dev.foresound.demo

import dev.foresound.Affinity
import dev.foresound.Clip
import dev.foresound.Engine
import dev.foresound.EngineOptions
import dev.foresound.Health
import dev.foresound.Scene
import dev.foresound.Schedule
import dev.foresound.Statistics
import java.nio.ByteBuffer
import java.nio.ByteOrder
import java.util.Locale
import kotlinx.coroutines.ensureActive
import kotlin.coroutines.coroutineContext

/** Configuration of a pass: threads pinned to the fastest cores or not, screen touched or not. */
class Pass(val pinned: Boolean, val touched: Boolean) {
    override fun toString() = (if (pinned) "pinned" else "unpinned") + (if (touched) ", touched" else ", untouched")

    companion object {
        val ALL = listOf(Pass(false, false), Pass(true, false), Pass(false, true), Pass(true, true))
    }
}

/** Result of one schedule in a cell. */
class Measured(val fps: Double, val statistics: Statistics, val health: Health)

/** A cell, measured by both schedules. */
class Row(val pass: Pass, val paper: PaperCell, val touches: Int, val baseline: Measured, val ours: Measured) {
    val speedup get() = ours.fps / baseline.fps
}

/** Contents of a cell. */
class Stage(val scene: Scene, val layout: SceneLayout, val clip: Clip)

/**
 * Measures cells of Table 4. A graphics frame is a tick and 1/60 s of sound, one after the other as fast as possible, on
 * the calling thread: the figure is the frame rate that propagation and sound leave to a graphics thread.
 */
class Benchmark(private val secondsEach: Double, private val touches: () -> Int = { 0 }) {
    private val block: ByteBuffer = ByteBuffer.allocateDirect(2 * FRAMES * 4).order(ByteOrder.nativeOrder())

    suspend fun row(stage: Stage, paper: PaperCell, pass: Pass): Row {
        val before = touches()
        val baseline = measure(stage, paper.sources, pass, Schedule.SYNCHRONOUS)
        val ours = measure(stage, paper.sources, pass, Schedule.ASYNCHRONOUS)
        return Row(pass, paper, touches() - before, baseline, ours)
    }

    private suspend fun measure(stage: Stage, sources: Int, pass: Pass, schedule: Schedule): Measured {
        val options = EngineOptions(
            rateHz = RATE_HZ,
            maxSources = sources,
            blockFrames = FRAMES,
            schedule = schedule,
            affinity = if (pass.pinned) Affinity.FASTEST else Affinity.SYSTEM,
        )
        return Engine(options).use { engine ->
            engine.setScene(stage.scene)
            for (position in stage.layout.sources.take(sources)) {
                engine.addSource(position[0], position[1], position[2]).play(stage.clip, looped = true)
            }
            var frame = 0
            while (frame < WARM_UP || engine.statistics().updates < WARM_UPDATES) next(engine, stage, frame++)
            val began = System.nanoTime()
            var count = 0
            var passed = 0.0
            while (passed < secondsEach) {
                coroutineContext.ensureActive()
                next(engine, stage, frame++)
                count++
                passed = (System.nanoTime() - began) * 1e-9
            }
            Measured(count / passed, engine.statistics(), engine.health())
        }
    }

    private fun next(engine: Engine, stage: Stage, frame: Int) {
        val (x, y, z) = stage.layout.listenerAt(frame / 60.0)
        engine.listener.set(x, y, z)
        engine.tick()
        engine.render(block, FRAMES)
    }

    companion object {
        const val RATE_HZ = 48_000
        const val FRAMES = 800
        const val WARM_UP = 40
        const val WARM_UPDATES = 20L
    }
}

private fun number(value: Double) = if (value.isFinite()) String.format(Locale.ROOT, "%.3f", value) else "null"

private fun Row.json() = buildString {
    append("{\"scene\":\"${paper.scene}\",\"sources\":${paper.sources}")
    append(",\"pinned\":${pass.pinned},\"touched\":${pass.touched},\"touches\":$touches")
    append(",\"synchronous_fps\":${number(baseline.fps)},\"asynchronous_fps\":${number(ours.fps)}")
    append(",\"speedup\":${number(speedup)}")
    append(",\"paper_synchronous_fps\":${paper.baselineFps},\"paper_asynchronous_fps\":${paper.proposedFps}")
    val now = ours.statistics
    append(",\"update_p50_ms\":${number(1e3 * now.propagation.p50S)},\"update_p95_ms\":${number(1e3 * now.propagation.p95S)}")
    append(",\"level\":${now.extrapolationLevel},\"tier\":${ours.health.qualityLevel},\"paths\":${now.paths}")
    append(",\"block_p50_ms\":${number(1e3 * now.block.p50S)},\"block_worst_ms\":${number(1e3 * now.block.worstS)}")
    append(",\"propagation_cores\":${now.propagationCores}")
    append(",\"thermal_headroom\":${ours.health.thermalHeadroom},\"thermal_status\":${ours.health.thermalStatus}}")
}

/** All rows as one JSON object; [device] is the phone's name. */
fun json(device: String, secondsEach: Double, rows: List<Row>): String {
    val name = device.replace("\\", "\\\\").replace("\"", "\\\"").filter { it >= ' ' }
    return "{\"benchmark\":\"table 4\",\"device\":\"$name\",\"seconds\":${number(secondsEach)},\"rows\":[" +
        rows.joinToString(",") { it.json() } + "]}"
}

/** The rows of one pass beside the paper's. */
fun table(rows: List<Row>): String = buildString {
    for ((pass, group) in rows.groupBy { it.pass }) {
        appendLine(pass)
        appendLine("scene          src   sync  async      x | paper sync  async      x")
        for (row in group) {
            val paper = row.paper
            val cells = listOf(
                row.baseline.fps, row.ours.fps, row.speedup, paper.baselineFps, paper.proposedFps,
                paper.proposedFps / paper.baselineFps,
            )
            append(String.format(Locale.ROOT, "%-14s %3d", paper.scene, paper.sources))
            append(String.format(Locale.ROOT, " %6.1f %6.1f %6.2f |     %6.1f %6.1f %6.2f", *cells.toTypedArray()))
            if (pass.touched && row.touches == 0) append("  not touched")
            appendLine()
        }
    }
}
