//! The small TOML file with what `calibrate` measured.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use scatter::{Machine, TechniqueSpeed};
use scatter_scene::write_atomically;
use serde::{Deserialize, Serialize};

/// The file's name in the user's config folder.
const FILE: &str = "scatter-machine.toml";

/// What the file says.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    /// What the machine is called.
    name: String,
    /// A technique each.
    technique: Vec<Entry>,
}

/// One technique.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    /// Its id.
    id: String,
    /// Its time over what the built-in constants predict.
    slowness: f64,
    /// What each further thread adds, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    thread_gain: Option<f64>,
}

/// Where `calibrate` writes to by itself.
pub fn default_path() -> anyhow::Result<PathBuf> {
    let folders = directories::ProjectDirs::from("", "", "scatter")
        .context("--machine: this user has no config folder; name a file with --machine FILE")?;
    Ok(folders.config_dir().join(FILE))
}

/// The machine of that file; of the default one where none is named; the built-in one where there is no default file.
pub fn machine_of(file: Option<&Path>) -> anyhow::Result<Machine> {
    match file {
        Some(path) => read(path),
        None => match default_path() {
            Ok(path) if path.exists() => read(&path),
            _ => Ok(Machine::built_in()),
        },
    }
}

/// Reads a file; an error names it, the place and the cure.
pub fn read(path: &Path) -> anyhow::Result<Machine> {
    let place = || format!("{}: no machine file; run cargo xtask calibrate --machine FILE", path.display());
    let text = std::fs::read_to_string(path).with_context(place)?;
    parse(&text).with_context(|| format!("{}; run cargo xtask calibrate anew", path.display()))
}

fn parse(text: &str) -> anyhow::Result<Machine> {
    let document: Document = toml::from_str(text)?;
    let mut speeds: Vec<TechniqueSpeed> = Vec::new();
    for entry in document.technique {
        let Entry { id, slowness, thread_gain } = entry;
        if !(slowness.is_finite() && slowness > 0.0) {
            bail!("technique {id}: slowness is {slowness}, and must be a finite number above 0");
        }
        if let Some(gain) = thread_gain
            && !(0.0..=1.0).contains(&gain)
        {
            bail!("technique {id}: thread_gain is {gain}, and must be from 0 to 1");
        }
        if speeds.iter().any(|other| other.id == id) {
            bail!("technique {id} is there twice");
        }
        speeds.push(TechniqueSpeed { id, slowness, thread_gain });
    }
    Ok(Machine::measured(document.name, speeds))
}

/// Writes a machine: the whole file, or nothing.
pub fn write(path: &Path, machine: &Machine) -> anyhow::Result<()> {
    let entry = |speed: &TechniqueSpeed| Entry {
        id: speed.id.clone(),
        slowness: speed.slowness,
        thread_gain: speed.thread_gain,
    };
    let document = Document {
        name: machine.name().to_string(),
        technique: machine.speeds().iter().map(entry).collect(),
    };
    let text = toml::to_string_pretty(&document).context("machine file")?;
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).with_context(|| {
            format!("{}: the folder cannot be made; name another with --machine", folder.display())
        })?;
    }
    write_atomically(path, |file| file.write_all(text.as_bytes()))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/machine.toml");
        let speed = |id: &str, slowness, thread_gain| TechniqueSpeed { id: id.into(), slowness, thread_gain };
        let machine = Machine::measured(
            "here",
            vec![speed("raymarch", 1.25, Some(0.5)), speed("epipolar", 0.75, None)],
        );
        write(&path, &machine).unwrap();
        assert_eq!(read(&path).unwrap(), machine);
        assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn damaged_files_are_errors_that_say_where() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("machine.toml");
        let message = |text: &str| {
            std::fs::write(&path, text).unwrap();
            let error = read(&path).unwrap_err();
            error.chain().map(ToString::to_string).collect::<Vec<_>>().join(": ")
        };
        let entry = |line: &str| format!("name = \"m\"\n[[technique]]\nid = \"raymarch\"\n{line}\n");
        for (text, word) in [
            ("name = ".to_string(), "line 1"),
            ("technique = []".into(), "name"),
            (entry("slowness = 0.0"), "slowness is 0"),
            (entry("slowness = nan"), "slowness is NaN"),
            (entry("slowness = 1.0\nthread_gain = 2.0"), "thread_gain is 2"),
            (entry("slowness = 1.0\nspeed = 3"), "speed"),
            (entry("slowness = 1.0") + "[[technique]]\nid = \"raymarch\"\nslowness = 1.0", "twice"),
        ] {
            let message = message(&text);
            assert!(message.contains("machine.toml") && message.contains(word), "{text}: {message}");
            assert!(message.contains("calibrate"), "{message}");
        }
        let missing = read(&folder.path().join("none.toml")).unwrap_err().to_string();
        assert!(missing.contains("none.toml") && missing.contains("calibrate"), "{missing}");
    }
}
