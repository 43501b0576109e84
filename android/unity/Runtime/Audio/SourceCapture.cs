using System;
using Foresound.Interop;

namespace Foresound
{
    /// <summary>
    /// Takes the samples of an AudioSource away from Unity's mix and into a source's stream. Unity calls the filters of sources
    /// before the listener's in the same DSP buffer, so each buffer written is rendered in that buffer. Audio thread; neither
    /// waits nor allocates.
    /// </summary>
    internal sealed class SourceCapture
    {
        readonly SoundStream stream;
        readonly float[] mono;

        internal SourceCapture(SoundStream stream, int bufferFrames)
        {
            this.stream = stream;
            mono = new float[Math.Max(bufferFrames, 32)];
        }

        /// <summary>Closes the stream; a call that is under way is refused by the library. Main thread.</summary>
        internal void Close() => stream.Dispose();

        /// <summary>Writes the mean of the channels, and silences them.</summary>
        internal Status Take(float[] data, int channels)
        {
            if (channels < 1 || data.Length % channels != 0) return Status.BadArgument;
            int frames = data.Length / channels;
            var status = Status.Ok;
            for (int start = 0; start < frames && status == Status.Ok;)
            {
                int count = Math.Min(frames - start, mono.Length);
                for (int i = 0; i < count; i++)
                {
                    float sum = 0;
                    for (int c = 0; c < channels; c++) sum += data[(start + i) * channels + c];
                    mono[i] = sum / channels;
                }
                status = stream.Write(mono, count);
                start += count;
            }
            Array.Clear(data, 0, data.Length);
            return status;
        }
    }
}
