package dev.foresound

import android.content.Context
import dev.foresound.Native.SceneInfo as Index
import java.io.File
import kotlinx.coroutines.CoroutineDispatcher
import kotlinx.coroutines.Dispatchers

/**
 * An immutable scene of triangles. Any thread. Loading suspends on a dispatcher and takes milliseconds to seconds.
 *
 * A cancelled load closes its scene as soon as it exists. Engines continue to use a closed scene.
 */
class Scene private constructor(handle: Long) : Resource(handle) {
    /** Properties of the scene. */
    val info: SceneInfo
        get() {
            val numbers = DoubleArray(Native.SceneInfo.LENGTH)
            Native.sceneInfo(handle, numbers)
            return SceneInfo(numbers)
        }

    companion object {
        /**
         * From an OBJ file; `usemtl` names its materials. [materials] is the text of a materials file (TOML) or null.
         * Throws [java.io.IOException] for an unreadable file, [IllegalArgumentException] with file and line for invalid
         * content.
         */
        suspend fun fromFile(
            file: File,
            materials: String? = null,
            dispatcher: CoroutineDispatcher = Dispatchers.IO,
        ): Scene = load(dispatcher, ::Scene) { Native.sceneFromFile(file.path, materials, null) }

        /** From an OBJ file among the app's assets, copied to the cache folder. */
        suspend fun fromAsset(
            context: Context,
            name: String,
            materials: String? = null,
            dispatcher: CoroutineDispatcher = Dispatchers.IO,
        ): Scene = load(dispatcher, ::Scene) {
            val copy = File.createTempFile("foresound", ".obj", context.cacheDir)
            try {
                openAsset(context, name).use { asset -> copy.outputStream().use { asset.copyTo(it) } }
                Native.sceneFromFile(copy.path, materials, null)
            } finally {
                copy.delete()
            }
        }

        /**
         * From a game engine's arrays: three coordinates a vertex in metres (+y up), three indices a triangle; one index
         * into [materialNames] a triangle, or neither.
         */
        suspend fun fromMesh(
            positions: FloatArray,
            indices: IntArray,
            triangleMaterials: IntArray? = null,
            materialNames: Array<String>? = null,
            materials: String? = null,
            dispatcher: CoroutineDispatcher = Dispatchers.Default,
        ): Scene = load(dispatcher, ::Scene) {
            Native.sceneFromMesh(positions, indices, triangleMaterials, materialNames, materials, null)
        }
    }
}

/** Properties of a scene. */
class SceneInfo internal constructor(numbers: DoubleArray) {
    val trianglesIn = numbers[Index.TRIANGLES_IN].toLong()
    val triangles = numbers[Index.TRIANGLES].toLong()
    val surfaces = numbers[Index.SURFACES].toLong()
    /** Materials that no table defines; they have the default's properties. */
    val unknownMaterials = numbers[Index.UNKNOWN_MATERIALS].toLong()
    val memoryBytes = numbers[Index.MEMORY_BYTES].toLong()
    val speedOfSoundMS = numbers[Index.SPEED_OF_SOUND_M_S]
    /** Minimum and maximum coordinates in metres. */
    val boundsMinM = numbers.copyOfRange(Index.BOUNDS_MIN_M, Index.BOUNDS_MIN_M + 3)
    val boundsMaxM = numbers.copyOfRange(Index.BOUNDS_MAX_M, Index.BOUNDS_MAX_M + 3)
}
