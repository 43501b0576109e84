using System;
using System.Threading.Tasks;
using Foresound.Interop;

namespace Foresound
{
    /// <summary>A scene that is being committed on a thread of the pool. Main thread.</summary>
    internal sealed class SceneBuild
    {
        readonly SoundProgress progress = SoundProgress.Create();
        readonly Task<SoundScene> task;

        internal SceneBuild(SceneInput input)
        {
            task = Task.Run(() => input.Commit(progress));
        }

        /// <summary>The part that is done, 0 to 1.</summary>
        internal float Done => IsDone ? 1 : progress.Done;

        /// <summary>Whether <see cref="Take"/> does not wait.</summary>
        internal bool IsDone => task.IsCompleted;

        /// <summary>The scene, the caller's from now on; waits for it.</summary>
        /// <exception cref="ForesoundException">The meshes or the materials are invalid.</exception>
        internal SoundScene Take()
        {
            try
            {
                return task.GetAwaiter().GetResult();
            }
            finally
            {
                progress.Dispose();
            }
        }

        /// <summary>Cancels the build, and gives the scene up if it is done all the same.</summary>
        internal void Abandon()
        {
            progress.Cancel();
            task.ContinueWith(Discard, TaskContinuationOptions.ExecuteSynchronously);
        }

        void Discard(Task<SoundScene> ended)
        {
            progress.Dispose();
            if (ended.Status == TaskStatus.RanToCompletion) ended.Result.Dispose();
            else GC.KeepAlive(ended.Exception);
        }
    }
}
