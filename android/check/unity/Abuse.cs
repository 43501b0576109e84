// Invalid arguments: through every binding by reflection, so a new function is abused without being named here, and through the
// package's classes.
using System;
using System.Collections.Generic;
using System.Reflection;
using System.Runtime.InteropServices;
using Foresound.Interop;
using UnityEngine;

namespace Foresound.Check
{
    static unsafe class Abuse
    {
        static int refused;

        internal static void Run()
        {
            Layouts();
            Bindings();
            Classes();
            Components();
            Console.WriteLine($"abuse refused {refused} calls; {Check.Passed} checks");
        }

        /// <summary>Structures have the bytes that the C header gives them.</summary>
        static void Layouts()
        {
            int structures = 0;
            foreach (Type type in typeof(Native).Assembly.GetTypes())
            {
                FieldInfo bytes = type.GetField("Bytes");
                if (type.Namespace != "Foresound.Interop" || bytes == null) continue;
                structures++;
                Check.That(Marshal.SizeOf(type) == (uint)bytes.GetRawConstantValue(), type.Name + " has another size");
            }
            Check.That(structures >= 12, structures + " structures");
            Check.That(SoundEngine.DefaultOptions.RateHz == 44100 || SoundEngine.DefaultOptions.RateHz == 48000, "default options");
        }

        /// <summary>A value for a parameter: the wrong handle, null for pointers, zero for the rest.</summary>
        static object Argument(ParameterInfo parameter, ulong handle) =>
            parameter.ParameterType == typeof(ulong) ? handle
            : parameter.ParameterType.IsPointer || !parameter.ParameterType.IsValueType ? null
            : Activator.CreateInstance(parameter.ParameterType);

        static void Bindings()
        {
            using (SoundEngine engine = SoundEngine.Create(Choices.Light()))
            using (SoundClip clip = SoundClip.FromSamples(new float[8], 48000, 48000))
            {
                ulong closed;
                using (SoundClip gone = SoundClip.FromSamples(new float[8], 48000, 48000)) closed = gone.Handle;
                ulong[] wrong = { 0, 1, ulong.MaxValue, 1ul << 63, closed, clip.Handle ^ 1ul << 40, clip.Handle };
                foreach (MethodInfo method in typeof(Native).GetMethods(BindingFlags.Static | BindingFlags.Public))
                {
                    // Null is no function for messages, which is a choice.
                    if (method.ReturnType != typeof(Status) || method.Name == "SetLog") continue;
                    ParameterInfo[] parameters = method.GetParameters();
                    bool takesHandle = Array.Exists(parameters, p => p.ParameterType == typeof(ulong));
                    bool takesPointer = Array.Exists(parameters, p => p.ParameterType.IsPointer);
                    foreach (ulong handle in wrong)
                    {
                        // The clip's own handle is wrong for all others, and needed later.
                        if (handle == clip.Handle && method.Name == "Close") continue;
                        if (!takesHandle && !takesPointer) continue;
                        object[] arguments = Array.ConvertAll(parameters, p => Argument(p, handle));
                        var status = (Status)method.Invoke(null, arguments);
                        bool isError = status != Status.Ok && status != Status.Panic && Enum.IsDefined(typeof(Status), status);
                        Check.That(isError, $"{method.Name} with handle {handle:x} gave {status}");
                        bool isAudio = method.Name == "Render" || method.Name == "StreamWrite";
                        Check.That(isAudio || ForesoundException.LastError().Length > 5, method.Name + " has no message");
                        refused++;
                    }
                }
                Check.That(engine.Statistics.Sources == 0, "a refused call left a source");
            }
            Check.That(refused > 200, refused + " calls");
        }

        static void Refuses<T>(string what, Action call) where T : Exception
        {
            Check.Throws<T>(what, call);
            refused++;
        }

        static void Refuses(string what, Status wanted, Action call)
        {
            try
            {
                call();
            }
            catch (ForesoundException error)
            {
                Check.That(error.Status == wanted, $"{what}: {error.Status}: {error.Message}");
                refused++;
                return;
            }
            throw new Exception(what + " was accepted");
        }

        static void Classes()
        {
            SoundEngine engine = SoundEngine.Create(Choices.Light());
            uint source = engine.AddSource(0, 1, 2);
            SoundClip clip = SoundClip.FromSamples(new float[8], 48000, 48000);
            float[] corners = { 0, 0, 0, 1, 0, 0, 0, 0, 1 };
            uint[] triangle = { 0, 1, 2 }, beyond = { 0, 1, 3 }, one = { 0 };
            string[] brick = { "brick" };
            SoundScene scene = SoundScene.FromMesh(corners, triangle, one, brick, null, null);
            Check.That(scene.Info.Triangles == 1 && scene.Info.UnknownMaterials == 0, "a triangle of brick");

            Options options = Choices.Light();
            options.Size = 0;
            Refuses("a size of 0", Status.BadArgument, () => SoundEngine.Create(options));
            options = Choices.Light();
            options.RateHz = 7;
            Refuses("a rate of 7 Hz", Status.BadArgument, () => SoundEngine.Create(options));
            Refuses<ArgumentNullException>("no samples", () => SoundClip.FromSamples(null, 48000, 48000));
            Refuses<OverflowException>("a negative rate", () => SoundClip.FromSamples(new float[8], -1, 48000));
            Refuses("NaN", Status.BadArgument, () => SoundClip.FromSamples(new[] { float.NaN }, 48000, 48000));
            Refuses<ArgumentNullException>("no corners", () => SoundScene.FromMesh(null, triangle, one, brick, null, null));
            Refuses<ArgumentNullException>("no name", () => SoundScene.FromMesh(corners, triangle, one, new string[1], null, null));
            Refuses<ArgumentException>("8 numbers", () => SoundScene.FromMesh(new float[8], triangle, one, brick, null, null));
            Refuses<ArgumentException>("2 indices", () => SoundScene.FromMesh(corners, new uint[2], one, brick, null, null));
            Refuses<ArgumentException>("2 materials", () => SoundScene.FromMesh(corners, triangle, new uint[2], brick, null, null));
            Refuses<ArgumentException>("a zero", () => SoundScene.FromMesh(corners, triangle, one, new[] { "a\0b" }, null, null));
            Refuses("an index beyond", Status.Format, () => SoundScene.FromMesh(corners, beyond, one, brick, null, null));
            Refuses("a material beyond", Status.Format, () => SoundScene.FromMesh(corners, triangle, new uint[] { 7 }, brick, null, null));
            Refuses("no materials file", Status.Format, () => SoundScene.FromMesh(corners, triangle, one, brick, "[what", null));
            Refuses("a source of no engine", Status.StaleSource, () => engine.Configure(source + 1, SoundEngine.DefaultSourceOptions));
            Refuses("a clip as a scene", Status.WrongKind, () => ForesoundException.Check(Native.EngineSetScene(engine.Handle, clip.Handle)));
            Refuses("a stream of nothing", Status.BadArgument, () => engine.Stream(source, 0));

            // A commit that is cancelled, before it begins and while it runs.
            using (SoundProgress progress = SoundProgress.Create())
            {
                Check.That(progress.Done == 0 && progress.Cancel() == Status.Ok, "a progress at its start");
                Refuses("a cancelled scene", Status.Cancelled, () => SoundScene.FromMesh(corners, triangle, one, brick, null, progress));
            }
            SoundProgress over = SoundProgress.Create();
            over.Dispose();
            Check.That(over.Done == 0 && over.Cancel() == Status.Closed, "a closed progress");
            ulong no;
            Check.That(Native.EngineCreate(Native.ApiVersion + 0x10000, null, null, UIntPtr.Zero, &no, &no) == Status.Version, "a newer header");

            var poses = new Interop.Pose[2];
            Interop.Pose head = Walk.PoseAt(0, 0, 1, 0, 0, 0, 0, 1);
            Check.That(engine.Tick(ref head, poses, 3) == Status.BadArgument, "3 of 2 poses");
            Check.That(engine.Tick(ref head, poses, -1) == Status.BadArgument, "-1 poses");
            poses[0] = Walk.PoseAt(source, float.NaN, 0, 0, 0, 0, 0, 1);
            Check.That(engine.Tick(ref head, poses, 1) == Status.BadArgument, "a source at NaN");
            SoundStream stream = engine.Stream(source, 64);
            Check.That(stream.Write(new float[8], 9) == Status.BadArgument, "9 of 8 samples");
            Check.That(stream.Write(new float[8], 8) == Status.Ok, "8 of 8 samples");

            foreach (NativeHandle handle in new NativeHandle[] { stream, clip, scene, engine })
            {
                handle.Dispose();
                handle.Dispose();
                Check.That(handle.Handle == 0, "a handle after Dispose");
            }
            Check.That(engine.Tick(ref head, poses, 0) == Status.Closed, "a tick of a closed engine");
            Check.That(stream.Write(new float[8], 8) == Status.Closed, "a closed stream");
            Check.That(engine.Paths(new ShownPath[4]) == 0, "paths of a closed engine");
            Refuses("a source of a closed engine", Status.Closed, () => engine.AddSource(0, 0, 0));
            Refuses("a closed clip", Status.Closed, () => engine.Play(source, clip, false));
            Refuses("a closed scene", Status.Closed, () => { SceneInfo info = scene.Info; });
        }

        /// <summary>Components in the wrong order, twice, without an engine, with meshes and clips that Unity does not give.</summary>
        static void Components()
        {
            AudioSettings.Change(48000, 256);
            var data = new float[512];
            GameObject head = Game.Inactive("head");
            var ears = head.AddComponent<ForesoundListener>();
            head.SetActive(true);
            Game.Filtered(ears, data, 2);
            GameObject second = Game.Inactive("second head");
            var more = second.AddComponent<ForesoundListener>();
            second.SetActive(true);
            Check.That(!more.enabled && Game.TakeError().Contains("already"), "two listeners");

            GameObject world = Game.Inactive("world");
            var engine = world.AddComponent<ForesoundEngine>();
            engine.changeOptions = (ref Options options) => options = Choices.Light();
            AudioSettings.outputSampleRate = 7;
            engine.changeOptions = (ref Options options) => options.RateHz = 7;
            world.SetActive(true);
            Check.That(!engine.enabled && engine.Sound == null && Game.TakeError().Contains("no engine"), "7 Hz");
            AudioSettings.outputSampleRate = 48000;
            engine.changeOptions = (ref Options options) =>
            {
                options = Choices.Light();
                options.BlockFrames = 64;
            };
            engine.maxSources = 2;
            engine.enabled = true;
            Check.That(engine.Sound != null, "an engine at the second attempt");
            GameObject rival = Game.Inactive("rival");
            var other = rival.AddComponent<ForesoundEngine>();
            rival.SetActive(true);
            Check.That(!other.enabled && Game.TakeError().Contains("already"), "two engines");
            Check.That(engine.Sound != null && engine.Clock != null, "the first engine goes on");

            var room = Game.Inactive("room");
            room.AddComponent<MeshFilter>().sharedMesh = new Mesh { name = "secret", isReadable = false };
            room.AddComponent<ForesoundGeometry>();
            room.SetActive(true);
            GameObject.Frame();
            Check.That(Game.TakeError().Contains("Read/Write"), "a mesh that is not readable");
            room.SetActive(false);
            var batch = Game.Inactive("batch");
            batch.AddComponent<MeshFilter>().sharedMesh = Game.Box(Vector3.one);
            batch.AddComponent<MeshRenderer>().isPartOfStaticBatch = true;
            batch.AddComponent<ForesoundGeometry>();
            batch.SetActive(true);
            GameObject.Frame();
            Check.That(Game.TakeError().Contains("static batch"), "a static batch");
            batch.SetActive(false);
            var broken = Game.Inactive("broken");
            broken.AddComponent<MeshFilter>().sharedMesh = new Mesh { vertices = new Vector3[3], triangles = new[] { 0, 1, 9 } };
            broken.AddComponent<ForesoundGeometry>();
            broken.SetActive(true);
            for (GameObject.Frame(); engine.IsBuilding; GameObject.Frame()) System.Threading.Thread.Sleep(1);
            Check.That(Game.TakeError().Contains("no scene"), "an index beyond its mesh");
            broken.SetActive(false);
            var empty = Game.Inactive("empty");
            empty.AddComponent<ForesoundInstance>();
            empty.SetActive(true);
            GameObject.Frame();
            Check.That(Game.TakeError().Contains("no triangles"), "an instance of nothing");
            empty.SetActive(false);

            var speaker = Game.Inactive("speaker");
            var source = speaker.AddComponent<ForesoundSource>();
            source.clip = AudioClip.Create("streamed", 8, 1, 48000, false);
            source.clip.isStreamed = true;
            speaker.SetActive(true);
            GameObject.Frame();
            Check.That(source.IsAttached && Game.TakeError().Contains("Decompress On Load"), "a streamed clip");
            source.directivity = float.NaN;
            GameObject.Frame();
            GameObject.Frame();
            Check.That(Game.TakeError().Contains("directivity"), "a directivity of NaN, reported once");
            source.gain = -1;
            GameObject.Frame();
            GameObject.Frame();
            Check.That(Game.TakeError().Contains("gain"), "a gain of -1, reported once");
            // More sources than room: the third waits.
            var crowd = new List<ForesoundSource>();
            for (int i = 0; i < 2; i++)
            {
                GameObject one = Game.Inactive("crowd");
                crowd.Add(one.AddComponent<ForesoundSource>());
                one.SetActive(true);
            }
            GameObject.Frame();
            Check.That(crowd[0].IsAttached && !crowd[1].IsAttached, "a third source of two");
            crowd[0].enabled = false;
            GameObject.Frame();
            GameObject.Frame();
            Game.NoErrors();
            Check.That(!crowd[0].IsAttached && crowd[1].IsAttached, "the waiting source joins");
            head.transform.position = new Vector3(float.NaN, 0, 0);
            GameObject.Frame();
            GameObject.Frame();
            Check.That(Game.TakeError().Length > 10, "a listener at NaN, reported once");
            head.transform.position = Vector3.up;

            crowd[1].enabled = false;
            crowd[1].transform.position = new Vector3(0, float.NaN, 0);
            crowd[1].enabled = true;
            GameObject.Frame();
            GameObject.Frame();
            Check.That(!crowd[1].IsAttached && Game.TakeError().Contains("crowd"), "a source at NaN, reported once");
            crowd[1].transform.position = Vector3.up;
            GameObject.Frame();
            Check.That(crowd[1].IsAttached, "the source at a place");
            GameObject door = Game.Inactive("door");
            door.AddComponent<MeshFilter>().sharedMesh = Game.Box(Vector3.one);
            var hinged = door.AddComponent<ForesoundInstance>();
            door.SetActive(true);
            GameObject.Frame();
            Game.FrameUntil(() => !hinged.IsBuilding);
            door.transform.position = new Vector3(0, 0, float.PositiveInfinity);
            GameObject.Frame();
            GameObject.Frame();
            door.transform.position = new Vector3(float.NaN, 0, 0);
            GameObject.Frame();
            GameObject.Frame();
            Check.That(Game.TakeError().Contains("does not move"), "a door at infinity and NaN, reported once");
            door.transform.position = Vector3.forward;
            GameObject.Frame();
            Game.NoErrors();

            // The device changes: another engine, the same components.
            SoundEngine before = engine.Sound;
            AudioSettings.Change(44100, 512);
            Check.That(engine.Sound != before && before.Handle == 0 && !source.IsAttached, "another device");
            engine.enabled = false;
            Check.That(engine.Sound == null && engine.Clock == null, "no engine");
            for (int i = 0; i < data.Length; i++) data[i] = 0.25f;
            Game.Filtered(ears, data, 2);
            Check.That(Array.TrueForAll(data, sample => sample == 0.25f), "a mix without an engine");
            GameObject.Frame();
            Debug.errors.Clear();
            GameObject.DestroyAll();
        }
    }
}
