//! The work of a command line: units of one reference and its estimates.

use foresound::extrapolation::PredictorKind;
use foresound::runtime::Latency;
use foresound::{Error, Result};
use foresound_tools::cells::{self, Condition, Platform, RendererKind, SCENES, SOURCE_COUNTS};
use foresound_tools::paper;

use super::Arguments;
use crate::laid_out::scene_label;

/// Repeats of a cell, each with its own ray seed and start of the walk.
const REPEATS: u64 = 5;

/// The scene of the paper's Figure 7.
const DOORWAY: &str = "doorway";

/// Part of the report that a unit belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// The tables.
    Table,
    /// The doorway's section.
    Doorway,
}

/// One reference rendering and the estimates compared with it.
#[derive(Debug, Clone)]
pub(super) struct Unit {
    pub(super) part: Part,
    pub(super) renderer: RendererKind,
    pub(super) platform: Platform,
    /// The scene's label, valid in file names.
    pub(super) scene: String,
    pub(super) sources: usize,
    pub(super) condition: Condition,
    pub(super) pace: paper::Pace,
    pub(super) repeat: u64,
    pub(super) latencies: Vec<Latency>,
    pub(super) signal: String,
    /// Whether the late reverb is rendered.
    pub(super) late: bool,
    pub(super) duration_s: f64,
    /// Each is rendered at each latency.
    pub(super) predictors: Vec<PredictorKind>,
}

impl Unit {
    /// Stem of file names, the same for all repeats.
    pub(super) fn cell_name(&self) -> String {
        let signal = match self.signal.as_str() {
            "speech" => String::new(),
            other => format!("-{other}"),
        };
        let late = if self.late { "" } else { "-no-late" };
        let renderer = match self.renderer {
            RendererKind::Offline => String::new(),
            engine => format!("-{}", engine.name()),
        };
        format!(
            "{}-{}-{}-{}{signal}{late}{renderer}",
            self.platform.name(),
            self.scene,
            self.condition.name(),
            self.sources
        )
    }

    /// All renderings besides the reference.
    pub(super) fn estimates(&self) -> impl Iterator<Item = (PredictorKind, Latency)> + '_ {
        let latencies = self.latencies.iter();
        latencies.flat_map(|&late| self.predictors.iter().map(move |&kind| (kind, late)))
    }

    /// All inputs of a result besides program, scene and sounds.
    pub(super) fn key(&self) -> String {
        let estimates: Vec<_> = self
            .estimates()
            .map(|(kind, late)| format!("{kind:?} {late:?}"))
            .collect();
        format!(
            "{} {:?} repeat {} of {} s with {}",
            self.cell_name(),
            self.pace,
            self.repeat,
            self.duration_s,
            estimates.join(",")
        )
    }

    /// Rough relative cost: propagation grows with the sources and runs in every graphics frame of the reference and in
    /// every (L + 1)th of each estimate.
    pub(super) fn weight(&self) -> u64 {
        let frames = self.duration_s * self.pace.graphics_rate_hz;
        let update = 1.0 + 0.3 * self.sources as f64;
        let estimate = 0.15 + 1.0 / f64::from(self.pace.level + 1);
        let renderings = 1.0 + estimate * self.estimates().count() as f64;
        (frames * update * renderings) as u64
    }
}

/// The choices of a word: one of them, or a group.
fn chosen<T: Copy>(
    argument: &str,
    text: &str,
    single: &[(&str, T)],
    groups: &[(&str, &[T])],
) -> Result<Vec<T>> {
    if let Some((_, one)) = single.iter().find(|(name, _)| *name == text) {
        return Ok(vec![*one]);
    }
    if let Some((_, some)) = groups.iter().find(|(name, _)| *name == text) {
        return Ok(some.to_vec());
    }
    let single = single.iter().map(|(name, _)| *name);
    let names: Vec<_> = single.chain(groups.iter().map(|(name, _)| *name)).collect();
    let advice = format!("give {}", names.join(", "));
    Err(Error::setting(
        argument,
        format!("{text:?} is unknown"),
        &advice,
    ))
}

/// The renderers of `--engine`; the offline one comes first.
fn renderers(engines: &[String]) -> Result<Vec<RendererKind>> {
    use RendererKind::{EngineReal, EngineVirtual, Offline};
    let mut found = vec![Offline];
    for engine in engines {
        let single = [("virtual", EngineVirtual), ("real", EngineReal)];
        found.extend(chosen("--engine", engine, &single, &[])?);
    }
    found.dedup();
    Ok(found)
}

/// All units of a command line, cell by cell.
pub(super) fn units(arguments: &Arguments) -> Result<Vec<Unit>> {
    use Condition::{Dynamic, Static, Stress};
    let is_default = arguments.condition.is_none();
    let platforms = Platform::ALL.map(|platform| (platform.name(), platform));
    let platforms = chosen(
        "--platform",
        arguments.platform.as_deref().unwrap_or("both"),
        &platforms,
        &[("both", &Platform::ALL)],
    )?;
    let conditions = Condition::ALL.map(|condition| (condition.name(), condition));
    let mut conditions = chosen(
        "--condition",
        arguments.condition.as_deref().unwrap_or("usual"),
        &conditions,
        &[
            ("usual", &Condition::USUAL),
            ("both", &[Static, Dynamic]),
            ("unpredicted", &Condition::UNPREDICTED),
            ("all", &Condition::ALL),
        ],
    )?;
    if arguments.stress && !conditions.contains(&Stress) {
        conditions.push(Stress);
    }
    let latencies = chosen(
        "--latency",
        &arguments.latency,
        &[("modelled", Latency::Modelled), ("none", Latency::None)],
        &[("both", &[Latency::Modelled, Latency::None])],
    )?;
    let renderers = renderers(&arguments.engine)?;
    let is_engine = renderers.iter().any(|kind| *kind != RendererKind::Offline);
    if is_engine && latencies.contains(&Latency::None) {
        let problem = "the engine's updates take time";
        return Err(Error::setting(
            "--latency",
            problem,
            "leave it out, or --engine",
        ));
    }
    let signals = ["speech", "music", "percussion"];
    let signals = chosen(
        "--signal",
        &arguments.signal,
        &signals.map(|name| (name, name)),
        &[("all", &signals)],
    )?;
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
    if repeats == 0 {
        return Err(Error::setting("--repeats", "0", "give one at least"));
    }
    let predictors = PredictorKind::ALL.map(|kind| (kind.name(), kind));
    let predictors = chosen(
        "--predictor",
        &arguments.predictor,
        &predictors,
        &[("all", &PredictorKind::ALL)],
    )?;
    let is_any_platform = platforms.len() > 1;
    let unit = |platform, condition: Condition, scene: &str, sources, repeat, signal: &str| {
        let scene = scene_label(scene);
        let mut pace = paper::pace(platform, &scene, sources);
        if condition == Stress {
            pace.level = cells::STRESS_LEVEL;
        }
        if condition.is_unpredicted() && is_any_platform {
            pace = paper::pace(Platform::Workstation, SCENES[0], 16);
        }
        Unit {
            part: Part::Table,
            renderer: RendererKind::Offline,
            platform,
            scene,
            sources,
            condition,
            pace,
            repeat,
            latencies: latencies.clone(),
            signal: signal.to_owned(),
            late: !arguments.no_late,
            duration_s: arguments.seconds,
            predictors: predictors.clone(),
        }
    };
    let mut units = Vec::new();
    for &platform in &platforms {
        for &condition in &conditions {
            let left_out = match condition {
                Static => arguments.quick && is_default && is_any_platform,
                Dynamic => false,
                // Rate and level, or the level, are the same on both platforms.
                _ => platform == Platform::Mobile && is_any_platform,
            };
            let quick_mobile =
                arguments.quick && platform == Platform::Mobile && is_default && is_any_platform;
            if left_out || quick_mobile {
                continue;
            }
            let counts = match (condition.is_unpredicted(), arguments.sources) {
                (true, None) => &[cells::UNPREDICTED_SOURCES][..],
                _ => &counts,
            };
            for scene in &scenes {
                for &sources in counts {
                    for (signal, &renderer) in signals.iter().flat_map(|signal| {
                        let renderers = renderers.iter();
                        renderers.map(move |renderer| (signal, renderer))
                    }) {
                        units.extend((0..repeats).map(|repeat| Unit {
                            renderer,
                            ..unit(platform, condition, scene, sources, repeat, signal)
                        }));
                    }
                }
            }
        }
    }
    let walks = conditions.contains(&Dynamic);
    if arguments.scene.is_none() && walks && signals.contains(&"speech") {
        let platform = platforms[0];
        let pictured = unit(platform, Dynamic, DOORWAY, 4, 0, "speech");
        units.extend(renderers.iter().map(|&renderer| Unit {
            part: Part::Doorway,
            renderer,
            latencies: vec![latencies[0]],
            ..pictured.clone()
        }));
    }
    Ok(units)
}
