// Coordinates and geometry: the laws that the conversion has to keep, and what comes out of meshes.
using System;
using Foresound.Interop;
using UnityEngine;

namespace Foresound.Check
{
    static unsafe class Places
    {
        static readonly System.Random random = new System.Random(26);

        static float Number() => (float)(random.NextDouble() * 20 - 10);

        static Vector3 Point() => new Vector3(Number(), Number(), Number());

        static Quaternion Turn() => Quaternion.AngleAxis(Number() * 18, Point());

        /// <summary>Relative, for values around 10 after some ten roundings.</summary>
        static bool IsNear(Vector3 a, Vector3 b) => (a - b).magnitude <= 3e-5f * (1 + a.magnitude);

        static Vector3 Convert(Vector3 v, float scale) => Foresound.Coordinates.ToForesound(v, scale);

        internal static void Coordinates()
        {
            Check.That(Convert(new Vector3(1, 2, 3), 2).Equals(new Vector3(2, 4, -6)), "x right, y up, z ahead is -z");
            Check.That(1 / Convert(Vector3.zero, 1).z > 0 && 1 / Convert(new Vector3(0, 0, -0f), 1).z > 0, "a zero is positive");
            for (int i = 0; i < 1000; i++)
            {
                float scale = (float)Math.Exp(Number() / 3);
                Vector3 p = Point(), v = Point(), w = Point();
                Quaternion q = Turn(), r = Turn();
                Check.That(IsNear(Foresound.Coordinates.ToUnity(Convert(p, scale), scale), p), "there and back");
                Check.That(Foresound.Coordinates.Mirrored(Foresound.Coordinates.Mirrored(q)).Equals(q), "a rotation there and back");
                // A rotation of the converted vector is the converted rotation of the vector.
                Quaternion mirrored = Foresound.Coordinates.Mirrored(q);
                Check.That(IsNear(mirrored * Convert(v, 1), Convert(q * v, 1)), "rotation and conversion commute");
                Quaternion product = Foresound.Coordinates.Mirrored(q * r), other = mirrored * Foresound.Coordinates.Mirrored(r);
                Check.That(IsNear(product * v, other * v), "products of rotations stay products");
                // Distances are the scale's; cross products change their sign: one hand is left, the other right.
                float distance = (Convert(p, scale) - Convert(v, scale)).magnitude;
                Check.That(Math.Abs(distance - scale * (p - v).magnitude) <= 1e-4f * distance + 1e-6f, "distances");
                Vector3 cross = Vector3.Cross(Convert(v, 1), Convert(w, 1));
                Check.That(IsNear(cross, Convert(Vector3.Cross(v, w), 1) * -1), "the other hand");
                // Foresound looks along -z, Unity along +z.
                Check.That(IsNear(mirrored * (Vector3.forward * -1), Convert(q * Vector3.forward, 1)), "ahead stays ahead");
                Winding(p, v, w, q, i % 2 == 0);
            }
            // The library's own words: a listener that turns to Unity's right has a source ahead of it at the right ear before.
            Check.That(IsNear(Quaternion.AngleAxis(90, Vector3.up) * Vector3.forward, new Vector3(1, 0, 0)), "Unity's right turn");
            var pose = new Interop.Pose();
            Foresound.Coordinates.Write(ref pose, 7, new Vector3(1, 2, 3), new Quaternion(0.1f, 0.2f, 0.3f, 0.9f), 0.5f);
            Check.That(pose.Source == 7 && pose.PositionM[0] == 0.5f && pose.PositionM[1] == 1 && pose.PositionM[2] == -1.5f, "a position");
            Check.That(
                pose.Orientation[0] == -0.1f && pose.Orientation[1] == -0.2f && pose.Orientation[2] == 0.3f && pose.Orientation[3] == 0.9f,
                "an orientation");
            Console.WriteLine($"coordinates {Check.Passed} checks");
        }

        /// <summary>The front of a triangle, clockwise in Unity and counter-clockwise in Foresound, stays its front.</summary>
        static void Winding(Vector3 a, Vector3 b, Vector3 c, Quaternion turn, bool isMirrored)
        {
            var placed = Matrix4x4.TRS(Vector3.zero, turn, new Vector3(isMirrored ? -2 : 2, 3, 0.5f));
            Check.That(placed.determinant < 0 == isMirrored, "a negative scale");
            // Clockwise in a left-handed system is Cross(b - a, c - a), and so is counter-clockwise in a right-handed one.
            Vector3[] corners = { placed.MultiplyPoint3x4(a), placed.MultiplyPoint3x4(b), placed.MultiplyPoint3x4(c) };
            Vector3 front = Vector3.Cross(corners[1] - corners[0], corners[2] - corners[0]) * (isMirrored ? -1 : 1);
            var indices = new uint[3];
            Foresound.Coordinates.Triangle(0, 1, 2, isMirrored, indices, 0);
            Vector3[] there = Array.ConvertAll(corners, corner => Foresound.Coordinates.ToForesound(corner, 1));
            Vector3 p = there[indices[0]], q = there[indices[1]], r = there[indices[2]];
            Vector3 normal = Vector3.Cross(q - p, r - p);
            Check.That(Vector3.Dot(normal, Foresound.Coordinates.ToForesound(front, 1)) > 0, "the front stays the front");
        }

        static GameObject WithMesh(string name, Mesh mesh, Transform parent)
        {
            GameObject made = Game.Inactive(name);
            made.AddComponent<MeshFilter>().sharedMesh = mesh;
            if (parent != null) made.transform.parent = parent;
            return made;
        }

        static SceneInfo InfoOf(params ForesoundMeshes[] meshes)
        {
            var input = new SceneInput(2);
            foreach (ForesoundMeshes owner in meshes)
                foreach (MeshPiece piece in owner.Pieces()) input.Add(piece);
            Game.NoErrors();
            var build = new SceneBuild(input);
            using (SoundScene scene = build.Take()) return scene.Info;
        }

        static void Bounds(SceneInfo info, Vector3 least, Vector3 most, string what)
        {
            var a = new Vector3(info.BoundsMinM[0], info.BoundsMinM[1], info.BoundsMinM[2]);
            var b = new Vector3(info.BoundsMaxM[0], info.BoundsMaxM[1], info.BoundsMaxM[2]);
            Check.That(IsNear(a, least) && IsNear(b, most), $"{what}: {a} to {b}");
        }

        /// <summary>A cube in a transform, with its fronts outside in Unity, has them outside in Foresound.</summary>
        static void Fronts(Vector3 scale, Quaternion turn)
        {
            var input = new SceneInput(1);
            input.Add(MeshPiece.Of(GameObject.CreatePrimitive(PrimitiveType.Cube).GetComponent<MeshFilter>().sharedMesh,
                Matrix4x4.TRS(Vector3.zero, turn, scale), submesh => null));
            input.Transform(out float[] at, out uint[] indices, out uint[] materials);
            Check.That(indices.Length == 36 && materials.Length == 12, "twelve triangles");
            for (int i = 0; i < indices.Length; i += 3)
            {
                Vector3[] c = new Vector3[3];
                for (int k = 0; k < 3; k++)
                    c[k] = new Vector3(at[3 * indices[i + k]], at[3 * indices[i + k] + 1], at[3 * indices[i + k] + 2]);
                // Counter-clockwise from outside in a right-handed system: the normal leads away from the centre.
                Vector3 normal = Vector3.Cross(c[1] - c[0], c[2] - c[0]);
                Check.That(Vector3.Dot(normal, c[0] + c[1] + c[2]) > 0, $"triangle {i / 3} of a cube of {scale} is inside out");
            }
        }

        /// <summary>Rolling ground: what the main thread does, and what another one does meanwhile.</summary>
        static string Ground()
        {
            const int side = 100;
            var mesh = new Mesh { name = "ground", vertices = new Vector3[side * side] };
            var triangles = new int[6 * (side - 1) * (side - 1)];
            for (int i = 0; i < side * side; i++)
                mesh.vertices[i] = new Vector3(i % side, (float)Math.Sin(0.1 * (i % side)) * (float)Math.Sin(0.1 * (i / side)), i / side);
            for (int z = 0, t = 0; z + 1 < side; z++)
                for (int x = 0; x + 1 < side; x++)
                {
                    int a = z * side + x;
                    foreach (int corner in new[] { a, a + side, a + 1, a + 1, a + side, a + side + 1 }) triangles[t++] = corner;
                }
            mesh.triangles = triangles;
            GameObject ground = WithMesh("ground", mesh, null);
            var geometry = ground.AddComponent<ForesoundGeometry>();
            ground.SetActive(true);
            var watch = System.Diagnostics.Stopwatch.StartNew();
            var input = new SceneInput(1);
            foreach (MeshPiece piece in geometry.Pieces()) input.Add(piece);
            var build = new SceneBuild(input);
            bool isDone = build.IsDone;
            double main = watch.Elapsed.TotalMilliseconds;
            Check.That(build.Done <= 1, "progress");
            using (SoundScene scene = build.Take()) Check.That((int)scene.Info.TrianglesIn == triangles.Length / 3, "the ground");
            Check.That(!isDone, "the main thread committed the ground itself");
            // A build that nobody waits for ends before its time.
            var abandoned = new SceneBuild(input);
            abandoned.Abandon();
            string cause = Check.Throws<ForesoundException>("an abandoned build", () => abandoned.Take());
            Check.That(cause.Contains("cancel"), cause);
            ground.SetActive(false);
            return $"{triangles.Length / 3} triangles: main thread {main:f1} ms, other thread {watch.Elapsed.TotalMilliseconds - main:f0} ms";
        }

        internal static void Geometry()
        {
            string ground = Ground();
            Fronts(Vector3.one, Quaternion.identity);
            Fronts(new Vector3(2, 3, -0.5f), Turn());
            Fronts(new Vector3(-2, 3, -0.5f), Turn());
            Fronts(new Vector3(-2, -3, -0.5f), Turn());
            // A house of two meshes, one of which has a material of its own, and a door that is not part of it.
            GameObject house = WithMesh("house", Game.Box(new Vector3(5, 2, 4)), null);
            house.transform.position = new Vector3(10, 2, 100);
            var walls = house.AddComponent<ForesoundGeometry>();
            walls.material = Game.MaterialOf("brick");
            GameObject table = WithMesh("table", Game.Box(Vector3.one), house.transform);
            table.transform.localScale = new Vector3(1, 0.5f, -1);
            GameObject carpet = WithMesh("carpet", Game.Box(new Vector3(1, 0.01f, 1)), house.transform);
            carpet.transform.localPosition = new Vector3(0, -1.9f, 0);
            var soft = carpet.AddComponent<ForesoundGeometry>();
            soft.material = Game.MaterialOf("carpet");
            GameObject door = WithMesh("door", Game.Box(Vector3.one), house.transform);
            door.transform.localPosition = new Vector3(5, 0, 0);
            door.transform.localRotation = Quaternion.AngleAxis(90, Vector3.up);
            door.transform.localScale = new Vector3(1, 2, 0.1f);
            var swing = door.AddComponent<ForesoundInstance>();
            GameObject knob = WithMesh("knob", Game.Box(Vector3.one), door.transform);
            knob.transform.localPosition = new Vector3(2, 0, 0);
            knob.transform.localScale = new Vector3(0.5f, 0.5f, 0.5f);
            var metal = knob.AddComponent<ForesoundGeometry>();
            metal.material = Game.MaterialOf("steel");
            foreach (GameObject made in new[] { house, table, carpet, door, knob }) made.SetActive(true);

            Check.That(walls.Pieces().Count == 2 && soft.Pieces().Count == 1, "the nearest component has a mesh");
            SceneInfo info = InfoOf(walls, soft);
            Check.That(info.TrianglesIn == 36 && info.UnknownMaterials == 0, "three boxes");
            Bounds(info, new Vector3(10, 0, -208), new Vector3(30, 8, -192), "the house, two metres a unit");
            Check.That(metal.Instance == swing && metal.Frame == door.transform, "a part of the door");
            info = InfoOf(swing, metal);
            Check.That(info.TrianglesIn == 24 && info.UnknownMaterials == 1, "the door and its knob");
            // In its own coordinates, with its scale and without its pose.
            Bounds(info, new Vector3(-2, -4, -0.2f), new Vector3(5, 4, 0.2f), "the door");

            // What the editor keeps of a scene stands for meshes that a build merges or makes unreadable.
            walls.Keep();
            house.GetComponent<MeshFilter>().sharedMesh.isReadable = false;
            info = InfoOf(walls, soft);
            Check.That(info.TrianglesIn == 36, "kept meshes");
            house.transform.position = new Vector3(0, 2, 100);
            Bounds(InfoOf(walls), new Vector3(-10, 0, -208), new Vector3(10, 8, -192), "kept meshes of a house that moved");
            walls.Release();
            walls.replacement = Game.Box(Vector3.one);
            Check.That(InfoOf(walls).TrianglesIn == 12, "a mesh for sound alone");

            // Materials: every name of the list is the library's; own values are accepted, and refused where they are impossible.
            foreach (string name in ForesoundMaterial.BuiltIn)
            {
                walls.material = Game.MaterialOf(name);
                Check.That(InfoOf(walls).UnknownMaterials == 0, name + " is no material of the library");
            }
            walls.material = Game.MaterialOf("unobtainium");
            Check.That(InfoOf(walls).UnknownMaterials == 1, "an unknown material");
            ForesoundMaterial own = Game.MaterialOf("brick"), twin = Game.MaterialOf("brick");
            own.ownValues = twin.ownValues = true;
            walls.material = own;
            soft.material = twin;
            Check.That(InfoOf(walls, soft).UnknownMaterials == 0, "own values of one name");
            twin.absorption = new float[] { 2 };
            string cause = Check.Throws<ForesoundException>("absorption of 2", () => InfoOf(walls, soft));
            Check.That(cause.Contains("absorption"), cause);
            twin.absorption = new float[3];
            Check.Throws<ForesoundException>("absorption in 3 bands", () => InfoOf(walls, soft));
            GameObject.DestroyAll();
            Console.WriteLine($"geometry {Check.Passed} checks; {ground}");
        }
    }
}
