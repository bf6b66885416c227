//! What can be wrong with a file: one line that names the file, the place in it, the problem and the cure.

use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

/// Why a scene, a shot or an image could not be read or written. `Display` is always a single line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The operating system refused. Cure: the path, its rights, or space on the disk.
    #[error("{}: cannot {action}: {}", line_of_path(.file), io_line(.source))]
    Io {
        /// The file.
        file: PathBuf,
        /// What was tried, as a verb: `read`, `write`.
        action: &'static str,
        /// The system's own error.
        source: io::Error,
    },
    /// The content breaks its format or a rule of the model. Cure: in the message.
    #[error("{}: {}", line_of_path(.file), .fault)]
    Invalid {
        /// The file.
        file: PathBuf,
        /// Place, problem and cure.
        fault: Fault,
    },
    /// The content is legal, but Scatter does not read it. Cure: in the message, usually another export setting.
    #[error("{}: {}", line_of_path(.file), .fault)]
    Unsupported {
        /// The file.
        file: PathBuf,
        /// Place, problem and cure.
        fault: Fault,
    },
    /// The content asks for more memory than the documented limits allow. Cure: in the message.
    #[error("{}: {}", line_of_path(.file), .fault)]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// Place, problem and cure.
        fault: Fault,
    },
}

/// One thing that is wrong inside of a file: `place: problem; cure`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    kind: FaultKind,
    place: String,
    problem: String,
    cure: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FaultKind {
    Invalid,
    Unsupported,
    TooLarge,
}

/// What the readers inside of this crate return: the file's name is added at the door.
pub(crate) type Checked<T> = Result<T, Fault>;

impl SceneError {
    /// The file that the error is about.
    pub fn file(&self) -> &Path {
        match self {
            Self::Io { file, .. }
            | Self::Invalid { file, .. }
            | Self::Unsupported { file, .. }
            | Self::TooLarge { file, .. } => file,
        }
    }

    pub(crate) fn read(file: &Path, source: io::Error) -> Self {
        Self::Io { file: file.to_path_buf(), action: "read", source }
    }

    pub(crate) fn write(file: &Path, source: io::Error) -> Self {
        Self::Io { file: file.to_path_buf(), action: "write", source }
    }
}

impl Fault {
    /// Content that breaks its format. An empty `place` means the file as a whole.
    pub(crate) fn invalid(
        place: impl Into<String>,
        problem: impl Into<String>,
        cure: impl Into<String>,
    ) -> Self {
        Self { kind: FaultKind::Invalid, place: place.into(), problem: problem.into(), cure: cure.into() }
    }

    /// Legal content that is not read.
    pub(crate) fn unsupported(
        place: impl Into<String>,
        problem: impl Into<String>,
        cure: impl Into<String>,
    ) -> Self {
        Self { kind: FaultKind::Unsupported, ..Self::invalid(place, problem, cure) }
    }

    /// Content beyond a documented limit.
    pub(crate) fn too_large(
        place: impl Into<String>,
        problem: impl Into<String>,
        cure: impl Into<String>,
    ) -> Self {
        Self { kind: FaultKind::TooLarge, ..Self::invalid(place, problem, cure) }
    }

    /// The same fault, at a place that only the caller knows.
    pub(crate) fn at(self, place: impl Into<String>) -> Self {
        Self { place: place.into(), ..self }
    }

    /// The place within the file: a line, a key, an array element. Empty: the file as a whole.
    pub fn place(&self) -> &str {
        &self.place
    }

    pub(crate) fn in_file(self, file: &Path) -> SceneError {
        let file = file.to_path_buf();
        match self.kind {
            FaultKind::Invalid => SceneError::Invalid { file, fault: self },
            FaultKind::Unsupported => SceneError::Unsupported { file, fault: self },
            FaultKind::TooLarge => SceneError::TooLarge { file, fault: self },
        }
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if !self.place.is_empty() {
            write!(f, "{}: ", one_line(&self.place))?;
        }
        write!(f, "{}; {}", one_line(&self.problem), one_line(&self.cure))
    }
}

/// Text from a file as a piece of one message: control characters escaped, cut at 240 characters (longer ones
/// would push the cure off a terminal).
pub(crate) fn one_line(text: &str) -> String {
    const MAX_CHARS: usize = 240;
    let mut line = String::with_capacity(text.len().min(4 * MAX_CHARS));
    for (count, c) in text.trim().chars().enumerate() {
        if count == MAX_CHARS {
            line.push('…');
            break;
        }
        // U+2028 and U+2029 break lines in many viewers and are no control characters.
        if c.is_control() || c == '\u{2028}' || c == '\u{2029}' {
            // Writing to a String cannot fail.
            let _ = write!(line, "{}", c.escape_default());
        } else {
            line.push(c);
        }
    }
    line
}

fn line_of_path(path: &Path) -> String {
    // Not cut: a path that is cut names nothing.
    path.display().to_string().chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

fn io_line(error: &io::Error) -> String {
    let cure = match error.kind() {
        io::ErrorKind::NotFound => "check the path",
        io::ErrorKind::PermissionDenied => "check the rights of the file and its folder",
        io::ErrorKind::IsADirectory => "name a file, not a folder",
        io::ErrorKind::StorageFull => "free space on the disk",
        _ => "check the path, its rights and the disk",
    };
    format!("{}; {cure}", one_line(&error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_one_line_even_if_file_and_content_have_line_breaks() {
        let error =
            Fault::invalid("node \"a\nb\"", "bad\r\n\u{2028}thing", "fix\tit").in_file("x\ny.glb".as_ref());
        let message = error.to_string();
        assert!(!message.contains(['\n', '\r', '\u{2028}']), "{message}");
        assert_eq!(message, "x\u{fffd}y.glb: node \"a\\nb\": bad\\r\\n\\u{2028}thing; fix\\tit");
    }

    #[test]
    fn a_long_text_from_the_file_does_not_hide_the_cure() {
        let message = Fault::invalid("", "x".repeat(10_000), "shorten it").to_string();
        assert!(message.len() < 300 && message.ends_with("…; shorten it"), "{message}");
    }

    #[test]
    fn a_missing_file_says_so_with_its_cure() {
        let error = SceneError::read("no/such.obj".as_ref(), io::Error::from(io::ErrorKind::NotFound));
        assert_eq!(error.to_string(), "no/such.obj: cannot read: entity not found; check the path");
    }
}
