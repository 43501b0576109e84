using System;
using System.Collections.Generic;
using Foresound.Interop;
using UnityEngine;
using Pose = Foresound.Interop.Pose;

namespace Foresound
{
    /// <summary>
    /// The engine, once a game. After all other components have moved it submits the frame's poses; sound comes out at the
    /// <see cref="ForesoundListener"/>. Its sample rate and its blocks are those of Unity's DSP clock; a change of the device
    /// makes a new engine.
    /// </summary>
    [AddComponentMenu("Foresound/Foresound Engine"), DisallowMultipleComponent, DefaultExecutionOrder(10000)]
    public sealed class ForesoundEngine : MonoBehaviour
    {
        /// <summary>Metres a unit.</summary>
        [Min(1e-6f)]
        public float metresPerUnit = 1;

        /// <summary>Most sources, 1 to 4096; beyond 256 near ones share a slot.</summary>
        [Range(1, 4096)]
        public int maxSources = 32;

        /// <summary>Rays from the listener an update; 0: the library's default.</summary>
        [Range(0, 65536)]
        public int guideRays;

        /// <summary>Rays from each source an update; 0: the library's default.</summary>
        [Range(0, 65536)]
        public int sourceRays;

        /// <summary>Largest share of one core for sound and propagation, 0.05 to 2; 0: no limit.</summary>
        [Range(0, 2)]
        public float coreShare;

        /// <summary>Silence until the first scene is committed; else sound in free field.</summary>
        public bool waitForGeometry = true;

        /// <summary>Draws the loudest paths in the scene view.</summary>
        public bool drawPaths;

        /// <summary>Most paths drawn, 1 to 1024.</summary>
        [Range(1, 1024)]
        public int drawnPaths = 64;

        /// <summary>Changes the library's options before an engine is created.</summary>
        public delegate void OptionsChange(ref Options options);

        /// <summary>Changes options that this component does not show; set it before the component is enabled.</summary>
        public OptionsChange changeOptions;

        readonly Dictionary<AudioClip, SoundClip> clips = new Dictionary<AudioClip, SoundClip>();
        SoundEngine engine;
        SceneBuild build;
        ShownPath[] paths;
        Pose[] poses;
        Pose listener;
        int rateHz, geometryRevision, pathCount;
        Status lastStatus;

        /// <summary>The engine without Unity; null while the component is disabled.</summary>
        public SoundEngine Sound => engine;

        /// <summary>Audio frames of Unity's DSP buffer.</summary>
        public int BufferFrames { get; private set; }

        /// <summary>Audio frames rendered and missed by the DSP clock; null while the component is disabled.</summary>
        public DspClock Clock => Registry.Output?.Clock;

        /// <summary>Whether frames are submitted: from the first scene on, or from the start.</summary>
        public bool HasBegun { get; private set; }

        /// <summary>Whether geometry is being committed.</summary>
        public bool IsBuilding
        {
            get
            {
                if (build != null) return true;
                foreach (ForesoundInstance instance in Registry.Instances)
                    if (instance.IsBuilding) return true;
                return false;
            }
        }

        /// <summary>The part of the fixed geometry that is committed, 0 to 1; for loading screens.</summary>
        public float BuildProgress => build == null ? 1 : build.Done;

        void OnEnable()
        {
            enabled = Registry.Add(this) && Open();
        }

        void OnDisable()
        {
            Close();
            Registry.Remove(this);
        }

        void OnApplicationPause(bool isPaused)
        {
            if (isPaused) engine?.Pause();
            else engine?.Resume();
        }

        bool Open()
        {
            rateHz = AudioSettings.outputSampleRate;
            AudioSettings.GetDSPBufferSize(out int frames, out _);
            BufferFrames = frames;
            try
            {
                Options options = SoundEngine.DefaultOptions;
                options.RateHz = (uint)rateHz;
                options.BlockFrames = (uint)DspClock.BlockFrames(frames);
                options.MaxSources = (uint)maxSources;
                if (guideRays > 0) options.GuideRays = (uint)guideRays;
                if (sourceRays > 0) options.SourceRays = (uint)sourceRays;
                options.ShownPaths = (uint)drawnPaths;
                changeOptions?.Invoke(ref options);
                engine = SoundEngine.Create(options);
                if (coreShare > 0) engine.SetCoreShare(coreShare);
            }
            catch (Exception error) when (error is ForesoundException || error is DllNotFoundException)
            {
                Debug.LogError($"Foresound: no engine: {error.Message}", this);
                Close();
                return false;
            }
            poses = new Pose[Math.Max(maxSources, 1)];
            paths = new ShownPath[drawnPaths];
            HasBegun = false;
            lastStatus = Status.Ok;
            geometryRevision = -1;
            Registry.Output = new RendererOutput(engine.Renderer, rateHz, frames);
            AudioSettings.OnAudioConfigurationChanged += Reopen;
            return true;
        }

        void Close()
        {
            AudioSettings.OnAudioConfigurationChanged -= Reopen;
            if (Registry.Engine != this) return;
            Registry.Output = null;
            foreach (ForesoundSource source in Registry.Sources) source.Detach();
            foreach (ForesoundInstance instance in Registry.Instances) instance.Detach();
            build?.Abandon();
            build = null;
            foreach (SoundClip clip in clips.Values) clip.Dispose();
            clips.Clear();
            engine?.Dispose();
            engine = null;
        }

        void Reopen(bool deviceWasChanged)
        {
            Close();
            enabled = Open();
        }

        void LateUpdate()
        {
            if (engine == null) return;
            Build();
            foreach (ForesoundInstance instance in Registry.Instances)
            {
                if (!instance.IsAttached) instance.Attach(engine, metresPerUnit);
                instance.BeforeTick(metresPerUnit);
            }
            if (Registry.Listener == null || (waitForGeometry && !HasBegun && IsBuilding)) return;
            HasBegun = true;
            Transform head = Registry.Listener.transform;
            Coordinates.Write(ref listener, 0, head.position, head.rotation, metresPerUnit);
            Report(engine.Tick(ref listener, poses, SourcePoses()));
        }

        int SourcePoses()
        {
            int count = 0;
            foreach (ForesoundSource source in Registry.Sources)
            {
                // Sources beyond the maximum wait for a place.
                if (count == poses.Length) break;
                if (source.IsAttached || source.Attach(this, engine)) source.BeforeTick(this, ref poses[count++]);
            }
            return count;
        }

        /// <summary>An invalid pose is reported once, not in every frame.</summary>
        void Report(Status status)
        {
            if (status == lastStatus) return;
            lastStatus = status;
            if (status != Status.Ok) Debug.LogError($"Foresound: {ForesoundException.LastError()}", this);
        }

        /// <summary>Takes a committed scene, and begins the next one if geometry came or went since.</summary>
        void Build()
        {
            if (build != null && build.IsDone)
            {
                try
                {
                    using (SoundScene scene = build.Take()) engine.SetScene(scene);
                }
                catch (ForesoundException error)
                {
                    Debug.LogError($"Foresound: no scene: {error.Message}", this);
                }
                build = null;
            }
            if (build != null || geometryRevision == Registry.GeometryRevision) return;
            geometryRevision = Registry.GeometryRevision;
            var input = new SceneInput(metresPerUnit);
            foreach (ForesoundGeometry geometry in Registry.Geometries)
                if (geometry.Instance == null)
                    foreach (MeshPiece piece in geometry.Pieces()) input.Add(piece);
            // Without geometry the last scene stays; the first one is free field.
            if (input.Triangles > 0) build = new SceneBuild(input);
        }

        /// <summary>The samples of a clip, kept until the engine closes; null, with a message, if Unity does not give them.</summary>
        internal SoundClip ClipOf(AudioClip clip)
        {
            if (clips.TryGetValue(clip, out SoundClip known)) return known;
            var samples = new float[clip.samples * clip.channels];
            if (!clip.GetData(samples, 0))
            {
                Debug.LogError($"Foresound: no samples of {clip.name}; set Decompress On Load in its import settings", clip);
                return null;
            }
            var mono = new float[clip.samples];
            for (int i = 0; i < samples.Length; i++) mono[i / clip.channels] += samples[i] / clip.channels;
            try
            {
                SoundClip made = SoundClip.FromSamples(mono, clip.frequency, rateHz);
                clips.Add(clip, made);
                return made;
            }
            catch (ForesoundException error)
            {
                Debug.LogError($"Foresound: {clip.name}: {error.Message}", clip);
                return null;
            }
        }

        void OnDrawGizmos()
        {
            if (!drawPaths || engine == null) return;
            pathCount = engine.Paths(paths);
            PathGizmos.Draw(paths, pathCount, metresPerUnit);
        }
    }
}
