// Stand-ins for the editor's types that the package's editor assembly uses: compiled against, and drawn into a list.
using System;
using System.Collections.Generic;
using UnityEngine;

namespace UnityEngine.SceneManagement
{
    public struct Scene
    {
        public GameObject[] roots;

        public GameObject[] GetRootGameObjects() => roots;
    }
}

namespace UnityEditor.Build
{
    public interface IOrderedCallback
    {
        int callbackOrder { get; }
    }

    public interface IProcessSceneWithReport : IOrderedCallback
    {
        void OnProcessScene(UnityEngine.SceneManagement.Scene scene, Reporting.BuildReport report);
    }
}

namespace UnityEditor.Build.Reporting
{
    public sealed class BuildReport : UnityEngine.Object
    {
    }
}

namespace UnityEditor
{
    public sealed class CustomEditor : Attribute
    {
        public CustomEditor(Type inspected)
        {
        }
    }

    public class Editor
    {
        public UnityEngine.Object target { get; set; }
        public SerializedObject serializedObject => new SerializedObject(target);

        public virtual bool RequiresConstantRepaint() => false;

        public virtual void OnInspectorGUI()
        {
        }

        public bool DrawDefaultInspector() => true;
    }

    public sealed class SerializedObject
    {
        readonly UnityEngine.Object inspected;

        public SerializedObject(UnityEngine.Object inspected)
        {
            this.inspected = inspected;
        }

        public void Update()
        {
        }

        public bool ApplyModifiedProperties() => true;
        public SerializedProperty FindProperty(string name) => new SerializedProperty(inspected, name);
    }

    public sealed class SerializedProperty
    {
        readonly UnityEngine.Object inspected;
        readonly System.Reflection.FieldInfo field;

        internal SerializedProperty(UnityEngine.Object inspected, string name)
        {
            this.inspected = inspected;
            field = inspected.GetType().GetField(name) ?? throw new ArgumentException(name);
        }

        public bool boolValue => (bool)field.GetValue(inspected);

        public string stringValue
        {
            get => (string)field.GetValue(inspected);
            set => field.SetValue(inspected, value);
        }

        public int arraySize
        {
            set
            {
                var values = (float[])field.GetValue(inspected);
                Array.Resize(ref values, value);
                field.SetValue(inspected, values);
            }
        }

        internal string Name => field.Name;
    }

    public static class EditorGUILayout
    {
        /// <summary>Of the stand-ins: what was drawn.</summary>
        public static readonly List<string> drawn = new List<string>();

        /// <summary>Of the stand-ins: what the next popup chooses; -1: nothing.</summary>
        public static int choice = -1;

        public static void LabelField(string label, string text) => drawn.Add(label + ": " + text);

        public static bool PropertyField(SerializedProperty property, bool includeChildren = false)
        {
            drawn.Add(property.Name);
            return true;
        }

        public static int Popup(string label, int selected, string[] names)
        {
            drawn.Add(label + ": " + (selected < 0 ? "" : names[selected]));
            return choice < 0 ? selected : choice;
        }
    }
}
