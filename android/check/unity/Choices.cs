using Foresound.Interop;

namespace Foresound.Check
{
    /// <summary>Settings whose form depends on the version of the C interface.</summary>
    static unsafe class Choices
    {
        internal static void Synchronous(ref Options options) => options.Schedule = Schedule.Synchronous;

        /// <summary>An engine that takes as little time and memory as possible.</summary>
        internal static Options Light()
        {
            Options options = SoundEngine.DefaultOptions;
            options.RateHz = 48000;
            options.MaxSources = 2;
            options.MaxVoices = 16;
            options.FineVoices = 8;
            options.MaxPaths = 16;
            options.GuideRays = 16;
            options.SourceRays = 8;
            options.MaxDelayS = 0.05;
            options.Hrtf = Hrtf.None;
            options.LateReverb = 0;
            options.ShownPaths = 4;
            Synchronous(ref options);
            return options;
        }

        internal static Status SceneFromFile(byte* path, ulong* scene) => Native.SceneFromFile(path, null, null, 0, scene);
    }
}
