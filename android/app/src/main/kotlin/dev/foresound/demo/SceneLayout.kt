package dev.foresound.demo

/** A benchmark scene's sources and walk, in metres, from the TOML files beside the scenes. */
class SceneLayout(text: String) {
    /** Three coordinates a source. */
    val sources: List<FloatArray>
    val from: FloatArray
    val to: FloatArray
    val speedMS: Float

    init {
        val named = NUMBERS.findAll(text).map { it.groupValues[1] to numbers(it.groupValues[2]) }.toList()
        sources = named.filter { it.first == "position" }.map { it.second }
        fun position(key: String) =
            requireNotNull(named.lastOrNull { it.first == key }?.second) { "the layout has no $key; add one for the listener" }
        from = position("from")
        to = position("to")
        speedMS = SPEED.find(text)?.groupValues?.get(1)?.toFloat() ?: USUAL_SPEED_M_S
        require((sources + listOf(from, to)).all { it.size == 3 }) { "a position in the layout does not have three coordinates" }
    }

    /** Position of the listener after some seconds of walking to and fro. */
    fun listenerAt(seconds: Double): FloatArray {
        val length = Math.sqrt((0..2).sumOf { ((to[it] - from[it]) * (to[it] - from[it])).toDouble() })
        val walked = (seconds * speedMS) % (2 * length)
        val part = (1 - Math.abs(walked / length - 1)).toFloat()
        return FloatArray(3) { from[it] + part * (to[it] - from[it]) }
    }

    private companion object {
        const val USUAL_SPEED_M_S = 1.4f
        val NUMBERS = Regex("""(?m)^(\w+) *= *\[([^\]]*)]""")
        val SPEED = Regex("""(?m)^speed_m_s *= *([0-9.]+)""")

        fun numbers(list: String) = list.split(',').map { it.trim().toFloat() }.toFloatArray()
    }
}
