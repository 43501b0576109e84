package dev.foresound

import dev.foresound.Native.ShownPath as Index

/** A path as a polyline in metres, from source to listener. */
class ShownPath internal constructor(numbers: DoubleArray, start: Int) {
    /** Slot of the source: [Source.slot]. */
    val sourceSlot = slotOf(numbers[start + Index.SOURCE].toLong().toInt())
    val reflections = numbers[start + Index.REFLECTIONS].toInt()
    val diffractionOrder = numbers[start + Index.DIFFRACTION_ORDER].toInt()
    /** Level in dB re the free field at 1 m. */
    val levelDb = numbers[start + Index.LEVEL_DB].toFloat()
    /** Three coordinates a corner, both ends included. */
    val corners = FloatArray(3 * numbers[start + Index.CORNER_COUNT].toInt()) {
        numbers[start + Index.CORNERS_M + it].toFloat()
    }
}
