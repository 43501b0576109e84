using System.Globalization;
using System.Text;
using UnityEngine;

namespace Foresound
{
    /// <summary>
    /// A surface material: one of the library's by name, or values in eight octave bands from 63 Hz to 8 kHz.
    /// </summary>
    [CreateAssetMenu(menuName = "Foresound/Material", fileName = "Foresound Material")]
    public sealed class ForesoundMaterial : ScriptableObject
    {
        /// <summary>Octave bands.</summary>
        public const int Bands = 8;

        /// <summary>The library's materials.</summary>
        public static readonly string[] BuiltIn =
        {
            "acoustic_ceiling", "asphalt", "audience", "brick", "carpet", "cinder_block", "concrete", "curtain", "door_wood",
            "foliage", "generic", "glass", "grass", "gravel", "gypsum_board", "linoleum", "marble", "parquet_on_concrete",
            "plaster", "plywood", "rock_wool", "sandbag", "snow", "soil", "steel", "tile", "upholstered_seat", "water",
            "wood_floor", "wood_panel",
        };

        /// <summary>Values of this asset instead of a material of the library.</summary>
        [Tooltip("Values of this asset instead of a material of the library.")]
        public bool ownValues;

        /// <summary>Name of a material of the library.</summary>
        [Tooltip("A material of the library.")]
        public string builtIn = "plaster";

        /// <summary>Absorbed share of the energy in each band, 0 to 1; includes what passes.</summary>
        [Tooltip("Absorbed share of the energy, 63 Hz to 8 kHz, 0 to 1; includes what passes.")]
        public float[] absorption = { 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f };

        /// <summary>Scattered share of the reflected energy, 0 to 1.</summary>
        [Range(0, 1), Tooltip("Scattered share of the reflected energy.")]
        public float scattering = 0.1f;

        /// <summary>Loss in dB of sound that passes, in each band, 0 to 200; the energy that passes is part of the absorption.</summary>
        [Tooltip("Loss in dB of sound that passes, 63 Hz to 8 kHz.")]
        public float[] transmissionLossDb = { 30, 30, 35, 40, 45, 50, 50, 50 };

        /// <summary>The asset's values as a table of a materials file.</summary>
        internal void Append(StringBuilder toml, string uniqueName)
        {
            toml.Append("[materials.\"").Append(uniqueName).Append("\"]\nabsorption = ");
            AppendBands(toml, absorption);
            toml.Append("scattering = ").Append(scattering.ToString("0.0######", CultureInfo.InvariantCulture)).Append('\n');
            toml.Append("transmission_loss_db = ");
            AppendBands(toml, transmissionLossDb);
        }

        static void AppendBands(StringBuilder toml, float[] values)
        {
            for (int band = 0; band < values.Length; band++)
            {
                toml.Append(band == 0 ? "[" : ", ");
                toml.Append(values[band].ToString("0.0######", CultureInfo.InvariantCulture));
            }
            toml.Append("]\n");
        }
    }
}
