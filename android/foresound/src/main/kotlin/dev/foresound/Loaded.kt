package dev.foresound

import kotlinx.coroutines.CoroutineDispatcher
import kotlinx.coroutines.withContext

/** What is loaded by the library and freed by [close]: a [Scene] or a [Clip]. */
sealed class Loaded(internal val handle: Long) : AutoCloseable {
    private var closed = false

    /** Lets go of it; who uses it keeps it. Closing twice is nothing. */
    @Synchronized
    final override fun close() {
        if (closed) return
        closed = true
        Native.close(handle)
    }
}

/** Loads on a dispatcher. A handle whose waiter was cancelled must not be lost on its way back. */
internal suspend fun <T : Loaded> load(dispatcher: CoroutineDispatcher, of: (Long) -> T, make: () -> Long): T {
    Native.require()
    var made: T? = null
    try {
        return withContext(dispatcher) { of(make()).also { made = it } }
    } catch (ended: Throwable) {
        made?.close()
        throw ended
    }
}
