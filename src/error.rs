//! Errors of the control side. The audio side never fails; it returns reports.

use std::error::Error as StdError;
use std::path::PathBuf;
use std::sync::Arc;

/// The cause of an [`Error::File`]: an error of the system or a library, or a text. Clones share it.
#[derive(Debug, Clone, thiserror::Error)]
#[error(transparent)]
pub struct Cause(Arc<dyn StdError + Send + Sync>);

impl PartialEq for Cause {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

/// An error of the control side: what is wrong, where, and how to fix it. The text is one line; ERRORS.md lists them.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be opened, read or written.
    #[error("{}: {source}; {advice}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The cause, also by [`std::error::Error::source`].
        source: Cause,
        /// What to do.
        advice: String,
    },
    /// The content of a file is invalid.
    #[error("{}{}: {problem}; {advice}", path.display(), line.map(|l| format!(":{l}")).unwrap_or_default())]
    Format {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1, if known.
        line: Option<usize>,
        /// What is wrong.
        problem: String,
        /// What to do.
        advice: String,
    },
    /// Geometry that cannot become a scene.
    #[error("mesh: {problem}; {advice}")]
    Mesh {
        /// What is wrong.
        problem: String,
        /// What to do.
        advice: String,
    },
    /// A setting or argument is outside its range.
    #[error("{name}: {problem}; {advice}")]
    Setting {
        /// Name of the setting or argument.
        name: String,
        /// What is wrong with the value.
        problem: String,
        /// What to do.
        advice: String,
    },
    /// A handle refers to a removed source.
    #[error(
        "source {slot}.{generation}: was removed or never added; use the handle of a source that is there"
    )]
    StaleSource {
        /// Slot of the handle.
        slot: usize,
        /// Generation of the handle, different from the slot's.
        generation: u32,
    },
    /// A handle refers to a removed instance.
    #[error(
        "instance {slot}.{generation}: was removed or never added; use the handle of an instance that is there"
    )]
    StaleInstance {
        /// Slot of the handle.
        slot: usize,
        /// Generation of the handle, different from the slot's.
        generation: u16,
    },
    /// An observer ended the construction of a scene.
    #[error("the construction was cancelled; build the scene again if it is wanted")]
    Cancelled,
    /// The engine cannot do it in its current state.
    #[error("engine: {problem}; {advice}")]
    Engine {
        /// The obstacle.
        problem: String,
        /// What to do.
        advice: String,
    },
}

/// Result of the control side.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// [`Self::File`].
    pub fn file(
        path: impl Into<PathBuf>,
        cause: impl Into<Box<dyn StdError + Send + Sync>>,
        advice: &str,
    ) -> Self {
        Self::File {
            path: path.into(),
            source: Cause(Arc::from(cause.into())),
            advice: advice.into(),
        }
    }

    /// [`Self::Format`].
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

    /// [`Self::Mesh`].
    pub fn mesh(problem: impl ToString, advice: &str) -> Self {
        Self::Mesh {
            problem: problem.to_string(),
            advice: advice.into(),
        }
    }

    /// [`Self::Engine`].
    pub fn engine(problem: impl ToString, advice: &str) -> Self {
        Self::Engine {
            problem: problem.to_string(),
            advice: advice.into(),
        }
    }

    /// [`Self::Setting`].
    pub fn setting(name: &str, problem: impl ToString, advice: &str) -> Self {
        Self::Setting {
            name: name.into(),
            problem: problem.to_string(),
            advice: advice.into(),
        }
    }
}
