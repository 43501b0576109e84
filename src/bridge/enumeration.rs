//! Enumerations of the interface: whole numbers that a caller may set to anything, with names for those that have a meaning.
//!
//! In Rust a number with constants, in C an enumeration of fixed width, in Java an integer with constants. Zero is always a
//! member: it is what an older library writes into fields that it does not know.

/// An enumeration of the interface.
pub trait Enumeration: Copy + 'static {
    /// The name.
    const NAME: &str;
    /// The declaration in Rust, from which cbindgen makes the C enumeration.
    const SOURCE: &str;
    /// Names and values of the members.
    const MEMBERS: &[(&str, i64)];

    /// The number.
    fn number(self) -> i64;

    /// The member's name, if the number is a member.
    fn name(self) -> Option<&'static str> {
        let member = Self::MEMBERS
            .iter()
            .find(|(_, value)| *value == self.number());
        member.map(|(name, _)| *name)
    }
}

/// Declares an enumeration of the interface.
macro_rules! enumeration {
    (
        $(#[$meta:meta])*
        pub enum $name:ident: $number:ident {
            $($(#[doc = $doc:literal])* $member:ident = $value:literal,)*
        }
    ) => {
        $(#[$meta])*
        #[repr(transparent)]
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub struct $name(pub $number);

        #[allow(non_upper_case_globals, reason = "constants that stand for an enumeration's members")]
        impl $name {
            $($(#[doc = $doc])* pub const $member: Self = Self($value);)*
        }

        impl $crate::bridge::enumeration::Enumeration for $name {
            const NAME: &str = stringify!($name);
            const SOURCE: &str = stringify!(
                $(#[$meta])*
                #[repr($number)]
                pub enum $name {
                    $($(#[doc = $doc])* $member = $value,)*
                }
            );
            const MEMBERS: &[(&str, i64)] = &[$((stringify!($member), $value)),*];

            fn number(self) -> i64 {
                self.0.into()
            }
        }

        impl $crate::bridge::record::Field for $name {
            const ELEMENTS: usize = 1;
            const ZERO: Self = Self(0);

            fn initializer(self) -> String {
                $crate::bridge::enumeration::c_constant(self)
            }

            fn read(name: &str, list: &mut &[f64]) -> Result<Self, $crate::bridge::CallError> {
                $crate::bridge::record::Field::read(name, list).map(Self)
            }

            fn write(self, list: &mut Vec<f64>) {
                $crate::bridge::record::Field::write(self.0, list);
            }
        }
    };
}

/// The member's name in C; of a number without a name the number.
pub fn c_constant<E: Enumeration>(value: E) -> String {
    value.name().map_or_else(
        || value.number().to_string(),
        |member| {
            let [prefix, name] = [E::NAME, member].map(constant_case);
            format!("FORESOUND_{prefix}_{name}")
        },
    )
}

/// A name in capitals, with an underscore before each word.
pub fn constant_case(name: &str) -> String {
    let mut text = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !text.is_empty() {
            text.push('_');
        }
        text.push(letter.to_ascii_uppercase());
    }
    text
}

enumeration! {
    /// When propagation runs.
    pub enum Schedule: u32 {
        /// Continuously, on a thread of its own.
        Asynchronous = 0,
        /// Within every tick.
        Synchronous = 1,
    }
}

enumeration! {
    /// Extrapolation of paths between updates.
    pub enum Predictor: u32 {
        /// Paths stay as the update had them.
        Hold = 0,
        /// Delays and amplitudes go on along lines.
        Linear = 1,
        /// Paths are computed anew for the poses of graphics frames. The default; `best` on the command line.
        Geometric = 2,
    }
}

enumeration! {
    /// Cores of an engine's threads.
    pub enum Affinity: u32 {
        /// The system chooses.
        System = 0,
        /// The two fastest.
        Fastest = 1,
        /// Those that the options name.
        Chosen = 2,
    }
}

enumeration! {
    /// What turns paths into two ears.
    pub enum Hrtf: u32 {
        /// The HRTF set passed at creation, else the built-in one.
        Set = 0,
        /// None: both ears receive the same signal.
        None = 1,
    }
}

enumeration! {
    /// Channels of the output and their order.
    pub enum Layout: u32 {
        /// Two ears, for headphones.
        Binaural = 0,
        /// Left and right by amplitude panning, for loudspeakers such as a phone's.
        Stereo = 1,
        /// One channel; the first two of more have it equally.
        Mono = 2,
        /// Six channels: left, right, centre, LFE (silent), left and right surround.
        Surround51 = 3,
        /// Eight channels: left, right, centre, LFE (silent), left and right back, left and right side.
        Surround71 = 4,
        /// Twelve channels: those of 7.1, then top front left and right, top back left and right.
        Surround714 = 5,
        /// Four channels of Ambisonics of order 1: AmbiX, order ACN, normalisation SN3D.
        Ambisonics1 = 6,
        /// Nine channels of Ambisonics of order 2.
        Ambisonics2 = 7,
        /// Sixteen channels of Ambisonics of order 3.
        Ambisonics3 = 8,
    }
}

enumeration! {
    /// Parts of a source's sound, bits to be added.
    pub enum Effect: u32 {
        /// No sound.
        None = 0,
        /// The direct path.
        Direct = 1,
        /// Reflections.
        Reflections = 2,
        /// Diffraction.
        Diffraction = 4,
        /// Transmission through walls.
        Transmission = 8,
        /// Late reverb.
        LateReverb = 16,
        /// All of them.
        All = 31,
    }
}

enumeration! {
    /// Level by distance. It scales all sound of a source; delays and the levels of its paths relative to each other stay.
    pub enum DistanceCurve: u32 {
        /// One over the distance, 1 at 1 m.
        Physical = 0,
        /// 1 up to the minimum distance, the minimum over the distance beyond it, constant from the maximum distance on.
        Inverse = 1,
        /// 1 up to the minimum distance, falling linearly to 0 at the maximum distance.
        Linear = 2,
    }
}

enumeration! {
    /// What a path does between source and listener.
    pub enum PathKind: u32 {
        /// The straight line, unobstructed.
        Direct = 0,
        /// The straight line, through walls.
        Transmitted = 1,
        /// Reflected, without diffraction.
        Reflected = 2,
        /// Diffracted at one or two edges, perhaps also reflected.
        Diffracted = 3,
    }
}

enumeration! {
    /// State of a source's clip.
    pub enum PlaybackState: u32 {
        /// No clip was played, or it was stopped.
        Idle = 0,
        /// A clip waits for the audio thread, or for its start.
        Scheduled = 1,
        /// A clip plays.
        Playing = 2,
        /// A clip is paused.
        Paused = 3,
        /// A clip has played to its end.
        Finished = 4,
    }
}

enumeration! {
    /// What a source's output holds (foresound_render_source).
    pub enum Bus: u32 {
        /// The source's paths.
        Own = 0,
        /// The source shares a slot, or has no position: it is heard in foresound_render_reverb's output. What it left in a slot of
        /// its own fades out here.
        Shared = 1,
        /// The source is not heard: masked by others, or the engine is paused. What it left in a slot of its own fades out here.
        Silent = 2,
    }
}

enumeration! {
    /// Exchange with a phone's system, bits to be added.
    pub enum DeviceHint: u32 {
        /// None.
        None = 0,
        /// Heat lowers the quality level.
        Thermal = 1,
        /// Threads report their durations to the system.
        Performance = 2,
    }
}

enumeration! {
    /// Threads with a performance hint session, bits that are added.
    pub enum HintedThread: u32 {
        /// None.
        None = 0,
        /// The propagation thread.
        Propagation = 1,
        /// The audio thread.
        Audio = 2,
    }
}

enumeration! {
    /// State of an engine.
    pub enum EngineState: u32 {
        /// Running.
        Running = 0,
        /// Paused.
        Paused = 1,
        /// Propagation failed; sound continues with the last paths. Call foresound_engine_restart.
        PropagationFailed = 2,
        /// The renderer was closed. Create another engine.
        RendererGone = 3,
    }
}

enumeration! {
    /// The system's thermal status.
    pub enum ThermalStatus: i32 {
        /// Unknown.
        Unknown = -1,
        /// No throttling.
        None = 0,
        /// Light.
        Light = 1,
        /// Moderate.
        Moderate = 2,
        /// Severe.
        Severe = 3,
        /// Critical.
        Critical = 4,
        /// Emergency.
        Emergency = 5,
        /// Shutdown.
        Shutdown = 6,
    }
}

enumeration! {
    /// Upward axis of a file.
    pub enum UpAxis: u32 {
        /// +y.
        Y = 0,
        /// +z.
        Z = 1,
    }
}

enumeration! {
    /// System library of a sound device.
    pub enum DeviceApi: u32 {
        /// Another, or none.
        Other = 0,
        /// AAudio.
        Aaudio = 1,
        /// OpenSL ES.
        OpenslEs = 2,
    }
}

enumeration! {
    /// Gravity of a message; as a limit, the least grave messages that are passed on.
    pub enum LogLevel: u32 {
        /// No message.
        Off = 0,
        /// Something failed.
        Error = 1,
        /// Something is worse than it could be.
        Warn = 2,
        /// What was chosen and found.
        Info = 3,
        /// Details.
        Debug = 4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_c_have_the_enumerations_name() {
        assert_eq!(
            c_constant(EngineState::RendererGone),
            "FORESOUND_ENGINE_STATE_RENDERER_GONE"
        );
        assert_eq!(
            c_constant(ThermalStatus(-1)),
            "FORESOUND_THERMAL_STATUS_UNKNOWN"
        );
        assert_eq!(c_constant(Schedule(7)), "7");
    }

    #[test]
    fn zero_is_a_member_of_each() {
        assert_eq!(Effect(0).name(), Some("None"));
        assert_eq!(ThermalStatus(0).name(), Some("None"));
    }
}
