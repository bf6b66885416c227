//! What leaves the program: stdout that may be a closed pipe, error lines, files that are whole or absent.

use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use scatter_scene::write_atomically;
use serde::Serialize;

/// Writes text to stdout. A reader who closes the pipe has seen enough: that is no error.
pub fn print(text: &str) -> anyhow::Result<()> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).context("stdout: cannot write"),
        _ => Ok(()),
    }
}

/// Prints one JSON document. Numbers that are not finite become `null`.
pub fn print_json(document: &impl Serialize) -> anyhow::Result<()> {
    let text = serde_json::to_string_pretty(document).context("JSON")?;
    print(&(text + "\n"))
}

/// Prints `error: …` on stderr, always as one line.
pub fn error_line(message: &str) {
    stderr_line(&format!("error: {}", message.split_whitespace().collect::<Vec<_>>().join(" ")));
}

/// Prints a line on stderr, which may be closed.
pub fn stderr_line(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// An error now if a file could not be written at `path` later: nobody wants to learn that after minutes of work.
pub fn check_writable(path: &Path) -> anyhow::Result<()> {
    if path.is_dir() {
        bail!("{}: this is a folder; name a file", path.display());
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        bail!("{}: the folder {} does not exist; make it first", path.display(), folder.display());
    }
    probe(&folder).map_err(|error| anyhow!("{}: cannot write: {error}; name another folder", path.display()))
}

/// As [`check_writable`], for a folder that is made if it does not exist. Nothing is made yet.
pub fn check_folder(folder: &Path) -> anyhow::Result<()> {
    if folder.exists() && !folder.is_dir() {
        bail!("{}: this is a file; name a folder", folder.display());
    }
    let parent = folder_of(folder);
    let existing = if folder.exists() { folder } else { &parent };
    if !existing.is_dir() {
        bail!("{}: the folder {} does not exist; make it first", folder.display(), existing.display());
    }
    probe(existing)
        .map_err(|error| anyhow!("{}: cannot write: {error}; name another folder", folder.display()))
}

/// Writes bytes into a file as a whole or not at all.
#[cfg(feature = "gpu")]
pub fn write_bytes(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    Ok(write_atomically(path, |writer| writer.write_all(bytes))?)
}

/// Writes a text file whole or not at all.
pub fn write_text(path: &Path, text: &str) -> anyhow::Result<()> {
    Ok(write_atomically(path, |writer| writer.write_all(text.as_bytes()))?)
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// Makes an unnamed file, which is gone at once.
fn probe(folder: &Path) -> io::Result<()> {
    tempfile::tempfile_in(folder).map(|_| ())
}
