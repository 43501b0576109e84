using System;
using System.Threading;

namespace Foresound.Interop
{
    /// <summary>
    /// An engine without Unity: the control half, and the handle of the audio half. Foresound's coordinates. Control threads;
    /// methods that run in every frame return a status and neither throw nor allocate.
    /// </summary>
    public sealed unsafe class SoundEngine : NativeHandle
    {
        long renderer;

        SoundEngine(ulong engine, ulong renderer) : base(engine)
        {
            this.renderer = (long)renderer;
        }

        /// <summary>The library's default options.</summary>
        public static Options DefaultOptions
        {
            get
            {
                var options = new Options { Size = Options.Bytes };
                ForesoundException.Check(Native.OptionsDefault(&options));
                return options;
            }
        }

        /// <summary>The library's default options of a source.</summary>
        public static SourceOptions DefaultSourceOptions
        {
            get
            {
                var options = new SourceOptions { Size = SourceOptions.Bytes };
                ForesoundException.Check(Native.SourceOptionsDefault(&options));
                return options;
            }
        }

        /// <summary>An engine in free field. Takes some ten milliseconds.</summary>
        /// <exception cref="ForesoundException">
        /// An option is out of range, or the library has another major version than the package.
        /// </exception>
        public static SoundEngine Create(Options options)
        {
            ulong engine, renderer;
            ForesoundException.Check(
                Native.EngineCreate(Native.ApiVersion, &options, null, UIntPtr.Zero, &engine, &renderer));
            return new SoundEngine(engine, renderer);
        }

        internal override void Close()
        {
            base.Close();
            ulong closed = (ulong)Interlocked.Exchange(ref renderer, 0);
            if (closed != 0) Native.Close(closed);
        }

        /// <summary>The handle of the audio half, for <see cref="Native.Render"/>.</summary>
        public ulong Renderer => (ulong)Interlocked.Read(ref renderer);

        /// <summary>Audio frames from geometry to sound.</summary>
        public int LatencyFrames
        {
            get
            {
                uint frames;
                ForesoundException.Check(Native.RendererLatency(Renderer, &frames));
                return (int)frames;
            }
        }

        /// <summary>Replaces the scene; its handle may be disposed afterwards.</summary>
        public void SetScene(SoundScene scene) => ForesoundException.Check(Native.EngineSetScene(Handle, scene.Handle));

        /// <summary>Limits the share of one core that sound and propagation use; 0: no limit.</summary>
        public void SetCoreShare(double share)
        {
            var budget = new BudgetOptions { Size = BudgetOptions.Bytes };
            ForesoundException.Check(Native.BudgetOptionsDefault(&budget));
            budget.CoreShare = share;
            ForesoundException.Check(Native.EngineSetBudget(Handle, &budget));
        }

        /// <summary>Submits a graphics frame.</summary>
        public Status Tick(ref Pose listener, Pose[] sources, int count)
        {
            if (count < 0 || count > sources.Length) return Status.BadArgument;
            fixed (Pose* head = &listener)
            fixed (Pose* first = sources)
                return Native.EngineTick(Handle, head, first, (UIntPtr)count, (UIntPtr)Pose.Bytes);
        }

        /// <summary>Fades to silence; <see cref="Resume"/> goes on.</summary>
        public void Pause() => ForesoundException.Check(Native.EnginePause(Handle));

        /// <summary>Goes on after <see cref="Pause"/>.</summary>
        public void Resume() => ForesoundException.Check(Native.EngineResume(Handle));

        /// <summary>Durations and counts.</summary>
        public EngineStatistics Statistics
        {
            get
            {
                var statistics = new EngineStatistics { Size = EngineStatistics.Bytes };
                ForesoundException.Check(Native.EngineStatistics(Handle, &statistics));
                return statistics;
            }
        }

        /// <summary>The loudest paths of the newest update; returns their number.</summary>
        public int Paths(ShownPath[] paths)
        {
            UIntPtr count;
            fixed (ShownPath* first = paths)
            {
                UIntPtr capacity = (UIntPtr)paths.Length, bytes = (UIntPtr)ShownPath.Bytes;
                return Native.EnginePaths(Handle, first, bytes, capacity, &count) == Status.Ok ? (int)count : 0;
            }
        }

        /// <summary>Adds a silent source; returns its id.</summary>
        public uint AddSource(float x, float y, float z)
        {
            uint source;
            ForesoundException.Check(Native.SourceAdd(Handle, x, y, z, &source));
            return source;
        }

        /// <summary>Removes a source.</summary>
        public Status RemoveSource(uint source) => Native.SourceRemove(Handle, source);

        /// <summary>Sets a source's options.</summary>
        public void Configure(uint source, SourceOptions options) =>
            ForesoundException.Check(Native.SourceConfigure(Handle, source, &options));

        /// <summary>Sets a source's linear gain, 0 to 1000.</summary>
        public Status SetGain(uint source, float gain) => Native.SourceSetGain(Handle, source, gain);

        /// <summary>Mutes or unmutes a source.</summary>
        public Status Mute(uint source, bool muted) => Native.SourceMute(Handle, source, muted ? 1u : 0u);

        /// <summary>Plays a clip from its beginning.</summary>
        public void Play(uint source, SoundClip clip, bool looped) =>
            ForesoundException.Check(Native.SourcePlay(Handle, source, clip.Handle, looped ? 1u : 0u));

        /// <summary>Silences a source.</summary>
        public Status Stop(uint source) => Native.SourceStop(Handle, source);

        /// <summary>Attaches a stream of <paramref name="capacity"/> samples to a source.</summary>
        public SoundStream Stream(uint source, int capacity)
        {
            ulong stream;
            ForesoundException.Check(Native.SourceStream(Handle, source, (UIntPtr)capacity, &stream));
            return new SoundStream(stream);
        }

        /// <summary>Adds an instance of a part; returns its id.</summary>
        public uint AddInstance(SoundScene part, Pose pose)
        {
            uint instance;
            ForesoundException.Check(Native.InstanceAdd(Handle, part.Handle, &pose, (UIntPtr)Pose.Bytes, &instance));
            return instance;
        }

        /// <summary>Moves an instance.</summary>
        public Status MoveInstance(uint instance, Pose pose) =>
            Native.InstanceMove(Handle, instance, &pose, (UIntPtr)Pose.Bytes);

        /// <summary>Removes an instance.</summary>
        public Status RemoveInstance(uint instance) => Native.InstanceRemove(Handle, instance);
    }

    /// <summary>The writing end of a source's samples.</summary>
    public sealed unsafe class SoundStream : NativeHandle
    {
        internal SoundStream(ulong handle) : base(handle)
        {
        }

        /// <summary>Appends samples as far as they fit. Audio thread: neither waits nor allocates.</summary>
        public Status Write(float[] samples, int count)
        {
            if (count < 0 || count > samples.Length) return Status.BadArgument;
            fixed (float* first = samples) return Native.StreamWrite(Handle, first, (UIntPtr)count, null);
        }
    }
}
