using System;

namespace Foresound.Interop
{
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
        /// <param name="progress">To follow and to cancel it from another thread, or null.</param>
        /// <exception cref="ForesoundException">The mesh or the materials are invalid, or it was cancelled.</exception>
        public static unsafe SoundScene FromMesh(
            float[] positions, uint[] indices, uint[] triangleMaterials, string[] materialNames, string materialsToml,
            SoundProgress progress)
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
                    (UIntPtr)starts.Length, toml, null, progress == null ? 0 : progress.Handle, &scene));
            }
            return new SoundScene(scene);
        }

        /// <summary>Properties of the scene.</summary>
        public unsafe SceneInfo Info
        {
            get
            {
                var info = new SceneInfo { Size = SceneInfo.Bytes };
                ForesoundException.Check(Native.SceneInfo(Handle, &info));
                return info;
            }
        }
    }

    /// <summary>Follows a scene that another thread commits.</summary>
    public sealed unsafe class SoundProgress : NativeHandle
    {
        SoundProgress(ulong handle) : base(handle)
        {
        }

        /// <summary>For one scene.</summary>
        public static SoundProgress Create()
        {
            ulong progress;
            ForesoundException.Check(Native.ProgressCreate(&progress));
            return new SoundProgress(progress);
        }

        /// <summary>The part that is done, 0 to 1; 0 after Dispose.</summary>
        public float Done
        {
            get
            {
                float done;
                return Native.ProgressRead(Handle, &done) == Status.Ok ? done : 0;
            }
        }

        /// <summary>Has the commit fail with <see cref="Status.Cancelled"/>, soon.</summary>
        public Status Cancel() => Native.ProgressCancel(Handle);
    }
}
