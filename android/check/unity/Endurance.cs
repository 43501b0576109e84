// What a long run shows: memory of cycles, garbage of frames and buffers.
using System;
using System.Diagnostics;
using Foresound.Interop;
using UnityEngine;

namespace Foresound.Check
{
    static class Endurance
    {
        /// <summary>Creates and closes engines with their components; resident memory must not grow.</summary>
        internal static void Cycles(int count)
        {
            AudioSettings.Change(48000, 256);
            GameObject speaker = Game.Inactive("speaker"), head = Game.Inactive("head"), door = Game.Inactive("door"), world = Game.Inactive("world");
            var source = speaker.AddComponent<ForesoundSource>();
            source.clip = AudioClip.Create("clip", 256, 1, 48000, false);
            source.loop = true;
            head.AddComponent<ForesoundListener>();
            door.AddComponent<MeshFilter>().sharedMesh = Game.Box(Vector3.one);
            door.AddComponent<ForesoundInstance>();
            var engine = world.AddComponent<ForesoundEngine>();
            engine.changeOptions = (ref Options options) => options = Choices.Light();
            var data = new float[512];
            foreach (GameObject made in new[] { speaker, head, door, world }) made.SetActive(true);
            Game.FrameUntil(() => engine.HasBegun);
            long before = 0;
            var watch = Stopwatch.StartNew();
            for (int n = 0; n < count; n++)
            {
                // A tenth to warm up: heaps grow to their size.
                if (n == count / 10) before = Game.Kilobytes("VmRSS");
                engine.enabled = false;
                engine.enabled = true;
                // Every hundredth with geometry and sound; the others are closed in the midst of it.
                if (n % 100 == 0) Game.FrameUntil(() => engine.HasBegun);
                else GameObject.Frame();
                Game.Buffer(data, 2);
            }
            long grown = Game.Kilobytes("VmRSS") - before;
            Game.NoErrors();
            GameObject.DestroyAll();
            Console.WriteLine($"cycles engines {count} us_each {watch.ElapsedMilliseconds * 1000.0 / count:f0} grown_kB {grown}");
            // A leak of 1 kB an engine is 9 MB.
            Check.That(grown < 4000, $"memory grows by {grown} kB");
        }

        /// <summary>Frames and buffers with sixteen sources and a door that swings: nothing is allocated.</summary>
        internal static void Tick()
        {
            AudioSettings.Change(48000, 256);
            const int sources = 16, warm = 3000, count = 10000;
            var speakers = new ForesoundSource[sources];
            for (int i = 0; i < sources; i++)
            {
                GameObject speaker = Game.Inactive("speaker");
                speakers[i] = speaker.AddComponent<ForesoundSource>();
                speakers[i].clip = AudioClip.Create("clip", 4800, 1, 48000, false);
                speakers[i].loop = true;
                // Every other one is played by Unity.
                if (i % 2 == 0) speaker.AddComponent<AudioSource>();
                speaker.transform.position = new Vector3(i - 8, 1, 3);
                speaker.SetActive(true);
            }
            GameObject head = Game.Inactive("head"), door = Game.Inactive("door"), world = Game.Inactive("world");
            var ears = head.AddComponent<ForesoundListener>();
            door.AddComponent<MeshFilter>().sharedMesh = Game.Box(new Vector3(1, 2, 0.1f));
            door.AddComponent<ForesoundInstance>();
            var engine = world.AddComponent<ForesoundEngine>();
            engine.guideRays = 64;
            engine.sourceRays = 16;
            foreach (GameObject made in new[] { head, door, world }) made.SetActive(true);
            Game.FrameUntil(() => engine.HasBegun);
            var data = new float[512];
            var paths = new ShownPath[64];
            long meter = GC.GetAllocatedBytesForCurrentThread();
            GC.KeepAlive(new byte[1000]);
            meter = GC.GetAllocatedBytesForCurrentThread() - meter;
            Check.That(meter >= 1000 && meter < 1200, $"the meter shows {meter} of 1000 bytes");
            long allocated = 0;
            int collections = 0;
            var watch = new Stopwatch();
            var times = new long[count];
            for (int n = -warm; n < count; n++)
            {
                if (n == 0)
                {
                    collections = GC.CollectionCount(0);
                    allocated = GC.GetAllocatedBytesForCurrentThread();
                }
                float along = 0.001f * (n & 1023);
                head.transform.position = new Vector3(along, 1.7f, 0);
                door.transform.position = new Vector3(0, 0, 2 + along);
                for (int i = 0; i < sources; i++)
                {
                    speakers[i].transform.position = new Vector3(i - 8, 1, 3 + along);
                    speakers[i].gain = 1 + along;
                }
                watch.Restart();
                GameObject.Frame();
                if (n >= 0) times[n] = watch.ElapsedTicks;
                for (int i = 0; i < sources; i += 2) Game.Filtered(speakers[i], data, 2);
                Game.Filtered(ears, data, 2);
                engine.Sound.Paths(paths);
            }
            allocated = GC.GetAllocatedBytesForCurrentThread() - allocated;
            collections = GC.CollectionCount(0) - collections;
            Game.NoErrors();
            GameObject.DestroyAll();
            Array.Sort(times);
            double us = 1e6 / Stopwatch.Frequency;
            Console.WriteLine(
                $"tick sources {sources} frames {count} p50_us {times[count / 2] * us:f1} p99_us {times[count * 99 / 100] * us:f1} " +
                $"allocated_bytes {allocated} collections {collections}");
            Check.That(allocated == 0 && collections == 0, $"{allocated} bytes in {count} frames");
        }
    }
}
