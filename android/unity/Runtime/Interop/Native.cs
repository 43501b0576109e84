// Written from include/foresound.h by `FORESOUND_WRITE_HEADER=1 cargo test --test c_header`; do not edit.

using System;
using System.Runtime.InteropServices;

namespace Foresound.Interop
{
    /// <summary>Result of every call.</summary>
    public enum Status : int
    {
        /// <summary>Success.</summary>
        Ok = 0,
        /// <summary>A number, size or text is out of range.</summary>
        BadArgument = 1,
        /// <summary>A pointer or reference is null where a value is required.</summary>
        Null = 2,
        /// <summary>The handle was closed or never existed.</summary>
        Closed = 3,
        /// <summary>The handle is of another kind.</summary>
        WrongKind = 4,
        /// <summary>Another thread is using the handle; audio calls do not wait.</summary>
        Busy = 5,
        /// <summary>A file cannot be read.</summary>
        File = 6,
        /// <summary>The content of a file or mesh is invalid.</summary>
        Format = 7,
        /// <summary>The source was removed or never added.</summary>
        StaleSource = 8,
        /// <summary>The call is not possible in the engine's present state.</summary>
        State = 9,
        /// <summary>Too many handles are open.</summary>
        Full = 10,
        /// <summary>
        /// A defect of the library was caught. The handle accepts nothing but foresound_close from now on.
        /// </summary>
        Panic = 11,
        /// <summary>The instance was removed or never added.</summary>
        StaleInstance = 12,
        /// <summary>The caller's header is of another major version than the library.</summary>
        Version = 13,
        /// <summary>The call was cancelled.</summary>
        Cancelled = 14,
    }

    /// <summary>When propagation runs.</summary>
    public enum Schedule : uint
    {
        /// <summary>Continuously, on a thread of its own.</summary>
        Asynchronous = 0,
        /// <summary>Within every tick.</summary>
        Synchronous = 1,
    }

    /// <summary>Extrapolation of paths between updates.</summary>
    public enum Predictor : uint
    {
        /// <summary>Paths stay as the update had them.</summary>
        Hold = 0,
        /// <summary>Delays and amplitudes go on along lines.</summary>
        Linear = 1,
        /// <summary>
        /// Paths are computed anew for the poses of graphics frames. The default; `best` on the command line.
        /// </summary>
        Geometric = 2,
    }

    /// <summary>Cores of an engine's threads.</summary>
    public enum Affinity : uint
    {
        /// <summary>The system chooses.</summary>
        System = 0,
        /// <summary>The two fastest.</summary>
        Fastest = 1,
        /// <summary>Those that the options name.</summary>
        Chosen = 2,
    }

    /// <summary>What turns paths into two ears.</summary>
    public enum Hrtf : uint
    {
        /// <summary>The HRTF set passed at creation, else the built-in one.</summary>
        Set = 0,
        /// <summary>None: both ears receive the same signal.</summary>
        None = 1,
    }

    /// <summary>Channels of the output and their order.</summary>
    public enum Layout : uint
    {
        /// <summary>Two ears, for headphones.</summary>
        Binaural = 0,
        /// <summary>Left and right by amplitude panning, for loudspeakers such as a phone's.</summary>
        Stereo = 1,
        /// <summary>One channel; the first two of more have it equally.</summary>
        Mono = 2,
        /// <summary>Six channels: left, right, centre, LFE (silent), left and right surround.</summary>
        Surround51 = 3,
        /// <summary>
        /// Eight channels: left, right, centre, LFE (silent), left and right back, left and right side.
        /// </summary>
        Surround71 = 4,
        /// <summary>
        /// Twelve channels: those of 7.1, then top front left and right, top back left and right.
        /// </summary>
        Surround714 = 5,
        /// <summary>Four channels of Ambisonics of order 1: AmbiX, order ACN, normalisation SN3D.</summary>
        Ambisonics1 = 6,
        /// <summary>Nine channels of Ambisonics of order 2.</summary>
        Ambisonics2 = 7,
        /// <summary>Sixteen channels of Ambisonics of order 3.</summary>
        Ambisonics3 = 8,
    }

    /// <summary>State of an engine.</summary>
    public enum EngineState : uint
    {
        /// <summary>Running.</summary>
        Running = 0,
        /// <summary>Paused.</summary>
        Paused = 1,
        /// <summary>
        /// Propagation failed; sound continues with the last paths. Call foresound_engine_restart.
        /// </summary>
        PropagationFailed = 2,
        /// <summary>The renderer was closed. Create another engine.</summary>
        RendererGone = 3,
    }

    /// <summary>The system's thermal status.</summary>
    public enum ThermalStatus : int
    {
        /// <summary>Unknown.</summary>
        Unknown = -1,
        /// <summary>No throttling.</summary>
        None = 0,
        /// <summary>Light.</summary>
        Light = 1,
        /// <summary>Moderate.</summary>
        Moderate = 2,
        /// <summary>Severe.</summary>
        Severe = 3,
        /// <summary>Critical.</summary>
        Critical = 4,
        /// <summary>Emergency.</summary>
        Emergency = 5,
        /// <summary>Shutdown.</summary>
        Shutdown = 6,
    }

    /// <summary>Upward axis of a file.</summary>
    public enum UpAxis : uint
    {
        /// <summary>+y.</summary>
        Y = 0,
        /// <summary>+z.</summary>
        Z = 1,
    }

    /// <summary>System library of a sound device.</summary>
    public enum DeviceApi : uint
    {
        /// <summary>Another, or none.</summary>
        Other = 0,
        /// <summary>AAudio.</summary>
        Aaudio = 1,
        /// <summary>OpenSL ES.</summary>
        OpenslEs = 2,
    }

    /// <summary>
    /// Level by distance. It scales all sound of a source; delays and the levels of its paths relative to each other stay.
    /// </summary>
    public enum DistanceCurve : uint
    {
        /// <summary>One over the distance, 1 at 1 m.</summary>
        Physical = 0,
        /// <summary>
        /// 1 up to the minimum distance, the minimum over the distance beyond it, constant from the maximum distance on.
        /// </summary>
        Inverse = 1,
        /// <summary>1 up to the minimum distance, falling linearly to 0 at the maximum distance.</summary>
        Linear = 2,
    }

    /// <summary>State of a source's clip.</summary>
    public enum PlaybackState : uint
    {
        /// <summary>No clip was played, or it was stopped.</summary>
        Idle = 0,
        /// <summary>A clip waits for the audio thread, or for its start.</summary>
        Scheduled = 1,
        /// <summary>A clip plays.</summary>
        Playing = 2,
        /// <summary>A clip is paused.</summary>
        Paused = 3,
        /// <summary>A clip has played to its end.</summary>
        Finished = 4,
    }

    /// <summary>What a path does between source and listener.</summary>
    public enum PathKind : uint
    {
        /// <summary>The straight line, unobstructed.</summary>
        Direct = 0,
        /// <summary>The straight line, through walls.</summary>
        Transmitted = 1,
        /// <summary>Reflected, without diffraction.</summary>
        Reflected = 2,
        /// <summary>Diffracted at one or two edges, perhaps also reflected.</summary>
        Diffracted = 3,
    }

    /// <summary>What a source's output holds (foresound_render_source).</summary>
    public enum Bus : uint
    {
        /// <summary>The source's paths.</summary>
        Own = 0,
        /// <summary>
        /// The source shares a slot, or has no position: it is heard in foresound_render_reverb's output. What it left in a slot of
        /// its own fades out here.
        /// </summary>
        Shared = 1,
        /// <summary>
        /// The source is not heard: masked by others, or the engine is paused. What it left in a slot of its own fades out here.
        /// </summary>
        Silent = 2,
    }

    /// <summary>Gravity of a message; as a limit, the least grave messages that are passed on.</summary>
    public enum LogLevel : uint
    {
        /// <summary>No message.</summary>
        Off = 0,
        /// <summary>Something failed.</summary>
        Error = 1,
        /// <summary>Something is worse than it could be.</summary>
        Warn = 2,
        /// <summary>What was chosen and found.</summary>
        Info = 3,
        /// <summary>Details.</summary>
        Debug = 4,
    }

    /// <summary>Parts of a source's sound, bits to be added.</summary>
    public enum Effect : uint
    {
        /// <summary>No sound.</summary>
        None = 0,
        /// <summary>The direct path.</summary>
        Direct = 1,
        /// <summary>Reflections.</summary>
        Reflections = 2,
        /// <summary>Diffraction.</summary>
        Diffraction = 4,
        /// <summary>Transmission through walls.</summary>
        Transmission = 8,
        /// <summary>Late reverb.</summary>
        LateReverb = 16,
        /// <summary>All of them.</summary>
        All = 31,
    }

    /// <summary>Exchange with a phone's system, bits to be added.</summary>
    public enum DeviceHint : uint
    {
        /// <summary>None.</summary>
        None = 0,
        /// <summary>Heat lowers the quality level.</summary>
        Thermal = 1,
        /// <summary>Threads report their durations to the system.</summary>
        Performance = 2,
    }

    /// <summary>Threads with a performance hint session, bits that are added.</summary>
    public enum HintedThread : uint
    {
        /// <summary>None.</summary>
        None = 0,
        /// <summary>The propagation thread.</summary>
        Propagation = 1,
        /// <summary>The audio thread.</summary>
        Audio = 2,
    }

    /// <summary>
    /// Settings of an engine. Begin with FORESOUND_OPTIONS_INIT or foresound_options_default, then change fields.
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct Options
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 144;

        /// <summary>
        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
        /// </summary>
        public uint Size;
        /// <summary>Sample rate in Hz: 44,100 or 48,000 with the built-in HRTF set.</summary>
        public uint RateHz;
        /// <summary>Audio frames a block, 32 to 4,096.</summary>
        public uint BlockFrames;
        /// <summary>Maximum number of sources, 1 to 4,096.</summary>
        public uint MaxSources;
        /// <summary>
        /// Sources with a slot of their own, 1 to 256; 0: as many as `max_sources`, at most 256. Beyond it neighbours share a
        /// slot, and sources that others mask are silent (`unheard_sources` of ForesoundEngineHealth). Cost and memory grow with
        /// slots.
        /// </summary>
        public uint SourceSlots;
        /// <summary>Maximum number of paths rendered at once, 1 to 16,384.</summary>
        public uint MaxVoices;
        /// <summary>
        /// How many of the paths rendered at once, the loudest, are rendered in full detail. The others use a shorter form of
        /// the HRTF set.
        /// </summary>
        public uint FineVoices;
        /// <summary>Maximum number of paths of one update, 1 to 16,384.</summary>
        public uint MaxPaths;
        /// <summary>Rays from the listener an update, 1 to 65,536.</summary>
        public uint GuideRays;
        /// <summary>Rays from each source an update, 1 to 65,536.</summary>
        public uint SourceRays;
        /// <summary>Maximum reflection order, 0 to 4.</summary>
        public uint Depth;
        /// <summary>Maximum number of edges that a path is diffracted at, 0 to 2.</summary>
        public uint DiffractionOrder;
        /// <summary>Seed of the ray directions.</summary>
        public uint Seed;
        /// <summary>When propagation runs.</summary>
        public Schedule Schedule;
        /// <summary>
        /// Threads of an update in the synchronous schedule, the calling one included, 1 to 64.
        /// </summary>
        public uint TracingThreads;
        /// <summary>Extrapolation of paths between updates.</summary>
        public Predictor Predictor;
        /// <summary>
        /// 1: the work of a graphics frame is spread over the blocks until the next one; 0: the first block does all of it.
        /// </summary>
        public uint EvenBlocks;
        /// <summary>Cores of the engine's threads. By default they are not pinned.</summary>
        public Affinity Affinity;
        /// <summary>Core of the propagation thread, if `affinity` is FORESOUND_AFFINITY_CHOSEN.</summary>
        public uint PropagationCore;
        /// <summary>Core of the audio thread, if `affinity` is FORESOUND_AFFINITY_CHOSEN.</summary>
        public uint AudioCore;
        /// <summary>What turns paths into two ears.</summary>
        public Hrtf Hrtf;
        /// <summary>1: with late reverb; 0: without.</summary>
        public uint LateReverb;
        /// <summary>1: with limiter; 0: without.</summary>
        public uint Limiter;
        /// <summary>
        /// Exchange with a phone's system, a sum of ForesoundDeviceHint. Without effect where the system lacks the functions.
        /// </summary>
        public uint DeviceHints;
        /// <summary>Maximum number of paths that foresound_engine_paths returns, 0 to 16,384.</summary>
        public uint ShownPaths;
        /// <summary>
        /// Maximum memory of the engine in MiB, without scenes and sounds; an engine of more is refused. Counted with the
        /// longest delay lines, 32 bytes x `rate_hz` x `max_delay_s` a slot; at first they are of 0.15 s, and grow with the paths.
        /// </summary>
        public uint MaxMemoryMib;
        /// <summary>Distance in metres below which a source gets no louder.</summary>
        public float MinDistanceM;
        /// <summary>Ceiling of the limiter in dB re full scale, -60 to 0.</summary>
        public float CeilingDb;
        /// <summary>
        /// Time from one graphics frame to the next (not of an audio frame) in seconds, 0.001 to 1, for rendering at another
        /// speed than real time; 0: measured from the ticks, for games.
        /// </summary>
        public double FrameS;
        /// <summary>Maximum path delay in seconds, 0.01 to 10.</summary>
        public double MaxDelayS;
        /// <summary>Layout of the output at first.</summary>
        public Layout Layout;
        /// <summary>
        /// Channels of the output, constant while the layout may change, to 16; 0: those that `layout` has.
        /// </summary>
        public uint OutputChannels;
        /// <summary>
        /// 1: sources can be rendered apart (foresound_render_source), for a mixer of the game's own; 0: not.
        /// </summary>
        public uint SourceBuses;
        /// <summary>
        /// Listeners, 1 to 4: for a split screen or spectators (foresound_engine_set_listener, foresound_render_listeners).
        /// </summary>
        public uint Listeners;
    }

    /// <summary>
    /// Properties of a material in octave bands, from the lowest: shares of energy, 0 to 1.
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct MaterialOptions
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 100;

        /// <summary>
        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
        /// </summary>
        public uint Size;
        /// <summary>
        /// Share of the incident energy that is not reflected, what passes through included.
        /// </summary>
        public fixed float Absorption[8];
        /// <summary>Share of the reflected energy outside the specular direction.</summary>
        public fixed float Scattering[8];
        /// <summary>Share of the incident energy behind the surface, at most the absorption.</summary>
        public fixed float Transmission[8];
    }

    /// <summary>
    /// Rays and orders of propagation. Begin with FORESOUND_PROPAGATION_OPTIONS_INIT or
    /// foresound_propagation_options_default, then change fields.
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct PropagationOptions
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 20;

        /// <summary>
        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
        /// </summary>
        public uint Size;
        /// <summary>Rays from the listener an update, 1 to 65,536.</summary>
        public uint GuideRays;
        /// <summary>Rays from each source an update, 1 to 65,536.</summary>
        public uint SourceRays;
        /// <summary>Maximum reflection order, 0 to 4.</summary>
        public uint Depth;
        /// <summary>Maximum number of edges that a path is diffracted at, 0 to 2.</summary>
        public uint DiffractionOrder;
    }

    /// <summary>
    /// Percentiles of durations in seconds; zeros without a measurement. Part of other structures: never changes.
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct Percentiles
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 40;

        /// <summary>Number of measurements.</summary>
        public ulong Count;
        /// <summary>50th percentile.</summary>
        public double P50S;
        /// <summary>95th percentile.</summary>
        public double P95S;
        /// <summary>99.9th percentile.</summary>
        public double P999S;
        /// <summary>Maximum.</summary>
        public double WorstS;
    }

    /// <summary>Statistics of an engine. Counts are since its creation.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct EngineStatistics
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 272;

        /// <summary>
        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
        /// </summary>
        public uint Size;
        /// <summary>State of the engine.</summary>
        public EngineState State;
        /// <summary>
        /// Graphics frames that an update lasts (the paper's L); at 0 every frame has an update of its own.
        /// </summary>
        public uint ExtrapolationLevel;
        /// <summary>Paths in the update in use.</summary>
        public uint Paths;
        /// <summary>Number of sources.</summary>
        public uint Sources;
        /// <summary>Quality level in use, 0 full detail to 5 the coarsest.</summary>
        public uint QualityLevel;
        /// <summary>Real-time priority of the audio thread; 0 outside that class.</summary>
        public int AudioPriority;
        /// <summary>Niceness of the audio thread, -20 to 19.</summary>
        public int AudioNice;
        /// <summary>Durations of propagation updates.</summary>
        public Percentiles Propagation;
        /// <summary>Durations of extrapolation a graphics frame.</summary>
        public Percentiles Extrapolation;
        /// <summary>Durations of generation a block.</summary>
        public Percentiles Generation;
        /// <summary>Durations of whole render calls.</summary>
        public Percentiles Block;
        /// <summary>Render calls.</summary>
        public ulong Blocks;
        /// <summary>Render calls that took longer than the duration of their sound.</summary>
        public ulong MissedDeadlines;
        /// <summary>Propagation updates in use so far.</summary>
        public ulong Updates;
        /// <summary>The quietest paths, dropped beyond the limit of an update.</summary>
        public ulong TrimmedPaths;
        /// <summary>Paths without a voice.</summary>
        public ulong DroppedPaths;
        /// <summary>Samples missing from streams at their time.</summary>
        public ulong UnderrunSamples;
        /// <summary>Duration of the update in use, in seconds.</summary>
        public double PropagationS;
        /// <summary>Time between graphics frames in seconds.</summary>
        public double GraphicsFrameS;
        /// <summary>Cores allowed for the propagation thread, a bit each.</summary>
        public ulong PropagationCores;
        /// <summary>Cores allowed for the audio thread, a bit each.</summary>
        public ulong AudioCores;
    }

    /// <summary>
    /// Budget of an engine. Begin with FORESOUND_BUDGET_OPTIONS_INIT or foresound_budget_options_default, then change fields.
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct BudgetOptions
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 32;

        /// <summary>
        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
        /// </summary>
        public uint Size;
        /// <summary>Finest quality level in use: 0 full detail to 5 the coarsest.</summary>
        public uint QualityLevel;
        /// <summary>1: that level exactly, regardless of load and temperature; else 0.</summary>
        public uint Fixed;
        /// <summary>0.</summary>
        public uint Reserved;
        /// <summary>Maximum duration of a propagation update in seconds, 0.0001 to 10; 0: no limit.</summary>
        public double UpdateS;
        /// <summary>
        /// Maximum share of one core for propagation and sound together, 0.05 to 2; 0: no limit.
        /// </summary>
        public double CoreShare;
    }

    /// <summary>Load of an engine and temperature of the phone.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct EngineHealth
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 64;

        /// <summary>
        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
        /// </summary>
        public uint Size;
        /// <summary>State of the engine.</summary>
        public EngineState State;
        /// <summary>Quality level in use, 0 full detail to 5 the coarsest.</summary>
        public uint QualityLevel;
        /// <summary>Finest quality level allowed by the temperature; 0 if unknown.</summary>
        public uint ThermalQualityLevel;
        /// <summary>The system's thermal status.</summary>
        public ThermalStatus ThermalStatus;
        /// <summary>The system's thermal headroom: 1 is severe throttling; -1 if unknown.</summary>
        public float ThermalHeadroom;
        /// <summary>Threads with a performance hint session, a sum of ForesoundHintedThread.</summary>
        public uint Hinted;
        /// <summary>
        /// Sources without a slot in the newest tick, as nothing of them would be heard: they play nothing, are below -100 dB re
        /// full scale, or are masked, with less than a millionth (-60 dB) of the energy of all sources at the listener. 0 while
        /// there are as many slots as sources.
        /// </summary>
        public uint UnheardSources;
        /// <summary>Rays cast by the newest update.</summary>
        public ulong Rays;
        /// <summary>Share of one core used by sound.</summary>
        public double SoundShare;
        /// <summary>Duration of the newest update in seconds.</summary>
        public double PropagationS;
        /// <summary>Time between graphics frames in seconds.</summary>
        public double GraphicsFrameS;
    }

    /// <summary>
    /// Position and orientation of a listener, a source or an instance.
    ///
    /// An element of an array, whose element size the functions take: a newer pose is longer.
    ///
    /// Metres, right-handed, +y up. The orientation rotates local coordinates (+x right, +y up, -z ahead) into the world's: a
    /// quaternion x, y, z, w of length 1. A listener's and a source's are normalised; four zeros of a source are (0, 0, 0, 1).
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct Pose
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 32;

        /// <summary>Id of the source; ignored for listeners and instances.</summary>
        public uint Source;
        /// <summary>Position in metres.</summary>
        public fixed float PositionM[3];
        /// <summary>Quaternion x, y, z, w; (0, 0, 0, 1) faces -z.</summary>
        public fixed float Orientation[4];
    }

    /// <summary>
    /// Settings of a scene. Begin with FORESOUND_SCENE_OPTIONS_INIT or foresound_scene_options_default, then change fields.
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct SceneOptions
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 40;

        /// <summary>
        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
        /// </summary>
        public uint Size;
        /// <summary>Upward axis of a file.</summary>
        public UpAxis Up;
        /// <summary>Metres a unit of a file, above zero.</summary>
        public float Scale;
        /// <summary>Air temperature in degrees Celsius.</summary>
        public float TemperatureC;
        /// <summary>Relative humidity in percent.</summary>
        public float HumidityPercent;
        /// <summary>Static pressure in kPa.</summary>
        public float PressureKpa;
        /// <summary>
        /// Least area in m² of a connected plane panel that reflects like a mirror; smaller ones block and scatter.
        /// </summary>
        public float MinPanelM2;
        /// <summary>Largest area in m² of a panel whose free edges limit its reflection; 0: none.</summary>
        public float MaxFinitePanelM2;
        /// <summary>
        /// Distance in metres from a common plane within which corners of neighbouring triangles are roughness of one plane
        /// surface, 0 to 0.5; -1: an eighth of the wavelength at 1 kHz.
        /// </summary>
        public float AcousticToleranceM;
        /// <summary>Maximum number of triangles; a mesh with more is refused.</summary>
        public uint MaxTriangles;
    }

    /// <summary>Properties of a scene.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct SceneInfo
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 72;

        /// <summary>
        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
        /// </summary>
        public uint Size;
        /// <summary>Materials that no table defines; they have the default's properties.</summary>
        public uint UnknownMaterials;
        /// <summary>Triangles of the mesh.</summary>
        public ulong TrianglesIn;
        /// <summary>Triangles kept: finite, with an area.</summary>
        public ulong Triangles;
        /// <summary>Plane surfaces that they form.</summary>
        public ulong Surfaces;
        /// <summary>Memory of the scene in bytes.</summary>
        public ulong MemoryBytes;
        /// <summary>Speed of sound in m/s.</summary>
        public double SpeedOfSoundMS;
        /// <summary>Minimum coordinates in metres.</summary>
        public fixed float BoundsMinM[3];
        /// <summary>Maximum coordinates in metres.</summary>
        public fixed float BoundsMaxM[3];
    }

    /// <summary>Properties and state of a device.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct OutputInfo
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 80;

        /// <summary>
        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
        /// </summary>
        public uint Size;
        /// <summary>1 playing, 0 closed and to be opened again.</summary>
        public uint Playing;
        /// <summary>Granted sample rate in Hz.</summary>
        public uint RateHz;
        /// <summary>Audio frames of the device's burst.</summary>
        public uint BurstFrames;
        /// <summary>Audio frames of the device's buffer.</summary>
        public uint BufferFrames;
        /// <summary>1 in exclusive mode.</summary>
        public uint Exclusive;
        /// <summary>1 in low-latency mode.</summary>
        public uint LowLatency;
        /// <summary>System library of the device.</summary>
        public DeviceApi DeviceApi;
        /// <summary>Latency of the ring buffer in audio frames.</summary>
        public uint RingFrames;
        /// <summary>Successful attempts to open a device.</summary>
        public uint Opened;
        /// <summary>Failed attempts to open a device.</summary>
        public uint Refused;
        /// <summary>Disconnections of the device.</summary>
        public uint Lost;
        /// <summary>Times that the device stopped its callbacks and was closed.</summary>
        public uint Stalled;
        /// <summary>Underruns counted by the device since it was opened.</summary>
        public uint Xruns;
        /// <summary>Minimum audio frames of a callback.</summary>
        public uint MinCallbackFrames;
        /// <summary>Maximum audio frames of a callback.</summary>
        public uint MaxCallbackFrames;
        /// <summary>Callbacks.</summary>
        public ulong Callbacks;
        /// <summary>Audio frames that were not rendered in time.</summary>
        public ulong UnderrunFrames;
    }

    /// <summary>
    /// What a graphics frame has of a source. Levels include the source's options and not its gain.
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct SourceNumbers
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 112;

        /// <summary>
        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
        /// </summary>
        public uint Size;
        /// <summary>Number of its paths.</summary>
        public uint PathCount;
        /// <summary>
        /// How much of the straight line is blocked, 0 to 1, times the strength of the source's occlusion.
        /// </summary>
        public float Occlusion;
        /// <summary>Delay from emission to the start of the late reverb in seconds; 0 without any.</summary>
        public float ReverbDelayS;
        /// <summary>
        /// Amplitude factor of the walls on the straight line in each octave band: 1 where nothing blocks it.
        /// </summary>
        public fixed float Transmission[8];
        /// <summary>
        /// Amplitude of the late reverb in each octave band: root of its whole energy, relative to the free field at 1 m.
        /// </summary>
        public fixed float ReverbSend[8];
        /// <summary>
        /// Reverberation time T60 of the late reverb in seconds in each octave band; 0 without any.
        /// </summary>
        public fixed float DecayTimeS[8];
    }

    /// <summary>
    /// Settings of a source. Begin with FORESOUND_SOURCE_OPTIONS_INIT or foresound_source_options_default, then change fields.
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct SourceOptions
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 116;

        /// <summary>
        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
        /// </summary>
        public uint Size;
        /// <summary>Computed parts, a sum of ForesoundEffect.</summary>
        public uint Effects;
        /// <summary>Radius in metres within which the source gets no louder; 0: the engine's.</summary>
        public float RadiusM;
        /// <summary>Exponent of the directivity, 0 to 64.</summary>
        public float Order;
        /// <summary>
        /// Directivity in each octave band, from the lowest: 0 omnidirectional, 0.5 cardioid, 1 dipole.
        /// </summary>
        public fixed float Directivity[8];
        /// <summary>Level by distance, unless the source has a distance table.</summary>
        public DistanceCurve DistanceCurve;
        /// <summary>Distance of full level in metres, for the inverse and the linear curve.</summary>
        public float DistanceMinM;
        /// <summary>
        /// Distance in metres from which the level is constant (inverse curve) or 0 (linear curve), at most 1e6.
        /// </summary>
        public float DistanceMaxM;
        /// <summary>Linear gain of the direct path, 0 to 1000.</summary>
        public float DirectGain;
        /// <summary>Linear gain of reflected paths, 0 to 1000.</summary>
        public float ReflectionsGain;
        /// <summary>Linear gain of diffracted paths, 0 to 1000.</summary>
        public float DiffractionGain;
        /// <summary>Linear gain of the late reverb, 0 to 1000.</summary>
        public float LateGain;
        /// <summary>
        /// Strength of occlusion, 0 to 1; 1 is physics. At 0 the direct path is as loud as if nothing were in its way.
        /// </summary>
        public float Occlusion;
        /// <summary>Linear gain of a direct path through walls, 0 to 4; 1 is physics.</summary>
        public float Transmission;
        /// <summary>
        /// Factor of the delay of direct sound, 0 to 4, whose change is the Doppler shift; 1 is physics. Other sound keeps its
        /// delay after the direct sound.
        /// </summary>
        public float Doppler;
        /// <summary>Strength of the air's absorption along paths, 0 to 1; 1 is physics.</summary>
        public float AirAbsorption;
        /// <summary>
        /// 1: heard without a position, propagation and late reverb, such as music; stereo clips keep their channels.
        /// </summary>
        public uint Is2d;
        /// <summary>
        /// 0 to 255: with more sources than slots, those of higher priority get slots of their own first.
        /// </summary>
        public uint Priority;
        /// <summary>
        /// Semi-axes in metres of an ellipsoid around the source along its x, y and z, 0 to 1000; all 0: a point. A wide source
        /// sounds from points on the ellipsoid, of which a share may be hidden.
        /// </summary>
        public fixed float ExtentM[3];
        /// <summary>Number of those points, 4 to 32.</summary>
        public uint ExtentPoints;
    }

    /// <summary>
    /// How a clip plays. Begin with FORESOUND_PLAY_OPTIONS_INIT or foresound_play_options_default, then change fields.
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct PlayOptions
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 32;

        /// <summary>
        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
        /// </summary>
        public uint Size;
        /// <summary>1: the clip repeats; 0: it plays once.</summary>
        public uint Looped;
        /// <summary>Audio frame of the clip at which its loop starts.</summary>
        public uint LoopStart;
        /// <summary>Audio frame of the clip at which its loop ends, excluded; 0: the clip's end.</summary>
        public uint LoopEnd;
        /// <summary>Audio frame of the clip to start from.</summary>
        public ulong FirstFrame;
        /// <summary>
        /// Audio frame of the engine at which it starts (ForesoundPlayback); earlier ones start at once.
        /// </summary>
        public ulong StartAt;
    }

    /// <summary>State and position of a source's clip.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct Playback
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 24;

        /// <summary>
        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
        /// </summary>
        public uint Size;
        /// <summary>The state.</summary>
        public PlaybackState State;
        /// <summary>Position in the clip in audio frames.</summary>
        public ulong Frame;
        /// <summary>Audio frames that the engine has rendered: the clock of `start_at`.</summary>
        public ulong EngineFrame;
    }

    /// <summary>
    /// A path as a polyline from source to listener. An element of an array, whose element size foresound_engine_paths takes.
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct ShownPath
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 92;

        /// <summary>Id of the source.</summary>
        public uint Source;
        /// <summary>Corners in use, both ends included.</summary>
        public uint CornerCount;
        /// <summary>Number of reflections.</summary>
        public uint Reflections;
        /// <summary>Number of diffractions.</summary>
        public uint DiffractionOrder;
        /// <summary>Level in dB re the free field at 1 m.</summary>
        public float LevelDb;
        /// <summary>Corners in metres.</summary>
        public fixed float CornersM[18];
    }

    /// <summary>
    /// A path of a source in a graphics frame. An element of an array, whose element size foresound_source_paths takes.
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct SourcePath
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 80;

        /// <summary>Identity of the path across frames; in Java rounded to 53 bits.</summary>
        public ulong Id;
        /// <summary>Delay from the source to the listener in seconds.</summary>
        public double DelayS;
        /// <summary>What the path does on its way.</summary>
        public PathKind Kind;
        /// <summary>Number of reflections.</summary>
        public uint Reflections;
        /// <summary>
        /// Unit vector in world coordinates from the listener to where the path arrives from.
        /// </summary>
        public fixed float Arrival[3];
        /// <summary>
        /// Unit vector in world coordinates from the source along the path; zero for a path of no length.
        /// </summary>
        public fixed float Departure[3];
        /// <summary>
        /// Signed amplitude relative to the free field at 1 m in each octave band, from the lowest.
        /// </summary>
        public fixed float Amplitude[8];
    }

    /// <summary>Result of one foresound_render.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct RenderInfo
    {
        /// <summary>Bytes in C.</summary>
        public const uint Bytes = 40;

        /// <summary>
        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
        /// </summary>
        public uint Size;
        /// <summary>Audio frames written.</summary>
        public uint Frames;
        /// <summary>Graphics frames consumed.</summary>
        public uint GraphicsFrames;
        /// <summary>Propagation updates consumed.</summary>
        public uint Updates;
        /// <summary>
        /// Graphics frames that an update lasts (the paper's L); at 0 every frame has an update of its own.
        /// </summary>
        public uint ExtrapolationLevel;
        /// <summary>Voices, fading ones included.</summary>
        public uint Voices;
        /// <summary>Paths without a voice.</summary>
        public uint DroppedPaths;
        /// <summary>Samples missing from streams at their time.</summary>
        public uint UnderrunSamples;
        /// <summary>1 if the call took longer than the duration of its sound.</summary>
        public uint MissedDeadline;
        /// <summary>1 if the engine was closed: sound continues with the last poses.</summary>
        public uint EngineGone;
    }

    /// <summary>
    /// Receives a message: one line in UTF-8, valid during the call. `user` is the pointer passed to foresound_set_log.
    /// </summary>
    [UnmanagedFunctionPointer(CallingConvention.Cdecl)]
    public unsafe delegate void LogCallback(void* user, LogLevel level, byte* message);

    /// <summary>
    /// The C interface, function by function: foresound_engine_tick is <see cref="EngineTick"/>, and so on. Comments are those
    /// of foresound.h, which has the rules for handles, threads, units and pointers. Calls neither allocate nor throw, except
    /// for a DllNotFoundException where the library is missing.
    /// </summary>
    public static unsafe class Native
    {
        const string Library = "foresound";

        /// <summary>The version of this file.</summary>
        public const uint ApiVersion = 0x00030000;

        /// <summary>
        /// Closes a handle of any kind and destroys its object: an engine after its running update, an output after its
        /// threads. Waits for a call that uses the handle. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_close", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status Close(ulong handle);

        /// <summary>Writes the default options; `size` is set before. Any thread.</summary>
        [DllImport(Library, EntryPoint = "foresound_options_default", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status OptionsDefault(Options* options);

        /// <summary>
        /// Creates an engine in free field without sources. `engine` receives the handle of the control half, `renderer`
        /// that of the audio half. Takes some ten milliseconds. Control thread.
        ///
        /// `api_version`: FORESOUND_API_VERSION. `options`: null for the defaults. `hrtf`: content of an HRTF set's file,
        /// baked or SOFA (some seconds); null for the built-in set. Fails with FORESOUND_STATUS_VERSION for another major
        /// version than the library's, FORESOUND_STATUS_BAD_ARGUMENT also for more memory than `max_memory_mib`,
        /// FORESOUND_STATUS_FORMAT for a damaged HRTF set, FORESOUND_STATUS_STATE if the system starts no thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_create", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineCreate(
            uint apiVersion, Options* options, byte* hrtf, UIntPtr hrtfBytes, ulong* engine, ulong* renderer);

        /// <summary>
        /// Replaces the scene. The old one is audible until the first update with the new one. The scene's handle may be
        /// closed afterwards. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_set_scene", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineSetScene(ulong engine, ulong scene);

        /// <summary>
        /// Gives all surfaces of a material's name, in the scene and in instances, other properties from the next tick on;
        /// audible with the next update. Another scene has its own, and so has an instance that is added later. `material`: null
        /// for a surface that reflects everything. Fails with FORESOUND_STATUS_BAD_ARGUMENT for a name that no surface has. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_set_material", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineSetMaterial(ulong engine, byte* name, MaterialOptions* material);

        /// <summary>Writes the default options; `size` is set before. Any thread.</summary>
        [DllImport(Library, EntryPoint = "foresound_propagation_options_default", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status PropagationOptionsDefault(PropagationOptions* options);

        /// <summary>
        /// Sets the rays and orders of propagation. `options`: null for the defaults. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_set_propagation", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineSetPropagation(ulong engine, PropagationOptions* options);

        /// <summary>Sets the extrapolation of paths, from the next update on. Control thread.</summary>
        [DllImport(Library, EntryPoint = "foresound_engine_set_predictor", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineSetPredictor(ulong engine, Predictor predictor);

        /// <summary>
        /// Changes the layout, such as when headphones are plugged in or out: sound cross-fades within the next
        /// graphics frame. The number of channels stays: a layout of more channels than the output fails with
        /// FORESOUND_STATUS_BAD_ARGUMENT, as does the binaural one without an HRTF set for the rate. Takes some
        /// milliseconds. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_set_layout", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineSetLayout(ulong engine, Layout layout);

        /// <summary>
        /// Changes the HRTF set: binaural sound cross-fades within the next graphics frame. `hrtf`: content of a SOFA
        /// file of the convention SimpleFreeFieldHRIR, or of a baked set at the engine's sample rate; null for the
        /// built-in set. A baked set takes some milliseconds. A SOFA file takes some seconds, in which other calls of
        /// the engine go on: call it on a thread of its own. Fails with FORESOUND_STATUS_FORMAT for a damaged set and
        /// FORESOUND_STATUS_BAD_ARGUMENT for one of another sample rate; the set stays. Any thread but the sound's.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_set_hrtf", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineSetHrtf(ulong engine, byte* hrtf, UIntPtr hrtfBytes);

        /// <summary>
        /// Sets when propagation runs, after the running update. Fails with FORESOUND_STATUS_STATE if the system
        /// starts no thread; the schedule stays. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_set_schedule", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineSetSchedule(ulong engine, Schedule schedule);

        /// <summary>
        /// Fades to silence within milliseconds and stops the playback positions. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_pause", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EnginePause(ulong engine);

        /// <summary>Continues after foresound_engine_pause. Control thread.</summary>
        [DllImport(Library, EntryPoint = "foresound_engine_resume", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineResume(ulong engine);

        /// <summary>
        /// Restarts propagation after its failure (FORESOUND_ENGINE_STATE_PROPAGATION_FAILED), after the running
        /// update. Fails with FORESOUND_STATUS_STATE if the system starts no thread; another call tries again.
        /// Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_restart", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineRestart(ulong engine);

        /// <summary>
        /// Writes the engine's statistics. Takes microseconds; meant for some ten calls a second. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_statistics", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineStatistics(ulong engine, EngineStatistics* statistics);

        /// <summary>
        /// Writes the default budget, which has no limit; `size` is set before. Any thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_budget_options_default", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status BudgetOptionsDefault(BudgetOptions* options);

        /// <summary>
        /// Sets the budget from the next update on: rays, reflection orders and paths are reduced to meet it. Temperature may
        /// reduce them further unless the level is fixed. `options`: null for no limit. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_set_budget", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineSetBudget(ulong engine, BudgetOptions* options);

        /// <summary>
        /// Writes the engine's load and the phone's temperature. Takes microseconds; meant for some ten calls a second.
        /// Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_health", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineHealth(ulong engine, EngineHealth* health);

        /// <summary>
        /// Adds an instance of a part, such as a door, at a pose from the next tick on; `instance` receives its id. A part
        /// is a scene in local coordinates, a hinge at the origin; its handle may be closed afterwards, and instances may
        /// share it. Instances stay when the scene is replaced. `pose_size`: sizeof(ForesoundPose). Fails with
        /// FORESOUND_STATUS_BAD_ARGUMENT for a part of too many triangles, and for too many instances. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_instance_add", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status InstanceAdd(ulong engine, ulong part, Pose* pose, UIntPtr poseSize, uint* instance);

        /// <summary>
        /// Adds an instance that stays where it is and is joined with the fixed scene and with all such instances that it touches,
        /// as if they had been built in one piece: floors and walls go on across borders. For chunks of a streamed world; a part
        /// may be shared. Else as foresound_instance_add. foresound_instance_remove removes it. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_instance_add_joined", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status InstanceAddJoined(
            ulong engine, ulong part, Pose* pose, UIntPtr poseSize, uint* instance);

        /// <summary>
        /// Moves an instance from the next tick on. The orientation is a quaternion of length 1; after an invalid pose the
        /// last valid one stays. `pose_size`: sizeof(ForesoundPose). Fails with FORESOUND_STATUS_BAD_ARGUMENT for one that
        /// was added by foresound_instance_add_joined. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_instance_move", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status InstanceMove(ulong engine, uint instance, Pose* pose, UIntPtr poseSize);

        /// <summary>
        /// Removes an instance from the next tick on. Its id is invalid at once. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_instance_remove", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status InstanceRemove(ulong engine, uint instance);

        /// <summary>Writes the default options; `size` is set before. Any thread.</summary>
        [DllImport(Library, EntryPoint = "foresound_scene_options_default", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SceneOptionsDefault(SceneOptions* options);

        /// <summary>
        /// Makes a progress, with which another thread follows and cancels the construction of a scene; `progress` receives
        /// its handle. For one construction. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_progress_create", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status ProgressCreate(ulong* progress);

        /// <summary>
        /// Writes the share of a scene's construction that is done, 0 to 1. Control thread, also during the construction.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_progress_read", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status ProgressRead(ulong progress, float* done);

        /// <summary>
        /// Cancels a construction: its call returns FORESOUND_STATUS_CANCELLED after the present phase, of four. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_progress_cancel", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status ProgressCancel(ulong progress);

        /// <summary>
        /// Builds a scene from a mesh file: OBJ or PLY, and glTF or GLB if the library is built with its feature
        /// `gltf`. The file names materials. Or loads a saved scene, for which `materials_toml`, `options` and
        /// `progress` mean nothing. Else as foresound_scene_from_mesh, also in how it fails, and with
        /// FORESOUND_STATUS_FILE for a file that cannot be read. Takes milliseconds to seconds: a control thread, but
        /// not the one that draws.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_scene_from_file", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SceneFromFile(
            byte* path, byte* materialsToml, SceneOptions* options, ulong progress, ulong* scene);

        /// <summary>
        /// Saves a scene to a file, which foresound_scene_from_file and foresound_scene_from_bytes load in a
        /// twentieth of the time of its construction or less, on any machine. Fails with FORESOUND_STATUS_FILE for a
        /// file that cannot be written. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_scene_save", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SceneSave(ulong scene, byte* path);

        /// <summary>
        /// Loads a saved scene from the bytes of its file. Fails with FORESOUND_STATUS_FORMAT for other bytes, damaged ones
        /// and those of another version. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_scene_from_bytes", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SceneFromBytes(byte* bytes, UIntPtr count, ulong* scene);

        /// <summary>Writes the properties of a scene. Control thread.</summary>
        [DllImport(Library, EntryPoint = "foresound_scene_info", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SceneInfo(ulong scene, SceneInfo* info);

        /// <summary>
        /// Writes the renderer's latency from geometry to sound in audio frames, without the device's buffer. Does not
        /// disturb foresound_render. Any thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_renderer_latency", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status RendererLatency(ulong renderer, uint* frames);

        /// <summary>Writes the number of channels that a renderer writes. Any thread.</summary>
        [DllImport(Library, EntryPoint = "foresound_renderer_channels", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status RendererChannels(ulong renderer, uint* channels);

        /// <summary>
        /// Plays a renderer of two channels on the system's device (Oboe on Android, a silent device elsewhere), rendered
        /// `blocks_ahead` blocks ahead (1 to 64) on a thread of its own. Closes the renderer's handle. A device that is
        /// lost or does not open is opened again at growing intervals. Fails with FORESOUND_STATUS_STATE if the system
        /// starts no thread; after FORESOUND_STATUS_BAD_ARGUMENT, also for other channels, the renderer stays open. Control
        /// thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_output_start", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status OutputStart(ulong renderer, UIntPtr blocksAhead, ulong* output);

        /// <summary>Writes the properties and the state of an output's device. Control thread.</summary>
        [DllImport(Library, EntryPoint = "foresound_output_info", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status OutputInfo(ulong output, OutputInfo* info);

        /// <summary>
        /// Sets the pose of one of several listeners from the next tick on. `listener`: 0 to below the option `listeners`; the
        /// pose of 0 is that of foresound_engine_tick. After an invalid pose the last valid one stays. `pose_size`:
        /// sizeof(ForesoundPose). Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_set_listener", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineSetListener(ulong engine, uint listener, Pose* pose, UIntPtr poseSize);

        /// <summary>
        /// Adds a silent source at a position in metres; `source` receives its id. Fails with FORESOUND_STATUS_STATE
        /// if the engine has `max_sources` sources. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_add", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourceAdd(ulong engine, float xM, float yM, float zM, uint* source);

        /// <summary>
        /// Takes the numbers of the newest graphics frame that the renderer has, for a mixer of the app's own;
        /// foresound_source_numbers and foresound_source_paths read them. `tick` receives the number of the frame's tick, 0
        /// before the first. The first call makes memory for them; from then on the renderer copies each frame without
        /// waiting. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_take_numbers", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineTakeNumbers(ulong engine, uint* tick);

        /// <summary>
        /// Writes what the frame taken last has of a source; zeros for a source without a slot. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_numbers", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourceNumbers(ulong engine, uint source, SourceNumbers* numbers);

        /// <summary>
        /// Removes a source from the next tick on; sound under way fades. Its id is invalid at once and is never given
        /// again: an engine has 1,048,575 ids for each of its `max_sources`. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_remove", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourceRemove(ulong engine, uint source);

        /// <summary>Writes the default options; `size` is set before. Any thread.</summary>
        [DllImport(Library, EntryPoint = "foresound_source_options_default", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourceOptionsDefault(SourceOptions* options);

        /// <summary>
        /// Sets a source's options from the next tick on. `options`: null for the defaults. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_configure", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourceConfigure(ulong engine, uint source, SourceOptions* options);

        /// <summary>
        /// Sets a source's directivity table from the next tick on: rows of eight levels in dB, one a band, the angles
        /// evenly from the front to the back, both included; 2 to 181 rows of -63 to 60 dB or minus infinity. `levels`:
        /// their number, 8 x rows; 0 for no table. The table is multiplied with the options' directivity. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_set_directivity_table", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourceSetDirectivityTable(
            ulong engine, uint source, float* levelsDb, UIntPtr levels);

        /// <summary>
        /// Sets a source's distance table from the next tick on, which replaces the options' curve: pairs of a distance in
        /// metres and a linear gain (0 to 1000) at rising distances, 1 to 16 pairs; straight lines between them. `values`:
        /// their number, 2 x pairs; 0 for no table. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_set_distance_table", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourceSetDistanceTable(ulong engine, uint source, float* points, UIntPtr values);

        /// <summary>Sets a source's linear gain, 0 to 1000, from the next tick on. Control thread.</summary>
        [DllImport(Library, EntryPoint = "foresound_source_set_gain", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourceSetGain(ulong engine, uint source, float gain);

        /// <summary>
        /// Mutes (1) or unmutes (0) a source; its playback position advances. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_mute", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourceMute(ulong engine, uint source, uint muted);

        /// <summary>
        /// Plays a clip from its beginning, once (0) or in a loop (1). The clip's handle may be closed afterwards. Fails
        /// with FORESOUND_STATUS_BAD_ARGUMENT for a clip at another rate than the engine's. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_play", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourcePlay(ulong engine, uint source, ulong clip, uint looped);

        /// <summary>Writes the default options; `size` is set before. Any thread.</summary>
        [DllImport(Library, EntryPoint = "foresound_play_options_default", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status PlayOptionsDefault(PlayOptions* options);

        /// <summary>
        /// Plays a clip with loop points, from a frame of it, at a frame of the engine. A pause of the source ends;
        /// its pitch stays. `options`: null for the defaults. The clip's handle may be closed afterwards. Fails as
        /// foresound_source_play. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_play_clip", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourcePlayClip(ulong engine, uint source, ulong clip, PlayOptions* options);

        /// <summary>
        /// Plays a clip once at a position in metres and forgets it: its source is removed when the clip has ended
        /// and its last path has arrived. `source` receives its id. `play` and `options`: null for the defaults. The
        /// id may be used until then, afterwards it gives FORESOUND_STATUS_STALE_SOURCE. Fails as
        /// foresound_source_add and foresound_source_play, and adds nothing then. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_play_once", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EnginePlayOnce(
            ulong engine, ulong clip, float xM, float yM, float zM, PlayOptions* play, SourceOptions* options, uint* source);

        /// <summary>
        /// Writes state and position of a source's clip, as of the last block; of a stream idle. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_playback", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourcePlayback(ulong engine, uint source, Playback* playback);

        /// <summary>
        /// Pauses (1) or continues (0) a source's clip from the next tick on; fades within 6 ms. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_pause", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourcePause(ulong engine, uint source, uint paused);

        /// <summary>
        /// Continues a source's clip at another audio frame of it from the next tick on, with a cross-fade. Fails with
        /// FORESOUND_STATUS_STATE if it plays no clip. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_seek", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourceSeek(ulong engine, uint source, uint frame);

        /// <summary>
        /// Sets the speed of a source's clips, 0.125 to 4, from the next tick on: 2 is an octave up. The pitch glides.
        /// Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_set_pitch", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourceSetPitch(ulong engine, uint source, float pitch);

        /// <summary>
        /// Ramps a source's linear gain to 0 to 1000 within 0 to 3600 seconds from the next tick on. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_fade_gain", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourceFadeGain(ulong engine, uint source, float gain, float seconds);

        /// <summary>Silences a source and releases its clip or stream. Control thread.</summary>
        [DllImport(Library, EntryPoint = "foresound_source_stop", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourceStop(ulong engine, uint source);

        /// <summary>
        /// Attaches a stream to a source, through a ring of `capacity` samples (1 to 16,777,216), and writes the handle for
        /// foresound_stream_write. Samples are mono at the engine's rate, 1 being full scale at 1 m; they are not converted.
        /// After a failure the source plays on as before. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_stream", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourceStream(ulong engine, uint source, UIntPtr capacity, ulong* stream);

        /// <summary>
        /// Makes a clip of mono samples at `rate_hz` for engines at `engine_rate_hz` (1,000 to 384,000 Hz), copied and
        /// resampled. A sample of 1 is full scale at 1 m. At most 2^28 samples, 2^26 if they are resampled. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_clip_from_samples", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status ClipFromSamples(
            float* samples, UIntPtr count, uint rateHz, uint engineRateHz, ulong* clip);

        /// <summary>
        /// Makes a clip of the bytes of a WAV file (PCM of 8 to 32 bits or float; channels are averaged) for engines
        /// at `engine_rate_hz`. Fails with FORESOUND_STATUS_FORMAT for bytes of another format, else as
        /// foresound_clip_from_samples. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_clip_from_wav", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status ClipFromWav(byte* bytes, UIntPtr count, uint engineRateHz, ulong* clip);

        /// <summary>
        /// Makes a clip of two channels, interleaved samples, left first; else as foresound_clip_from_samples. A source with a
        /// position plays their mean, a 2D source both. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_clip_from_stereo", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status ClipFromStereo(
            float* samples, UIntPtr count, uint rateHz, uint engineRateHz, ulong* clip);

        /// <summary>
        /// Makes a clip of the first two channels of a WAV file; else as foresound_clip_from_wav. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_clip_from_stereo_wav", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status ClipFromStereoWav(byte* bytes, UIntPtr count, uint engineRateHz, ulong* clip);

        /// <summary>
        /// Makes a clip of a first-order sound field in AmbiX form, four interleaved channels W, Y, Z, X in SN3D; else as
        /// foresound_clip_from_samples. A 2D source plays it around the listener, fixed in the world: its front is -z, its
        /// left -x, its top +y. A source with a position plays W. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_clip_from_ambix", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status ClipFromAmbix(
            float* samples, UIntPtr count, uint rateHz, uint engineRateHz, ulong* clip);

        /// <summary>
        /// Makes a clip of the bytes of a sound file: WAV, or FLAC or Ogg Vorbis if the library is built with its
        /// feature `compressed`. `channels`: 1 for their mean, 2 for the first two, 4 for a sound field in AmbiX
        /// form, for which the file must have four. Fails with FORESOUND_STATUS_FORMAT for other bytes and formats
        /// that the library is built without, else as foresound_clip_from_samples. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_clip_from_file", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status ClipFromFile(
            byte* bytes, UIntPtr count, uint channels, uint engineRateHz, ulong* clip);

        /// <summary>
        /// Version of this interface: 65,536 x major + 256 x minor + patch. Another major number than
        /// FORESOUND_API_VERSION's is incompatible, and foresound_engine_create refuses it. Any thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_version", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern uint Version();

        /// <summary>
        /// Message of this thread's last failed call: one line in UTF-8, the cause and the remedy. Valid until the thread's next
        /// failure; empty before the first. Never null; not to be freed. Functions of the audio thread leave no
        /// message. Any thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_last_error", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern byte* LastError();

        /// <summary>
        /// Submits a graphics frame: the listener's pose, and the poses of the sources that moved. Meant for one call a frame;
        /// never waits for propagation or sound, except that the synchronous schedule runs propagation in it. After an invalid pose
        /// (FORESOUND_STATUS_BAD_ARGUMENT: not finite, beyond 1,000 km, an orientation of no length) or an unknown source
        /// (FORESOUND_STATUS_STALE_SOURCE) it fails, and the frame is submitted with the last valid poses. `sources`: null if none.
        /// `pose_size`: sizeof(ForesoundPose). Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_tick", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EngineTick(
            ulong engine, Pose* listener, Pose* sources, UIntPtr sourceCount, UIntPtr poseSize);

        /// <summary>
        /// Writes the loudest paths of the newest update, in no order, as many as fit, and their number. At most the option
        /// `shown_paths` of them are available. `path_size`: sizeof(ForesoundShownPath). Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_engine_paths", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status EnginePaths(
            ulong engine, ShownPath* paths, UIntPtr pathSize, UIntPtr capacity, UIntPtr* count);

        /// <summary>
        /// Writes a source's paths in the frame taken last (foresound_engine_take_numbers), by identity, as many as fit, and their
        /// number. `path_size`: sizeof(ForesoundSourcePath). Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_source_paths", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SourcePaths(
            ulong engine, uint source, SourcePath* paths, UIntPtr pathSize, UIntPtr capacity, UIntPtr* count);

        /// <summary>
        /// Builds a scene from triangles: three coordinates a vertex in metres, +y up, and three indices a triangle. With
        /// materials: their names, and one index into them a triangle; without: null and zero. `materials_toml`: the text of a
        /// materials file, or null. `options`: null for the defaults. `progress`: a handle of foresound_progress_create, or 0. Fails
        /// with FORESOUND_STATUS_FORMAT for a mesh or a materials file that is invalid, FORESOUND_STATUS_BAD_ARGUMENT for an option out of
        /// range, FORESOUND_STATUS_CANCELLED after foresound_progress_cancel. Takes milliseconds to seconds: a control thread, but not
        /// the one that draws.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_scene_from_mesh", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SceneFromMesh(
            float* positionsM, UIntPtr vertexCount, uint* indices, UIntPtr indexCount, uint* triangleMaterials, byte** materialNames, UIntPtr materialCount, byte* materialsToml, SceneOptions* options, ulong progress, ulong* scene);

        /// <summary>
        /// Renders `frames` audio frames of interleaved stereo into `output`; silence on failure. An engine of another number of
        /// channels than two fails with FORESOUND_STATUS_BAD_ARGUMENT: use foresound_render_channels. `info`: null if unused. One thread at
        /// a time a renderer; a second concurrent call gets FORESOUND_STATUS_BUSY. Multiples of the engine's block size are the most
        /// efficient. Audio thread: wait-free, without allocation, without a message.
        ///
        /// `output` has 2 x `frames` elements.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_render", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status Render(ulong renderer, float* output, UIntPtr frames, RenderInfo* info);

        /// <summary>
        /// Renders `frames` audio frames of `channels` interleaved channels into `output`, as foresound_render; `channels` is the
        /// number of the engine (foresound_renderer_channels), another one gets FORESOUND_STATUS_BAD_ARGUMENT and silence. Audio
        /// thread: wait-free, without allocation, without a message.
        ///
        /// `output` has `channels` x `frames` elements.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_render_channels", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status RenderChannels(
            ulong renderer, float* output, uint channels, UIntPtr frames, RenderInfo* info);

        /// <summary>
        /// Appends as many of `count` samples to a stream as fit; `written` (null if unused) receives their number. Samples are
        /// mono at the engine's rate, 1 being full scale at 1 m; they are not converted. Fails with FORESOUND_STATUS_STATE once the
        /// stream has no reader. Any one thread at a time, the audio thread included: wait-free, without allocation, without a message.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_stream_write", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status StreamWrite(ulong stream, float* samples, UIntPtr count, UIntPtr* written);

        /// <summary>
        /// Begins a block of `frames` audio frames, 1 to the option `block_frames` (else FORESOUND_STATUS_BAD_ARGUMENT), whose sources are
        /// rendered apart: for a game with a mixer of its own, in place of foresound_render. Then call foresound_render_source for each
        /// source and foresound_render_reverb once: the sum of their outputs is what foresound_render renders, without its limiter. Needs
        /// the option `source_buses` (else FORESOUND_STATUS_STATE). One thread at a time a renderer. Audio thread: wait-free, without
        /// allocation, without a message.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_render_begin", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status RenderBegin(ulong renderer, UIntPtr frames);

        /// <summary>
        /// Renders one source of the block into `output`: `frames` audio frames of interleaved `channels`, those of the engine
        /// (foresound_renderer_channels); silence on failure. Its paths, without the late reverb. `dry`: the block's mono samples of the
        /// source, 1 being the pressure at 1 m, or null for what the source plays in the engine. `bus` (null if unused) receives
        /// what the output holds. Once a source and block; a source that is not rendered is in foresound_render_reverb's output. A
        /// source that was removed, or that no graphics frame has yet, fails with FORESOUND_STATUS_STALE_SOURCE; a second call for it, or
        /// one outside a block, with FORESOUND_STATUS_STATE; other frames or channels than the block's with FORESOUND_STATUS_BAD_ARGUMENT.
        /// Audio thread: as foresound_render_begin.
        ///
        /// `dry` has `frames` elements, `output` `channels` x `frames`.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_render_source", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status RenderSource(
            ulong renderer, uint source, float* dry, float* output, uint channels, UIntPtr frames, Bus* bus);

        /// <summary>
        /// Ends the block: renders the late reverb of all sources into `output`, and with it everything without a bus of its own in this
        /// block: sources that were not rendered, that share slots (with more sources than slots) or have no position, and the
        /// fading sound of removed ones. Silence on failure: FORESOUND_STATUS_STATE outside a block, FORESOUND_STATUS_BAD_ARGUMENT for other
        /// channels or frames than the block's; a wrong number of frames ends the block too. `info`: null if unused; of the whole block.
        /// Audio thread: as foresound_render_begin.
        ///
        /// `output` has `channels` x `frames` elements.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_render_reverb", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status RenderReverb(
            ulong renderer, float* output, uint channels, UIntPtr frames, RenderInfo* info);

        /// <summary>
        /// Renders each of several listeners into its own part of `output`, one after the other: `listeners` times `frames` audio frames of
        /// interleaved `channels`, the option `listeners` and the engine's channels (else FORESOUND_STATUS_BAD_ARGUMENT); silence on
        /// failure. foresound_render gives their mix, for listeners at one pair of loudspeakers. `info`: null if unused. Audio thread: as
        /// foresound_render.
        ///
        /// `output` has `listeners` x `channels` x `frames` elements.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_render_listeners", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status RenderListeners(
            ulong renderer, float* output, uint listeners, uint channels, UIntPtr frames, RenderInfo* info);

        /// <summary>
        /// Passes the library's messages up to a level to a function, for the whole process; null: none, but for the system's log on
        /// Android. The function is called from any thread but the audio thread, from several at once, until this function is called
        /// again and has returned; it must return and must not call foresound_set_log. FORESOUND_STATUS_STATE in a Rust program with a
        /// logger of its own. Control thread.
        /// </summary>
        [DllImport(Library, EntryPoint = "foresound_set_log", CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        public static extern Status SetLog(LogLevel level, LogCallback callback, void* user);
    }
}
