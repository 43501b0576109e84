//! The predictor `best` with one of its settings changed.

use foresound::extrapolation::{GeometricSettings, PredictionTarget, PredictorKind};

use super::plan::Variant;

const FULL: GeometricSettings = GeometricSettings::FULL;

/// Names and settings.
const ABLATION: [(&str, GeometricSettings); 5] = [
    (
        "best-without-rays",
        GeometricSettings {
            rays_per_source: 0,
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
        "best-without-prediction",
        GeometricSettings {
            prediction_target: PredictionTarget::None,
            ..FULL
        },
    ),
    (
        "best-prediction-to-arrival",
        GeometricSettings {
            prediction_target: PredictionTarget::Arrival,
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
