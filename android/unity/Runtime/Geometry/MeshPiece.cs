using System;
using UnityEngine;

namespace Foresound
{
    /// <summary>A copy of a mesh, with its place and its materials. Made on the main thread, read on another.</summary>
    [Serializable]
    internal sealed class MeshPiece
    {
        /// <summary>Vertices in the mesh's own coordinates.</summary>
        public Vector3[] vertices;

        /// <summary>Triangles of each submesh.</summary>
        public Submesh[] submeshes;

        /// <summary>From the mesh's coordinates to those of its component, or of what that placed it in. Unity's units.</summary>
        public Matrix4x4 placed;

        /// <summary>The same mesh, placed further. The copies are shared.</summary>
        internal MeshPiece In(Matrix4x4 outer) =>
            new MeshPiece { vertices = vertices, submeshes = submeshes, placed = outer * placed };

        /// <summary>Triangles of one material.</summary>
        [Serializable]
        internal struct Submesh
        {
            /// <summary>Three indices a triangle.</summary>
            public int[] triangles;

            /// <summary>Null: the library's generic material.</summary>
            public ForesoundMaterial material;
        }

        /// <summary>Copies a readable mesh. Main thread.</summary>
        internal static MeshPiece Of(Mesh mesh, Matrix4x4 placed, Func<int, ForesoundMaterial> materialOf)
        {
            var piece = new MeshPiece
            {
                vertices = mesh.vertices,
                submeshes = new Submesh[mesh.subMeshCount],
                placed = placed,
            };
            for (int i = 0; i < piece.submeshes.Length; i++)
            {
                bool isSurface = mesh.GetTopology(i) == MeshTopology.Triangles;
                piece.submeshes[i].triangles = isSurface ? mesh.GetTriangles(i) : new int[0];
                piece.submeshes[i].material = materialOf(i);
            }
            return piece;
        }
    }
}
