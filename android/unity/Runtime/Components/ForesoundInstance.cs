using System.Collections.Generic;
using Foresound.Interop;
using UnityEngine;
using Pose = Foresound.Interop.Pose;

namespace Foresound
{
    /// <summary>
    /// Meshes that move as one rigid body: a door, a lift, a vehicle. Its scale is that of the moment when it is enabled.
    /// </summary>
    [AddComponentMenu("Foresound/Foresound Instance"), DisallowMultipleComponent]
    public sealed class ForesoundInstance : ForesoundMeshes
    {
        static readonly List<ForesoundMeshes> parts = new List<ForesoundMeshes>();
        SceneBuild build;
        SoundEngine engine;
        uint id;
        bool isAdded;
        Status lastStatus;
        Vector3 position;
        Quaternion rotation;

        internal override Transform Frame => transform;

        /// <summary>Whether the part is still being committed.</summary>
        internal bool IsBuilding => build != null;

        /// <summary>Whether the instance is one of the engine's, or about to be.</summary>
        internal bool IsAttached => engine != null;

        void OnEnable() => Registry.Add(this);

        void OnDisable() => Registry.Remove(this);

        /// <summary>Begins to commit the part.</summary>
        internal void Attach(SoundEngine to, float metresPerUnit)
        {
            engine = to;
            var input = new SceneInput(metresPerUnit);
            GetComponentsInChildren(false, parts);
            foreach (ForesoundMeshes part in parts)
                if (part.Frame == transform)
                    foreach (MeshPiece piece in part.Pieces()) input.Add(piece);
            parts.Clear();
            if (input.Triangles > 0) build = new SceneBuild(input);
            else Debug.LogError($"Foresound: {name} has no triangles; give it a mesh", this);
        }

        /// <summary>Leaves the engine, which may be closed.</summary>
        internal void Detach()
        {
            build?.Abandon();
            build = null;
            if (isAdded) engine.RemoveInstance(id);
            isAdded = false;
            engine = null;
        }

        /// <summary>Adds the instance once its part is committed, and moves it if it moved.</summary>
        internal void BeforeTick(float metresPerUnit)
        {
            if (build != null && build.IsDone) Add(metresPerUnit);
            if (!isAdded) return;
            Vector3 at = transform.position;
            Quaternion turned = transform.rotation;
            // Exact comparison: a part at rest keeps what is known about it.
            if (at.Equals(position) && turned.Equals(rotation)) return;
            Status status = engine.MoveInstance(id, PoseNow(metresPerUnit));
            // An invalid pose is reported once, not in every frame.
            if (status != Status.Ok && lastStatus == Status.Ok)
                Debug.LogError($"Foresound: {name} does not move: {ForesoundException.LastError()}", this);
            lastStatus = status;
        }

        void Add(float metresPerUnit)
        {
            try
            {
                using (SoundScene part = build.Take()) id = engine.AddInstance(part, PoseNow(metresPerUnit));
                isAdded = true;
            }
            catch (ForesoundException error)
            {
                Debug.LogError($"Foresound: {name}: {error.Message}", this);
            }
            build = null;
        }

        Pose PoseNow(float metresPerUnit)
        {
            position = transform.position;
            rotation = transform.rotation;
            var pose = new Pose();
            Coordinates.Write(ref pose, 0, position, rotation, metresPerUnit);
            return pose;
        }
    }
}
