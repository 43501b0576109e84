//! `best` with one ingredient alone, and with all but one.

use foresound::extrapolation::{BestSettings, Lead, PredictorKind};

use super::plan::Variant;

/// `best` without any of its ingredients.
const NOTHING: BestSettings = BestSettings {
    rays_per_source: 0,
    remembered_updates: 0,
    exact_geometry: false,
    drop_outside: false,
    nearby: false,
    lead: Lead::None,
    exact_every: 1,
};

const FULL: BestSettings = BestSettings::FULL;

/// Names and settings.
const ABLATION: [(&str, BestSettings); 15] = [
    (
        "best-geometry-alone",
        BestSettings {
            exact_geometry: true,
            ..NOTHING
        },
    ),
    (
        "best-dropping-alone",
        BestSettings {
            drop_outside: true,
            ..NOTHING
        },
    ),
    (
        "best-rays-alone",
        BestSettings {
            rays_per_source: FULL.rays_per_source,
            ..NOTHING
        },
    ),
    (
        "best-memory-alone",
        BestSettings {
            remembered_updates: FULL.remembered_updates,
            ..NOTHING
        },
    ),
    (
        "best-lead-alone",
        BestSettings {
            lead: FULL.lead,
            ..NOTHING
        },
    ),
    (
        "best-nearby-alone",
        BestSettings {
            nearby: true,
            ..NOTHING
        },
    ),
    ("best-nothing", NOTHING),
    (
        "best-without-geometry",
        BestSettings {
            exact_geometry: false,
            ..FULL
        },
    ),
    (
        "best-without-dropping",
        BestSettings {
            drop_outside: false,
            ..FULL
        },
    ),
    (
        "best-without-rays",
        BestSettings {
            rays_per_source: 0,
            ..FULL
        },
    ),
    (
        "best-without-memory",
        BestSettings {
            remembered_updates: 0,
            ..FULL
        },
    ),
    (
        "best-without-nearby",
        BestSettings {
            nearby: false,
            ..FULL
        },
    ),
    (
        "best-without-lead",
        BestSettings {
            lead: Lead::None,
            ..FULL
        },
    ),
    (
        "best-lead-to-arrival",
        BestSettings {
            lead: Lead::Arrival,
            ..FULL
        },
    ),
    (
        "best-four-times-the-rays",
        BestSettings {
            rays_per_source: 4 * FULL.rays_per_source,
            ..FULL
        },
    ),
];

/// All of them.
pub(super) fn variants() -> Vec<Variant> {
    let variant = |(name, settings)| Variant {
        name,
        kind: PredictorKind::Best(settings),
    };
    ABLATION.into_iter().map(variant).collect()
}
