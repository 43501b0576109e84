package dev.foresound

import android.content.Context
import java.io.File
import kotlinx.coroutines.CoroutineDispatcher
import kotlinx.coroutines.Dispatchers

/**
 * A room of triangles that does not change; another one replaces it. Any thread. Loading suspends: it runs on a
 * dispatcher of its own choice and takes as long as a tree over the triangles does, milliseconds to seconds.
 *
 * Cancelling a load ends the wait, and the scene is closed as soon as it is there. An engine that uses a closed scene
 * keeps it.
 */
class Scene private constructor(handle: Long) : Loaded(handle) {
    /** What became of the mesh. */
    val info: SceneInfo
        get() {
            val numbers = DoubleArray(Native.SCENE_INFO)
            Native.sceneInfo(handle, numbers)
            return SceneInfo(numbers)
        }

    companion object {
        /**
         * From an OBJ file; `usemtl` names its materials. [materials] is the text of a materials file (TOML) or null.
         * Throws [java.io.IOException] where the file cannot be read, [IllegalArgumentException] with file and line where
         * its content is wrong.
         */
        suspend fun fromFile(
            file: File,
            materials: String? = null,
            dispatcher: CoroutineDispatcher = Dispatchers.IO,
        ): Scene = load(dispatcher, ::Scene) { Native.sceneFromFile(file.path, materials, null) }

        /** From an OBJ file among the app's assets, by way of the cache folder. */
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
         * From an engine's buffers: three coordinates a vertex in metres (+y up), three indices a triangle; one index
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

/** What became of a mesh. */
class SceneInfo internal constructor(numbers: DoubleArray) {
    val trianglesIn = numbers[0].toLong()
    val triangles = numbers[1].toLong()
    val surfaces = numbers[2].toLong()
    /** Materials whose name no table knows; they are the generic one. */
    val unknownMaterials = numbers[3].toLong()
    val memoryBytes = numbers[4].toLong()
    val speedOfSoundMS = numbers[5]
    /** Least and greatest coordinates in metres. */
    val boundsMinM = numbers.copyOfRange(6, 9)
    val boundsMaxM = numbers.copyOfRange(9, 12)
}
