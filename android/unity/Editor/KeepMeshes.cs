using UnityEditor.Build;
using UnityEditor.Build.Reporting;
using UnityEngine;
using UnityEngine.SceneManagement;

namespace Foresound.Editor
{
    /// <summary>
    /// Keeps copies of the meshes of a scene that goes into a build or into play mode: static batching merges them afterwards,
    /// and players drop the vertices of meshes without Read/Write.
    /// </summary>
    public sealed class KeepMeshes : IProcessSceneWithReport
    {
        /// <summary>Before Unity's own processing, which has the order 0.</summary>
        public int callbackOrder => -1000;

        /// <summary>Called by the editor for each scene.</summary>
        public void OnProcessScene(Scene scene, BuildReport report)
        {
            foreach (GameObject root in scene.GetRootGameObjects())
                foreach (ForesoundMeshes meshes in root.GetComponentsInChildren<ForesoundMeshes>(true)) meshes.Keep();
        }
    }
}
