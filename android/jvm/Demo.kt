package dev.foresound

import dev.foresound.demo.Benchmark
import dev.foresound.demo.PaperCell
import dev.foresound.demo.Pass
import dev.foresound.demo.SceneLayout
import dev.foresound.demo.Stage
import dev.foresound.demo.json
import dev.foresound.demo.paperTable
import dev.foresound.demo.table
import java.io.File
import kotlinx.coroutines.Dispatchers
import kotlinx.coroutines.runBlocking

/**
 * The demo's benchmark on a host: reads the scenes' layouts and the paper's table, measures one small cell in all passes,
 * and prints its JSON. Two arguments: the folder of the repository's assets, and the paper's table.
 */
fun main(arguments: Array<String>) = runBlocking(Dispatchers.Default) {
    val scenes = File(arguments[0], "scenes")
    val cells = paperTable(File(arguments[1]).readText())
    check(cells.size == 15 && cells.groupBy { it.scene }.values.all { it.map(PaperCell::sources) == listOf(1, 2, 4, 8, 16) })
    for (name in cells.map { it.scene }.distinct()) {
        val layout = SceneLayout(File(scenes, "$name.toml").readText())
        check(layout.sources.size == 16 && layout.speedMS == 1.4f)
        val length = Math.hypot((layout.to[0] - layout.from[0]).toDouble(), (layout.to[2] - layout.from[2]).toDouble())
        val (x, _, z) = layout.listenerAt(length / 1.4)
        check(Math.abs(x - layout.to[0]) < 1e-3 && Math.abs(z - layout.to[2]) < 1e-3) { "$name: $x $z" }
    }
    val small = PaperCell("doorway", 2, 21.7, 82.4)
    val layout = SceneLayout(File(scenes, "doorway.toml").readText())
    val signal = FloatArray(48_000) { (it * 7919 % 997 - 498) / 4000f }
    val benchmark = Benchmark(0.05)
    val rows = Scene.fromFile(File(scenes, "doorway.obj")).use { scene ->
        Clip.fromSamples(signal, 48_000, 48_000).use { clip ->
            Pass.ALL.map { benchmark.row(Stage(scene, layout, clip), small, it) }
        }
    }
    check(rows.all { it.baseline.fps > 0 && it.ours.fps > 0 && it.ours.statistics.paths > 0 })
    check(table(rows).lines().count { "doorway" in it } == 4 && "not touched" in table(rows))
    println(json("a \"host\"", 0.05, rows))
    check(Native.openHandles() == 0) { "${Native.openHandles()} handles are left open" }
}
