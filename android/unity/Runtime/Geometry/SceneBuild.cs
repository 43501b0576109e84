using System;
using System.Threading.Tasks;
using Foresound.Interop;

namespace Foresound
{
    /// <summary>A scene that is being committed on a thread of the pool. Main thread.</summary>
    internal sealed class SceneBuild
    {
        Task<SoundScene> task;

        internal SceneBuild(SceneInput input)
        {
            task = Task.Run(input.Commit);
        }

        /// <summary>Whether <see cref="Take"/> does not wait.</summary>
        internal bool IsDone => task.IsCompleted;

        /// <summary>The scene, the caller's from now on; waits for it.</summary>
        /// <exception cref="ForesoundException">The meshes or the materials are invalid.</exception>
        internal SoundScene Take() => task.GetAwaiter().GetResult();

        /// <summary>Gives the scene up, now or when it is done.</summary>
        internal void Abandon()
        {
            task.ContinueWith(Discard, TaskContinuationOptions.ExecuteSynchronously);
        }

        static void Discard(Task<SoundScene> done)
        {
            if (done.Status == TaskStatus.RanToCompletion) done.Result.Dispose();
            else GC.KeepAlive(done.Exception);
        }
    }
}
