using System.Runtime.CompilerServices;

[assembly: InternalsVisibleTo("Foresound.Editor")]
[assembly: InternalsVisibleTo("Foresound.Check")]
