// Stand-ins for Unity's meshes, sound and attributes.
using System;

namespace UnityEngine
{
    public enum MeshTopology
    {
        Triangles = 0,
        Lines = 3,
    }

    public enum PrimitiveType
    {
        Cube = 3,
    }

    public sealed class Mesh : Object
    {
        int[][] submeshes = { new int[0] };

        public bool isReadable = true;
        public Vector3[] vertices = { };
        public int subMeshCount
        {
            get => submeshes.Length;
            set => Array.Resize(ref submeshes, value);
        }

        public int[] triangles
        {
            set => submeshes[0] = value;
        }

        /// <summary>Of the stand-ins: Unity's cube, a unit a side, seen from outside.</summary>
        internal static Mesh Cube()
        {
            var mesh = new Mesh { name = "Cube", vertices = new Vector3[8] };
            for (int i = 0; i < 8; i++)
                mesh.vertices[i] = new Vector3((i & 1) - 0.5f, (i & 2) / 2 - 0.5f, (i & 4) / 4 - 0.5f);
            mesh.triangles = new[]
            {
                0, 3, 1, 0, 2, 3, 4, 7, 6, 4, 5, 7, 0, 5, 4, 0, 1, 5, 2, 7, 3, 2, 6, 7, 0, 6, 2, 0, 4, 6, 1, 7, 5, 1, 3, 7,
            };
            return mesh;
        }

        public MeshTopology GetTopology(int submesh) => MeshTopology.Triangles;
        public int[] GetTriangles(int submesh) => (int[])submeshes[submesh].Clone();
        public void SetTriangles(int[] triangles, int submesh) => submeshes[submesh] = triangles;
    }

    public sealed class MeshFilter : Component
    {
        public Mesh sharedMesh;
    }

    public sealed class MeshRenderer : Component
    {
        public bool isPartOfStaticBatch;
    }

    public sealed class AudioClip : Object
    {
        float[] data;

        public int samples { get; private set; }
        public int channels { get; private set; }
        public int frequency { get; private set; }

        /// <summary>Of the stand-ins: without samples in memory.</summary>
        public bool isStreamed;

        public static AudioClip Create(string name, int lengthSamples, int channels, int frequency, bool stream) => new AudioClip
        {
            name = name,
            samples = lengthSamples,
            channels = channels,
            frequency = frequency,
            data = new float[lengthSamples * channels],
        };

        public bool SetData(float[] from, int offsetSamples)
        {
            Array.Copy(from, 0, data, offsetSamples * channels, from.Length);
            return true;
        }

        public bool GetData(float[] to, int offsetSamples)
        {
            if (isStreamed) return false;
            Array.Copy(data, offsetSamples * channels, to, 0, to.Length);
            return true;
        }
    }

    public sealed class AudioSource : Behaviour
    {
        public float spatialBlend = 1;
    }

    public sealed class AudioListener : Behaviour
    {
    }

    public static class AudioSettings
    {
        public delegate void AudioConfigurationChangeHandler(bool deviceWasChanged);

        public static event AudioConfigurationChangeHandler OnAudioConfigurationChanged;

        public static int outputSampleRate = 48000;
        public static double dspTime;

        /// <summary>Of the stand-ins: audio frames of a buffer.</summary>
        public static int bufferFrames = 512;

        public static void GetDSPBufferSize(out int bufferLength, out int numBuffers)
        {
            bufferLength = bufferFrames;
            numBuffers = 4;
        }

        /// <summary>Of the stand-ins: another device.</summary>
        public static void Change(int rateHz, int frames)
        {
            outputSampleRate = rateHz;
            bufferFrames = frames;
            OnAudioConfigurationChanged?.Invoke(true);
        }
    }

    public enum RuntimeInitializeLoadType
    {
        SubsystemRegistration = 4,
    }

    public sealed class RuntimeInitializeOnLoadMethodAttribute : Attribute
    {
        public RuntimeInitializeOnLoadMethodAttribute(RuntimeInitializeLoadType type)
        {
        }
    }

    public sealed class DefaultExecutionOrder : Attribute
    {
        internal readonly int order;

        public DefaultExecutionOrder(int order)
        {
            this.order = order;
        }
    }

    public sealed class RequireComponent : Attribute
    {
        internal readonly Type type;

        public RequireComponent(Type type)
        {
            this.type = type;
        }
    }

    public sealed class AddComponentMenu : Attribute
    {
        public AddComponentMenu(string menu)
        {
        }
    }

    public sealed class CreateAssetMenuAttribute : Attribute
    {
        public string menuName { get; set; }
        public string fileName { get; set; }
    }

    public sealed class TooltipAttribute : Attribute
    {
        public TooltipAttribute(string text)
        {
        }
    }

    public sealed class RangeAttribute : Attribute
    {
        public RangeAttribute(float least, float most)
        {
        }
    }

    public sealed class MinAttribute : Attribute
    {
        public MinAttribute(float least)
        {
        }
    }

    public sealed class DisallowMultipleComponent : Attribute
    {
    }

    public sealed class SerializeField : Attribute
    {
    }

    public sealed class HideInInspector : Attribute
    {
    }
}
