package dev.foresound

import dev.foresound.Native.Options as Index

/** When propagation runs. */
enum class Schedule(internal val number: Int) {
    ASYNCHRONOUS(Native.Schedule.ASYNCHRONOUS),
    SYNCHRONOUS(Native.Schedule.SYNCHRONOUS),
}

/** Extrapolation of paths between updates. */
enum class Predictor(internal val number: Int) {
    HOLD(Native.Predictor.HOLD),
    LINEAR(Native.Predictor.LINEAR),
    GEOMETRIC(Native.Predictor.GEOMETRIC),
}

/** Cores of the engine's threads. Android advises to leave the choice to the system. */
enum class Affinity(internal val number: Int) {
    SYSTEM(Native.Affinity.SYSTEM),
    FASTEST(Native.Affinity.FASTEST),
    /** [EngineOptions.propagationCore] and [EngineOptions.audioCore]. */
    CHOSEN(Native.Affinity.CHOSEN),
}

/** Channels of the output and their order; see the guide's page on layouts. */
enum class Layout(internal val number: Int) {
    /** Two ears, for headphones. */
    BINAURAL(Native.Layout.BINAURAL),
    /** Left and right by amplitude panning, for loudspeakers such as the phone's. */
    STEREO(Native.Layout.STEREO),
    /** One channel; both channels of the device have it equally. */
    MONO(Native.Layout.MONO),
    SURROUND_51(Native.Layout.SURROUND51),
    SURROUND_71(Native.Layout.SURROUND71),
    SURROUND_714(Native.Layout.SURROUND714),
    /** Ambisonics as AmbiX: order ACN, normalisation SN3D. */
    AMBISONICS_1(Native.Layout.AMBISONICS1),
    AMBISONICS_2(Native.Layout.AMBISONICS2),
    AMBISONICS_3(Native.Layout.AMBISONICS3),
}

/** What a source's output holds ([Engine.renderSource]). Mix it in every case. */
enum class Bus {
    /** The source's paths. */
    OWN,
    /**
     * The source shares a slot, or has no position: it is heard in [Engine.renderReverb]'s output. What it left in a slot of its
     * own fades out here.
     */
    SHARED,
    /** The source is not heard: masked by others, or the engine is paused. What it left in a slot of its own fades out here. */
    SILENT,
}

/** Settings of an engine. Null is the library's default. */
class EngineOptions @JvmOverloads constructor(
    /** 44,100 or 48,000 Hz. The device's (`AudioManager.PROPERTY_OUTPUT_SAMPLE_RATE`) has the lowest latency. */
    var rateHz: Int = 48_000,
    /** Maximum number of sources, 1 to 4,096. */
    var maxSources: Int = 16,
    /** Audio frames a block, 32 to 4,096. */
    var blockFrames: Int? = null,
    /** Maximum number of paths rendered at once, 1 to 16,384. */
    var maxVoices: Int? = null,
    /** Rays from the listener an update, 1 to 65,536. */
    var guideRays: Int? = null,
    /** Rays from each source an update, 1 to 65,536. */
    var sourceRays: Int? = null,
    /** Maximum reflection order, 0 to 4. */
    var depth: Int? = null,
    var schedule: Schedule = Schedule.ASYNCHRONOUS,
    var predictor: Predictor? = null,
    var affinity: Affinity = Affinity.SYSTEM,
    /** Duration of a graphics frame in seconds; null: measured from the ticks. */
    var frameSeconds: Double? = null,
    /** Content of an HRTF set's file, SOFA (some seconds) or baked; null is the built-in set. */
    var hrtf: ByteArray? = null,
    /** Whether imminent thermal throttling lowers the quality level (API 30 and later). */
    var thermal: Boolean = true,
    /** Whether the threads report their durations to the system (performance hints, API 33 and later). */
    var hints: Boolean = true,
    /** Maximum number of paths that [Engine.paths] returns, 0 to 16,384. */
    var shownPaths: Int = 0,
    /** Maximum memory of the engine in MiB, without scenes and sounds; an engine of more is refused. */
    var maxMemoryMib: Int? = null,
    /** Sources with a slot of their own, 1 to 256; null: as many as [maxSources], at most 256. */
    var sourceSlots: Int? = null,
    /** Number of the loudest paths, of those rendered, that are rendered in full detail; at most [maxVoices]. */
    var fineVoices: Int? = null,
    /** Maximum number of paths of an update, 1 to 16,384. */
    var maxPaths: Int? = null,
    /** Maximum number of edges that a path is diffracted at, 0 to 2. */
    var diffractionOrder: Int? = null,
    /** Threads of an update in the synchronous schedule, the calling one included, 1 to 64. */
    var tracingThreads: Int? = null,
    /** Whether the work of a graphics frame is spread over its blocks. */
    var evenBlocks: Boolean = true,
    /** Whether there is late reverb. */
    var lateReverb: Boolean = true,
    /** Whether a limiter keeps peaks below [ceilingDb]. */
    var limiter: Boolean = true,
    /** Ceiling of the limiter in dB re full scale, -60 to 0. */
    var ceilingDb: Float? = null,
    /** Distance in metres below which a source gets no louder. */
    var minDistanceM: Float? = null,
    /** Maximum path delay in seconds, 0.01 to 10. */
    var maxDelaySeconds: Double? = null,
    /** Whether both ears receive the same signal, without an HRTF set. */
    var withoutHrtf: Boolean = false,
    /** Core of the propagation thread for [Affinity.CHOSEN]. */
    var propagationCore: Int = 0,
    /** Core of the audio thread for [Affinity.CHOSEN]. */
    var audioCore: Int = 0,
    /** Seed of the ray directions. */
    var seed: Int? = null,
    /** Layout of the output at first; [Engine.setLayout] changes it. */
    var layout: Layout = Layout.BINAURAL,
    /** Channels of the output, constant, to 16; null: those of [layout]. [Engine.start] needs two. */
    var outputChannels: Int? = null,
    /** Whether [Engine.renderSource] can render sources apart, for a mixer of the app's own. */
    var sourceBuses: Boolean = false,
    /** Listeners, 1 to 4: for a split screen or spectators ([Engine.listeners]). */
    var listeners: Int = 1,
) {
    init {
        check()
    }

    /** Ranges of what is allocated here. */
    private fun check() {
        require(maxSources in 1..MAX_SOURCES) { "maxSources: $maxSources is outside 1 to $MAX_SOURCES" }
        require(shownPaths in 0..MAX_PATHS) { "shownPaths: $shownPaths is outside 0 to $MAX_PATHS" }
        require(listeners in 1..MAX_LISTENERS) { "listeners: $listeners is outside 1 to $MAX_LISTENERS" }
        require(sourceSlots != 0) { "sourceSlots: 0 is no slot; pass null" }
    }

    internal fun numbers(): DoubleArray {
        Native.require()
        check()
        val numbers = DoubleArray(Index.LENGTH)
        Native.optionsDefault(numbers)
        fun set(index: Int, value: Number?) = value?.let { numbers[index] = it.toDouble() }
        fun flag(index: Int, value: Boolean) = set(index, if (value) 1 else 0)
        set(Index.RATE_HZ, rateHz)
        set(Index.BLOCK_FRAMES, blockFrames)
        set(Index.MAX_SOURCES, maxSources)
        set(Index.SOURCE_SLOTS, sourceSlots)
        set(Index.MAX_VOICES, maxVoices)
        set(Index.FINE_VOICES, fineVoices)
        set(Index.MAX_PATHS, maxPaths)
        set(Index.GUIDE_RAYS, guideRays)
        set(Index.SOURCE_RAYS, sourceRays)
        set(Index.DEPTH, depth)
        set(Index.DIFFRACTION_ORDER, diffractionOrder)
        set(Index.SEED, seed)
        set(Index.SCHEDULE, schedule.number)
        set(Index.TRACING_THREADS, tracingThreads)
        set(Index.PREDICTOR, predictor?.number)
        flag(Index.EVEN_BLOCKS, evenBlocks)
        set(Index.AFFINITY, affinity.number)
        set(Index.PROPAGATION_CORE, propagationCore)
        set(Index.AUDIO_CORE, audioCore)
        set(Index.HRTF, if (withoutHrtf) Native.Hrtf.NONE else Native.Hrtf.SET)
        flag(Index.LATE_REVERB, lateReverb)
        flag(Index.LIMITER, limiter)
        val thermalBit = if (thermal) Native.DeviceHint.THERMAL else 0
        set(Index.DEVICE_HINTS, thermalBit + if (hints) Native.DeviceHint.PERFORMANCE else 0)
        set(Index.SHOWN_PATHS, shownPaths)
        set(Index.MAX_MEMORY_MIB, maxMemoryMib)
        set(Index.MIN_DISTANCE_M, minDistanceM)
        set(Index.CEILING_DB, ceilingDb)
        set(Index.FRAME_S, frameSeconds)
        set(Index.MAX_DELAY_S, maxDelaySeconds)
        set(Index.LAYOUT, layout.number)
        set(Index.OUTPUT_CHANNELS, outputChannels)
        flag(Index.SOURCE_BUSES, sourceBuses)
        set(Index.LISTENERS, listeners)
        return numbers
    }

    private companion object {
        const val MAX_SOURCES = 4096
        const val MAX_LISTENERS = 4
        const val MAX_PATHS = 16_384
    }
}
