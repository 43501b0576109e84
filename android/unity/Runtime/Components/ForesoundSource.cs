using System.Threading;
using Foresound.Interop;
using UnityEngine;
using Pose = Foresound.Interop.Pose;

namespace Foresound
{
    /// <summary>
    /// A sound source. With an AudioSource on the same object that one plays, to the sample of the DSP clock (PlayScheduled,
    /// pitch, filters below this component), and Foresound takes its samples. Without one, Foresound plays the clip.
    /// </summary>
    [AddComponentMenu("Foresound/Foresound Source"), DisallowMultipleComponent]
    public sealed class ForesoundSource : MonoBehaviour
    {
        /// <summary>Mono, or the mean of its channels; import setting Decompress On Load. Without an AudioSource.</summary>
        [Tooltip("Played by Foresound; import setting Decompress On Load. With an AudioSource on this object that one plays.")]
        public AudioClip clip;

        /// <summary>Whether the clip repeats.</summary>
        public bool loop;

        /// <summary>Whether the clip begins when the component is enabled.</summary>
        public bool playOnEnable = true;

        /// <summary>Linear gain, 0 to 1000. A sample of 1 is full scale at 1 m.</summary>
        [Range(0, 10)]
        public float gain = 1;

        /// <summary>Silent; the clip goes on.</summary>
        public bool muted;

        /// <summary>Radius in units within which the source gets no louder; 0: the engine's.</summary>
        [Min(0)]
        public float radius;

        /// <summary>0 omnidirectional, 0.5 cardioid, 1 dipole; ahead is the object's forward direction.</summary>
        [Range(0, 1)]
        public float directivity;

        /// <summary>Exponent of the directivity, 0 to 64.</summary>
        [Range(0, 64)]
        public float sharpness = 1;

        SoundEngine engine;
        SourceCapture capture;
        uint id;
        bool wantsPlay;
        float setGain = 1, setRadius, setDirectivity, setSharpness = 1;
        bool isMuted, isRefused;

        void OnEnable()
        {
            wantsPlay = playOnEnable;
            Registry.Add(this);
        }

        void OnDisable() => Registry.Remove(this);

        /// <summary>Plays the clip from its beginning, from the next frame on.</summary>
        public void Play() => wantsPlay = true;

        /// <summary>Stops the clip.</summary>
        public void Stop()
        {
            wantsPlay = false;
            if (IsAttached) engine.Stop(id);
        }

        /// <summary>Whether the source is one of the engine's.</summary>
        public bool IsAttached => engine != null;

        /// <summary>Joins an engine; false if it has no room.</summary>
        internal bool Attach(ForesoundEngine owner, SoundEngine to)
        {
            Vector3 at = Coordinates.ToForesound(transform.position, owner.metresPerUnit);
            try
            {
                id = to.AddSource(at.x, at.y, at.z);
                engine = to;
                isRefused = false;
                var player = GetComponent<AudioSource>();
                if (player == null) return true;
                // Distance and direction are Foresound's.
                player.spatialBlend = 0;
                int frames = owner.BufferFrames;
                // Four buffers: what Unity may mix ahead after a stall.
                Volatile.Write(ref capture, new SourceCapture(to.Stream(id, 4 * frames), frames));
                return true;
            }
            catch (ForesoundException error)
            {
                if (engine != null) to.RemoveSource(id);
                engine = null;
                // Reported once, tried in every frame.
                if (!isRefused) Debug.LogError($"Foresound: {name}: {error.Message}", this);
                isRefused = true;
                return false;
            }
        }

        /// <summary>Leaves the engine, which may be closed.</summary>
        internal void Detach()
        {
            capture?.Close();
            Volatile.Write(ref capture, null);
            engine?.RemoveSource(id);
            engine = null;
            setGain = 1;
            isMuted = false;
            setRadius = setDirectivity = 0;
            setSharpness = 1;
        }

        /// <summary>Passes on what changed, and writes the pose.</summary>
        internal void BeforeTick(ForesoundEngine owner, ref Pose pose)
        {
            if (wantsPlay) Begin(owner);
            // Equals has NaN equal itself: a value is refused once, not in every frame.
            if (!gain.Equals(setGain)) Report(engine.SetGain(id, setGain = gain));
            if (muted != isMuted) Report(engine.Mute(id, isMuted = muted));
            bool isLike = radius.Equals(setRadius) && directivity.Equals(setDirectivity) && sharpness.Equals(setSharpness);
            if (!isLike) Configure(owner);
            Transform at = transform;
            Coordinates.Write(ref pose, id, at.position, at.rotation, owner.metresPerUnit);
        }

        void Report(Status status)
        {
            if (status != Status.Ok) Debug.LogError($"Foresound: {name}: {ForesoundException.LastError()}", this);
        }

        void Begin(ForesoundEngine owner)
        {
            wantsPlay = false;
            if (clip == null || capture != null) return;
            SoundClip samples = owner.ClipOf(clip);
            if (samples != null) engine.Play(id, samples, loop);
        }

        unsafe void Configure(ForesoundEngine owner)
        {
            setRadius = radius;
            setDirectivity = directivity;
            setSharpness = sharpness;
            SourceOptions options = SoundEngine.DefaultSourceOptions;
            options.RadiusM = radius * owner.metresPerUnit;
            options.Order = sharpness;
            for (int band = 0; band < ForesoundMaterial.Bands; band++) options.Directivity[band] = directivity;
            try
            {
                engine.Configure(id, options);
            }
            catch (ForesoundException error)
            {
                Debug.LogError($"Foresound: {name}: {error.Message}", this);
            }
        }

        /// <summary>Unity's audio thread, once a DSP buffer while the AudioSource plays.</summary>
        void OnAudioFilterRead(float[] data, int channels) => Volatile.Read(ref capture)?.Take(data, channels);

        void OnDrawGizmosSelected()
        {
            Gizmos.color = Color.cyan;
            Gizmos.DrawWireSphere(transform.position, radius > 0 ? radius : 0.1f);
        }
    }
}
