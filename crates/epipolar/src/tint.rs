//! Coloured glass before the light: a slice's runs, cut where the colour of their light rays changes.
//!
//! The colour of a light ray does not depend on where view rays cross it, so it multiplies Γ (Baran et al. 2010,
//! Section 6). The glass is cut at its own texels' borders, exactly, as the shadow map is.

use scatter_core::LightTexture;

use crate::map_line::MapLine;
use crate::row::Row;

/// A row's runs with a colour each.
#[derive(Debug, Clone, Default)]
pub struct TintedRow {
    starts: Vec<f32>,
    lit: Vec<u32>,
    tints: [Vec<f32>; 3],
    /// Where colours begin along the slice.
    glass: Vec<(f32, [f32; 3])>,
}

impl TintedRow {
    /// Room for rows of `runs` runs behind glass of `side` texels.
    pub fn reserve(&mut self, runs: usize, side: usize) {
        self.clear();
        let glass = 2 * side + 4;
        self.starts.reserve(runs + glass + 1);
        self.lit.reserve(runs + glass);
        for tint in &mut self.tints {
            tint.reserve(runs + glass);
        }
        self.glass.reserve(glass);
    }

    fn clear(&mut self) {
        self.starts.clear();
        self.lit.clear();
        self.tints.iter_mut().for_each(Vec::clear);
        self.glass.clear();
    }

    /// Cuts `row` where the glass along `line` changes its colour; without a line all of it is white.
    pub fn fill(&mut self, row: &Row, line: Option<&MapLine>, texture: &LightTexture<'_>) {
        self.clear();
        self.glass.push((0.0, [1.0; 3]));
        if let Some(line) = line {
            line.for_each_texel(|start, texel| self.glass.push((start, texture.texels()[texel])));
            self.glass.push((line.gamma.at(line.length), [1.0; 3]));
        }
        self.glass.dedup_by(|next, before| next.1 == before.1);
        let mut colour = 0;
        for (run, &lit) in row.lit().iter().enumerate() {
            let (start, end) = (row.starts()[run], row.starts()[run + 1]);
            self.push(start, lit, self.glass[colour].1);
            while colour + 1 < self.glass.len() && self.glass[colour + 1].0 < end {
                colour += 1;
                // Rounding may put a border of the glass an ulp before the run that it lies in.
                self.push(self.glass[colour].0.max(start), lit, self.glass[colour].1);
            }
        }
        self.starts.push(f32::INFINITY);
    }

    fn push(&mut self, start: f32, lit: u32, tint: [f32; 3]) {
        self.starts.push(start);
        self.lit.push(lit);
        for (list, value) in self.tints.iter_mut().zip(tint) {
            list.push(value);
        }
    }

    /// As [`Row::starts`].
    pub fn starts(&self) -> &[f32] {
        &self.starts
    }

    /// As [`Row::lit`].
    pub fn lit(&self) -> &[u32] {
        &self.lit
    }

    /// One channel of the runs' colours.
    pub fn tint(&self, channel: usize) -> &[f32] {
        &self.tints[channel]
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.starts.capacity()
            + self.lit.capacity()
            + self.tints.iter().map(Vec::capacity).sum::<usize>())
            + size_of::<(f32, [f32; 3])>() * self.glass.capacity()
    }
}
