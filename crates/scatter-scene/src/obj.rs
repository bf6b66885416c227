//! Wavefront OBJ: positions and faces as f64 triangles, with the line's number in every error.
//!
//! Source: the "Object Files" appendix of Wavefront's Advanced Visualizer manual. Read here rather than through
//! `tobj` (which the tests compare with): tobj takes a polyline `l a b c` for a face, demands texture coordinates
//! and colours that we never use to be well-formed, overflows on far negative `vt` indices and knows no lines.
//! Departures: polygons become fans from their first vertex, as everywhere (a concave one may overlap itself);
//! a fourth coordinate divides the first three, as in tobj and Assimp; a face may use a vertex that comes later.

use glam::DVec3;

use crate::error::{Checked, Fault};
use crate::load::{checked_counts, checked_position};
use crate::scene::Scene;

/// Reads the text of an OBJ file. Bytes that are not UTF-8 (comments, names) do no harm.
pub(crate) fn read(bytes: &[u8]) -> Checked<Scene> {
    let text = String::from_utf8_lossy(bytes);
    let mut reader = Reader::default();
    let mut joined = String::new();
    let mut first_line = 1;
    for (line_idx, line) in text.lines().enumerate() {
        // A backslash at the end continues the statement on the next line.
        let (part, continues) = match line.trim_end().strip_suffix('\\') {
            Some(part) => (part, true),
            None => (line, false),
        };
        if joined.is_empty() {
            first_line = line_idx + 1;
        }
        if continues {
            joined.push_str(part);
            joined.push(' ');
        } else if joined.is_empty() {
            reader.statement(part, first_line)?;
        } else {
            joined.push_str(part);
            reader.statement(&joined, first_line)?;
            joined.clear();
        }
    }
    reader.statement(&joined, first_line)?;
    reader.finish()
}

#[derive(Default)]
struct Reader {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// The face vertex that refers farthest ahead, and its line: checked when all vertices are known.
    farthest: Option<(u32, usize)>,
    corners: Vec<u32>,
    counts: Ignored,
}

/// What is left out, for the notes.
#[derive(Default)]
struct Ignored {
    points: usize,
    lines: usize,
    curves: usize,
    degenerate: usize,
}

impl Reader {
    fn statement(&mut self, statement: &str, line: usize) -> Checked<()> {
        let statement = statement.split('#').next().unwrap_or_default();
        let mut words = statement.split_whitespace();
        match words.next() {
            Some("v") => self.vertex(words, line),
            // `fo` is the face of the format's first version.
            Some("f" | "fo") => self.face(words, line),
            Some("p") => {
                self.counts.points += 1;
                Ok(())
            }
            Some("l") => {
                self.counts.lines += 1;
                Ok(())
            }
            Some("curv" | "surf") => {
                self.counts.curves += 1;
                Ok(())
            }
            // Texture coordinates, normals, groups, materials, and what nobody knows.
            _ => Ok(()),
        }
    }

    fn vertex<'a>(&mut self, words: impl Iterator<Item = &'a str>, line: usize) -> Checked<()> {
        let place = || format!("line {line}");
        let mut values = [0.0; 4];
        let mut count = 0;
        for word in words {
            // Four values: x y z w. Six or seven: x y z [w] r g b; colours are not read.
            if count < 4 {
                values[count] = word.parse::<f64>().map_err(|_| {
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
        self.positions.push(checked_position(p_world, place)?);
        Ok(())
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a str>, line: usize) -> Checked<()> {
        self.corners.clear();
        for word in words {
            let corner = self.corner(word, line)?;
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
        for edge in self.corners.get(1..).unwrap_or_default().windows(2) {
            let triangle @ [a, b, c] = [self.corners[0], edge[0], edge[1]];
            if a == b || b == c || c == a {
                self.counts.degenerate += 1;
            } else {
                self.triangles.push(triangle);
            }
        }
        Ok(())
    }

    /// The vertex index of `v`, `v/vt`, `v//vn` or `v/vt/vn`: from 1, or from −1 backwards.
    fn corner(&mut self, word: &str, line: usize) -> Checked<u32> {
        let fault = |problem: String| {
            Fault::invalid(format!("line {line}"), problem, "vertices count from 1, or backwards from -1")
        };
        let number = word.split('/').next().unwrap_or_default();
        let index: i64 =
            number.parse().map_err(|_| fault(format!("`{word}` does not begin with a vertex index")))?;
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
        Ok(idx)
    }

    fn finish(self) -> Checked<Scene> {
        if let Some((idx, line)) = self.farthest
            && idx as usize >= self.positions.len()
        {
            let problem = format!(
                "vertex index {}, but the file has {} vertices",
                u64::from(idx) + 1,
                self.positions.len()
            );
            return Err(Fault::invalid(
                format!("line {line}"),
                problem,
                "the file is cut off or damaged: export it again",
            ));
        }
        let Self { positions, triangles, counts, .. } = self;
        let mut notes = Vec::new();
        let mut note = |count: usize, what: &str| {
            if count > 0 {
                notes.push(format!("{count} {what}"));
            }
        };
        note(counts.points, "point elements are left out");
        note(counts.lines, "line elements are left out");
        note(counts.curves, "free-form curves and surfaces are left out: export polygons");
        note(counts.degenerate, "triangles that repeat a vertex index are left out");
        Ok(Scene { positions, triangles, notes, ..Scene::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    fn scene(faces: &str) -> Scene {
        read(format!("{SQUARE}{faces}").as_bytes()).unwrap()
    }

    fn message(text: &str) -> String {
        read(text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn coordinates_are_the_nearest_f64_to_their_decimals() {
        let scene = read(b"v 0.1 1e-3 -16777217.25\nv 1 0 0\nv 0 1 0\nf 1 2 3").unwrap();
        assert_eq!(scene.positions[0], DVec3::new(0.1, 1e-3, -16777217.25));
    }

    #[test]
    fn all_face_notations_mean_the_same_triangle() {
        for face in [
            "f 1 2 3",
            "f 1/9 2/9 3/9",
            "f 1//7 2//7 3//7",
            "f 1/1/1 2/2/2 3/3/3",
            "f -4 -3 -2",
            "f 1 \\\n 2 3",
        ] {
            assert_eq!(scene(face).triangles, [[0, 1, 2]], "{face}");
        }
    }

    #[test]
    fn polygons_become_fans_and_faces_may_come_before_their_vertices() {
        assert_eq!(scene("f 1 2 3 4").triangles, [[0, 1, 2], [0, 2, 3]]);
        let early = format!("f 1 2 3\n{SQUARE}");
        assert_eq!(read(early.as_bytes()).unwrap().triangles, [[0, 1, 2]]);
    }

    #[test]
    fn a_polyline_is_no_face() {
        let scene = scene("l 1 2 3\np 1\nf 1 2 4\nf 1 2\nf 2 2 3");
        assert_eq!(scene.triangles, [[0, 1, 3]]);
        assert_eq!(scene.notes.len(), 3);
        assert!(scene.notes[1].starts_with("2 line"), "{:?}", scene.notes);
    }

    #[test]
    fn weights_divide_and_colours_and_comments_do_not_matter() {
        let scene = read(b"\xff# caf\xe9\nv 2 4 6 2 # w\nv 1 0 0 .5 .5 .5\r\nv 0 1 0\nusemtl\nmtllib none.mtl\nvt x\nf 1 2 3").unwrap();
        assert_eq!(scene.positions, [DVec3::new(1.0, 2.0, 3.0), DVec3::X, DVec3::Y]);
    }

    #[test]
    fn faults_name_their_line() {
        let line = |text: &str| message(&format!("{SQUARE}{text}"));
        for (text, place, part) in [
            ("f 1 2 9", "line 5", "index 9"),
            ("f 1 2 0", "line 5", "index 0"),
            ("f 1 2 -5", "line 5", "index -5"),
            ("f 1 2 99999999999999999999", "line 5", "vertex index"),
            ("\nf", "line 6", "without"),
            ("v nan 0 0\nf 1 2 3", "line 5", "finite"),
            ("v 0 1e400 0", "line 5", "finite"),
            ("v 0 0 1 0", "line 5", "finite"),
            ("v 0 1e16 0", "line 5", "farther"),
            ("v 0 1", "line 5", "three"),
            ("v 0 1 z", "line 5", "`z`"),
        ] {
            let message = line(text);
            assert!(message.starts_with(place) && message.contains(part), "{text}: {message}");
        }
    }
}
