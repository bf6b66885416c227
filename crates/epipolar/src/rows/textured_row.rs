//! A light's colour texture: a slice's runs, cut where the colour of their light rays changes.
//!
//! The colour of a light ray does not depend on where view rays cross it, so it multiplies Γ (Baran et al. 2010,
//! Section 6). The texture is cut at its own texels' borders, exactly, as the shadow map is.

use scatter_core::LightTexture;

use super::map_line::MapLine;
use super::row::Row;

/// A row's runs with a colour each: cut at the borders of the texture's texels, exactly (textured lights: Baran et al. 2010,
/// Section 6). White where the texture does not reach. O(runs + texels along the slice).
#[derive(Debug, Clone, Default)]
pub struct TexturedRow {
    starts: Vec<f32>,
    lit: Vec<u32>,
    colours: [Vec<f32>; 3],
    /// Where colours begin along the slice.
    texture_runs: Vec<(f32, [f32; 3])>,
}

impl TexturedRow {
    /// Room for rows of `runs` runs behind a texture of `side` texels.
    pub fn reserve(&mut self, runs: usize, side: usize) {
        self.clear();
        let stretches = 2 * side + 4;
        self.starts.reserve(runs + stretches + 1);
        self.lit.reserve(runs + stretches);
        for colour in &mut self.colours {
            colour.reserve(runs + stretches);
        }
        self.texture_runs.reserve(stretches);
    }

    fn clear(&mut self) {
        self.starts.clear();
        self.lit.clear();
        self.colours.iter_mut().for_each(Vec::clear);
        self.texture_runs.clear();
    }

    /// Cuts `row` where the texture along `line` changes its colour; without a line all of it is white.
    pub fn fill(&mut self, row: &Row, line: Option<&MapLine>, texture: &LightTexture<'_>) {
        self.clear();
        self.texture_runs.push((0.0, [1.0; 3]));
        if let Some(line) = line {
            line.for_each_texel(|start, texel| self.texture_runs.push((start, texture.texels()[texel])));
            self.texture_runs.push((line.gamma.at(line.length), [1.0; 3]));
        }
        self.texture_runs.dedup_by(|next, before| next.1 == before.1);
        let mut colour = 0;
        for (run, &lit) in row.lit().iter().enumerate() {
            let (start, end) = (row.starts()[run], row.starts()[run + 1]);
            self.push(start, lit, self.texture_runs[colour].1);
            while colour + 1 < self.texture_runs.len() && self.texture_runs[colour + 1].0 < end {
                colour += 1;
                // Rounding may put a border of the texture an ulp before the run that it lies in.
                self.push(self.texture_runs[colour].0.max(start), lit, self.texture_runs[colour].1);
            }
        }
        self.starts.push(f32::INFINITY);
    }

    fn push(&mut self, start: f32, lit: u32, colour: [f32; 3]) {
        self.starts.push(start);
        self.lit.push(lit);
        for (list, value) in self.colours.iter_mut().zip(colour) {
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
    pub fn colour(&self, channel: usize) -> &[f32] {
        &self.colours[channel]
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.starts.capacity()
            + self.lit.capacity()
            + self.colours.iter().map(Vec::capacity).sum::<usize>())
            + size_of::<(f32, [f32; 3])>() * self.texture_runs.capacity()
    }
}
