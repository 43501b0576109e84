using System.Collections.Generic;
using UnityEngine;

namespace Foresound
{
    /// <summary>
    /// Gives meshes to Foresound: those of this object and of the objects below it, as far as no other component of this kind is
    /// nearer. Meshes need the import setting Read/Write unless the scene was processed for a build or for play mode, which
    /// keeps copies.
    /// </summary>
    public abstract class ForesoundMeshes : MonoBehaviour
    {
        /// <summary>Material of the triangles; none: the library's generic material.</summary>
        [Tooltip("Material of all triangles that the list below does not name.")]
        public ForesoundMaterial material;

        /// <summary>Materials of the submeshes, by index; none: <see cref="material"/>.</summary>
        [Tooltip("Materials of submeshes, by index.")]
        public ForesoundMaterial[] submeshMaterials = { };

        /// <summary>A mesh of this object instead of all visible ones: simpler for sound.</summary>
        [Tooltip("A mesh, in this object's coordinates, instead of the visible ones. Sound needs walls, not ornaments.")]
        public Mesh replacement;

        /// <summary>Copies from the processing of the scene; empty: the meshes themselves.</summary>
        [SerializeField, HideInInspector]
        MeshPiece[] kept = { };

        static readonly List<MeshFilter> filters = new List<MeshFilter>();

        /// <summary>The object whose coordinates the meshes are placed in; null: the world.</summary>
        internal abstract Transform Frame { get; }

        /// <summary>
        /// Keeps copies of the meshes, before a build merges static ones. They stay where this object is. Main thread.
        /// </summary>
        internal void Keep()
        {
            kept = new MeshPiece[0];
            kept = OwnPieces().ToArray();
        }

        /// <summary>Forgets the copies.</summary>
        internal void Release() => kept = new MeshPiece[0];

        /// <summary>The meshes in the frame's coordinates. Main thread.</summary>
        internal List<MeshPiece> Pieces()
        {
            List<MeshPiece> pieces = kept.Length > 0 ? new List<MeshPiece>(kept) : OwnPieces();
            Matrix4x4 own = Placed();
            for (int i = 0; i < pieces.Count; i++) pieces[i] = pieces[i].In(own);
            return pieces;
        }

        /// <summary>Copies of the meshes in this object's coordinates.</summary>
        List<MeshPiece> OwnPieces()
        {
            var pieces = new List<MeshPiece>();
            if (replacement != null)
            {
                pieces.Add(MeshPiece.Of(replacement, Matrix4x4.identity, MaterialOf));
                return pieces;
            }
            GetComponentsInChildren(true, filters);
            foreach (MeshFilter filter in filters)
            {
                Mesh mesh = filter.sharedMesh;
                if (mesh == null || !Has(filter.transform)) continue;
                var shown = filter.GetComponent<MeshRenderer>();
                string cause = !mesh.isReadable ? "is not readable; turn on Read/Write in its import settings"
                    : shown != null && shown.isPartOfStaticBatch ? "is in a static batch; have the scene processed, or turn Batching Static off"
                    : null;
                if (cause == null) pieces.Add(MeshPiece.Of(mesh, Between(filter.transform, transform), MaterialOf));
                else Debug.LogError($"Foresound: the mesh {mesh.name} of {filter.name} {cause}", filter);
            }
            filters.Clear();
            return pieces;
        }

        /// <summary>Whether this is the nearest component of its kind, and everything up to it is active.</summary>
        bool Has(Transform at)
        {
            for (; at != transform; at = at.parent)
                if (!at.gameObject.activeSelf || at.GetComponent<ForesoundMeshes>() != null) return false;
            return true;
        }

        ForesoundMaterial MaterialOf(int submesh)
        {
            bool isNamed = submesh < submeshMaterials.Length && submeshMaterials[submesh] != null;
            return isNamed ? submeshMaterials[submesh] : material;
        }

        /// <summary>
        /// From this object's coordinates to the frame's. In an instance with its scale but without its pose, which is the
        /// engine's: rounding of a far pose stays out of the mesh.
        /// </summary>
        Matrix4x4 Placed()
        {
            Transform frame = Frame;
            return frame == null ? transform.localToWorldMatrix : Matrix4x4.Scale(frame.lossyScale) * Between(transform, frame);
        }

        /// <summary>From an object's coordinates to those of one above it, or its own.</summary>
        static Matrix4x4 Between(Transform from, Transform to)
        {
            Matrix4x4 product = Matrix4x4.identity;
            for (; from != to; from = from.parent)
                product = Matrix4x4.TRS(from.localPosition, from.localRotation, from.localScale) * product;
            return product;
        }
    }
}
