using Foresound.Interop;
using UnityEngine;

namespace Foresound
{
    /// <summary>Draws paths as polylines: direct white, reflected green, diffracted orange; quiet ones fade.</summary>
    internal static class PathGizmos
    {
        /// <summary>Range of levels in dB that fades from opaque to nearly nothing.</summary>
        const float RangeDb = 60;

        internal static void Draw(ShownPath[] paths, int count, float metresPerUnit)
        {
            for (int i = 0; i < count; i++)
            {
                Gizmos.color = ColorOf(ref paths[i]);
                Vector3 from = Coordinates.Corner(ref paths[i], 0, metresPerUnit);
                for (int corner = 1; corner < paths[i].CornerCount; corner++)
                {
                    Vector3 to = Coordinates.Corner(ref paths[i], corner, metresPerUnit);
                    Gizmos.DrawLine(from, to);
                    from = to;
                }
            }
        }

        static Color ColorOf(ref ShownPath path)
        {
            Color color = path.DiffractionOrder > 0 ? new Color(1, 0.6f, 0.1f)
                : path.Reflections > 0 ? new Color(0.3f, 0.9f, 0.4f)
                : Color.white;
            color.a = Mathf.Clamp01(1 + path.LevelDb / RangeDb) * 0.9f + 0.1f;
            return color;
        }
    }
}
