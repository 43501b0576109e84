package dev.foresound

import android.content.Context
import dev.foresound.Native.SceneInfo as Index
import dev.foresound.Native.SceneOptions as Options
import java.io.File
import kotlinx.coroutines.CoroutineDispatcher
import kotlinx.coroutines.Dispatchers

/** Upward axis of a file. */
enum class UpAxis(internal val number: Int) {
    Y(Native.UpAxis.Y),
    Z(Native.UpAxis.Z),
}

/** Settings of a scene. Null is the library's default. */
class SceneOptions @JvmOverloads constructor(
    /** Upward axis of a file. */
    var up: UpAxis = UpAxis.Y,
    /** Metres a unit of a file. */
    var scale: Float? = null,
    /** Air temperature in degrees Celsius. */
    var temperatureC: Float? = null,
    /** Relative humidity in percent. */
    var humidityPercent: Float? = null,
    /** Static pressure in kPa. */
    var pressureKpa: Float? = null,
    /** Least area in m² of a plane panel that reflects like a mirror. */
    var minPanelM2: Float? = null,
    /** Largest area in m² of a panel whose free edges limit its reflection; 0: none. */
    var maxFinitePanelM2: Float? = null,
    /** Maximum number of triangles. */
    var maxTriangles: Int? = null,
    /** Distance in metres from a common plane within which corners are roughness of one plane surface; 0: none. */
    var acousticToleranceM: Float? = null,
) {
    internal fun numbers(): DoubleArray {
        val numbers = DoubleArray(Options.LENGTH)
        Native.sceneOptionsDefault(numbers)
        numbers[Options.UP] = up.number.toDouble()
        scale?.let { numbers[Options.SCALE] = it.toDouble() }
        temperatureC?.let { numbers[Options.TEMPERATURE_C] = it.toDouble() }
        humidityPercent?.let { numbers[Options.HUMIDITY_PERCENT] = it.toDouble() }
        pressureKpa?.let { numbers[Options.PRESSURE_KPA] = it.toDouble() }
        minPanelM2?.let { numbers[Options.MIN_PANEL_M2] = it.toDouble() }
        maxFinitePanelM2?.let { numbers[Options.MAX_FINITE_PANEL_M2] = it.toDouble() }
        acousticToleranceM?.let { numbers[Options.ACOUSTIC_TOLERANCE_M] = it.toDouble() }
        maxTriangles?.let { numbers[Options.MAX_TRIANGLES] = it.toDouble() }
        return numbers
    }
}

/**
 * An immutable scene of triangles. Any thread. Construction takes milliseconds to seconds: the functions `from...` suspend on a
 * dispatcher, and a cancelled one ends the construction; the functions `load...` block, for Java and for threads of one's own.
 *
 * Engines continue to use a closed scene.
 */
class Scene private constructor(handle: Long) : Resource(handle) {
    /** Properties of the scene. */
    val info: SceneInfo
        get() {
            val numbers = DoubleArray(Native.SceneInfo.LENGTH)
            Native.sceneInfo(handle, numbers)
            return SceneInfo(numbers)
        }

    /** Saves the scene to a file that [loadFile], [loadAsset] and [loadBytes] load without the work of construction. Blocks. */
    fun save(file: File) = Native.sceneSave(handle, file.path)

    companion object {
        /** From the bytes of a saved scene ([save], or `foresound commit`). Blocks, for a fraction of the construction. */
        @JvmStatic
        fun loadBytes(bytes: ByteArray): Scene {
            Native.require()
            return Scene(Native.sceneFromBytes(bytes))
        }

        /**
         * From an OBJ or PLY file, which names its materials, or from a saved scene. [materials] is the text of a materials file (TOML) or null.
         * Throws [java.io.IOException] for an unreadable file, [IllegalArgumentException] with file and line for invalid
         * content, [java.util.concurrent.CancellationException] after [Progress.cancel]. Blocks.
         */
        @JvmStatic
        @JvmOverloads
        fun loadFile(
            file: File,
            materials: String? = null,
            options: SceneOptions = SceneOptions(),
            progress: Progress? = null,
        ): Scene {
            Native.require()
            return Scene(Native.sceneFromFile(file.path, materials, options.numbers(), progress?.handle ?: 0))
        }

        /** From an OBJ or PLY file or a saved scene among the app's assets, copied to the cache folder. Blocks. */
        @JvmStatic
        @JvmOverloads
        fun loadAsset(
            context: Context,
            name: String,
            materials: String? = null,
            options: SceneOptions = SceneOptions(),
            progress: Progress? = null,
        ): Scene {
            val copy = File.createTempFile("foresound", ".mesh", context.cacheDir)
            try {
                openAsset(context, name).use { asset -> copy.outputStream().use { asset.copyTo(it) } }
                return loadFile(copy, materials, options, progress)
            } finally {
                copy.delete()
            }
        }

        /**
         * From a game engine's arrays: three coordinates a vertex in metres (+y up), three indices a triangle; one index
         * into [materialNames] a triangle, or neither. Blocks.
         */
        @JvmStatic
        @JvmOverloads
        fun loadMesh(
            positions: FloatArray,
            indices: IntArray,
            triangleMaterials: IntArray? = null,
            materialNames: Array<String>? = null,
            materials: String? = null,
            options: SceneOptions = SceneOptions(),
            progress: Progress? = null,
        ): Scene {
            Native.require()
            val handle = Native.sceneFromMesh(
                positions,
                indices,
                triangleMaterials,
                materialNames,
                materials,
                options.numbers(),
                progress?.handle ?: 0,
            )
            return Scene(handle)
        }

        /** As [loadFile], on a dispatcher. */
        suspend fun fromFile(
            file: File,
            materials: String? = null,
            options: SceneOptions = SceneOptions(),
            dispatcher: CoroutineDispatcher = Dispatchers.IO,
        ): Scene = load(dispatcher) { loadFile(file, materials, options, it) }

        /** As [loadAsset], on a dispatcher. */
        suspend fun fromAsset(
            context: Context,
            name: String,
            materials: String? = null,
            options: SceneOptions = SceneOptions(),
            dispatcher: CoroutineDispatcher = Dispatchers.IO,
        ): Scene = load(dispatcher) { loadAsset(context, name, materials, options, it) }

        /** As [loadMesh], on a dispatcher. */
        suspend fun fromMesh(
            positions: FloatArray,
            indices: IntArray,
            triangleMaterials: IntArray? = null,
            materialNames: Array<String>? = null,
            materials: String? = null,
            options: SceneOptions = SceneOptions(),
            dispatcher: CoroutineDispatcher = Dispatchers.Default,
        ): Scene = load(dispatcher) {
            loadMesh(positions, indices, triangleMaterials, materialNames, materials, options, it)
        }
    }
}

/** Properties of a scene. */
class SceneInfo internal constructor(numbers: DoubleArray) {
    /** Triangles of the mesh. */
    val trianglesIn = numbers[Index.TRIANGLES_IN].toLong()
    /** Triangles kept: finite, with an area. */
    val triangles = numbers[Index.TRIANGLES].toLong()
    /** Plane surfaces that they form. */
    val surfaces = numbers[Index.SURFACES].toLong()
    /** Materials that no table defines; they have the default's properties. */
    val unknownMaterials = numbers[Index.UNKNOWN_MATERIALS].toLong()
    /** Memory of the scene in bytes. */
    val memoryBytes = numbers[Index.MEMORY_BYTES].toLong()
    /** Speed of sound in metres a second. */
    val speedOfSoundMS = numbers[Index.SPEED_OF_SOUND_M_S]
    /** Minimum coordinates in metres. */
    val boundsMinM = numbers.copyOfRange(Index.BOUNDS_MIN_M, Index.BOUNDS_MIN_M + 3)
    /** Maximum coordinates in metres. */
    val boundsMaxM = numbers.copyOfRange(Index.BOUNDS_MAX_M, Index.BOUNDS_MAX_M + 3)
}
