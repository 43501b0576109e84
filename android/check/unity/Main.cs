// Drives the Unity package without Unity. The first argument is the part: walk SCENE OUT, components SCENE OUT,
// coordinates, geometry, editor, audio, abuse, cycles N, tick. Prints lines of figures; anything unexpected ends it with an exception.
using System;
using Foresound.Interop;

namespace Foresound.Check
{
    static class Program
    {
        static int Main(string[] arguments)
        {
            try
            {
                switch (arguments[0])
                {
                    case "walk": Walk.Bindings(arguments[1], arguments[2]); break;
                    case "components": Walk.Components(arguments[1], arguments[2]); break;
                    case "abuse": Abuse.Run(); break;
                    case "coordinates": Places.Coordinates(); break;
                    case "geometry": Places.Geometry(); break;
                    case "editor": Inspected.Run(); break;
                    case "audio": Audio.Run(); break;
                    case "cycles": Endurance.Cycles(int.Parse(arguments[1])); break;
                    case "tick": Endurance.Tick(); break;
                    default: throw new ArgumentException(arguments[0]);
                }
                return 0;
            }
            catch (Exception error)
            {
                Console.WriteLine(error);
                return 1;
            }
        }
    }
}
