package dev.foresound

import android.util.Log
import java.lang.ref.PhantomReference
import java.lang.ref.ReferenceQueue
import java.util.concurrent.ConcurrentHashMap
import kotlinx.coroutines.CancellationException
import kotlinx.coroutines.CoroutineDispatcher
import kotlinx.coroutines.async
import kotlinx.coroutines.coroutineScope

/** Handles of the library that belong to one object, closed once in their order; one that fails leaves none of the others open. */
internal class Handles(private vararg val handles: Long) {
    private var closed = false

    /** Whether they are closed. */
    @get:Synchronized
    val areClosed: Boolean
        get() = closed

    /** Puts another handle in the place of one that the library closed. */
    @Synchronized
    fun replace(index: Int, handle: Long) {
        handles[index] = handle
    }

    @Synchronized
    fun close() {
        if (closed) return
        closed = true
        var failed: RuntimeException? = null
        for (handle in handles) {
            try {
                Native.close(handle)
            } catch (failure: RuntimeException) {
                failed = failed ?: failure
            }
        }
        if (failed != null) throw failed
    }
}

/**
 * Closes the handles of objects that were forgotten without `close`, on a thread of its own, some time after their last use.
 * `java.lang.ref.Cleaner` does the same from API 33 on.
 */
internal object Cleaner {
    private val queue = ReferenceQueue<Any>()
    private val entries: MutableSet<Entry> = ConcurrentHashMap.newKeySet()

    private class Entry(owner: Any, val handles: Handles) : PhantomReference<Any>(owner, queue)

    init {
        Thread(::clean, "foresound-cleaner").apply { isDaemon = true }.start()
    }

    /** Closes [handles], which do not refer to [owner], once that is unreachable. */
    fun watch(owner: Any, handles: Handles): Handles {
        entries.add(Entry(owner, handles))
        return handles
    }

    /** Forgets handles that were closed. */
    fun forget(handles: Handles) {
        entries.removeIf { it.handles === handles }
    }

    private fun clean() {
        while (true) {
            val entry = queue.remove() as Entry
            entries.remove(entry)
            try {
                entry.handles.close()
            } catch (failure: RuntimeException) {
                // Nobody waits for it, and the objects after it are closed too.
                Log.w("foresound", "a forgotten object was not closed", failure)
            }
        }
    }
}

/** An object of the library that [close] frees: a [Scene] or a [Clip]. A forgotten one is freed some time later. */
sealed class Resource(internal val handle: Long) : AutoCloseable {
    private val handles = Cleaner.watch(this, Handles(handle))

    /** Frees it, after its last use by an engine. Idempotent. */
    final override fun close() {
        handles.close()
        Cleaner.forget(handles)
    }
}

/** Progress of a scene's construction, which another thread follows and cancels. For one construction. */
class Progress : AutoCloseable {
    internal val handle: Long
    private val handles: Handles

    init {
        Native.require()
        handle = Native.progressCreate()
        handles = Cleaner.watch(this, Handles(handle))
    }

    /** The share that is done, 0 to 1. */
    val done: Float
        get() = Native.progressRead(handle)

    /** Cancels the construction, which throws [java.util.concurrent.CancellationException] soon. */
    fun cancel() = Native.progressCancel(handle)

    /** Frees it, after the construction. Idempotent. */
    override fun close() {
        handles.close()
        Cleaner.forget(handles)
    }
}

/** Loads on a dispatcher. A cancelled caller ends the construction of a scene, and what was loaded is closed. */
internal suspend fun <T : Resource> load(dispatcher: CoroutineDispatcher, make: (Progress) -> T): T {
    var made: T? = null
    val progress = Progress()
    try {
        return coroutineScope {
            val work = async(dispatcher) { make(progress).also { made = it } }
            try {
                work.await()
            } catch (ended: CancellationException) {
                progress.cancel()
                throw ended
            }
        }
    } catch (ended: Throwable) {
        made?.close()
        throw ended
    } finally {
        progress.close()
    }
}
