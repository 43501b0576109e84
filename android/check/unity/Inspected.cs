// The editor assembly and the sample: processing of a scene, inspectors, and the first sound.
using System;
using Foresound.Editor;
using UnityEditor;
using UnityEngine;
using UnityEngine.SceneManagement;

namespace Foresound.Check
{
    static class Inspected
    {
        internal static void Run()
        {
            Kept();
            Materials();
            double level = Sample();
            Console.WriteLine($"editor and sample {Check.Passed} checks; the first sound has {level:f1} dB re full scale");
        }

        static void Kept()
        {
            GameObject hall = Game.Inactive("hall"), pillar = new GameObject("pillar"), hidden = new GameObject("hidden");
            var geometry = hall.AddComponent<ForesoundGeometry>();
            hall.AddComponent<MeshFilter>().sharedMesh = Game.Box(new Vector3(5, 2, 4));
            foreach (GameObject part in new[] { pillar, hidden })
            {
                part.AddComponent<MeshFilter>().sharedMesh = Game.Box(Vector3.one);
                part.transform.parent = hall.transform;
            }
            hidden.SetActive(false);
            // The object is inactive as a whole: its parts are kept, except those that are inactive themselves.
            var keep = new KeepMeshes();
            Check.That(keep.callbackOrder < 0, "before static batching");
            keep.OnProcessScene(new Scene { roots = new[] { hall } }, null);
            hall.GetComponent<MeshFilter>().sharedMesh.isReadable = false;
            Check.That(geometry.Pieces().Count == 2, geometry.Pieces().Count + " meshes of the hall are kept");
            Game.NoErrors();
        }

        static void Materials()
        {
            ForesoundMaterial material = Game.MaterialOf("brick");
            var inspector = new MaterialInspector { target = material };
            inspector.OnInspectorGUI();
            Check.That(EditorGUILayout.drawn.Contains("Material: brick"), "the material's name");
            EditorGUILayout.choice = Array.IndexOf(ForesoundMaterial.BuiltIn, "carpet");
            inspector.OnInspectorGUI();
            Check.That(material.builtIn == "carpet", "a chosen material");
            EditorGUILayout.choice = -1;
            material.builtIn = "unobtainium";
            inspector.OnInspectorGUI();
            Check.That(material.builtIn == "unobtainium", "an unknown name stays");
            material.ownValues = true;
            material.absorption = new float[3];
            inspector.OnInspectorGUI();
            Check.That(material.absorption.Length == ForesoundMaterial.Bands, "eight bands");
        }

        /// <summary>The sample of the package: sound, through the door, within a second.</summary>
        static double Sample()
        {
            AudioSettings.Change(48000, 800);
            GameObject head = Game.Inactive("camera");
            head.AddComponent<AudioListener>();
            head.AddComponent<FirstSound>();
            head.SetActive(true);
            ForesoundEngine engine = Registry.Engine;
            Game.FrameUntil(() => engine.HasBegun);
            double energy = 0;
            var data = new float[1600];
            // The first update of a scene also finds its late field.
            for (int n = 0; n < 60 || (n < 3000 && engine.Sound.Statistics.Paths == 0); n++)
            {
                GameObject.Frame();
                Array.Clear(data, 0, data.Length);
                Game.Buffer(data, 2);
                foreach (float sample in data) energy += (double)sample * sample;
                System.Threading.Thread.Sleep(2);
            }
            var inspector = new EngineInspector { target = engine };
            EditorGUILayout.drawn.Clear();
            inspector.OnInspectorGUI();
            Check.That(inspector.RequiresConstantRepaint() && EditorGUILayout.drawn.Count == 5, "five lines of figures");
            Check.That(EditorGUILayout.drawn.Contains("Geometry: in use"), "the geometry is in use");
            Check.That(engine.Sound.Statistics.Paths > 0, "paths");
            Game.NoErrors();
            GameObject.DestroyAll();
            double level = 10 * Math.Log10(energy / (60 * 1600));
            Check.That(level > -70 && level < 0, $"{level} dB");
            return level;
        }
    }
}
