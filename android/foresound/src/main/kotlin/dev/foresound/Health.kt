package dev.foresound

/** What an engine may spend; the default is no limit. */
class Budget(
    /** Longest time of a propagation update in seconds, 0.0001 to 10; null is no limit. */
    val updateSeconds: Double? = null,
    /** Share of one core for propagation and sound together, 0.05 to 2; null is no limit. */
    val coreShare: Double? = null,
    /** Most detail: 0 everything to 5 the least. */
    val leastTier: Int = 0,
    /** Holds that tier exactly, whatever the budget and the phone's heat say. */
    val fixed: Boolean = false,
) {
    internal fun numbers() = doubleArrayOf(
        leastTier.toDouble(),
        if (fixed) 1.0 else 0.0,
        // Zero would be no limit, and nobody asks for that by number.
        updateSeconds?.also { require(it != 0.0) { "updateSeconds: 0 is no limit; give null" } } ?: 0.0,
        coreShare?.also { require(it != 0.0) { "coreShare: 0 is no limit; give null" } } ?: 0.0,
    )
}

/** How an engine bears its load, and the phone its heat. */
class Health internal constructor(numbers: DoubleArray) {
    val state = EngineState.entries[numbers[0].toInt()]
    /** Tier of detail in force, 0 everything to 5 the least. */
    val tier = numbers[1].toInt()
    /** Least tier because of heat. */
    val thermalTier = numbers[2].toInt()
    /** The system's thermal status, 0 none to 6 shutdown; null where it says nothing. */
    val thermalStatus: Int? = numbers[3].toInt().takeIf { it >= 0 }
    /** The system's forecast of heat, 1 is severe throttling; null where it says nothing. */
    val thermalHeadroom: Float? = numbers[4].toFloat().takeIf { it >= 0 }
    /** Whether the system hears how long propagation's work takes. */
    val hintsPropagation = numbers[5].toInt() and 1 != 0
    /** Whether the system hears how long sound's work takes. */
    val hintsSound = numbers[5].toInt() and 2 != 0
    /** Sources that others mask, where there are more than slots. */
    val unheardSources = numbers[6].toInt()
    /** Rays of the newest update. */
    val rays = numbers[7].toLong()
    /** Share of a core that sound takes lately. */
    val soundShare = numbers[8]
    /** T_SPS: time of the newest update in seconds. */
    val propagationS = numbers[9]
    /** T_g: time between the graphics frames that are heard, in seconds. */
    val graphicsFrameS = numbers[10]
}

/** A path of sound as a line with corners in metres, from source to listener. */
class ShownPath internal constructor(floats: FloatArray, at: Int) {
    /** Slot of the source it starts at. */
    val sourceSlot = floats[at].toInt()
    val reflections = floats[at + 2].toInt()
    val bends = floats[at + 3].toInt()
    /** Level in dB relative to the free field at 1 m. */
    val levelDb = floats[at + 4]
    /** Three coordinates a corner. */
    val corners: FloatArray = floats.copyOfRange(at + 5, at + 5 + 3 * floats[at + 1].toInt())
}
