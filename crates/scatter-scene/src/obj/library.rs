//! Material libraries of OBJ files: which part of a face is there.
//!
//! Source: the MTL appendix of Wavefront's manual. The statements are read by the crate `tobj`, from lines that are
//! chosen and cleaned here: it gives up a whole file for one colour that it cannot read. A face is there where `map_d` is
//! at least a half (its alpha where the image has one, else its red), without `map_d` where the alpha of `map_Kd` is.
//! Done of the options: `-s`, `-o`, `-clamp`, `-mm`, `-imfchan`. Departures, each with a note: `d`, `Tr` and glass
//! (`illum`) count as opaque, `-t` moves nothing, and a mask that cannot be read counts as opaque.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use glam::{DAffine2, DMat2, DVec2};

use super::lines::{each_statement, number, text};
use crate::cutout::{AlphaMask, Wrap};
use crate::error::{Checked, Fault, one_line};
use crate::regular_file::read_file;
use crate::texels::{Texels, decode_texels, has_alpha};
use crate::text::utf8_bytes;

/// Illumination models of glass.
const GLASS: [u8; 4] = [4, 6, 7, 9];

/// Which part of a material's faces is there.
#[derive(Clone, Copy)]
pub(super) enum Coverage {
    Whole,
    Nothing,
    /// A mask, by its index, with the way from the file's texture coordinates to its own.
    Masked {
        mask: u32,
        mask_from_file: DAffine2,
    },
}

/// The materials of all libraries of a file.
#[derive(Default)]
pub(super) struct Library {
    coverages: HashMap<String, Coverage>,
    pub masks: Vec<AlphaMask>,
    pub notes: Vec<String>,
    /// What the file's statements name, each once: exporters repeat it for every object.
    named: BTreeSet<String>,
    unread_colours: BTreeSet<String>,
    unknown: BTreeSet<String>,
}

impl Library {
    /// Reads what one `mtllib` statement names: one file whose name may hold spaces, or several.
    pub(super) fn add(&mut self, folder: &Path, names: &str) {
        if !self.named.insert(names.to_owned()) {
            return;
        }
        let one = found(folder, names);
        let paths: Vec<(&str, Option<PathBuf>)> = match one {
            Some(path) => vec![(names, Some(path))],
            None if names.split_whitespace().any(|name| found(folder, name).is_some()) => {
                names.split_whitespace().map(|name| (name, found(folder, name))).collect()
            }
            None => vec![(names, None)],
        };
        for (name, path) in paths {
            let read = match path {
                Some(path) => self.read(&path),
                None => Err(Fault::invalid("", "there is no such file beside this one", "put it there")),
            };
            if let Err(fault) = read {
                let name = one_line(name);
                self.notes.push(format!(
                    "material library {name} is not read, so that all its materials count as opaque: {fault}"
                ));
            }
        }
    }

    /// The coverage of a material; an unknown one counts as opaque.
    pub(super) fn coverage(&mut self, name: &str) -> Coverage {
        match self.coverages.get(name) {
            Some(&coverage) => coverage,
            None => {
                if !self.named.is_empty() && !name.is_empty() {
                    self.unknown.insert(name.to_owned());
                }
                Coverage::Whole
            }
        }
    }

    /// The notes of all that was read.
    pub(super) fn into_notes(mut self) -> (Vec<AlphaMask>, Vec<String>) {
        let list = |names: &BTreeSet<String>| {
            let shown: Vec<String> = names.iter().take(5).map(|name| one_line(name)).collect();
            let more = if names.len() > 5 { format!(" and {} more", names.len() - 5) } else { String::new() };
            shown.join(", ") + &more
        };
        if !self.unknown.is_empty() && !self.coverages.is_empty() {
            let names = list(&self.unknown);
            self.notes.push(format!("materials that no library has count as opaque: {names}"));
        }
        if !self.unread_colours.is_empty() {
            let names = list(&self.unread_colours);
            self.notes.push(format!(
                "textures that cannot be read, so that any alpha of theirs is not seen: {names}"
            ));
        }
        (self.masks, self.notes)
    }

    fn read(&mut self, path: &Path) -> Checked<()> {
        let bytes = read_file(path)
            .map_err(|error| Fault::invalid("", error.to_string(), "put it beside the OBJ file"))?;
        let text = text(utf8_bytes(&bytes, "as UTF-8")?);
        let folder = path.parent().unwrap_or(Path::new(""));
        let clean = cleaned(&text);
        let (materials, _) = tobj::load_mtl_buf(&mut clean.as_bytes())
            .map_err(|error| Fault::invalid("", error.to_string(), "export the library again"))?;
        for material in materials {
            let coverage = self.read_material(folder, &material);
            self.coverages.insert(material.name, coverage);
        }
        Ok(())
    }

    fn read_material(&mut self, folder: &Path, material: &tobj::Material) -> Coverage {
        let name = format!("material \"{}\"", one_line(&material.name));
        let transparency = material.unknown_param.get("Tr").and_then(|tr| number(tr));
        let opacity = material.dissolve.or(transparency.map(|tr| 1.0 - tr)).unwrap_or(1.0);
        if opacity < 1.0 {
            self.notes.push(format!("{name} lets light through (opacity {opacity}), but counts as opaque"));
        } else if let Some(model) = material.illumination_model.filter(|model| GLASS.contains(model)) {
            self.notes.push(format!("{name} is glass (illum {model}), but counts as opaque"));
        }
        if let Some(map) = &material.dissolve_texture {
            let map = Map::parse(map);
            return match map.texels(folder) {
                Ok(texels) => self.masked(&name, &map, &texels, if texels.has_alpha { 3 } else { 0 }),
                Err(fault) => {
                    self.notes.push(format!("{name} is a cut-out, but counts as opaque: {fault}"));
                    Coverage::Whole
                }
            };
        }
        let Some(map) = material.diffuse_texture.as_deref().map(Map::parse) else { return Coverage::Whole };
        match map.bytes(folder) {
            Ok(bytes) if !has_alpha(&bytes) => Coverage::Whole,
            Ok(bytes) => match decode_texels(&bytes) {
                Ok(texels) => self.masked(&name, &map, &texels, 3),
                Err(_) => self.unread(map.file),
            },
            Err(_) => self.unread(map.file),
        }
    }

    fn unread(&mut self, file: &str) -> Coverage {
        self.unread_colours.insert(file.to_owned());
        Coverage::Whole
    }

    fn masked(&mut self, name: &str, map: &Map<'_>, texels: &Texels, channel: usize) -> Coverage {
        if map.is_turbulent {
            self.notes.push(format!("{name} has a map with -t (turbulence), which is not done"));
        }
        let value = |column, row| match map.channel.unwrap_or(channel) {
            // Luminance, after ITU-R BT.709.
            LUMINANCE => {
                let [r, g, b] = [0, 1, 2].map(|c| texels.channel(c, column, row));
                0.2126 * r + 0.7152 * g + 0.0722 * b
            }
            channel => texels.channel(channel, column, row),
        };
        let is_there = |column, row| map.base + map.gain * value(column, row) >= 0.5;
        match texels.uniform(is_there) {
            Some(true) => Coverage::Whole,
            Some(false) => Coverage::Nothing,
            None => {
                let mask = self.masks.len() as u32;
                let wrap = if map.is_clamped { Wrap::ClampToEdge } else { Wrap::Repeat };
                self.masks.push(AlphaMask::new(texels.size, [wrap; 2], is_there));
                // OBJ's v goes up, a mask's down.
                let flip =
                    DAffine2 { matrix2: DMat2::from_diagonal(DVec2::new(1.0, -1.0)), translation: DVec2::Y };
                let placed = DAffine2 { matrix2: DMat2::from_diagonal(map.scale), translation: map.offset };
                Coverage::Masked { mask, mask_from_file: flip * placed }
            }
        }
    }
}

/// The lines of a library that matter, in the spelling and order that `tobj` reads.
fn cleaned(text: &str) -> String {
    let mut clean = String::new();
    let mut push = |keyword: &str, value: &str| {
        clean.push_str(keyword);
        clean.push(' ');
        clean.push_str(value);
        clean.push('\n');
    };
    let statement = |statement: &str, _| {
        let statement = statement.trim();
        let (keyword, rest) = statement.split_once(char::is_whitespace).unwrap_or((statement, ""));
        let rest = rest.trim();
        if rest.is_empty() {
            return Ok::<(), ()>(());
        }
        // `d -halo 0.5` ends in its number too.
        let last = rest.split_whitespace().last().and_then(number).filter(|v| v.is_finite());
        match (keyword.to_ascii_lowercase().as_str(), last) {
            ("newmtl", _) => push("newmtl", rest),
            ("d", Some(value)) => push("d", &value.to_string()),
            ("tr", Some(value)) => push("Tr", &value.to_string()),
            ("illum", Some(value)) if value == value.trunc() && (0.0..=255.0).contains(&value) => {
                push("illum", &value.to_string());
            }
            ("map_d" | "map_opacity", _) => push("map_d", rest),
            ("map_kd", _) => push("map_Kd", rest),
            _ => {}
        }
        Ok(())
    };
    let _ = each_statement(text, statement);
    clean
}

/// A texture statement: options, then a file's name, which may hold spaces.
struct Map<'a> {
    file: &'a str,
    scale: DVec2,
    offset: DVec2,
    is_clamped: bool,
    is_turbulent: bool,
    base: f64,
    gain: f64,
    channel: Option<usize>,
}

/// The channel number of luminance.
const LUMINANCE: usize = 4;

impl<'a> Map<'a> {
    fn parse(statement: &'a str) -> Self {
        let mut map = Map {
            file: statement.trim(),
            scale: DVec2::ONE,
            offset: DVec2::ZERO,
            is_clamped: false,
            is_turbulent: false,
            base: 0.0,
            gain: 1.0,
            channel: None,
        };
        while map.file.starts_with('-') {
            let (option, rest) = word(map.file);
            // One value at least, so that a file's name that is a number is left alone.
            let least = match option {
                "-o" | "-s" | "-t" => 1,
                "-mm" => 2,
                "-blendu" | "-blendv" | "-cc" | "-clamp" | "-bm" | "-boost" | "-texres" | "-imfchan"
                | "-type" => 1,
                // A file whose name begins with a dash.
                _ => break,
            };
            let most = if matches!(option, "-o" | "-s" | "-t") { 3 } else { least };
            let mut values = Vec::new();
            let mut rest = rest;
            while values.len() < most {
                let (value, after) = word(rest);
                let is_last = after.is_empty();
                if is_last || (values.len() >= least && number(value).is_none()) {
                    break;
                }
                values.push(value);
                rest = after;
            }
            if values.len() < least {
                break;
            }
            map.file = rest;
            let at = |i: usize, default: f64| values.get(i).and_then(|v| number(v)).unwrap_or(default);
            match option {
                "-o" => map.offset = DVec2::new(at(0, 0.0), at(1, 0.0)),
                "-s" => map.scale = DVec2::new(at(0, 1.0), at(1, 1.0)),
                "-t" => map.is_turbulent = (0..3).any(|i| at(i, 0.0) != 0.0),
                "-mm" => (map.base, map.gain) = (at(0, 0.0), at(1, 1.0)),
                "-clamp" => map.is_clamped = values[0].eq_ignore_ascii_case("on"),
                "-imfchan" => {
                    map.channel = match values[0] {
                        "r" => Some(0),
                        "g" => Some(1),
                        "b" => Some(2),
                        "m" => Some(3),
                        "l" => Some(LUMINANCE),
                        _ => None,
                    };
                }
                _ => {}
            }
        }
        map
    }

    fn bytes(&self, folder: &Path) -> Checked<Vec<u8>> {
        let fault = |problem: String| Fault::invalid("", problem, "put the image beside the MTL file");
        let path = found(folder, self.file)
            .ok_or_else(|| fault(format!("there is no image {}", one_line(self.file))))?;
        read_file(&path).map_err(|error| fault(error.to_string()))
    }

    fn texels(&self, folder: &Path) -> Checked<Texels> {
        decode_texels(&self.bytes(folder)?).map_err(|fault| fault.at(one_line(self.file)))
    }
}

/// The first word, and what follows it.
fn word(text: &str) -> (&str, &str) {
    match text.split_once(char::is_whitespace) {
        Some((word, rest)) => (word, rest.trim_start()),
        None => (text, ""),
    }
}

/// A file by the name that another one has for it: relative to `folder`, with either slash; of an absolute path only
/// the last part, beside the file, so that a file from elsewhere can name nothing else.
fn found(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = name.trim().trim_matches('"').replace('\\', "/");
    let is_absolute =
        name.starts_with('/') || name.split('/').next().is_some_and(|first| first.contains(':'));
    let last = name.rsplit('/').next().unwrap_or_default();
    let whole = folder.join(&name);
    if name.is_empty() || last.is_empty() {
        return None;
    }
    if !is_absolute && whole.is_file() {
        return Some(whole);
    }
    Some(folder.join(last)).filter(|path| path.is_file())
}
