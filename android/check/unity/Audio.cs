// Sound: Unity's channels, buffers and DSP clock, samples of an AudioSource, left and right, and what is drawn.
using System;
using System.Threading;
using Foresound.Interop;
using UnityEngine;

namespace Foresound.Check
{
    static class Audio
    {
        const int RateHz = 48000;

        /// <summary>A listener at the origin that faces +z, and a source in free field.</summary>
        sealed class Scene
        {
            internal readonly ForesoundEngine engine;
            internal readonly ForesoundSource source;
            internal readonly ForesoundListener ears;
            readonly AudioSource player;

            internal Scene(Vector3 at, AudioClip clip, bool isPlayedByUnity, OptionsChange change)
            {
                GameObject speaker = Game.Inactive("speaker"), head = Game.Inactive("head"), world = Game.Inactive("world");
                if (isPlayedByUnity) player = speaker.AddComponent<AudioSource>();
                source = speaker.AddComponent<ForesoundSource>();
                source.clip = clip;
                source.loop = true;
                speaker.transform.position = at;
                ears = head.AddComponent<ForesoundListener>();
                engine = world.AddComponent<ForesoundEngine>();
                engine.changeOptions = (ref Options options) =>
                {
                    Choices.Synchronous(ref options);
                    options.FrameS = 1.0 / 60;
                    change(ref options);
                };
                foreach (GameObject made in new[] { speaker, head, world }) made.SetActive(true);
                GameObject.Frame();
                Game.NoErrors();
                Check.That(player == null || player.spatialBlend == 0, "Unity leaves distance and direction to Foresound");
            }

            /// <summary>Buffers of frames and channels; the left and right of all of them.</summary>
            internal float[] Render(int buffers, int frames, int channels, float[] played)
            {
                var heard = new float[2 * buffers * frames];
                var data = new float[frames * channels];
                for (int n = 0; n < buffers; n++)
                {
                    GameObject.Frame();
                    if (player != null)
                    {
                        for (int i = 0; i < data.Length; i++) data[i] = played[(n * frames + i / channels) % played.Length];
                        Game.Filtered(source, data, channels);
                        Check.That(Array.TrueForAll(data, sample => sample == 0), "Unity does not hear the source too");
                    }
                    for (int i = 0; i < data.Length; i++) data[i] = -0f;
                    Game.Buffer(data, channels);
                    for (int i = 0; i < frames; i++)
                    {
                        heard[2 * (n * frames + i)] = data[i * channels];
                        heard[2 * (n * frames + i) + 1] = data[i * channels + (channels > 1 ? 1 : 0)];
                        for (int c = 2; c < channels; c++) Check.That(data[i * channels + c] == 0, "a channel behind the first two");
                    }
                }
                Game.NoErrors();
                return heard;
            }
        }

        delegate void OptionsChange(ref Options options);

        static void Unchanged(ref Options options)
        {
        }

        static void Mono(ref Options options) => options = Choices.Light();

        static float[] Noise()
        {
            var noise = new float[RateHz];
            var random = new System.Random(3);
            for (int i = 0; i < noise.Length; i++) noise[i] = (float)(random.NextDouble() - 0.5);
            return noise;
        }

        static AudioClip ClipOf(float[] samples, int channels)
        {
            AudioClip clip = AudioClip.Create("noise", samples.Length / channels, channels, RateHz, false);
            clip.SetData(samples, 0);
            return clip;
        }

        static double Energy(float[] heard, int side)
        {
            double sum = 0;
            for (int i = side; i < heard.Length; i += 2) sum += (double)heard[i] * heard[i];
            return sum;
        }

        static double LevelDb(double energy, double other) => 10 * Math.Log10(energy / other);

        static float[] Heard(Vector3 at, Quaternion turned, OptionsChange change)
        {
            var scene = new Scene(at, ClipOf(Noise(), 1), false, change);
            scene.ears.transform.rotation = turned;
            float[] heard = scene.Render(40, 800, 2, null);
            GameObject.DestroyAll();
            return heard;
        }

        internal static void Run()
        {
            Clock();
            AudioSettings.Change(RateHz, 800);
            // The source at Unity's right is louder at the right ear, for every way of getting there.
            float[] right = Heard(new Vector3(3, 0, 0), Quaternion.identity, Unchanged);
            float[] left = Heard(new Vector3(-3, 0, 0), Quaternion.identity, Unchanged);
            float[] turned = Heard(new Vector3(0, 0, 3), Quaternion.AngleAxis(-90, Vector3.up), Unchanged);
            float[] ahead = Heard(new Vector3(0, 0, 3), Quaternion.identity, Unchanged);
            double side = LevelDb(Energy(right, 1), Energy(right, 0)), other = LevelDb(Energy(left, 1), Energy(left, 0));
            double turn = LevelDb(Energy(turned, 1), Energy(turned, 0)), front = LevelDb(Energy(ahead, 1), Energy(ahead, 0));
            Check.That(side > 6 && other < -6, $"right {side:f1} dB, left {other:f1} dB");
            Check.That(Math.Abs(turn - side) < 0.1, $"turned to the left: {turn:f2} dB instead of {side:f2}");
            Check.That(Math.Abs(front) < 0.5, $"ahead {front:f2} dB");
            Channels();
            Capture();
            int threads = Threads();
            Gizmo();
            Console.WriteLine(
                $"audio right-left {side:f1} {other:f1} dB, ahead {front:f2} dB; {threads} buffers beside a closing engine; {Check.Passed} checks");
        }

        static void Clock()
        {
            int[,] blocks = { { 1024, 256 }, { 512, 256 }, { 800, 200 }, { 480, 240 }, { 441, 147 }, { 256, 256 }, { 192, 192 }, { 31, 256 }, { 1, 256 } };
            for (int i = 0; i < blocks.GetLength(0); i++)
                Check.That(DspClock.BlockFrames(blocks[i, 0]) == blocks[i, 1], $"blocks of {blocks[i, 0]}");
            var clock = new DspClock(RateHz);
            double time = 1234.5;
            for (int i = 0; i < 100000; i++, time += 512.0 / RateHz) clock.Count(time, 512);
            Check.That(clock.RenderedFrames == 51200000 && clock.MissedFrames == 0 && clock.RepeatedBuffers == 0, "eighteen minutes");
            time += 2048.0 / RateHz;
            clock.Count(time, 512);
            Check.That(clock.MissedFrames == 2048, clock.MissedFrames + " missed");
            clock.Count(time, 512);
            Check.That(clock.RepeatedBuffers == 1 && clock.MissedFrames == 2048, "the same buffer twice");
            time += 512.0 / RateHz;
            clock.Count(time, 512);
            Check.That(clock.RepeatedBuffers == 1 && clock.MissedFrames == 2048, "and on");
        }

        /// <summary>The same sound in every number of channels; what Unity mixed stays.</summary>
        static void Channels()
        {
            Vector3 at = new Vector3(2, 0, 1);
            float[] stereo = Heard(at, Quaternion.identity, Unchanged);
            foreach (int channels in new[] { 1, 6 })
            {
                // A stereo clip whose mean is the mono one.
                float[] noise = Noise(), wide = new float[2 * noise.Length];
                for (int i = 0; i < noise.Length; i++) wide[2 * i] = 2 * noise[i];
                var scene = new Scene(at, ClipOf(wide, 2), false, Unchanged);
                float[] heard = scene.Render(40, 800, channels, null);
                double worst = 0;
                for (int i = 0; i < stereo.Length; i += 2)
                {
                    float mean = 0.5f * (stereo[i] + stereo[i + 1]);
                    worst = Math.Max(worst, Math.Abs(heard[i] - (channels == 1 ? mean : stereo[i])));
                }
                Check.That(worst == 0, $"{channels} channels differ by {worst}");
                if (channels == 1)
                {
                    var odd = new float[7];
                    Game.Filtered(scene.ears, odd, 2);
                    Check.That(Array.TrueForAll(odd, sample => sample == 0), "7 samples of 2 channels");
                    // Two seconds at once are rendered in pieces, upon what is there.
                    var long_ = new float[4 * RateHz];
                    for (int i = 0; i < long_.Length; i++) long_[i] = 100;
                    Game.Filtered(scene.ears, long_, 2);
                    Check.That(Array.TrueForAll(long_, sample => sample > 90 && sample < 110), "the mix is added to");
                    Check.That(Array.Exists(long_, sample => sample != 100), "sound is added");
                }
                GameObject.DestroyAll();
            }
        }

        /// <summary>Samples of an AudioSource are heard as those of the same clip, in the same buffer.</summary>
        static void Capture()
        {
            float[] noise = Noise();
            float[] clip = Heard(new Vector3(0.5f, 0, 0), Quaternion.identity, Mono);
            var scene = new Scene(new Vector3(0.5f, 0, 0), null, true, Mono);
            float[] stream = scene.Render(40, 800, 2, noise);
            int differ = 0, audible = 0;
            for (int i = 0; i < clip.Length; i++)
            {
                if (clip[i] != 0) audible++;
                if (clip[i] != stream[i]) differ++;
            }
            EngineStatistics statistics = scene.engine.Sound.Statistics;
            Check.That(audible > clip.Length / 2, "the clip is audible");
            Check.That(differ == 0, $"{differ} of {clip.Length} samples differ from the clip's");
            Check.That(statistics.UnderrunSamples == 0, statistics.UnderrunSamples + " samples came late");
            // More than the ring holds is dropped, and nothing waits.
            Game.Filtered(scene.source, new float[100 * 800], 2);
            scene.source.enabled = false;
            var data = new[] { 1f, 2f };
            Game.Filtered(scene.source, data, 2);
            Check.That(data[0] == 1 && data[1] == 2, "a disabled source leaves Unity's sound alone");
            GameObject.DestroyAll();
        }

        /// <summary>An audio thread that never stops while engines come and go.</summary>
        static int Threads()
        {
            var scene = new Scene(Vector3.forward, ClipOf(Noise(), 1), false, Mono);
            bool isOver = false;
            int buffers = 0;
            Exception failure = null;
            var audio = new Thread(() =>
            {
                try
                {
                    var data = new float[512];
                    for (; !Volatile.Read(ref isOver); buffers++) Game.Filtered(scene.ears, data, 2);
                }
                catch (Exception error)
                {
                    failure = error;
                }
            });
            Game.Filtered(scene.ears, new float[2], 2);
            audio.Start();
            for (int i = 0; i < 100; i++)
            {
                GameObject.Frame();
                scene.engine.enabled = i % 2 != 0;
            }
            Volatile.Write(ref isOver, true);
            audio.Join();
            Check.That(failure == null, "the audio thread: " + failure);
            Game.NoErrors();
            GameObject.DestroyAll();
            return buffers;
        }

        /// <summary>A drawn path begins at the source and ends at the listener, in Unity's coordinates.</summary>
        static void Gizmo()
        {
            var at = new Vector3(1, 0.5f, 2);
            var scene = new Scene(at, null, false, Unchanged);
            GameObject room = Game.Inactive("room");
            room.AddComponent<MeshFilter>().sharedMesh = Game.Box(new Vector3(4, 3, 5));
            room.AddComponent<ForesoundGeometry>();
            room.SetActive(true);
            scene.engine.drawPaths = true;
            Game.FrameUntil(() => !scene.engine.IsBuilding);
            for (int i = 0; i < 30; i++) GameObject.Frame();
            Gizmos.lines.Clear();
            typeof(ForesoundEngine).GetMethod("OnDrawGizmos", System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic)
                .Invoke(scene.engine, null);
            int starts = 0, ends = 0;
            for (int i = 0; i < Gizmos.lines.Count; i += 2)
            {
                if ((Gizmos.lines[i] - at).magnitude < 1e-3f) starts++;
                if (Gizmos.lines[i + 1].magnitude < 1e-3f) ends++;
                Vector3 p = Gizmos.lines[i];
                Check.That(Math.Abs(p.x) < 4.001f && Math.Abs(p.y) < 3.001f && Math.Abs(p.z) < 5.001f, $"{p} is outside the room");
            }
            Check.That(starts > 6 && starts == ends, $"{starts} paths begin at the source, {ends} end at the listener");
            GameObject.DestroyAll();
        }
    }
}
