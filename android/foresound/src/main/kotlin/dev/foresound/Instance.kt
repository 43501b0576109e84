package dev.foresound

/**
 * A moving part of the scene: a door, a lift, a vehicle. One thread at a time; changes take effect with the next
 * [Engine.tick]. Throws [IllegalArgumentException] for an invalid pose, and keeps the last one, or once it is closed.
 */
class Instance internal constructor(
    private val engine: Engine,
    private val id: Int,
    private val pose: FloatArray,
) : AutoCloseable {
    private val wanted = pose.copyOf()
    private var closed = false

    /** Moves the origin of its local coordinates, in metres. */
    fun set(x: Float, y: Float, z: Float) {
        wanted[0] = x
        wanted[1] = y
        wanted[2] = z
        move()
    }

    /** Rotates it about that origin by a quaternion of length 1; (0, 0, 0, 1) is no rotation. */
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
            // After an error, the last valid pose.
            pose.copyInto(wanted)
        }
    }

    /** Removes it. Idempotent. */
    override fun close() {
        if (closed) return
        closed = true
        engine.removeInstance(id)
    }
}
