//! `best` with one ingredient alone, and with all but one.

use foresound::extrapolation::{GeometricSettings, PredictionTarget, PredictorKind};

use super::plan::Variant;

/// `best` without any of its ingredients.
const NOTHING: GeometricSettings = GeometricSettings {
    rays_per_source: 0,
    remembered_updates: 0,
    exact_geometry: false,
    drop_outside: false,
    nearby: false,
    lead: PredictionTarget::None,
    exact_every: 1,
};

const FULL: GeometricSettings = GeometricSettings::FULL;

/// Names and settings.
const ABLATION: [(&str, GeometricSettings); 15] = [
    (
        "best-geometry-alone",
        GeometricSettings {
            exact_geometry: true,
            ..NOTHING
        },
    ),
    (
        "best-dropping-alone",
        GeometricSettings {
            drop_outside: true,
            ..NOTHING
        },
    ),
    (
        "best-rays-alone",
        GeometricSettings {
            rays_per_source: FULL.rays_per_source,
            ..NOTHING
        },
    ),
    (
        "best-memory-alone",
        GeometricSettings {
            remembered_updates: FULL.remembered_updates,
            ..NOTHING
        },
    ),
    (
        "best-lead-alone",
        GeometricSettings {
            lead: FULL.lead,
            ..NOTHING
        },
    ),
    (
        "best-nearby-alone",
        GeometricSettings {
            nearby: true,
            ..NOTHING
        },
    ),
    ("best-nothing", NOTHING),
    (
        "best-without-geometry",
        GeometricSettings {
            exact_geometry: false,
            ..FULL
        },
    ),
    (
        "best-without-dropping",
        GeometricSettings {
            drop_outside: false,
            ..FULL
        },
    ),
    (
        "best-without-rays",
        GeometricSettings {
            rays_per_source: 0,
            ..FULL
        },
    ),
    (
        "best-without-memory",
        GeometricSettings {
            remembered_updates: 0,
            ..FULL
        },
    ),
    (
        "best-without-nearby",
        GeometricSettings {
            nearby: false,
            ..FULL
        },
    ),
    (
        "best-without-lead",
        GeometricSettings {
            lead: PredictionTarget::None,
            ..FULL
        },
    ),
    (
        "best-lead-to-arrival",
        GeometricSettings {
            lead: PredictionTarget::Arrival,
            ..FULL
        },
    ),
    (
        "best-four-times-the-rays",
        GeometricSettings {
            rays_per_source: 4 * FULL.rays_per_source,
            ..FULL
        },
    ),
];

/// All of them.
pub(super) fn variants() -> Vec<Variant> {
    let variant = |(name, settings)| Variant {
        name,
        kind: PredictorKind::Geometric(settings),
    };
    ABLATION.into_iter().map(variant).collect()
}
