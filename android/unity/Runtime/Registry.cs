using System.Collections.Generic;
using System.Threading;
using UnityEngine;

namespace Foresound
{
    /// <summary>The enabled components, in the order in which they were enabled. Main thread, except where it says so.</summary>
    internal static class Registry
    {
        static RendererOutput output;

        internal static List<ForesoundSource> Sources { get; } = new List<ForesoundSource>();

        internal static List<ForesoundGeometry> Geometries { get; } = new List<ForesoundGeometry>();

        internal static List<ForesoundInstance> Instances { get; } = new List<ForesoundInstance>();

        internal static ForesoundListener Listener { get; private set; }

        internal static ForesoundEngine Engine { get; private set; }

        /// <summary>Counts changes of the fixed geometry.</summary>
        internal static int GeometryRevision { get; private set; }

        /// <summary>What the audio thread renders with; null: nothing. Any thread.</summary>
        internal static RendererOutput Output
        {
            get => Volatile.Read(ref output);
            set => Volatile.Write(ref output, value);
        }

        /// <summary>Where the editor keeps static variables between two runs.</summary>
        [RuntimeInitializeOnLoadMethod(RuntimeInitializeLoadType.SubsystemRegistration)]
        static void Reset()
        {
            Sources.Clear();
            Geometries.Clear();
            Instances.Clear();
            Listener = null;
            Engine = null;
            Output = null;
        }

        internal static bool Add(ForesoundEngine engine) => IsFirst(Engine, engine) && (Engine = engine) != null;

        internal static void Remove(ForesoundEngine engine)
        {
            if (Engine == engine) Engine = null;
        }

        internal static bool Add(ForesoundListener listener) => IsFirst(Listener, listener) && (Listener = listener) != null;

        internal static void Remove(ForesoundListener listener)
        {
            if (Listener == listener) Listener = null;
        }

        internal static void Add(ForesoundSource source) => Sources.Add(source);

        internal static void Remove(ForesoundSource source)
        {
            if (Sources.Remove(source)) source.Detach();
        }

        internal static void Add(ForesoundInstance instance) => Instances.Add(instance);

        internal static void Remove(ForesoundInstance instance)
        {
            if (Instances.Remove(instance)) instance.Detach();
        }

        internal static void Add(ForesoundGeometry geometry)
        {
            Geometries.Add(geometry);
            GeometryRevision++;
        }

        internal static void Remove(ForesoundGeometry geometry)
        {
            if (Geometries.Remove(geometry)) GeometryRevision++;
        }

        static bool IsFirst<T>(T known, T added) where T : MonoBehaviour
        {
            if (known == null || known == added) return true;
            Debug.LogError($"Foresound: {known.name} has a {typeof(T).Name} already; disable one of the two", added);
            return false;
        }
    }
}
