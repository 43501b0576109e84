using System.Collections.Generic;
using System.Text;
using Foresound.Interop;
using UnityEngine;

namespace Foresound
{
    /// <summary>
    /// Meshes on their way into a scene. Collected on the main thread, which copies; transformed and committed on another, which
    /// takes the time.
    /// </summary>
    internal sealed class SceneInput
    {
        readonly List<MeshPiece> pieces = new List<MeshPiece>();
        readonly List<string> names = new List<string>();
        readonly List<ForesoundMaterial> materials = new List<ForesoundMaterial>();
        readonly StringBuilder toml = new StringBuilder();
        readonly List<uint> materialOfSubmesh = new List<uint>();
        readonly float metresPerUnit;

        internal SceneInput(float metresPerUnit)
        {
            this.metresPerUnit = metresPerUnit;
        }

        /// <summary>Triangles so far.</summary>
        internal int Triangles { get; private set; }

        /// <summary>Adds a mesh. Main thread.</summary>
        internal void Add(MeshPiece piece)
        {
            pieces.Add(piece);
            foreach (MeshPiece.Submesh submesh in piece.submeshes)
            {
                Triangles += submesh.triangles.Length / 3;
                materialOfSubmesh.Add(IndexOf(submesh.material));
            }
        }

        uint IndexOf(ForesoundMaterial material)
        {
            // Two assets may have one name, and one asset of own values may have the name of a material of the library.
            // "default" is the library's name for triangles without a material.
            string name = material == null ? "default" : material.ownValues ? null : material.builtIn;
            int known = name == null ? materials.IndexOf(material) : names.IndexOf(name);
            if (known >= 0) return (uint)known;
            if (name == null) material.Append(toml, name = "own values " + names.Count);
            names.Add(name);
            materials.Add(material);
            return (uint)(names.Count - 1);
        }

        /// <summary>Transforms the meshes and commits the scene. Any thread but those of frames and sound.</summary>
        /// <exception cref="ForesoundException">The meshes or the materials are invalid, or it was cancelled.</exception>
        internal SoundScene Commit(SoundProgress progress)
        {
            Transform(out float[] positions, out uint[] indices, out uint[] triangleMaterials);
            string text = toml.Length == 0 ? null : toml.ToString();
            return SoundScene.FromMesh(positions, indices, triangleMaterials, names.ToArray(), text, progress);
        }

        /// <summary>All meshes as one, in Foresound's coordinates.</summary>
        internal void Transform(out float[] positions, out uint[] indices, out uint[] triangleMaterials)
        {
            int vertexCount = 0;
            foreach (MeshPiece piece in pieces) vertexCount += piece.vertices.Length;
            positions = new float[3 * vertexCount];
            indices = new uint[3 * Triangles];
            triangleMaterials = new uint[Triangles];
            int vertex = 0, index = 0, submeshIndex = 0;
            foreach (MeshPiece piece in pieces)
            {
                int first = vertex;
                foreach (Vector3 corner in piece.vertices)
                {
                    Vector3 at = Coordinates.ToForesound(piece.placed.MultiplyPoint3x4(corner), metresPerUnit);
                    positions[3 * vertex] = at.x;
                    positions[3 * vertex + 1] = at.y;
                    positions[3 * vertex + 2] = at.z;
                    vertex++;
                }
                bool isMirrored = piece.placed.determinant < 0;
                foreach (MeshPiece.Submesh submesh in piece.submeshes)
                {
                    uint material = materialOfSubmesh[submeshIndex++];
                    int[] t = submesh.triangles;
                    for (int i = 0; i + 2 < t.Length; i += 3, index += 3)
                    {
                        Coordinates.Triangle(first + t[i], first + t[i + 1], first + t[i + 2], isMirrored, indices, index);
                        triangleMaterials[index / 3] = material;
                    }
                }
            }
        }
    }
}
