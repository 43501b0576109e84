//! The laws: propagation against closed forms, standards and independent oracles. One file a law; every figure has a
//! bound.

pub mod air;
mod continuity;
mod corner;
pub mod decay;
pub mod doorway;
pub mod doppler;
pub mod edge;
pub(crate) mod edge_scene;
mod flush;
mod free_field;
mod invariance;
pub mod joining;
mod late;
pub mod late_figures;
mod late_level;
mod late_particles;
pub mod late_reference;
mod late_rooms;
mod late_sound;
mod leak;
mod mesh;
mod mesh_chunks;
mod mesh_curved;
mod mesh_rooms;
pub mod random_late;
mod random_rooms;
pub mod recall;
mod recall_rooms;
pub mod reciprocity;
mod rims;
pub mod rooms;
pub mod shoebox;
mod solids;
mod thick;
pub mod thread_count;
pub mod transmission;
pub mod wave_cases;
#[path = "oracles/wedge.rs"]
#[expect(unreachable_pub, reason = "the oracle is a file of the tests")]
pub(crate) mod wedge;

use foresound::error::{Error, Result};

/// One measured figure of a law.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The law, and behind a colon the case.
    pub law: String,
    /// The measured quantity.
    pub figure: f64,
    /// The bound.
    pub bound: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Whether the figure is within the bound.
    pub pass: bool,
}

impl Row {
    /// A figure that may not exceed its bound.
    pub fn at_most(law: impl Into<String>, figure: f64, bound: f64, unit: &'static str) -> Self {
        Self::new(law.into(), figure, bound, unit, figure <= bound)
    }

    /// A figure that must reach its bound.
    pub fn at_least(law: impl Into<String>, figure: f64, bound: f64, unit: &'static str) -> Self {
        Self::new(law.into(), figure, bound, unit, figure >= bound)
    }

    fn new(law: String, figure: f64, bound: f64, unit: &'static str, pass: bool) -> Self {
        Self {
            law,
            figure,
            bound,
            unit,
            pass,
        }
    }
}

/// Rows of one case: its name, a comma and the measured quantity.
struct Case {
    name: String,
    rows: Vec<Row>,
}

impl Case {
    fn new(name: String) -> Self {
        Self {
            name,
            rows: Vec::new(),
        }
    }

    fn at_most(&mut self, what: &str, figure: f64, bound: f64, unit: &'static str) {
        let law = format!("{}, {what}", self.name);
        self.rows.push(Row::at_most(law, figure, bound, unit));
    }

    fn at_least(&mut self, what: &str, figure: f64, bound: f64, unit: &'static str) {
        let law = format!("{}, {what}", self.name);
        self.rows.push(Row::at_least(law, figure, bound, unit));
    }
}

type Law = fn() -> Result<Vec<Row>>;

/// The laws by name.
const LAWS: [(&str, Law); 30] = [
    ("shoebox", shoebox::rows),
    ("recall", recall::rows),
    ("decay", decay::rows),
    ("joining", joining::rows),
    ("reciprocity", reciprocity::rows),
    ("air", air::rows),
    ("doppler", doppler::rows),
    ("edge", edge::rows),
    ("doorway", doorway::rows),
    ("flush", flush::rows),
    ("thick", thick::rows),
    ("invariance", invariance::rows),
    ("leak", leak::rows),
    ("rims", rims::rows),
    ("corner", corner::rows),
    ("continuity", continuity::rows),
    ("transmission", transmission::rows),
    ("late/density", late_sound::density),
    ("late/colour", late_sound::colour),
    ("late/coherence", late_sound::coherence),
    ("late/level", late_level::level),
    ("partition", late::partition),
    ("late/slopes", late::slopes),
    ("late/direction", late::direction),
    ("late/independence", late::independence),
    ("late/steady", late::steady),
    ("thread count", thread_count::rows),
    ("mesh", mesh::rows),
    ("mesh/curved", mesh_curved::rows),
    ("mesh/chunks", mesh_chunks::rows),
];

/// Names of all laws.
pub fn law_names() -> Vec<&'static str> {
    LAWS.iter().map(|(name, _)| *name).collect()
}

/// Measures one law.
///
/// # Errors
/// [`Error::Setting`] if there is no such law.
pub fn measure(law: &str) -> Result<Vec<Row>> {
    match LAWS.iter().find(|(name, _)| *name == law) {
        Some((_, measure)) => measure(),
        None => {
            let known = law_names().join(", ");
            Err(Error::setting(
                "--law",
                format!("no law is called {law:?}"),
                &format!("choose of: {known}"),
            ))
        }
    }
}
