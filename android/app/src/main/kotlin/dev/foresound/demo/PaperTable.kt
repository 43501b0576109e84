package dev.foresound.demo

/** A cell of the paper's Table 4: frames a second on its phone. */
class PaperCell(val scene: String, val sources: Int, val baselineFps: Double, val proposedFps: Double)

/** Reads `paper_table_4.csv`. */
fun paperTable(text: String): List<PaperCell> = text.trim().lines().drop(1).map { line ->
    val words = line.split(',')
    PaperCell(words[0], words[1].toInt(), words[2].toDouble(), words[3].toDouble())
}
