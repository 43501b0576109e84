// Stand-ins for Unity's objects and components, with the life cycle that the package relies on: OnEnable when a component becomes
// active and enabled, LateUpdate by DefaultExecutionOrder, OnDisable.
using System;
using System.Collections.Generic;
using System.Reflection;

namespace UnityEngine
{
    public class Object
    {
        public string name = "";
        public override string ToString() => name;
        public static implicit operator bool(Object o) => o != null;
    }

    public class ScriptableObject : Object
    {
        public static T CreateInstance<T>() where T : ScriptableObject, new() => new T();
    }

    public class Component : Object
    {
        public GameObject gameObject { get; internal set; }
        public Transform transform => gameObject.transform;
        public T GetComponent<T>() where T : class => gameObject.GetComponent<T>();

        public T GetComponentInParent<T>() where T : class
        {
            for (Transform t = transform; t != null; t = t.parent)
                if (t.gameObject.GetComponent<T>() is T found) return found;
            return null;
        }

        public void GetComponentsInChildren<T>(bool includeInactive, List<T> found) where T : class
        {
            found.Clear();
            Gather(transform, includeInactive, found);
        }

        static void Gather<T>(Transform at, bool includeInactive, List<T> found) where T : class
        {
            if (!includeInactive && !at.gameObject.activeInHierarchy) return;
            foreach (Component component in at.gameObject.components)
                if (component is T fits) found.Add(fits);
            foreach (Transform child in at.children) Gather(child, includeInactive, found);
        }
    }

    public class Behaviour : Component
    {
        bool isEnabled = true, isRunning;
        Action onEnable, onDisable;
        internal Action update, lateUpdate;

        public bool enabled
        {
            get => isEnabled;
            set
            {
                isEnabled = value;
                Refresh();
            }
        }

        internal void Bind()
        {
            onEnable = Find("OnEnable");
            onDisable = Find("OnDisable");
            update = Find("Update");
            lateUpdate = Find("LateUpdate");
        }

        Action Find(string method)
        {
            const BindingFlags any = BindingFlags.Instance | BindingFlags.Public | BindingFlags.NonPublic;
            MethodInfo found = GetType().GetMethod(method, any, null, Type.EmptyTypes, null);
            return found == null ? null : (Action)Delegate.CreateDelegate(typeof(Action), this, found);
        }

        internal bool IsRunning => isRunning;

        internal void Refresh()
        {
            bool runs = isEnabled && gameObject.activeInHierarchy;
            if (runs == isRunning) return;
            isRunning = runs;
            if (runs) onEnable?.Invoke();
            else onDisable?.Invoke();
        }
    }

    public class MonoBehaviour : Behaviour
    {
    }

    public sealed class GameObject : Object
    {
        /// <summary>Of the stand-ins: every behaviour, by execution order.</summary>
        public static readonly List<Behaviour> behaviours = new List<Behaviour>();

        internal readonly List<Component> components = new List<Component>();
        bool isActive = true;

        public GameObject(string name)
        {
            this.name = name;
            transform = new Transform { gameObject = this, name = name };
            components.Add(transform);
        }

        public Transform transform { get; }
        public bool activeSelf => isActive;
        public bool activeInHierarchy => isActive && (transform.parent == null || transform.parent.gameObject.activeInHierarchy);

        public T AddComponent<T>() where T : Component, new()
        {
            foreach (RequireComponent required in typeof(T).GetCustomAttributes(typeof(RequireComponent), true))
                if (required.type == typeof(AudioListener) && GetComponent<AudioListener>() == null) AddComponent<AudioListener>();
            var added = new T { gameObject = this, name = name };
            components.Add(added);
            if (!(added is Behaviour behaviour)) return added;
            behaviour.Bind();
            behaviours.Add(behaviour);
            behaviours.Sort((a, b) => OrderOf(a).CompareTo(OrderOf(b)));
            behaviour.Refresh();
            return added;
        }

        public static GameObject CreatePrimitive(PrimitiveType type)
        {
            if (type != PrimitiveType.Cube) throw new NotSupportedException("cubes only");
            var made = new GameObject("Cube");
            made.AddComponent<MeshFilter>().sharedMesh = Mesh.Cube();
            made.AddComponent<MeshRenderer>();
            return made;
        }

        static int OrderOf(Behaviour behaviour)
        {
            object[] orders = behaviour.GetType().GetCustomAttributes(typeof(DefaultExecutionOrder), true);
            return orders.Length == 0 ? 0 : ((DefaultExecutionOrder)orders[0]).order;
        }

        public T GetComponent<T>() where T : class
        {
            foreach (Component component in components)
                if (component is T found) return found;
            return null;
        }

        public T[] GetComponentsInChildren<T>(bool includeInactive) where T : class
        {
            var found = new List<T>();
            transform.GetComponentsInChildren(includeInactive, found);
            return found.ToArray();
        }

        public void SetActive(bool active)
        {
            isActive = active;
            var below = new List<Behaviour>();
            transform.GetComponentsInChildren(true, below);
            foreach (Behaviour behaviour in below) behaviour.Refresh();
        }

        /// <summary>Of the stand-ins: forgets every object.</summary>
        public static void DestroyAll()
        {
            foreach (Behaviour behaviour in behaviours.ToArray()) behaviour.gameObject.SetActive(false);
            behaviours.Clear();
        }

        /// <summary>Of the stand-ins: one frame.</summary>
        public static void Frame()
        {
            Time.time += Time.deltaTime;
            for (int i = 0; i < behaviours.Count; i++)
                if (behaviours[i].IsRunning) behaviours[i].update?.Invoke();
            for (int i = 0; i < behaviours.Count; i++)
                if (behaviours[i].IsRunning) behaviours[i].lateUpdate?.Invoke();
        }
    }

    public sealed class Transform : Component
    {
        internal readonly List<Transform> children = new List<Transform>();
        Transform above;

        public Vector3 localPosition = Vector3.zero;
        public Quaternion localRotation = Quaternion.identity;
        public Vector3 localScale = Vector3.one;

        public Transform parent
        {
            get => above;
            set
            {
                above?.children.Remove(this);
                above = value;
                above?.children.Add(this);
            }
        }

        public Vector3 position
        {
            get => above == null ? localPosition : above.localToWorldMatrix.MultiplyPoint3x4(localPosition);
            set => localPosition = above == null ? value : throw new NotSupportedException("set roots only");
        }

        public Quaternion rotation
        {
            get => above == null ? localRotation : above.rotation * localRotation;
            set => localRotation = above == null ? value : throw new NotSupportedException("set roots only");
        }

        public Vector3 lossyScale
        {
            get
            {
                if (above == null) return localScale;
                Vector3 s = above.lossyScale;
                return new Vector3(s.x * localScale.x, s.y * localScale.y, s.z * localScale.z);
            }
        }

        public Matrix4x4 localToWorldMatrix
        {
            get
            {
                Matrix4x4 own = Matrix4x4.TRS(localPosition, localRotation, localScale);
                return above == null ? own : above.localToWorldMatrix * own;
            }
        }
    }

    public static class Application
    {
        public static bool isPlaying => true;
    }

    public static class Time
    {
        public static float time;
        public static float deltaTime = 1 / 60f;
    }

    public static class Debug
    {
        /// <summary>Of the stand-ins: the errors so far.</summary>
        public static readonly List<string> errors = new List<string>();

        public static void LogError(object message, Object context)
        {
            if (context == null) throw new ArgumentNullException(nameof(context));
            errors.Add(message.ToString());
        }
    }

    public static class Gizmos
    {
        public static Color color;

        /// <summary>Of the stand-ins: the ends of the lines so far.</summary>
        public static readonly List<Vector3> lines = new List<Vector3>();

        public static void DrawLine(Vector3 from, Vector3 to)
        {
            lines.Add(from);
            lines.Add(to);
        }

        public static void DrawWireSphere(Vector3 centre, float radius) => lines.Add(centre);
    }
}
