using Foresound.Interop;
using UnityEditor;
using UnityEngine;

namespace Foresound.Editor
{
    /// <summary>Shows a running engine's figures below its settings.</summary>
    [CustomEditor(typeof(ForesoundEngine))]
    public sealed class EngineInspector : UnityEditor.Editor
    {
        /// <summary>Figures change in play mode.</summary>
        public override bool RequiresConstantRepaint() => Application.isPlaying;

        /// <summary>Draws the settings and the figures.</summary>
        public override void OnInspectorGUI()
        {
            DrawDefaultInspector();
            var engine = (ForesoundEngine)target;
            if (engine.Sound == null) return;
            EngineStatistics statistics = engine.Sound.Statistics;
            DspClock clock = engine.Clock;
            Line("Geometry", engine.IsBuilding ? "being committed" : "in use");
            Line("Sources and paths", $"{statistics.Sources}, {statistics.Paths}");
            Line("Update", $"{1e3 * statistics.PropagationS:f1} ms, level L {statistics.ExtrapolationLevel}");
            Line("DSP buffer, 99.9 %", $"{1e3 * statistics.Block.P999S:f2} ms of {1e3 * engine.BufferFrames / AudioSettings.outputSampleRate:f2}");
            Line("Missed", $"{statistics.MissedDeadlines} deadlines, {clock.MissedFrames} audio frames, {statistics.UnderrunSamples} samples");
        }

        static void Line(string label, string text) => EditorGUILayout.LabelField(label, text);
    }
}
