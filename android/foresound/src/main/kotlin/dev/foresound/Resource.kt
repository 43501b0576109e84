package dev.foresound

import kotlinx.coroutines.CoroutineDispatcher
import kotlinx.coroutines.withContext

/** An object of the library that [close] frees: a [Scene] or a [Clip]. */
sealed class Resource(internal val handle: Long) : AutoCloseable {
    private var closed = false

    /** Frees it, after its last use by an engine. Idempotent. */
    @Synchronized
    final override fun close() {
        if (closed) return
        closed = true
        Native.close(handle)
    }
}

/** Loads on a dispatcher. Closes what was loaded if the caller was cancelled. */
internal suspend fun <T : Resource> load(dispatcher: CoroutineDispatcher, of: (Long) -> T, make: () -> Long): T {
    Native.require()
    var made: T? = null
    try {
        return withContext(dispatcher) { of(make()).also { made = it } }
    } catch (ended: Throwable) {
        made?.close()
        throw ended
    }
}
