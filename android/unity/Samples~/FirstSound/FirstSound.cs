using Foresound;
using UnityEngine;

/// <summary>
/// A room, a door that swings in the opening of its wall, and a voice behind it. Add this to the object of the audio listener in
/// an empty scene, press play, and listen with headphones.
/// </summary>
public sealed class FirstSound : MonoBehaviour
{
    GameObject hinge;

    void OnEnable()
    {
        GameObject room = Part("Room");
        Box(room, new Vector3(0, -0.1f, 0), new Vector3(8, 0.2f, 12));
        Box(room, new Vector3(0, 3.1f, 0), new Vector3(8, 0.2f, 12));
        Box(room, new Vector3(-4, 1.5f, 0), new Vector3(0.2f, 3, 12));
        Box(room, new Vector3(4, 1.5f, 0), new Vector3(0.2f, 3, 12));
        Box(room, new Vector3(0, 1.5f, -6), new Vector3(8, 3, 0.2f));
        Box(room, new Vector3(0, 1.5f, 6), new Vector3(8, 3, 0.2f));
        // A wall across with an opening of one metre from the hinge on.
        Box(room, new Vector3(-2.25f, 1.5f, 0), new Vector3(3.5f, 3, 0.2f));
        Box(room, new Vector3(2.25f, 1.5f, 0), new Vector3(3.5f, 3, 0.2f));
        room.AddComponent<ForesoundGeometry>().material = Material("brick");
        room.SetActive(true);

        hinge = Part("Door");
        hinge.transform.position = new Vector3(-0.5f, 0, 0);
        Box(hinge, new Vector3(0.5f, 1.5f, 0), new Vector3(1, 3, 0.05f));
        hinge.AddComponent<ForesoundInstance>().material = Material("door_wood");
        hinge.SetActive(true);

        GameObject voice = Part("Voice");
        voice.transform.position = new Vector3(1, 1.6f, 3);
        var source = voice.AddComponent<ForesoundSource>();
        source.clip = Clicks();
        source.loop = true;
        voice.SetActive(true);

        transform.position = new Vector3(-1, 1.6f, -3);
        gameObject.AddComponent<ForesoundListener>();
        GameObject engine = Part("Engine");
        engine.AddComponent<ForesoundEngine>().drawPaths = true;
        engine.SetActive(true);
    }

    void Update()
    {
        float angle = 45 - 45 * (float)System.Math.Cos(Time.time);
        hinge.transform.rotation = Quaternion.AngleAxis(angle, Vector3.up);
    }

    /// <summary>An object that is enabled once its components have their settings.</summary>
    static GameObject Part(string name)
    {
        var made = new GameObject(name);
        made.SetActive(false);
        return made;
    }

    static void Box(GameObject parent, Vector3 at, Vector3 size)
    {
        GameObject box = GameObject.CreatePrimitive(PrimitiveType.Cube);
        box.transform.parent = parent.transform;
        box.transform.localPosition = at;
        box.transform.localScale = size;
    }

    static ForesoundMaterial Material(string name)
    {
        var material = ScriptableObject.CreateInstance<ForesoundMaterial>();
        material.builtIn = name;
        return material;
    }

    /// <summary>Four clicks a second, each a short burst of noise.</summary>
    static AudioClip Clicks()
    {
        const int rateHz = 48000;
        var samples = new float[rateHz];
        var random = new System.Random(1);
        for (int n = 0; n < samples.Length; n++)
            samples[n] = n % (rateHz / 4) < 400 ? (float)(random.NextDouble() - 0.5) : 0;
        AudioClip clip = AudioClip.Create("Clicks", samples.Length, 1, rateHz, false);
        clip.SetData(samples, 0);
        return clip;
    }
}
