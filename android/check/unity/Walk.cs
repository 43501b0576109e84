// The walk of android/jvm/reference.rs: through the bindings alone, and through the package's components in Unity's
// coordinates. Both write stereo floats that the caller compares with Rust's.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using Foresound.Interop;
using UnityEngine;
using Pose = Foresound.Interop.Pose;

namespace Foresound.Check
{
    static unsafe class Walk
    {
        const int RateHz = 48000, Frames = 800, Ticks = 90;

        internal static void Must(Status status) => ForesoundException.Check(status);

        static float[] Signal()
        {
            var signal = new float[2 * RateHz];
            uint state = 12345;
            for (int n = 0; n < signal.Length; n++)
            {
                state = unchecked(state * 1664525u + 1013904223u);
                float noise = ((int)(state >> 16) - 32768) / 262144f;
                signal[n] = n % 9600 < 8 ? 0.5f : noise;
            }
            return signal;
        }

        internal static Pose PoseAt(uint source, float x, float y, float z, float qx, float qy, float qz, float qw)
        {
            var pose = new Pose { Source = source };
            float[] numbers = { x, y, z, qx, qy, qz, qw };
            for (int i = 0; i < 3; i++) pose.PositionM[i] = numbers[i];
            for (int i = 0; i < 4; i++) pose.Orientation[i] = numbers[3 + i];
            return pose;
        }

        static void Write(BinaryWriter to, float[] block)
        {
            foreach (float sample in block) to.Write(sample);
        }

        /// <summary>Every call as in android/c/walk.c.</summary>
        internal static void Bindings(string obj, string raw)
        {
            var options = new Options { Size = Options.Bytes };
            Must(Native.OptionsDefault(&options));
            options.RateHz = RateHz;
            options.GuideRays = 256;
            Choices.Synchronous(ref options);
            options.FrameS = 1.0 / 60.0;
            using (SoundEngine engine = SoundEngine.Create(options))
            {
                ulong scene, clip, part;
                fixed (byte* path = Utf8.Bytes(obj)) Must(Choices.SceneFromFile(path, &scene));
                Must(Native.EngineSetScene(engine.Handle, scene));
                Must(Native.Close(scene));
                float[] signal = Signal();
                fixed (float* samples = signal)
                    Must(Native.ClipFromSamples(samples, (UIntPtr)signal.Length, RateHz, RateHz, &clip));
                uint near = engine.AddSource(5, 1.5f, 3.2f), far = engine.AddSource(10, 1.5f, 2), door;
                Must(Native.SourcePlay(engine.Handle, near, clip, 1));
                Must(Native.SourcePlay(engine.Handle, far, clip, 0));
                Must(Native.Close(clip));
                Must(engine.SetGain(far, 0.5f));
                float[] corners = { 0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0 };
                uint[] triangles = { 0, 1, 2, 0, 2, 3 };
                using (SoundScene panel = SoundScene.FromMesh(corners, triangles, new uint[0], new string[0], null, null))
                {
                    part = panel.Handle;
                    door = engine.AddInstance(panel, PoseAt(0, 9, 0, 1, 0, 0.6f, 0, 0.8f));
                }
                if (part == 0) throw new Exception("no panel");
                var block = new float[2 * Frames];
                var poses = new Pose[1];
                using (var to = new BinaryWriter(File.Create(raw)))
                    for (int tick = 0; tick < Ticks; tick++)
                    {
                        float progress = (float)tick / Ticks;
                        Pose listener = PoseAt(0, 12.5f - 6 * progress, 1.65f, 0.5f + 4 * progress, 0, 0.5f * progress, 0, 1);
                        poses[0] = PoseAt(near, 5, 1.5f, 3.25f - progress, 0, 0, 0, 1);
                        Must(engine.MoveInstance(door, PoseAt(0, 9, 0, 1 + progress, 0, 0.6f, 0, 0.8f)));
                        Must(engine.Tick(ref listener, poses, 1));
                        fixed (float* output = block) Must(Native.Render(engine.Renderer, output, (UIntPtr)Frames, null));
                        Write(to, block);
                    }
                EngineStatistics statistics = engine.Statistics;
                Console.WriteLine($"bindings updates {statistics.Updates} paths {statistics.Paths}");
            }
        }

        /// <summary>A point of the walk in Unity's coordinates.</summary>
        static Vector3 At(float x, float y, float z) => new Vector3(x, y, -z);

        static Quaternion Turned(float x, float y, float z, float w) => new Quaternion(-x, -y, z, w);

        static float Number(string word) => float.Parse(word, CultureInfo.InvariantCulture);

        /// <summary>An OBJ file's triangles as Unity would have them: mirrored, a submesh for each run of one material.</summary>
        static Mesh MeshOf(string obj, List<string> materials)
        {
            var vertices = new List<Vector3>();
            var submeshes = new List<List<int>>();
            foreach (string line in File.ReadLines(obj))
            {
                string[] words = line.Split(' ');
                if (words[0] == "v") vertices.Add(At(Number(words[1]), Number(words[2]), Number(words[3])));
                if (words[0] == "usemtl")
                {
                    materials.Add(words[1]);
                    submeshes.Add(new List<int>());
                }
                if (words[0] != "f") continue;
                if (words.Length != 4) throw new Exception("no triangle: " + line);
                foreach (int corner in new[] { 1, 3, 2 })
                    submeshes[submeshes.Count - 1].Add(int.Parse(words[corner].Split('/')[0]) - 1);
            }
            var mesh = new Mesh { name = obj, vertices = vertices.ToArray(), subMeshCount = submeshes.Count };
            for (int i = 0; i < submeshes.Count; i++) mesh.SetTriangles(submeshes[i].ToArray(), i);
            return mesh;
        }

        /// <summary>The same walk as a game would have it.</summary>
        internal static void Components(string obj, string raw)
        {
            AudioSettings.Change(RateHz, Frames);
            var names = new List<string>();
            var room = Game.Inactive("room");
            room.AddComponent<MeshFilter>().sharedMesh = MeshOf(obj, names);
            var geometry = room.AddComponent<ForesoundGeometry>();
            geometry.submeshMaterials = names.ConvertAll(Game.MaterialOf).ToArray();
            var door = Game.Inactive("door");
            door.AddComponent<MeshFilter>().sharedMesh = new Mesh
            {
                vertices = new[] { At(0, 0, 0), At(2, 0, 0), At(2, 2, 0), At(0, 2, 0) },
                triangles = new[] { 0, 2, 1, 0, 3, 2 },
            };
            door.AddComponent<ForesoundInstance>();
            door.transform.position = At(9, 0, 1);
            door.transform.rotation = Turned(0, 0.6f, 0, 0.8f);
            AudioClip clip = AudioClip.Create("walk", 2 * RateHz, 1, RateHz, false);
            clip.SetData(Signal(), 0);
            ForesoundSource near = Source(clip, At(5, 1.5f, 3.25f)), far = Source(clip, At(10, 1.5f, 2));
            near.loop = true;
            far.gain = 0.5f;
            GameObject head = Game.Inactive("head");
            head.AddComponent<ForesoundListener>();
            GameObject world = Game.Inactive("world");
            var engine = world.AddComponent<ForesoundEngine>();
            engine.guideRays = 256;
            engine.changeOptions = (ref Options options) =>
            {
                Choices.Synchronous(ref options);
                options.FrameS = 1.0 / 60.0;
                // As the reference: the component takes a divisor of the buffer, 200.
                options.BlockFrames = SoundEngine.DefaultOptions.BlockFrames;
                options.MaxSources = SoundEngine.DefaultOptions.MaxSources;
            };
            foreach (GameObject part in new[] { room, door, near.gameObject, far.gameObject, head, world }) part.SetActive(true);
            // The component adds to what Unity mixed; -0 is the number that adds nothing, to -0 too.
            var block = new float[2 * Frames];
            using (var to = new BinaryWriter(File.Create(raw)))
                for (int tick = 0; tick < Ticks; tick++)
                {
                    float progress = (float)tick / Ticks;
                    head.transform.position = At(12.5f - 6 * progress, 1.65f, 0.5f + 4 * progress);
                    head.transform.rotation = Turned(0, 0.5f * progress, 0, 1);
                    near.transform.position = At(5, 1.5f, 3.25f - progress);
                    door.transform.position = At(9, 0, 1 + progress);
                    // The engine waits for its geometry.
                    Game.FrameUntil(() => engine.HasBegun);
                    for (int i = 0; i < block.Length; i++) block[i] = -0f;
                    Game.Buffer(block, 2);
                    Write(to, block);
                }
            Game.NoErrors();
            EngineStatistics statistics = engine.Sound.Statistics;
            DspClock clock = engine.Clock;
            Check.That(clock.RenderedFrames == Ticks * Frames && clock.MissedFrames == 0 && clock.RepeatedBuffers == 0, "clock");
            Console.WriteLine($"components updates {statistics.Updates} paths {statistics.Paths} triangles of {names.Count} submeshes");
            GameObject.DestroyAll();
        }

        static ForesoundSource Source(AudioClip clip, Vector3 at)
        {
            var source = Game.Inactive("source").AddComponent<ForesoundSource>();
            source.clip = clip;
            source.transform.position = at;
            return source;
        }
    }
}
