//! What the shadow planes of neighbouring view rays share under a sun: the triangles that matter, listed once.
//!
//! All shadow planes of a perspective camera hold the line through the eye along the light. Rays whose planes lie in a
//! narrow wedge about it (those near one epipolar line of the image) meet nearly the same triangles, so the tree is
//! walked once for all of them. In the wedge a place has three coordinates:
//!
//! ```text
//! c   distance from the line: a light ray keeps it, so a blocker at c shadows the ray's point t = c/sin(angle to the sun)
//! a   height towards the sun: on one light ray the blocker of larger a comes first
//! φ   angle about the line: constant on a view ray
//! ```
//!
//! The wedge is cut in cells along c. A cell lists the triangles that meet it, but for those that lie below one that
//! spans all of the cell: on every ray of the wedge that one's shadow holds theirs, with room to spare. A ray goes
//! through its cells and adds the shadows of what is listed by the arithmetic of [`ShadowWalk`], except in cells that
//! the union covers. The union is made by comparisons alone, so it is that of all triangles, to the bit.

use glam::DVec3;

use crate::caster::SceneCaster;
use crate::tree::Pending;

use super::shadow_plane::ShadowPlane;
use super::shadow_walk::ShadowWalk;
use super::wedge_frame::{Part, WedgeFrame};

/// Triangles for each cell. Fewer: more cells to go through. More: longer lists.
const TRIANGLES_A_CELL: usize = 4;
/// Most cells, and least.
const CELLS: [usize; 2] = [16, 2048];
/// Margin of a place along a ray, as a share of the coordinates: that of `wedge_frame`, and the ray's own rounding.
const MARGIN: f64 = 1e-11;

/// Largest cotangent of a ray's angle to the sun: the slope of a ray nearer to it is not known well enough for
/// [`MARGIN`].
pub(super) const STEEPEST: f64 = 1e3;

/// A view ray of the wedge; its cotangent is at most [`STEEPEST`].
#[derive(Debug, Clone, Copy)]
pub(super) struct WedgeRay {
    /// Its shadow plane; the sun's.
    pub shadow: ShadowPlane,
    /// Where it ends.
    pub end: f64,
}

/// A wedge's triangles by cells. Buffers are reused from wedge to wedge.
#[derive(Debug, Default)]
pub(super) struct SunWedge {
    /// The triangles' numbers.
    triangles: Vec<u32>,
    parts: Vec<Part>,
    cells: Vec<Cell>,
    /// With their cells, as they are found.
    unsorted: Vec<(u32, Entry)>,
    /// All cells' lists.
    entries: Vec<Entry>,
    /// `[triangle of the wedge]` → the number of the ray that asked for it last.
    asked_by: Vec<u32>,
    ray: u32,
    /// Cells of one ray that hold something above it and are not dark, with the ray's smallest a there.
    uncovered: Vec<(u32, f64)>,
    /// Length of a cell; 0 if nothing is listed.
    cell: f64,
    margin: f64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    /// Its list.
    first: u32,
    count: u32,
    /// Largest a of what is listed.
    highest: f64,
    /// Below this all is shadowed by one triangle, all over the cell.
    hidden_below: f64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Entry {
    /// Of the wedge.
    triangle: u32,
    /// Largest a within the cell.
    highest: f64,
}

impl SunWedge {
    /// Lists what the planes of `rays` meet; all start at `eye`, and `sun` points to the light. Whether it did: rays
    /// that do not lie in a narrow wedge must walk alone. Counts boxes in `walk`.
    pub fn gather(
        &mut self,
        caster: &SceneCaster,
        eye: DVec3,
        sun: DVec3,
        rays: &[WedgeRay],
        walk: &mut ShadowWalk,
    ) -> bool {
        self.triangles.clear();
        self.parts.clear();
        self.entries.clear();
        let farthest = rays.iter().map(WedgeRay::last_c).fold(0.0, f64::max);
        let lowest_slope = rays.iter().map(|ray| ray.slope()).fold(f64::INFINITY, f64::min);
        let across = rays.iter().map(|ray| ray.shadow.across());
        let Some(frame) = WedgeFrame::new(eye, sun, across, farthest, lowest_slope) else { return false };
        self.gather_parts(caster, &frame, walk);
        let reached = self.parts.iter().map(|part| part.c[1]).fold(0.0, f64::max).min(farthest);
        let count = (self.parts.len() / TRIANGLES_A_CELL).clamp(CELLS[0], CELLS[1]);
        self.cell = reached / count as f64;
        self.margin = MARGIN * (eye.abs().max_element() + reached);
        self.cells.clear();
        self.cells.resize(count, Cell { hidden_below: f64::NEG_INFINITY, ..Cell::default() });
        if self.cell > 0.0 {
            self.find_hidden(caster, &frame);
            self.list(&frame);
        }
        self.asked_by.clear();
        self.asked_by.resize(self.parts.len(), 0);
        self.ray = 0;
        true
    }

    fn gather_parts(&mut self, caster: &SceneCaster, frame: &WedgeFrame, walk: &mut ShadowWalk) {
        let bvh = caster.bvh();
        if bvh.nodes.is_empty() {
            return;
        }
        let test = frame.box_test(bvh);
        let mut pending = Pending::new();
        pending.push(0u32);
        while let Some(index) = pending.pop() {
            let node = &bvh.nodes[index as usize];
            walk.counts.boxes += 1;
            if !test.may_hold(node) {
                continue;
            }
            if node.count == 0 {
                pending.push(node.first);
                pending.push(node.first + 1);
                continue;
            }
            for triangle in node.first..node.first + node.count {
                if let Some(part) = frame.part(caster.corners(triangle)) {
                    self.triangles.push(triangle);
                    self.parts.push(part);
                }
            }
        }
    }

    /// The cells that a stretch of c meets, with the margin; none beyond the last.
    fn cells_of(&self, [low, high]: [f64; 2]) -> std::ops::Range<usize> {
        let per_cell = 1.0 / self.cell;
        let first = ((low - self.margin) * per_cell).max(0.0) as usize;
        let last = ((high + self.margin) * per_cell).max(0.0) as usize;
        first.min(self.cells.len() - 1)..last.saturating_add(1).min(self.cells.len())
    }

    /// Both ends of a cell, grown by the margin.
    fn ends_of(&self, cell: usize) -> [f64; 2] {
        // The last one holds all that lies beyond.
        let low = cell as f64 * self.cell - self.margin;
        [low.max(0.0), (cell + 1) as f64 * self.cell + self.margin]
    }

    fn find_hidden(&mut self, caster: &SceneCaster, frame: &WedgeFrame) {
        for index in 0..self.parts.len() {
            // A cut-out hides nothing for certain.
            let Some(sheet) =
                self.parts[index].sheet.filter(|_| caster.cards().get(self.triangles[index]).is_none())
            else {
                continue;
            };
            for cell in self.cells_of(self.parts[index].c) {
                let corners = frame.cell(self.ends_of(cell));
                let [lowest, _] = sheet.heights(&corners);
                if lowest > self.cells[cell].hidden_below && sheet.covers(&corners) {
                    self.cells[cell].hidden_below = lowest;
                }
            }
        }
    }

    fn list(&mut self, frame: &WedgeFrame) {
        self.unsorted.clear();
        for index in 0..self.parts.len() {
            let Part { c, highest, sheet } = self.parts[index];
            for cell in self.cells_of(c) {
                let corners = frame.cell(self.ends_of(cell));
                let within = sheet.map_or(highest, |sheet| sheet.heights(&corners)[1].min(highest));
                if within >= self.cells[cell].hidden_below {
                    self.cells[cell].count += 1;
                    self.unsorted.push((cell as u32, Entry { triangle: index as u32, highest: within }));
                }
            }
        }
        let mut first = 0;
        for cell in &mut self.cells {
            cell.first = first;
            first += cell.count;
            cell.count = 0;
            cell.highest = f64::NEG_INFINITY;
        }
        self.entries.clear();
        self.entries.resize(self.unsorted.len(), Entry::default());
        for &(cell, entry) in &self.unsorted {
            let cell = &mut self.cells[cell as usize];
            self.entries[(cell.first + cell.count) as usize] = entry;
            cell.count += 1;
            cell.highest = cell.highest.max(entry.highest);
        }
    }

    /// Fills the walk's union with all shadows on one of the rays that were gathered for.
    pub fn collect(&mut self, caster: &SceneCaster, ray: &WedgeRay, walk: &mut ShadowWalk) {
        walk.spans.reset(ray.end);
        self.ray += 1;
        let last = ray.last_c();
        if !(last > 0.0) || self.entries.is_empty() {
            return;
        }
        let per_c = ray.t_per_c();
        let slope = ray.slope();
        // Of heights, which are as large as t.
        let margin = self.margin * per_c;
        let cells = self.cells_of([0.0, last]);
        // Where one triangle shadows all of a cell, the cell itself is added: it lies within that one's shadow.
        self.uncovered.clear();
        let mut dark_from = None;
        for index in cells.clone() {
            let cell = self.cells[index];
            let [low, high] = self.ends_of(index);
            let highest = slope * (if slope < 0.0 { low } else { high }) + margin;
            if cell.hidden_below > highest {
                dark_from.get_or_insert(low);
                continue;
            }
            if let Some(from) = dark_from.take() {
                walk.spans.add(from * per_c, low * per_c);
            }
            let lowest = slope * (if slope < 0.0 { high } else { low }) - margin;
            if cell.count > 0 && cell.highest >= lowest {
                self.uncovered.push((index as u32, lowest));
            }
        }
        if let Some(from) = dark_from {
            walk.spans.add(from * per_c, self.ends_of(cells.end - 1)[1] * per_c);
        }
        for &(index, lowest) in &self.uncovered {
            let [low, high] = self.ends_of(index as usize);
            if walk.spans.covers(low * per_c, high * per_c) {
                continue;
            }
            let cell = self.cells[index as usize];
            for entry in &self.entries[cell.first as usize..][..cell.count as usize] {
                let asked_by = &mut self.asked_by[entry.triangle as usize];
                if entry.highest < lowest || *asked_by == self.ray {
                    continue;
                }
                *asked_by = self.ray;
                // Its shadow lies within that of its part.
                let [low, high] = self.parts[entry.triangle as usize].c;
                if !walk.spans.covers((low - self.margin) * per_c, (high + self.margin) * per_c) {
                    walk.add(caster, &ray.shadow, self.triangles[entry.triangle as usize]);
                }
            }
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> u64 {
        let bytes = self.triangles.capacity() * size_of::<u32>()
            + self.parts.capacity() * size_of::<Part>()
            + self.cells.capacity() * size_of::<Cell>()
            + self.unsorted.capacity() * size_of::<(u32, Entry)>()
            + self.entries.capacity() * size_of::<Entry>()
            + self.uncovered.capacity() * size_of::<(u32, f64)>()
            + self.asked_by.capacity() * size_of::<u32>();
        bytes as u64
    }
}

impl WedgeRay {
    /// t for each unit of c.
    fn t_per_c(&self) -> f64 {
        self.slope().hypot(1.0)
    }

    /// Height over the line for each unit of c: the cotangent of the angle to the sun.
    fn slope(&self) -> f64 {
        self.shadow.cotangent()
    }

    /// c at its end; 0 for a ray without length.
    fn last_c(&self) -> f64 {
        self.end / self.t_per_c()
    }
}
