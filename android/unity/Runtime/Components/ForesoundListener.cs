using UnityEngine;

namespace Foresound
{
    /// <summary>
    /// The ears, on the object of the audio listener. Adds Foresound's sound to Unity's mix, on the audio thread.
    /// </summary>
    [AddComponentMenu("Foresound/Foresound Listener"), DisallowMultipleComponent, RequireComponent(typeof(AudioListener))]
    public sealed class ForesoundListener : MonoBehaviour
    {
        void OnEnable() => enabled = Registry.Add(this);

        void OnDisable() => Registry.Remove(this);

        /// <summary>Unity's audio thread, once a DSP buffer, with the mix of everything else.</summary>
        void OnAudioFilterRead(float[] data, int channels) => Registry.Output?.Add(data, channels, AudioSettings.dspTime);
    }
}
