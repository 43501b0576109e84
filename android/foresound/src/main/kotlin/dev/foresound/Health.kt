package dev.foresound

import dev.foresound.Native.EngineHealth as Index

/** Budget of an engine; the default is no limit. */
class Budget @JvmOverloads constructor(
    /** Maximum duration of a propagation update in seconds, 0.0001 to 10; null is no limit. */
    var updateSeconds: Double? = null,
    /** Maximum share of one core for propagation and sound together, 0.05 to 2; null is no limit. */
    var coreShare: Double? = null,
    /** Finest quality level in use: 0 full detail to 5 the coarsest. */
    var qualityLevel: Int = 0,
    /** That level exactly, regardless of load and temperature. */
    var fixed: Boolean = false,
) {
    internal fun numbers() = DoubleArray(Native.BudgetOptions.LENGTH).also {
        it[Native.BudgetOptions.QUALITY_LEVEL] = qualityLevel.toDouble()
        it[Native.BudgetOptions.FIXED] = if (fixed) 1.0 else 0.0
        it[Native.BudgetOptions.UPDATE_S] = limit("updateSeconds", updateSeconds)
        it[Native.BudgetOptions.CORE_SHARE] = limit("coreShare", coreShare)
    }

    /** The library's 0 for no limit; as a limit, 0 is an error. */
    private fun limit(name: String, value: Double?): Double {
        require(value != 0.0) { "$name: 0 is no limit; pass null" }
        return value ?: 0.0
    }
}

/** Load of an engine and temperature of the phone. */
class Health internal constructor(numbers: DoubleArray) {
    val state = EngineState.entries[numbers[Index.STATE].toInt()]
    /** Quality level in use, 0 full detail to 5 the coarsest. */
    val qualityLevel = numbers[Index.QUALITY_LEVEL].toInt()
    /** Finest quality level allowed by the temperature. */
    val thermalQualityLevel = numbers[Index.THERMAL_QUALITY_LEVEL].toInt()
    /** The system's thermal status, 0 none to 6 shutdown; null if unknown. */
    val thermalStatus: Int? = numbers[Index.THERMAL_STATUS].toInt().takeIf { it >= 0 }
    /** The system's thermal headroom, 1 is severe throttling; null if unknown. */
    val thermalHeadroom: Float? = numbers[Index.THERMAL_HEADROOM].toFloat().takeIf { it >= 0 }
    /** Whether the propagation thread has a performance hint session. */
    val hintsPropagation = numbers[Index.HINTED].toInt() and Native.HintedThread.PROPAGATION != 0
    /** Whether the audio thread has a performance hint session. */
    val hintsSound = numbers[Index.HINTED].toInt() and Native.HintedThread.AUDIO != 0
    /**
     * Sources without a slot in the newest tick, as nothing of them would be heard: they play nothing, are below -100 dB re full
     * scale, or are masked, with less than a millionth (-60 dB) of the energy of all sources at the listener.
     */
    val unheardSources = numbers[Index.UNHEARD_SOURCES].toInt()
    /** Rays cast by the newest update. */
    val rays = numbers[Index.RAYS].toLong()
    /** Share of one core used by sound. */
    val soundShare = numbers[Index.SOUND_SHARE]
    /** Duration of the newest update in seconds. */
    val propagationS = numbers[Index.PROPAGATION_S]
    /** Time between graphics frames in seconds. */
    val graphicsFrameS = numbers[Index.GRAPHICS_FRAME_S]
}
