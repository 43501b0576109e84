//! Sections of the system's own trace (ATrace) around propagation updates, where the platform has one.
//!
//! Propagation side only: `ndk` copies a section's name, so the audio side stays away from it.

/// Begins a section that ends when it is dropped; none unless somebody is tracing.
#[cfg(target_os = "android")]
pub(crate) fn section(name: &str) -> Option<ndk::trace::Section> {
    let is_traced = ndk::trace::is_trace_enabled();
    is_traced
        .then(|| ndk::trace::Section::new(name).ok())
        .flatten()
}

/// No such trace here.
#[cfg(not(target_os = "android"))]
pub(crate) fn section(_name: &str) -> Option<()> {
    None
}
