using System;
using UnityEditor;

namespace Foresound.Editor
{
    /// <summary>A list of the library's materials, or eight bands of own values.</summary>
    [CustomEditor(typeof(ForesoundMaterial))]
    public sealed class MaterialInspector : UnityEditor.Editor
    {
        /// <summary>Draws what is in use.</summary>
        public override void OnInspectorGUI()
        {
            serializedObject.Update();
            SerializedProperty own = serializedObject.FindProperty("ownValues");
            EditorGUILayout.PropertyField(own);
            if (own.boolValue)
            {
                Bands(serializedObject.FindProperty("absorption"));
                EditorGUILayout.PropertyField(serializedObject.FindProperty("scattering"));
                Bands(serializedObject.FindProperty("transmissionLossDb"));
            }
            else
            {
                SerializedProperty name = serializedObject.FindProperty("builtIn");
                int known = Array.IndexOf(ForesoundMaterial.BuiltIn, name.stringValue);
                int chosen = EditorGUILayout.Popup("Material", known, ForesoundMaterial.BuiltIn);
                if (chosen >= 0) name.stringValue = ForesoundMaterial.BuiltIn[chosen];
            }
            serializedObject.ApplyModifiedProperties();
        }

        static void Bands(SerializedProperty values)
        {
            values.arraySize = ForesoundMaterial.Bands;
            EditorGUILayout.PropertyField(values, true);
        }
    }
}
