using System;
using System.Threading;

namespace Foresound
{
    /// <summary>
    /// Compares rendered audio frames with Unity's DSP clock. Every buffer of the clock is rendered once: a jump ahead is sound
    /// that was never asked for, a step back or none is a second call for the same buffer.
    /// </summary>
    public sealed class DspClock
    {
        readonly double rateHz;
        double next = double.NaN;
        long rendered, missed, repeated;

        /// <summary>A clock of a device's rate in Hz.</summary>
        public DspClock(int rateHz)
        {
            this.rateHz = rateHz;
        }

        /// <summary>Audio frames rendered. Any thread.</summary>
        public long RenderedFrames => Interlocked.Read(ref rendered);

        /// <summary>Audio frames of the DSP clock that were not rendered. Any thread.</summary>
        public long MissedFrames => Interlocked.Read(ref missed);

        /// <summary>Buffers rendered more than once. Any thread.</summary>
        public long RepeatedBuffers => Interlocked.Read(ref repeated);

        /// <summary>Counts a buffer that begins at a time of the DSP clock in seconds. Audio thread.</summary>
        internal void Count(double dspTime, int frames)
        {
            double ahead = (dspTime - next) * rateHz;
            // Half a buffer is more than the clock's rounding and less than a buffer. The first buffer compares with NaN.
            if (ahead > 0.5 * frames) Interlocked.Add(ref missed, (long)Math.Round(ahead));
            if (ahead < -0.5 * frames) Interlocked.Increment(ref repeated);
            Interlocked.Add(ref rendered, frames);
            next = dspTime + frames / rateHz;
        }

        /// <summary>
        /// The block size for a device's buffer: its largest divisor of 32 to 256 audio frames, else 256. Whole blocks make every
        /// callback equally long.
        /// </summary>
        public static int BlockFrames(int bufferFrames)
        {
            for (int block = Math.Min(bufferFrames, 256); block >= 32; block--)
                if (bufferFrames % block == 0) return block;
            return 256;
        }
    }
}
