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

    /// <summary>A committed scene, or the part of instances.</summary>
    public sealed class SoundScene : NativeHandle
    {
        SoundScene(ulong handle) : base(handle)
        {
        }

        /// <summary>
        /// A scene of triangles in Foresound's coordinates: three coordinates a vertex in metres, three indices and a material a
        /// triangle. Takes milliseconds to seconds: any thread but those of frames and sound.
        /// </summary>
        /// <param name="materialsToml">The text of a materials file, or null.</param>
        /// <exception cref="ForesoundException">The mesh or the materials are invalid.</exception>
        public static unsafe SoundScene FromMesh(
            float[] positions, uint[] indices, uint[] triangleMaterials, string[] materialNames, string materialsToml)
        {
            if (positions == null) throw new ArgumentNullException(nameof(positions));
            if (indices == null) throw new ArgumentNullException(nameof(indices));
            if (triangleMaterials == null) throw new ArgumentNullException(nameof(triangleMaterials));
            if (materialNames == null) throw new ArgumentNullException(nameof(materialNames));
            if (positions.Length % 3 != 0) throw new ArgumentException("pass three coordinates a vertex", nameof(positions));
            if (indices.Length % 3 != 0) throw new ArgumentException("pass three indices a triangle", nameof(indices));
            if (materialNames.Length > 0 && triangleMaterials.Length != indices.Length / 3)
                throw new ArgumentException("pass one material a triangle", nameof(triangleMaterials));
            var starts = new int[materialNames.Length];
            var names = new System.IO.MemoryStream();
            for (int i = 0; i < starts.Length; i++)
            {
                starts[i] = (int)names.Length;
                byte[] name = Utf8.Bytes(materialNames[i]) ?? throw new ArgumentNullException(nameof(materialNames));
                names.Write(name, 0, name.Length);
            }
            var pointers = new byte*[starts.Length];
            ulong scene;
            fixed (float* corners = positions)
            fixed (uint* triangles = indices, materials = triangleMaterials)
            fixed (byte* texts = names.ToArray(), toml = Utf8.Bytes(materialsToml))
            fixed (byte** list = pointers)
            {
                for (int i = 0; i < starts.Length; i++) pointers[i] = texts + starts[i];
                ForesoundException.Check(Native.SceneFromMesh(
                    corners, (UIntPtr)(positions.Length / 3), triangles, (UIntPtr)indices.Length, materials, list,
                    (UIntPtr)starts.Length, toml, null, 0, &scene));
            }
            return new SoundScene(scene);
        }

        /// <summary>Properties of the scene.</summary>
        public unsafe SceneInfo Info
        {
            get
            {
                var info = new SceneInfo { Size = Foresound.Interop.SceneInfo.Bytes };
                ForesoundException.Check(Native.SceneInfo(Handle, &info));
                return info;
            }
        }
    }
}
