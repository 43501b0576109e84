package dev.foresound

/**
 * A part of the scene that moves: a door, a lift, a vehicle. Any one thread at a time; heard from the next [Engine.tick]
 * on. Throws [IllegalArgumentException] for numbers that cannot be, and stays where it was, or once it is closed.
 */
class Instance internal constructor(
    private val engine: Engine,
    private val id: Int,
    x: Float,
    y: Float,
    z: Float,
) : AutoCloseable {
    private val pose = floatArrayOf(x, y, z, 0f, 0f, 0f, 1f)
    private val wanted = pose.copyOf()
    private var closed = false

    /** Moves the origin of its own coordinates, in metres. */
    fun set(x: Float, y: Float, z: Float) {
        wanted[0] = x
        wanted[1] = y
        wanted[2] = z
        move()
    }

    /** Turns it about that origin by a quaternion of length 1; (0, 0, 0, 1) leaves it as its part was made. */
    fun turn(x: Float, y: Float, z: Float, w: Float) {
        wanted[3] = x
        wanted[4] = y
        wanted[5] = z
        wanted[6] = w
        move()
    }

    private fun move() {
        try {
            engine.move(id, wanted)
            wanted.copyInto(pose)
        } finally {
            // What was refused is forgotten.
            pose.copyInto(wanted)
        }
    }

    /** Removes it. Closing twice is nothing. */
    override fun close() {
        if (closed) return
        closed = true
        engine.removeInstance(id)
    }
}
