using System;
using System.Threading;

namespace Foresound.Interop
{
    /// <summary>
    /// An object of the library. A closed handle is refused by every call, so a call after Dispose fails with
    /// <see cref="Status.Closed"/> and nothing else. Any control thread.
    /// </summary>
    public abstract class NativeHandle : IDisposable
    {
        long handle;

        internal NativeHandle(ulong handle)
        {
            this.handle = (long)handle;
        }

        /// <summary>Closes an object that was not disposed, at the garbage collector's time.</summary>
        ~NativeHandle()
        {
            Close();
        }

        /// <summary>The handle; 0, which is none, after Dispose.</summary>
        public ulong Handle => (ulong)Interlocked.Read(ref handle);

        /// <summary>Closes the object. May be called again, and during calls on other threads.</summary>
        public void Dispose()
        {
            Close();
            GC.SuppressFinalize(this);
        }

        internal virtual void Close()
        {
            ulong closed = (ulong)Interlocked.Exchange(ref handle, 0);
            if (closed != 0) Native.Close(closed);
        }
    }

    /// <summary>Samples, ready for engines of one sample rate.</summary>
    public sealed class SoundClip : NativeHandle
    {
        SoundClip(ulong handle) : base(handle)
        {
        }

        /// <summary>
        /// A clip of mono samples at <paramref name="rateHz"/>, resampled for engines at <paramref name="engineRateHz"/>.
        /// </summary>
        /// <exception cref="ForesoundException">A rate or a sample is out of range.</exception>
        public static unsafe SoundClip FromSamples(float[] samples, int rateHz, int engineRateHz)
        {
            if (samples == null) throw new ArgumentNullException(nameof(samples));
            ulong clip;
            fixed (float* first = samples)
            {
                var count = (UIntPtr)samples.Length;
                ForesoundException.Check(
                    Native.ClipFromSamples(first, count, checked((uint)rateHz), checked((uint)engineRateHz), &clip));
            }
            return new SoundClip(clip);
        }
    }
}
