//! Sections of the system's trace (ATrace) around propagation updates. Propagation side: `ndk` allocates for the name.

/// Begins a section, which ends when dropped; `None` unless tracing is on.
#[cfg(target_os = "android")]
pub(crate) fn section(name: &str) -> Option<ndk::trace::Section> {
    let is_traced = ndk::trace::is_trace_enabled();
    is_traced
        .then(|| ndk::trace::Section::new(name).ok())
        .flatten()
}

/// This system has no such trace.
#[cfg(not(target_os = "android"))]
pub(crate) fn section(_name: &str) -> Option<()> {
    None
}
