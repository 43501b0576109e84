//! Errors of the control side. The audio side never fails: it reports.

use std::path::PathBuf;

/// What went wrong on the control side, where, and what to do about it.
///
/// The text is one line and names the file and place, so that a command line may print it as it is.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be opened, read or written.
    #[error("{}: {reason}; {advice}", path.display())]
    File {
        /// The file that was named.
        path: PathBuf,
        /// What the system said.
        reason: String,
        /// What to do.
        advice: String,
    },
    /// A file's content is not what it should be.
    #[error("{}{}: {problem}; {advice}", path.display(), line.map(|l| format!(":{l}")).unwrap_or_default())]
    Format {
        /// The file that was read.
        path: PathBuf,
        /// The line counted from one, where the format has lines and the place is known.
        line: Option<usize>,
        /// What is wrong there.
        problem: String,
        /// What to do.
        advice: String,
    },
    /// Geometry that no scene can be made of.
    #[error("mesh: {problem}; {advice}")]
    Mesh {
        /// What is wrong.
        problem: String,
        /// What to do.
        advice: String,
    },
    /// A setting or argument outside its range.
    #[error("{name}: {problem}; {advice}")]
    Setting {
        /// Name of the setting or argument.
        name: String,
        /// What is wrong with the value.
        problem: String,
        /// What to do.
        advice: String,
    },
    /// A handle of a source that was removed.
    #[error(
        "source {slot}.{generation}: was removed or never added; use the handle of a source that is there"
    )]
    StaleSource {
        /// Its slot.
        slot: usize,
        /// Its generation, which the slot does not have now.
        generation: u16,
    },
    /// A handle of an instance that was removed.
    #[error(
        "instance {slot}.{generation}: was removed or never added; use the handle of an instance that is there"
    )]
    StaleInstance {
        /// Its slot.
        slot: usize,
        /// Its generation, which the slot does not have now.
        generation: u16,
    },
    /// The engine cannot do it in its present state.
    #[error("engine: {problem}; {advice}")]
    Engine {
        /// What stands in the way.
        problem: String,
        /// What to do.
        advice: String,
    },
}

/// Result of the control side.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A file that could not be opened, read or written.
    pub fn file(path: impl Into<PathBuf>, reason: impl ToString, advice: &str) -> Self {
        Self::File {
            path: path.into(),
            reason: reason.to_string(),
            advice: advice.into(),
        }
    }

    /// A file whose content is wrong, with the line if it is known.
    pub fn format(
        path: impl Into<PathBuf>,
        line: Option<usize>,
        problem: impl ToString,
        advice: &str,
    ) -> Self {
        Self::Format {
            path: path.into(),
            line,
            problem: problem.to_string(),
            advice: advice.into(),
        }
    }

    /// Geometry that no scene can be made of.
    pub fn mesh(problem: impl ToString, advice: &str) -> Self {
        Self::Mesh {
            problem: problem.to_string(),
            advice: advice.into(),
        }
    }

    /// Something the engine cannot do now.
    pub fn engine(problem: impl ToString, advice: &str) -> Self {
        Self::Engine {
            problem: problem.to_string(),
            advice: advice.into(),
        }
    }

    /// A setting or argument outside its range.
    pub fn setting(name: &str, problem: impl ToString, advice: &str) -> Self {
        Self::Setting {
            name: name.into(),
            problem: problem.to_string(),
            advice: advice.into(),
        }
    }
}
