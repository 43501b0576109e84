//! What is to be rendered and compared: units of one reference and its estimates, with names for their results.

use foresound::evaluation::cells::{self, Pace, Platform, SCENES, SOURCE_COUNTS};
use foresound::extrapolation::{BestSettings, Lead, PredictorKind};
use foresound::runtime::Latency;
use foresound::{Error, Result};

use super::Arguments;

/// Repeats of a cell, each with rays and a start of its own.
const REPEATS: u64 = 5;

/// A predictor under a name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Variant {
    pub(super) name: &'static str,
    pub(super) kind: PredictorKind,
}

/// One reference rendering and what is compared with it.
#[derive(Debug, Clone)]
pub(super) struct Unit {
    pub(super) platform: Platform,
    pub(super) scene: String,
    pub(super) sources: usize,
    pub(super) dynamic: bool,
    pub(super) pace: Pace,
    pub(super) repeat: u64,
    pub(super) latency: Latency,
    pub(super) signal: String,
    pub(super) duration_s: f64,
    pub(super) variants: Vec<Variant>,
}

impl Unit {
    /// What a folder's or file's name begins with, alike for all repeats.
    pub(super) fn cell_name(&self) -> String {
        let latency = match self.latency {
            Latency::Modelled => "",
            Latency::None => "-at-once",
        };
        let signal = match self.signal.as_str() {
            "speech" => String::new(),
            other => format!("-{other}"),
        };
        format!(
            "{}-{}-{}-{}{latency}{signal}",
            self.platform.name(),
            self.scene,
            self.condition(),
            self.sources
        )
    }

    pub(super) fn condition(&self) -> &'static str {
        if self.dynamic { "dynamic" } else { "static" }
    }

    /// Everything a result depends on besides the program and the scene's file.
    pub(super) fn key(&self) -> String {
        let variants: Vec<_> = self
            .variants
            .iter()
            .map(|v| format!("{}={:?}", v.name, v.kind))
            .collect();
        format!(
            "{} {:?} repeat {} of {} s with {}",
            self.cell_name(),
            self.pace,
            self.repeat,
            self.duration_s,
            variants.join(",")
        )
    }
}

/// All units of a command line, cell by cell.
pub(super) fn units(arguments: &Arguments) -> Result<Vec<Unit>> {
    let chosen = |text: &str, names: [&str; 2]| -> Option<Vec<bool>> {
        match text {
            "both" => Some(vec![false, true]),
            one => Some(vec![names.iter().position(|n| *n == one)? == 1]),
        }
    };
    let wrong = |argument: &str, text: &str, advice: &str| {
        Error::setting(argument, format!("{text:?} is unknown"), advice)
    };
    let platforms = chosen(&arguments.platform, ["workstation", "mobile"]).ok_or_else(|| {
        wrong(
            "--platform",
            &arguments.platform,
            "give workstation, mobile or both",
        )
    })?;
    let conditions = chosen(&arguments.condition, ["static", "dynamic"]).ok_or_else(|| {
        wrong(
            "--condition",
            &arguments.condition,
            "give static, dynamic or both",
        )
    })?;
    let latency = match arguments.latency.as_str() {
        "modelled" => Latency::Modelled,
        "none" => Latency::None,
        other => return Err(wrong("--latency", other, "give modelled or none")),
    };
    let scenes = match &arguments.scene {
        Some(scene) => vec![scene.clone()],
        None => SCENES.map(str::to_owned).to_vec(),
    };
    let counts = match (arguments.sources, arguments.quick) {
        (Some(count @ 1..=16), _) => vec![count],
        (Some(count), _) => {
            let problem = format!("{count} sources");
            return Err(Error::setting("--sources", problem, "give 1 to 16"));
        }
        (None, true) => vec![4],
        (None, false) => SOURCE_COUNTS.to_vec(),
    };
    let repeats = arguments
        .repeats
        .unwrap_or(if arguments.quick { 1 } else { REPEATS });
    let variants = variants(&arguments.predictor)?;
    let mut units = Vec::new();
    for mobile in platforms {
        for &dynamic in &conditions {
            if arguments.quick && (mobile || !dynamic) && arguments.is_default_choice() {
                continue;
            }
            for scene in &scenes {
                for &sources in &counts {
                    let platform = Platform::ALL[usize::from(mobile)];
                    units.extend((0..repeats).map(|repeat| Unit {
                        platform,
                        scene: scene.clone(),
                        sources,
                        dynamic,
                        pace: cells::pace(platform, scene, sources),
                        repeat,
                        latency,
                        signal: arguments.signal.clone(),
                        duration_s: arguments.seconds,
                        variants: variants.clone(),
                    }));
                }
            }
        }
    }
    Ok(units)
}

/// Ablation: `best` without one ingredient each, with geometry alone, and with more rays.
const ABLATION: [(&str, BestSettings); 8] = [
    (
        "best-without-geometry",
        BestSettings {
            exact_geometry: false,
            ..BestSettings::FULL
        },
    ),
    (
        "best-without-dropping",
        BestSettings {
            drop_outside: false,
            ..BestSettings::FULL
        },
    ),
    (
        "best-without-rays",
        BestSettings {
            rays_per_source: 0,
            ..BestSettings::FULL
        },
    ),
    (
        "best-without-memory",
        BestSettings {
            remembered_updates: 0,
            ..BestSettings::FULL
        },
    ),
    (
        "best-without-lead",
        BestSettings {
            lead: Lead::None,
            ..BestSettings::FULL
        },
    ),
    (
        "best-lead-to-arrival",
        BestSettings {
            lead: Lead::Arrival,
            ..BestSettings::FULL
        },
    ),
    (
        "best-geometry-alone",
        BestSettings {
            rays_per_source: 0,
            remembered_updates: 0,
            exact_geometry: true,
            drop_outside: false,
            lead: Lead::None,
        },
    ),
    (
        "best-four-times-the-rays",
        BestSettings {
            rays_per_source: 256,
            ..BestSettings::FULL
        },
    ),
];

fn variants(named: &str) -> Result<Vec<Variant>> {
    let plain = PredictorKind::ALL.map(|kind| Variant {
        name: kind.name(),
        kind,
    });
    match named {
        "all" => Ok(plain.to_vec()),
        "ablation" => {
            let without = ABLATION.map(|(name, settings)| Variant {
                name,
                kind: PredictorKind::Best(settings),
            });
            Ok(plain.into_iter().chain(without).collect())
        }
        one => {
            let found = plain.into_iter().find(|variant| variant.name == one);
            let advice = "give hold, linear, best, all or ablation";
            found.map(|variant| vec![variant]).ok_or_else(|| {
                Error::setting("--predictor", format!("{one:?} is no predictor"), advice)
            })
        }
    }
}
