using UnityEngine;

namespace Foresound
{
    /// <summary>
    /// Meshes that stay where they are: rooms, ground, buildings. All of them make one scene, which is committed again when one is
    /// enabled or disabled. Below a <see cref="ForesoundInstance"/> it gives a material to a part of the instance.
    /// </summary>
    [AddComponentMenu("Foresound/Foresound Geometry"), DisallowMultipleComponent]
    public sealed class ForesoundGeometry : ForesoundMeshes
    {
        /// <summary>The instance that this moves with; null: none.</summary>
        internal ForesoundInstance Instance => GetComponentInParent<ForesoundInstance>();

        internal override Transform Frame
        {
            get
            {
                ForesoundInstance instance = Instance;
                return instance == null ? null : instance.transform;
            }
        }

        void OnEnable() => Registry.Add(this);

        void OnDisable() => Registry.Remove(this);
    }
}
