//! Wavefront OBJ: positions and faces as f64 triangles, points and lines as particles and strands where a shot gives them a
//! size, with the line's number in every error.
//!
//! Source: the "Object Files" appendix of Wavefront's Advanced Visualizer manual. [`lines`] finds the statements,
//! [`polygon`] cuts polygons, [`elements`] keeps points and lines, [`library`] reads materials through the crate `tobj`. The statements themselves are read
//! here rather than through `tobj` (which the tests compare with): tobj takes a polyline `l a b c` for a face, refuses
//! files in which only some vertices have colours and faces that come before their vertices, gives a corner without
//! texture coordinates those of the corner before, knows no lines, and hashes every vertex of every face.
//! Departures: a fourth coordinate divides the first three, as in tobj and Assimp; a face may use a vertex that comes
//! later; a vertex that is not finite is a fault only where a face uses it.

mod elements;
mod library;
mod lines;
mod polygon;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::path::Path;

use glam::{DVec2, DVec3};

use self::elements::{Elements, particle_values, strand_values};
use self::library::{Coverage, Library};
use self::lines::{each_statement, number, text};
use self::polygon::{Cut, Triangulator};
use crate::cutout::Cutout;
use crate::error::{Checked, Fault};
use crate::limits::{checked_counts, checked_position};
use crate::scene::Scene;
use crate::text::utf8_bytes;
use crate::translucent::{OccluderValues, Particle, Strands};

const CUT_OFF: &str = "the file is cut off or damaged: export it again";

/// Reads the text of an OBJ file; libraries and their images are looked for in `folder`.
pub(crate) fn read(bytes: &[u8], folder: &Path, values: &OccluderValues) -> Checked<Scene> {
    let text = text(utf8_bytes(bytes, "as UTF-8 or ASCII")?);
    let mut reader = Reader { library: library(&text, folder), values: *values, ..Reader::default() };
    each_statement(&text, |statement, line| reader.statement(statement, line))?;
    reader.finish()
}

/// The libraries that the file names, wherever it does.
fn library(text: &str, folder: &Path) -> Library {
    let mut library = Library::default();
    for (at, keyword) in text.match_indices("mtllib") {
        let line_start = text[..at].rfind(['\n', '\r']).map_or(0, |end| end + 1);
        let rest = &text[at + keyword.len()..];
        if text[line_start..at].trim().is_empty() && rest.starts_with(char::is_whitespace) {
            library.add(folder, rest.split(['\n', '\r']).next().unwrap_or_default().trim());
        }
    }
    library
}

#[derive(Default)]
struct Reader {
    library: Library,
    values: OccluderValues,
    elements: Elements,
    /// The vertices of the line that is read.
    line_vertices: Vec<u32>,
    positions: Vec<DVec3>,
    /// Vertices that no face may use: their index, and why.
    unusable: Vec<(u32, Fault)>,
    /// The coordinates of `vt` statements, with v upwards; NaN where they cannot be read. Kept if there are masks.
    tex_coords: Vec<DVec2>,
    tex_coord_count: u32,
    triangles: Vec<[u32; 3]>,
    cutouts: Vec<Unresolved>,
    /// Polygons whose vertices come later.
    late: Vec<Face>,
    /// The face vertex that refers farthest ahead, and its line: checked when all vertices are known.
    farthest: Option<(u32, usize)>,
    coverage: Option<Coverage>,
    material: String,
    /// The corners of the face that is read.
    corners: Vec<Corner>,
    places: Vec<DVec3>,
    triangulator: Triangulator,
    counts: Ignored,
}

/// A corner of a face: its vertex, and its texture coordinates, which may come later.
#[derive(Clone, Copy)]
struct Corner {
    vertex: u32,
    tex_coord: Option<u32>,
}

struct Face {
    corners: Vec<Corner>,
    coverage: Coverage,
    line: usize,
}

/// A cut-out whose texture coordinates may come later.
struct Unresolved {
    cutout: Cutout,
    corners: [u32; 3],
    mask_from_file: glam::DAffine2,
    line: usize,
}

/// What is left out, for the notes.
#[derive(Default)]
struct Ignored {
    points: usize,
    lines: usize,
    curves: usize,
    calls: usize,
    degenerate: usize,
    /// How many polygons cross themselves, and the line of the first.
    crossed: (usize, usize),
    /// Materials of cut-outs that some face has no texture coordinates for.
    untextured: BTreeSet<String>,
}

impl Reader {
    fn statement(&mut self, statement: &str, line: usize) -> Checked<()> {
        let mut words = statement.split_whitespace();
        match words.next() {
            Some("v") => self.vertex(words, line)?,
            Some("vt") => self.tex_coord(words),
            // `fo` is the face of the format's first version.
            Some("f" | "fo") => self.face(words, line)?,
            Some("usemtl") => {
                let name = statement.trim_start().strip_prefix("usemtl").unwrap_or_default();
                name.trim().clone_into(&mut self.material);
                self.coverage = Some(self.library.coverage(&self.material));
            }
            Some("p") => self.points(words, line)?,
            Some("l") => self.polyline(words, line)?,
            Some("curv" | "surf") => self.counts.curves += 1,
            Some("call" | "csh") => self.counts.calls += 1,
            // Normals, groups, and what nobody knows.
            _ => {}
        }
        Ok(())
    }

    fn vertex<'a>(&mut self, words: impl Iterator<Item = &'a str>, line: usize) -> Checked<()> {
        let place = || format!("line {line}");
        let mut values = [0.0; 4];
        let mut count = 0;
        for word in words {
            // Four values: x y z w. Six or seven: x y z [w] r g b; colours are not read.
            if count < 4 {
                values[count] = number(word).ok_or_else(|| {
                    let problem = format!("`{word}` is no number");
                    Fault::invalid(place(), problem, "write a vertex as `v x y z`")
                })?;
            }
            count += 1;
        }
        if count < 3 {
            return Err(Fault::invalid(
                place(),
                "a vertex with less than three coordinates",
                "write it as `v x y z`",
            ));
        }
        let [x, y, z, w] = values;
        let mut p_world = DVec3::new(x, y, z);
        if count == 4 && w != 1.0 {
            p_world /= w;
        }
        checked_counts(place, 0, self.positions.len() as u64 + 1)?;
        if let Err(fault) = checked_position(p_world, place) {
            // MAX_POSITIONS fits a u32.
            self.unusable.push((self.positions.len() as u32, fault));
        }
        self.positions.push(p_world);
        Ok(())
    }

    fn tex_coord<'a>(&mut self, words: impl Iterator<Item = &'a str>) {
        self.tex_coord_count = self.tex_coord_count.saturating_add(1);
        if !self.library.masks.is_empty() {
            let mut values = words.map(number);
            let u = values.next().flatten().unwrap_or(f64::NAN);
            let v = values.next().map_or(0.0, |v| v.unwrap_or(f64::NAN));
            self.tex_coords.push(DVec2::new(u, v));
        }
    }

    fn points<'a>(&mut self, words: impl Iterator<Item = &'a str>, line: usize) -> Checked<()> {
        if particle_values(&self.values).is_none() {
            self.counts.points += 1;
            return Ok(());
        }
        for word in words {
            let vertex = self.corner(word, line)?.vertex;
            self.elements.add_point(vertex, line)?;
        }
        Ok(())
    }

    fn polyline<'a>(&mut self, words: impl Iterator<Item = &'a str>, line: usize) -> Checked<()> {
        if strand_values(&self.values).is_none() {
            self.counts.lines += 1;
            return Ok(());
        }
        self.line_vertices.clear();
        for word in words {
            let vertex = self.corner(word, line)?.vertex;
            self.line_vertices.push(vertex);
        }
        self.elements.add_line(&self.line_vertices, line)
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a str>, line: usize) -> Checked<()> {
        self.corners.clear();
        let mut is_late = false;
        for word in words {
            let corner = self.corner(word, line)?;
            is_late |= corner.vertex as usize >= self.positions.len();
            self.corners.push(corner);
        }
        match self.corners.len() {
            0 => {
                return Err(Fault::invalid(
                    format!("line {line}"),
                    "a face without vertices",
                    "write it as `f a b c`",
                ));
            }
            1 => self.counts.points += 1,
            2 => self.counts.lines += 1,
            _ => {}
        }
        let total = (self.triangles.len() + self.corners.len()) as u64;
        checked_counts(|| format!("line {line}"), total, 0)?;
        let coverage = self.coverage.unwrap_or(Coverage::Whole);
        let corners = std::mem::take(&mut self.corners);
        if is_late && corners.len() > 3 {
            self.late.push(Face { corners, coverage, line });
        } else {
            self.cut(&corners, coverage, line);
            self.corners = corners;
        }
        Ok(())
    }

    /// Appends a polygon whose vertices are known; a triangle's need not be.
    fn cut(&mut self, corners: &[Corner], coverage: Coverage, line: usize) {
        let cut = if corners.len() > 3 {
            self.places.clear();
            self.places.extend(corners.iter().map(|corner| self.positions[corner.vertex as usize]));
            self.triangulator.cut(&self.places)
        } else {
            Cut::Fan
        };
        if cut == Cut::Crossed {
            let (count, first) = self.counts.crossed;
            self.counts.crossed = (count + 1, if count == 0 { line } else { first });
        }
        if cut != Cut::Ears {
            for edge in corners.get(1..).unwrap_or_default().windows(2) {
                self.triangle([corners[0], edge[0], edge[1]], coverage, line);
            }
            return;
        }
        for i in 0..self.triangulator.ears().len() {
            let triangle = self.triangulator.ears()[i].map(|corner| corners[corner as usize]);
            self.triangle(triangle, coverage, line);
        }
    }

    fn triangle(&mut self, corners: [Corner; 3], coverage: Coverage, line: usize) {
        let [a, b, c] = corners.map(|corner| corner.vertex);
        if a == b || b == c || c == a {
            self.counts.degenerate += 1;
            return;
        }
        match coverage {
            Coverage::Whole => {}
            Coverage::Nothing => return,
            Coverage::Masked { mask, mask_from_file } => {
                if let [Some(a), Some(b), Some(c)] = corners.map(|corner| corner.tex_coord) {
                    // MAX_TRIANGLES fits a u32.
                    let triangle = self.triangles.len() as u32;
                    let cutout = Cutout { triangle, mask, uv: [DVec2::ZERO; 3] };
                    self.cutouts.push(Unresolved { cutout, corners: [a, b, c], mask_from_file, line });
                } else if !self.counts.untextured.contains(&self.material) {
                    self.counts.untextured.insert(self.material.clone());
                }
            }
        }
        self.triangles.push([a, b, c]);
    }

    /// The vertex index of `v`, `v/vt`, `v//vn` or `v/vt/vn`: from 1, or from −1 backwards.
    fn corner(&mut self, word: &str, line: usize) -> Checked<Corner> {
        let fault = |problem: String| {
            Fault::invalid(format!("line {line}"), problem, "vertices count from 1, or backwards from -1")
        };
        let mut numbers = word.split('/');
        let index: i64 = numbers
            .next()
            .unwrap_or_default()
            .parse()
            .map_err(|_| fault(format!("`{word}` does not begin with a vertex index")))?;
        let count = self.positions.len();
        let zero_based = match index {
            1.. => index - 1,
            0 => return Err(fault("vertex index 0".to_owned())),
            _ => index.saturating_add(count as i64),
        };
        // MAX_POSITIONS keeps sane indices below u32::MAX.
        let Ok(idx) = u32::try_from(zero_based) else {
            return Err(fault(format!("vertex index {index}, but {count} vertices are known here")));
        };
        if idx as usize >= count && self.farthest.is_none_or(|(far, _)| far < idx) {
            self.farthest = Some((idx, line));
        }
        // Only masks read texture coordinates: elsewhere they may be anything.
        let tex_coord = match self.coverage {
            Some(Coverage::Masked { .. }) => numbers.next().and_then(|number| self.tex_coord_index(number)),
            _ => None,
        };
        Ok(Corner { vertex: idx, tex_coord })
    }

    fn tex_coord_index(&self, number: &str) -> Option<u32> {
        let index: i64 = number.parse().ok()?;
        let zero_based =
            if index > 0 { index - 1 } else { index.checked_add(self.tex_coord_count.into())? };
        // Zero and what lies before the first are no index of any: found missing at the end.
        Some(if index == 0 { u32::MAX } else { u32::try_from(zero_based).unwrap_or(u32::MAX) })
    }

    fn finish(mut self) -> Checked<Scene> {
        if let Some((idx, line)) = self.farthest
            && idx as usize >= self.positions.len()
        {
            let problem = format!(
                "vertex index {}, but the file has {} vertices",
                u64::from(idx) + 1,
                self.positions.len()
            );
            return Err(Fault::invalid(format!("line {line}"), problem, CUT_OFF));
        }
        for face in std::mem::take(&mut self.late) {
            self.cut(&face.corners, face.coverage, face.line);
        }
        let (particles, strands) = self.occluders()?;
        self.drop_unusable()?;
        let cutouts = self.resolved_cutouts()?;
        let Self { positions, triangles, counts, library, .. } = self;
        let (masks, notes) = library.into_notes();
        let mut scene =
            Scene { positions, triangles, cutouts, masks, particles, strands, notes, ..Scene::default() };
        counts.add_notes(&mut scene.notes);
        Ok(scene)
    }

    /// Points and lines as what dims light; an error if one uses a vertex that is nowhere.
    fn occluders(&mut self) -> Checked<(Vec<Particle>, Strands)> {
        if !self.unusable.is_empty() {
            let find = |vertex: u32| self.unusable.binary_search_by_key(&vertex, |(idx, _)| *idx).ok();
            if let Some(at) = self.elements.vertices().filter_map(find).min() {
                return Err(self.unusable.swap_remove(at).1);
            }
        }
        Ok(self.elements.occluders(&self.positions, &self.values))
    }

    /// An error if a face uses a vertex that is nowhere; such vertices that no face uses go.
    fn drop_unusable(&mut self) -> Checked<()> {
        if self.unusable.is_empty() {
            return Ok(());
        }
        let find = |vertex: &u32| self.unusable.binary_search_by_key(vertex, |(idx, _)| *idx);
        let used = self.triangles.iter().flatten().filter_map(|vertex| find(vertex).ok()).min();
        if let Some(at) = used {
            return Err(self.unusable.swap_remove(at).1);
        }
        // As many vertices before it are gone as are found before it.
        let before = |vertex: u32| find(&vertex).unwrap_or_else(|at| at) as u32;
        let triangles = self.triangles.iter().map(|triangle| triangle.map(|vertex| vertex - before(vertex)));
        let triangles = triangles.collect();
        let mut idx = 0;
        let unusable = &self.unusable;
        self.positions.retain(|_| {
            idx += 1;
            unusable.binary_search_by_key(&(idx - 1), |(idx, _)| *idx).is_err()
        });
        self.triangles = triangles;
        Ok(())
    }

    fn resolved_cutouts(&self) -> Checked<Vec<Cutout>> {
        let resolve = |unresolved: &Unresolved| {
            let mut cutout = unresolved.cutout;
            for (uv, &corner) in cutout.uv.iter_mut().zip(&unresolved.corners) {
                let place = || format!("line {}", unresolved.line);
                let file = self.tex_coords.get(corner as usize).ok_or_else(|| {
                    let problem = format!(
                        "texture coordinates that are not there: the file has {}",
                        self.tex_coords.len()
                    );
                    Fault::invalid(place(), problem, CUT_OFF)
                })?;
                *uv = unresolved.mask_from_file.transform_point2(*file);
                if !uv.is_finite() {
                    let problem = format!("texture coordinates {} that are not finite", corner + 1);
                    return Err(Fault::invalid(place(), problem, "write them as `vt u v`"));
                }
            }
            Ok(cutout)
        };
        self.cutouts.iter().map(resolve).collect()
    }
}

impl Ignored {
    fn add_notes(self, notes: &mut Vec<String>) {
        let mut note = |count: usize, what: &str| {
            if count > 0 {
                notes.push(format!("{count} {what}"));
            }
        };
        note(self.points, "point elements are left out");
        note(self.lines, "line elements are left out");
        note(self.curves, "free-form curves and surfaces are left out: export polygons");
        note(self.calls, "other files that this one calls are left out");
        note(self.degenerate, "triangles that repeat a vertex index are left out");
        let (crossed, first) = self.crossed;
        note(
            crossed,
            &format!("polygons cross themselves, the first in line {first}: they are drawn as fans"),
        );
        for material in self.untextured {
            let material = crate::error::one_line(&material);
            notes.push(format!(
                "material \"{material}\" is a cut-out, but counts as opaque on faces without texture coordinates"
            ));
        }
    }
}
