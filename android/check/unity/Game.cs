// Drives the stand-ins as Unity drives a game.
using System;
using System.Collections.Generic;
using System.IO;
using System.Reflection;
using System.Threading;
using UnityEngine;

namespace Foresound.Check
{
    static class Check
    {
        internal static int Passed { get; private set; }

        internal static void That(bool holds, string what)
        {
            if (!holds) throw new Exception(what);
            Passed++;
        }

        /// <summary>Fails unless a call throws an exception of this type; returns its message.</summary>
        internal static string Throws<T>(string what, Action call) where T : Exception
        {
            try
            {
                call();
            }
            catch (T expected)
            {
                That(expected.Message.Length > 5, what + " has no message");
                return expected.Message;
            }
            throw new Exception(what + " was accepted");
        }
    }

    static class Game
    {
        delegate void Filter(float[] data, int channels);

        static readonly Dictionary<Behaviour, Filter> filters = new Dictionary<Behaviour, Filter>();

        internal static GameObject Inactive(string name)
        {
            var made = new GameObject(name);
            made.SetActive(false);
            return made;
        }

        internal static ForesoundMaterial MaterialOf(string name)
        {
            var material = ScriptableObject.CreateInstance<ForesoundMaterial>();
            material.name = material.builtIn = name;
            return material;
        }

        /// <summary>A box seen from inside, of half the size a side, in Unity's winding.</summary>
        internal static Mesh Box(Vector3 half)
        {
            var mesh = new Mesh { name = "box", vertices = new Vector3[8] };
            for (int i = 0; i < 8; i++)
                mesh.vertices[i] = new Vector3((i & 1) * 2 - 1, (i & 2) - 1, (i & 4) / 2 - 1);
            for (int i = 0; i < 8; i++)
            {
                Vector3 v = mesh.vertices[i];
                mesh.vertices[i] = new Vector3(v.x * half.x, v.y * half.y, v.z * half.z);
            }
            mesh.triangles = new[]
            {
                0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3,
            };
            return mesh;
        }

        static Filter FilterOf(Behaviour behaviour)
        {
            if (filters.TryGetValue(behaviour, out Filter known)) return known;
            const BindingFlags any = BindingFlags.Instance | BindingFlags.NonPublic;
            MethodInfo method = behaviour.GetType().GetMethod("OnAudioFilterRead", any);
            var filter = method == null ? null : (Filter)Delegate.CreateDelegate(typeof(Filter), behaviour, method);
            filters.Add(behaviour, filter);
            return filter;
        }

        /// <summary>Frames until something holds, one at least; an error of a component or a minute ends it.</summary>
        internal static void FrameUntil(Func<bool> holds)
        {
            for (int i = 0; i < 60000; i++)
            {
                GameObject.Frame();
                NoErrors();
                if (holds()) return;
                Thread.Sleep(1);
            }
            throw new Exception("a minute of frames was not enough");
        }

        /// <summary>Calls a component's filter, as Unity's audio thread does.</summary>
        internal static void Filtered(Behaviour behaviour, float[] data, int channels) => FilterOf(behaviour)(data, channels);

        /// <summary>A DSP buffer at the listener; the DSP clock goes on.</summary>
        internal static void Buffer(float[] data, int channels)
        {
            foreach (Behaviour behaviour in GameObject.behaviours)
                if (behaviour.enabled && behaviour is ForesoundListener) FilterOf(behaviour)(data, channels);
            AudioSettings.dspTime += (double)(data.Length / channels) / AudioSettings.outputSampleRate;
        }

        internal static void NoErrors()
        {
            if (Debug.errors.Count > 0) throw new Exception(Debug.errors[0]);
        }

        /// <summary>Takes the only error so far.</summary>
        internal static string TakeError()
        {
            if (Debug.errors.Count != 1) throw new Exception($"{Debug.errors.Count} errors: {string.Join("; ", Debug.errors)}");
            string error = Debug.errors[0];
            Debug.errors.Clear();
            return error;
        }

        /// <summary>A number of kB from /proc/self/status.</summary>
        internal static long Kilobytes(string key)
        {
            foreach (string line in File.ReadLines("/proc/self/status"))
                if (line.StartsWith(key + ":")) return long.Parse(line.Split(':')[1].Replace("kB", "").Trim());
            throw new Exception("no " + key);
        }
    }
}
