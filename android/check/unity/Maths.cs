// Stand-ins for Unity's mathematics: what the package uses, by Unity's documentation.
using System;

namespace UnityEngine
{
    public struct Vector3 : IEquatable<Vector3>
    {
        public float x, y, z;

        public Vector3(float x, float y, float z)
        {
            this.x = x;
            this.y = y;
            this.z = z;
        }

        public static Vector3 zero => new Vector3(0, 0, 0);
        public static Vector3 one => new Vector3(1, 1, 1);
        public static Vector3 up => new Vector3(0, 1, 0);
        public static Vector3 forward => new Vector3(0, 0, 1);

        public static Vector3 Cross(Vector3 a, Vector3 b) =>
            new Vector3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);

        public static float Dot(Vector3 a, Vector3 b) => a.x * b.x + a.y * b.y + a.z * b.z;
        public static Vector3 operator +(Vector3 a, Vector3 b) => new Vector3(a.x + b.x, a.y + b.y, a.z + b.z);
        public static Vector3 operator -(Vector3 a, Vector3 b) => new Vector3(a.x - b.x, a.y - b.y, a.z - b.z);
        public static Vector3 operator *(Vector3 a, float s) => new Vector3(a.x * s, a.y * s, a.z * s);
        public float magnitude => (float)Math.Sqrt(Dot(this, this));
        public bool Equals(Vector3 other) => x == other.x && y == other.y && z == other.z;
        public override bool Equals(object other) => other is Vector3 v && Equals(v);
        public override int GetHashCode() => x.GetHashCode() ^ y.GetHashCode() ^ z.GetHashCode();
        public override string ToString() => $"({x:R}, {y:R}, {z:R})";
    }

    public struct Quaternion : IEquatable<Quaternion>
    {
        public float x, y, z, w;

        public Quaternion(float x, float y, float z, float w)
        {
            this.x = x;
            this.y = y;
            this.z = z;
            this.w = w;
        }

        public static Quaternion identity => new Quaternion(0, 0, 0, 1);

        /// <summary>Unity's own: left-handed, so a positive angle about +y turns +z to +x.</summary>
        public static Quaternion AngleAxis(float degrees, Vector3 axis)
        {
            double half = degrees * Math.PI / 360;
            float s = (float)Math.Sin(half) / axis.magnitude;
            return new Quaternion(axis.x * s, axis.y * s, axis.z * s, (float)Math.Cos(half));
        }

        public static Quaternion operator *(Quaternion a, Quaternion b) => new Quaternion(
            a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z,
            a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x,
            a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z);

        public static Vector3 operator *(Quaternion q, Vector3 v)
        {
            var u = new Vector3(q.x, q.y, q.z);
            Vector3 t = Vector3.Cross(u, v) * 2;
            return v + t * q.w + Vector3.Cross(u, t);
        }

        public bool Equals(Quaternion other) => x == other.x && y == other.y && z == other.z && w == other.w;
        public override bool Equals(object other) => other is Quaternion q && Equals(q);
        public override int GetHashCode() => x.GetHashCode() ^ y.GetHashCode() ^ z.GetHashCode() ^ w.GetHashCode();
    }

    public struct Matrix4x4
    {
        public Vector3 right, up, forward, origin;

        public static Matrix4x4 identity => TRS(Vector3.zero, Quaternion.identity, Vector3.one);
        public static Matrix4x4 Scale(Vector3 scale) => TRS(Vector3.zero, Quaternion.identity, scale);

        public static Matrix4x4 TRS(Vector3 position, Quaternion rotation, Vector3 scale) => new Matrix4x4
        {
            right = rotation * new Vector3(1, 0, 0) * scale.x,
            up = rotation * new Vector3(0, 1, 0) * scale.y,
            forward = rotation * new Vector3(0, 0, 1) * scale.z,
            origin = position,
        };

        public Vector3 MultiplyPoint3x4(Vector3 p) => right * p.x + up * p.y + forward * p.z + origin;

        public static Matrix4x4 operator *(Matrix4x4 a, Matrix4x4 b) => new Matrix4x4
        {
            right = a.MultiplyPoint3x4(b.right) - a.origin,
            up = a.MultiplyPoint3x4(b.up) - a.origin,
            forward = a.MultiplyPoint3x4(b.forward) - a.origin,
            origin = a.MultiplyPoint3x4(b.origin),
        };

        public float determinant => Vector3.Dot(Vector3.Cross(right, up), forward);
    }

    public struct Color
    {
        public float r, g, b, a;

        public Color(float r, float g, float b)
        {
            this.r = r;
            this.g = g;
            this.b = b;
            a = 1;
        }

        public static Color white => new Color(1, 1, 1);
        public static Color cyan => new Color(0, 1, 1);
    }

    public static class Mathf
    {
        public static float Clamp01(float value) => value < 0 ? 0 : value > 1 ? 1 : value;
    }
}
