using Foresound.Interop;
using UnityEngine;
using Pose = Foresound.Interop.Pose;

namespace Foresound
{
    /// <summary>
    /// Unity's coordinates and Foresound's, and nothing else in the package converts.
    /// Unity: left-handed, +x right, +y up, +z ahead, in units. Foresound: right-handed, +x right, +y up, -z ahead, in metres.
    /// The conversion mirrors z and scales; a second one undoes the first.
    /// </summary>
    public static class Coordinates
    {
        /// <summary>A point or a direction with a length, in Foresound's coordinates.</summary>
        public static Vector3 ToForesound(Vector3 unity, float metresPerUnit) =>
            // A zero stays a positive zero: -0 would be another key where vertices are joined.
            new Vector3(unity.x * metresPerUnit, unity.y * metresPerUnit, 0f - unity.z * metresPerUnit);

        /// <summary>A point or a direction with a length, in Unity's coordinates.</summary>
        public static Vector3 ToUnity(Vector3 foresound, float metresPerUnit) =>
            new Vector3(foresound.x / metresPerUnit, foresound.y / metresPerUnit, 0f - foresound.z / metresPerUnit);

        /// <summary>A rotation in the other coordinates, either way: the mirror turns rotations about x and y round.</summary>
        public static Quaternion Mirrored(Quaternion rotation) =>
            new Quaternion(-rotation.x, -rotation.y, rotation.z, rotation.w);

        /// <summary>
        /// Three indices of a triangle whose front stays its front. The mirror reverses the winding, and so does a transform
        /// with a negative determinant: both together keep it.
        /// </summary>
        public static void Triangle(int a, int b, int c, bool isMirrored, uint[] indices, int at)
        {
            indices[at] = (uint)a;
            indices[at + 1] = (uint)(isMirrored ? b : c);
            indices[at + 2] = (uint)(isMirrored ? c : b);
        }

        /// <summary>The pose of a source, an instance or the listener.</summary>
        public static unsafe void Write(
            ref Pose pose, uint source, Vector3 position, Quaternion rotation, float metresPerUnit)
        {
            Vector3 at = ToForesound(position, metresPerUnit);
            Quaternion turn = Mirrored(rotation);
            pose.Source = source;
            fixed (float* p = pose.PositionM, q = pose.Orientation)
            {
                p[0] = at.x;
                p[1] = at.y;
                p[2] = at.z;
                q[0] = turn.x;
                q[1] = turn.y;
                q[2] = turn.z;
                q[3] = turn.w;
            }
        }

        /// <summary>A corner of a path in Unity's coordinates.</summary>
        public static unsafe Vector3 Corner(ref ShownPath path, int corner, float metresPerUnit)
        {
            fixed (float* c = path.CornersM)
                return ToUnity(new Vector3(c[3 * corner], c[3 * corner + 1], c[3 * corner + 2]), metresPerUnit);
        }
    }
}
