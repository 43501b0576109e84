//! Structures and enumerations of the interface, for the tests that write and compare its bindings.
//!
//! Any thread.

use super::enumeration::Enumeration;
use super::record::{Growing, Record};

/// A structure of the interface.
pub struct Structure {
    /// Its name.
    pub name: &'static str,
    /// Its declaration in Rust.
    pub source: &'static str,
    /// Length of its list.
    pub length: usize,
    /// Its fields and their indices in the list.
    pub fields: Vec<(&'static str, usize)>,
    /// Bytes up to the end of each field, the size included.
    pub ends: &'static [usize],
    /// Bytes to which sizes are multiples.
    pub alignment: usize,
    /// The initial values as an initialiser in C, of a structure that begins with its size.
    pub initializer: Option<String>,
}

/// An enumeration of the interface.
pub struct EnumerationInfo {
    /// Its name.
    pub name: &'static str,
    /// Its declaration in Rust.
    pub source: &'static str,
    /// Names and values of its members.
    pub members: &'static [(&'static str, i64)],
}

/// The enumerations of the interface.
pub fn enumerations() -> Vec<EnumerationInfo> {
    use super::enumeration as e;
    fn of<T: Enumeration>() -> EnumerationInfo {
        EnumerationInfo {
            name: T::NAME,
            source: T::SOURCE,
            members: T::MEMBERS,
        }
    }
    vec![
        of::<e::Schedule>(),
        of::<e::Predictor>(),
        of::<e::Affinity>(),
        of::<e::Hrtf>(),
        of::<e::Layout>(),
        of::<e::Effect>(),
        of::<e::DistanceCurve>(),
        of::<e::PathKind>(),
        of::<e::PlaybackState>(),
        of::<e::Bus>(),
        of::<e::DeviceHint>(),
        of::<e::HintedThread>(),
        of::<e::EngineState>(),
        of::<e::ThermalStatus>(),
        of::<e::UpAxis>(),
        of::<e::DeviceApi>(),
        of::<e::LogLevel>(),
    ]
}

/// The structures of the interface.
pub fn structures() -> Vec<Structure> {
    use super::{
        engine, health, numbers, options, playback, scenes, shown_paths, sound, statistics,
    };
    fn part<T: Record>() -> Structure {
        Structure {
            name: T::NAME,
            source: T::SOURCE,
            length: T::ELEMENTS,
            fields: T::fields(),
            ends: T::ENDS,
            alignment: align_of::<T>(),
            initializer: None,
        }
    }
    fn of<T: Growing>() -> Structure {
        Structure {
            initializer: Some(T::default().initializer()),
            ..part::<T>()
        }
    }
    vec![
        of::<options::Options>(),
        of::<engine::SourceOptions>(),
        of::<engine::PropagationOptions>(),
        of::<engine::MaterialOptions>(),
        of::<scenes::SceneOptions>(),
        of::<health::BudgetOptions>(),
        of::<scenes::SceneInfo>(),
        part::<statistics::Percentiles>(),
        of::<statistics::EngineStatistics>(),
        of::<health::EngineHealth>(),
        part::<shown_paths::ShownPath>(),
        part::<numbers::SourcePath>(),
        of::<numbers::SourceNumbers>(),
        of::<playback::PlayOptions>(),
        of::<playback::Playback>(),
        of::<sound::RenderInfo>(),
        of::<sound::OutputInfo>(),
    ]
}
