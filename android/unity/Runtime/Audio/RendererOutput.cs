using System;
using Foresound.Interop;

namespace Foresound
{
    /// <summary>
    /// What the audio thread has of an engine: the renderer's handle and memory of its own. After the engine is closed the
    /// library refuses the handle, and nothing is added. Audio thread; neither waits nor allocates.
    /// </summary>
    internal sealed class RendererOutput
    {
        readonly ulong renderer;
        readonly float[] stereo;

        internal RendererOutput(ulong renderer, int rateHz, int bufferFrames)
        {
            this.renderer = renderer;
            stereo = new float[2 * Math.Max(bufferFrames, 32)];
            Clock = new DspClock(rateHz);
        }

        internal DspClock Clock { get; }

        /// <summary>Adds the sound of a buffer that begins at a time of the DSP clock.</summary>
        internal unsafe Status Add(float[] data, int channels, double dspTime)
        {
            if (channels < 1 || data.Length % channels != 0) return Status.BadArgument;
            int frames = data.Length / channels;
            Clock.Count(dspTime, frames);
            for (int start = 0; start < frames;)
            {
                int count = Math.Min(frames - start, stereo.Length / 2);
                fixed (float* block = stereo)
                {
                    Status status = Native.Render(renderer, block, (UIntPtr)count, null);
                    if (status != Status.Ok) return status;
                }
                Mix(data, channels, start, count);
                start += count;
            }
            return Status.Ok;
        }

        /// <summary>Adds to the two front channels; to a single channel the mean.</summary>
        void Mix(float[] data, int channels, int start, int count)
        {
            for (int i = 0; i < count; i++)
            {
                int at = (start + i) * channels;
                float left = stereo[2 * i], right = stereo[2 * i + 1];
                if (channels == 1)
                {
                    data[at] += 0.5f * (left + right);
                    continue;
                }
                data[at] += left;
                data[at + 1] += right;
            }
        }
    }
}
