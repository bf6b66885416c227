//! Lit runs behind coloured glass before a sun, sixteen side by side: each is cut where its ray passes from a block of one
//! colour to the next.
//!
//! ```text
//!     blocks   for each texel of the glass the largest aligned block of one colour that holds it
//!     walk     s ← the run's start;  until its end:
//!                  e ← where the ray leaves the block;  each channel += colour · ∫ₛᵉ e^{−σt} dt;  s ← e
//! ```
//!
//! Before and behind the glass' rectangle all is white. The walk is that of the packets, without a tree to go up and down:
//! the glass says at each texel how far its colour reaches.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use scatter_core::{Level, LightTexture, MapFan, at_level};

use super::lanes::{Answers, Indices, Reals, index, lit_length, real};
use super::ray_fan::{LANES, MapLanes, MapPaths, Wide, greater, lesser};

/// Coarsest block: 2⁵ texels a side.
const COARSEST: u8 = 5;

/// Largest number of texels a unit of depth, and of its inverse: products stay finite in f32.
const STEEPEST: f64 = 1e30;

/// For each texel of a glass the level of the largest aligned block of one colour that holds it; buffers are reused.
#[derive(Debug, Clone, Default)]
pub struct GlassBlocks {
    levels: Vec<u8>,
}

impl GlassBlocks {
    /// Of a glass. O(texels), for each level.
    pub fn build(&mut self, glass: &LightTexture<'_>) {
        let [width, height] = glass.projection().size();
        self.levels.clear();
        self.levels.resize(width as usize * height as usize, 0);
        for level in 1..=COARSEST {
            let (side, half) = (1 << level, 1 << (level - 1));
            let mut found = false;
            for j in (0..height).step_by(side as usize).take_while(|j| j + side <= height) {
                for i in (0..width).step_by(side as usize).take_while(|i| i + side <= width) {
                    let colour = glass.at(i, j);
                    let same = [(i, j), (i + half, j), (i, j + half), (i + half, j + half)].into_iter().all(
                        |(i, j)| {
                            self.levels[(j * width + i) as usize] == level - 1 && glass.at(i, j) == colour
                        },
                    );
                    if same {
                        found = true;
                        for row in j..j + side {
                            self.levels[(row * width + i) as usize..][..side as usize].fill(level);
                        }
                    }
                }
            }
            if !found {
                break;
            }
        }
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        self.levels.capacity() as u64
    }
}

/// A glass under a parallel projection, and the view rays in its space.
#[derive(Clone, Copy)]
pub struct Glass<'a> {
    texture: &'a LightTexture<'a>,
    blocks: &'a GlassBlocks,
    fan: MapFan,
    size: [u32; 2],
    /// Powers of two ≥ the size, and at least the side of the coarsest block.
    sides: [u32; 2],
}

/// Sixteen runs: the pixels' places in the image, and between which depths of the camera they are lit.
pub struct GlassRuns {
    /// Columns and rows.
    pub places: [Wide; 2],
    /// Where they begin and end.
    pub part: [Wide; 2],
}

/// One image axis of the glass along sixteen runs, as a segment has it (`segment.rs`).
struct Axis<S: Simd> {
    texel: Indices<S>,
    first: Indices<S>,
    mirror: Indices<S>,
    place: Reals<S>,
    step: Reals<S>,
    per: Reals<S>,
    before: Reals<S>,
}

impl<'a> Glass<'a> {
    /// Of a glass whose blocks are built; `fan` is the camera's rays in its space.
    pub fn new(texture: &'a LightTexture<'a>, blocks: &'a GlassBlocks, fan: MapFan) -> Self {
        let size = texture.projection().size();
        let sides = size.map(|n| n.next_power_of_two().max(1 << COARSEST));
        Self { texture, blocks, fan, size, sides }
    }

    /// The glass.
    pub fn texture(&self) -> &'a LightTexture<'a> {
        self.texture
    }

    /// Lit lengths `∫ colour·e^{−σt} dt` of sixteen runs, a vector a channel; σ by channel, per unit of the camera's depth,
    /// of which the first one is that of all where the air is grey.
    ///
    /// Not inlined: within the traversal's function it would take registers from rays that pass no glass.
    pub fn lengths(
        &self,
        simd: Level,
        runs: &GlassRuns,
        sigma: &[[f32; LANES]; 3],
        grey: bool,
    ) -> [[f32; LANES]; 3] {
        at_level!(simd, vectors => {
            let [red, green, blue] = *sigma;
            let sigma = [
                Reals::load_array(vectors, red),
                Reals::load_array(vectors, green),
                Reals::load_array(vectors, blue),
            ];
            let [red, green, blue] = self.lengths_on(vectors, runs, &sigma, grey);
            [red.to_array(), green.to_array(), blue.to_array()]
        })
    }

    #[inline(always)]
    fn lengths_on<S: Simd>(
        &self,
        simd: S,
        runs: &GlassRuns,
        sigma: &[Reals<S>; 3],
        grey: bool,
    ) -> [Reals<S>; 3] {
        let [from, to] = &runs.part;
        let paths = self.fan.paths_at(&runs.places);
        let (mut first, mut last) = (*from, *to);
        self.fan.clip(&paths, &mut first, &mut last);
        let mut white = [[0.0; LANES]; 2];
        let mut inside = [0.0; LANES];
        for lane in 0..LANES {
            let crosses = first[lane] < last[lane];
            // Of a run that does not pass the glass all is before it.
            first[lane] = if crosses { first[lane] } else { to[lane] };
            last[lane] = if crosses { last[lane] } else { to[lane] };
            inside[lane] = last[lane] - first[lane];
            white[0][lane] = greater(0.0, first[lane] - from[lane]);
            white[1][lane] = greater(0.0, to[lane] - last[lane]);
        }
        let mut sums = [real(simd, 0.0); 3];
        for (start, length) in [(from, &white[0]), (&last, &white[1])] {
            let (start, length) = (narrow(simd, start), narrow(simd, length));
            if length.simd_gt(real(simd, 0.0)).any_true() {
                let all = Answers::splat(simd, true);
                add(simd, &mut sums, [start, length], (sigma, grey), [real(simd, 1.0); 3], all);
            }
        }
        self.walk(simd, &paths, [&first, &inside], (sigma, grey), &mut sums);
        sums
    }

    /// Adds what is inside of the glass' rectangle: from where, and how far.
    #[inline(always)]
    fn walk<S: Simd>(
        &self,
        simd: S,
        paths: &MapPaths,
        [first, length]: [&Wide; 2],
        (sigma, grey): (&[Reals<S>; 3], bool),
        sums: &mut [Reals<S>; 3],
    ) {
        let mut u = self.axis(simd, paths, first, 0);
        let mut v = self.axis(simd, paths, first, 1);
        let (start, end) = (narrow(simd, first), narrow(simd, length));
        let mut s = real(simd, 0.0);
        let mut live = end.simd_gt(s);
        while live.any_true() {
            let (level, colour) = self.fetch(simd, [u.texel ^ u.mirror, v.texel ^ v.mirror]);
            let within = index(simd, i32::MAX) >> (31 - level);
            let (last_u, last_v) = (u.texel | within, v.texel | within);
            let (by_u, by_v) = (u.border(last_u), v.border(last_v));
            let until = by_u.min(by_v).min(end);
            add(simd, sums, [start + s, until - s], (sigma, grey), colour, live);
            let next_u = by_u.simd_le(by_v).select(last_u + 1, u.follow(last_u, until));
            v.texel = by_u.simd_le(by_v).select(v.follow(last_v, until), last_v + 1);
            u.texel = next_u;
            s = until;
            live &= until.simd_lt(end)
                & u.texel.simd_lt(index(simd, self.sides[0] as i32))
                & v.texel.simd_lt(index(simd, self.sides[1] as i32));
        }
    }

    /// Levels and colours of sixteen texels; those of lanes that are done may lie anywhere.
    #[inline(always)]
    fn fetch<S: Simd>(&self, simd: S, [i, j]: [Indices<S>; 2]) -> (Indices<S>, [Reals<S>; 3]) {
        let (zero, texels) = (index(simd, 0), self.texture.texels());
        let i = i.max(zero).min(index(simd, self.size[0] as i32 - 1));
        let j = j.max(zero).min(index(simd, self.size[1] as i32 - 1));
        let at = (j * index(simd, self.size[0] as i32) + i).to_array();
        let (mut levels, mut colours) = ([0i32; LANES], [[0.0f32; LANES]; 3]);
        for lane in 0..LANES {
            let at = at[lane] as usize;
            levels[lane] = self.blocks.levels[at].into();
            for channel in 0..3 {
                colours[channel][lane] = texels[at][channel];
            }
        }
        let [red, green, blue] = colours;
        (
            Indices::load_array(simd, levels),
            [Reals::load_array(simd, red), Reals::load_array(simd, green), Reals::load_array(simd, blue)],
        )
    }

    /// Sets up one axis of runs that begin at the depth `first`, inside of the rectangle.
    #[inline(always)]
    fn axis<S: Simd>(&self, simd: S, paths: &MapPaths, first: &Wide, axis: usize) -> Axis<S> {
        let (size, side) = (f64::from(self.size[axis]), f64::from(self.sides[axis]));
        let (mut texel, mut mirror) = ([0i32; LANES], [0i32; LANES]);
        let (mut place, mut step, mut per, mut before) =
            ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let slope = paths.step[axis][lane];
            let at = paths.start[axis][lane] + first[lane] * slope;
            let flips = slope < 0.0;
            let at = if flips { side - at } else { at };
            let least = if flips { side - size } else { 0.0 };
            let most = if flips { side - 1.0 } else { size - 1.0 };
            // Comparisons with NaN are false: what has no place begins at the first texel.
            let whole = lesser(greater(least, at.floor()), most);
            texel[lane] = whole as i32;
            mirror[lane] = if flips { self.sides[axis] as i32 - 1 } else { 0 };
            place[lane] = lesser(greater(0.0, at - whole), 1.0 - 1.0 / (1u64 << 24) as f64);
            step[lane] = lesser(STEEPEST, slope.abs());
            per[lane] = lesser(STEEPEST, 1.0 / slope.abs());
            before[lane] = -place[lane] * per[lane];
        }
        let texel = Indices::load_array(simd, texel);
        Axis {
            texel,
            first: texel,
            mirror: Indices::load_array(simd, mirror),
            place: narrow(simd, &place),
            step: narrow(simd, &step),
            per: narrow(simd, &per),
            before: narrow(simd, &before),
        }
    }
}

impl<S: Simd> Axis<S> {
    /// Where the border behind a texel is on each run.
    #[inline(always)]
    fn border(&self, last: Indices<S>) -> Reals<S> {
        (last + 1 - self.first).to_float::<Reals<S>>().mul_add(self.per, self.before)
    }

    /// The texel at `end`, inside of the block, and not behind the one before.
    #[inline(always)]
    fn follow(&self, last: Indices<S>, end: Reals<S>) -> Indices<S> {
        let texels: Indices<S> = end.mul_add(self.step, self.place).to_int();
        (texels + self.first).min(last).max(self.texel)
    }
}

/// Adds lit lengths of one colour.
#[inline(always)]
fn add<S: Simd>(
    simd: S,
    sums: &mut [Reals<S>; 3],
    [start, length]: [Reals<S>; 2],
    (sigma, grey): (&[Reals<S>; 3], bool),
    colour: [Reals<S>; 3],
    lanes: Answers<S>,
) {
    // Rounding may put a border a little before the last one.
    let length = lanes.select(length.max(real(simd, 0.0)), real(simd, 0.0));
    let mut lit = lit_length(simd, sigma[0], start, length);
    for channel in 0..3 {
        if channel > 0 && !grey {
            lit = lit_length(simd, sigma[channel], start, length);
        }
        sums[channel] = lit.mul_add(colour[channel], sums[channel]);
    }
}

/// Rounded to f32.
#[inline(always)]
fn narrow<S: Simd>(simd: S, wide: &Wide) -> Reals<S> {
    let mut narrow = [0.0; LANES];
    for lane in 0..LANES {
        narrow[lane] = wide[lane] as f32;
    }
    Reals::load_array(simd, narrow)
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::MapProjection;
    use scatter_testing::Random;

    /// By the definition, texel by texel: the largest aligned block inside of the glass that has one colour.
    #[test]
    fn blocks_have_one_colour_and_are_the_largest() {
        let (size, mut random) = ([75u32, 41u32], Random(11));
        // Panes of odd sides, and a corner of noise.
        let texels: Vec<[f32; 3]> = (0..size[0] * size[1])
            .map(|n| {
                let (i, j) = (n % size[0], n / size[0]);
                let pane =
                    if i < 8 && j < 8 { random.below(3) as f32 } else { ((i / 37) + 2 * (j / 33)) as f32 };
                [pane, 0.5, 4.0 - pane]
            })
            .collect();
        let projection =
            MapProjection::orthographic([0.0; 3], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [1.0; 2], size).unwrap();
        let glass = LightTexture::new(projection, &texels).unwrap();
        // What an earlier glass left must not matter.
        let mut blocks = GlassBlocks { levels: vec![7; 9999] };
        blocks.build(&glass);
        let mut seen = [0; COARSEST as usize + 1];
        for (i, j) in (0..size[1]).flat_map(|j| (0..size[0]).map(move |i| (i, j))) {
            let is_one = |level: u8| {
                let side = 1 << level;
                let (i0, j0) = (i & !(side - 1), j & !(side - 1));
                i0 + side <= size[0]
                    && j0 + side <= size[1]
                    && (j0..j0 + side).all(|b| (i0..i0 + side).all(|a| glass.at(a, b) == glass.at(i, j)))
            };
            let largest = (0..=COARSEST).rev().find(|&level| is_one(level)).unwrap();
            assert_eq!(blocks.levels[(j * size[0] + i) as usize], largest, "texel {i}, {j}");
            seen[usize::from(largest)] += 1;
        }
        assert!(seen.iter().filter(|&&count| count > 0).count() >= 5, "{seen:?}: too few levels to tell");
    }
}
