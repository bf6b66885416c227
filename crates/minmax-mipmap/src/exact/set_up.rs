//! Rays to segments: cuts sixteen rays by all layers of a light, and writes down the part inside of each.
//!
//! The first layer that contains a point decides. What is not covered yet is a list of stretches, each with an end on
//! every ray; a layer takes what lies in it and leaves the stretches before and behind. With one layer that is one stretch,
//! with nested cascades it stays at two or three. What is left over in the end is lit.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};

use scatter_core::{MapFan, RayFan};

use super::lanes::transpose;
use super::layers::LayerTrees;
use super::ray_fan::{GROUP, LANES, MapLanes, MapPaths, Wide, clip_by, greater, lesser, place_in_group};
use super::segment::{Segment, Start, Word};
use super::slabs::{Kind, SlabView, Slabs};
use super::tree_view::TreeView;
use crate::depth_codes::DepthCodes;

/// Largest code that a segment may have at either end: beyond it its rounding in f32 is more than the margin of the nodes.
const FARTHEST_CODE: f64 = 1.5e5;

/// Largest number of a segment's steps and rates: products with them stay finite in f32.
const STEEPEST: f64 = 1e30;

/// Depth over its start's from which on the way back from s to the camera's depth has no digits left.
const LONGEST_PERSPECTIVE: f64 = 1e5;

/// Stretches that room is made for: two more a layer is the most that real cascades and cubes leave.
const MOST_STRETCHES: usize = 64;

/// A stretch of each of sixteen rays, `from < to` where there is one \[the camera's depth\].
pub type Stretch = [Wide; 2];

/// A layer as the set-up knows it.
#[derive(Debug, Clone, Copy)]
pub struct LayerFan {
    fan: MapFan,
    /// Depth below which codes of a perspective map tell nothing; 0 of a parallel one.
    nearest: f64,
    codes: DepthCodes,
    size: [u32; 2],
    /// Powers of two ≥ the size.
    sides: [u32; 2],
    perspective: bool,
}

/// A part of a ray that lanes of f32 cannot hold.
#[derive(Debug, Clone, Copy)]
pub struct Leftover {
    /// The pixel's number in its tile.
    pub pixel: u32,
    /// The layer.
    pub layer: u32,
    /// From where to where \[the camera's depth\].
    pub part: [f64; 2],
}

/// Groups of a block of 8×8 pixels, one under the other.
pub const GROUPS: usize = 4;

/// A group of the block that is being looked at, in one layer: between which depths of the camera its rays are inside of it.
type Crossing = [Wide; 2];

/// A block in one layer.
#[derive(Debug, Clone, Copy)]
struct BlockInLayer {
    /// Whether all its rays are inside from the eye to their ends; if not, its groups have [`Crossing`]s.
    whole: bool,
    /// Whether none of them ever is.
    missed: bool,
    slabs: Slabs,
}

/// Where the set-up puts what it finds; buffers are reused.
#[derive(Debug, Clone, Default)]
pub struct Found {
    /// Segments of each layer.
    pub segments: Vec<Vec<Segment>>,
    /// Their pixels, and the camera's depth where each starts.
    pub starts: Vec<Vec<Start>>,
    /// That depth in f64: near a lamp f32 is too coarse.
    pub bases: Vec<Vec<f64>>,
    /// What goes the long way.
    pub leftovers: Vec<Leftover>,
    /// Stretches that are lit as a whole, of the group that was cut last.
    pub lit: Vec<Stretch>,
    /// Where the block that is being cut is, `[layer]` and `[layer][group]`.
    place: [u32; 2],
    blocks: Vec<BlockInLayer>,
    crossings: Vec<[Crossing; GROUPS]>,
    /// What is not covered yet, and what will be.
    open: Vec<Stretch>,
    next: Vec<Stretch>,
}

impl LayerFan {
    /// Of a layer that has its tree.
    pub fn new(
        fan: &RayFan,
        layer: &scatter_core::ShadowLayer<'_>,
        trees: &LayerTrees,
        index: usize,
    ) -> Self {
        let tree = &trees.trees()[index];
        let projection = layer.projection();
        Self {
            fan: fan.in_map(projection),
            nearest: tree.codes().nearest_depth(),
            codes: *tree.codes(),
            size: projection.size(),
            sides: tree.sides(),
            perspective: projection.is_perspective(),
        }
    }
}

impl Found {
    /// Empties all lists, for a tile of that many pixels. Leaves room for twice as many segments a layer: which worker
    /// gets which tile is chance, and the second frame should allocate nothing.
    pub fn clear(&mut self, layers: usize, pixels: usize) {
        self.segments.resize_with(layers, Vec::new);
        self.starts.resize_with(layers, Vec::new);
        self.bases.resize_with(layers, Vec::new);
        for starts in &mut self.starts {
            starts.clear();
            starts.reserve(2 * pixels);
        }
        for bases in &mut self.bases {
            bases.clear();
            bases.reserve(2 * pixels);
        }
        for segments in &mut self.segments {
            segments.clear();
            segments.reserve(2 * pixels + LANES);
        }
        self.leftovers.clear();
        self.leftovers.reserve(pixels);
        for stretches in [&mut self.open, &mut self.next, &mut self.lit] {
            stretches.clear();
            stretches.reserve(MOST_STRETCHES);
        }
    }

    /// Looks at the block of 8×8 pixels from `place` on as a whole: where its rays, which end at `ends`, are inside of
    /// each layer, and which slabs of them are lit or dark. `whole_intervals`: lit intervals are dear, and must not be cut at slabs.
    #[inline(always)]
    pub fn look<S: Simd>(
        &mut self,
        simd: S,
        (layers, trees): (&[LayerFan], &LayerTrees),
        place: [u32; 2],
        ends: &[Wide; GROUPS],
        whole_intervals: bool,
    ) {
        self.place = place;
        self.blocks.clear();
        self.crossings.resize(layers.len(), [[[0.0; LANES]; 2]; GROUPS]);
        let mut farthest = [0.0; LANES];
        for ends in ends {
            for lane in 0..LANES {
                farthest[lane] = greater(farthest[lane], ends[lane]);
            }
        }
        let end = farthest.into_iter().fold(0.0, greater);
        let [x, y] = place;
        let corner = [x + GROUP[0] - 1, y + GROUP[1] * GROUPS as u32 - 1];
        for ((layer, tree), crossings) in layers.iter().zip(trees.trees()).zip(&mut self.crossings) {
            let corners = layer.fan.corners(place, corner);
            // Of a cube's faces most blocks meet one or two.
            if layer.fan.misses(&corners, end) {
                self.blocks.push(BlockInLayer { whole: false, missed: true, slabs: Slabs::UNKNOWN });
                continue;
            }
            let whole = layer.fan.holds(&corners, end);
            let mut range = [0.0, end];
            if !whole {
                let (mut first, mut last) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
                for (group, ([from, to], ends)) in crossings.iter_mut().zip(ends).enumerate() {
                    (*from, *to) = ([0.0; LANES], *ends);
                    layer.fan.clip(&layer.fan.paths([x, y + GROUP[1] * group as u32]), from, to);
                    for lane in 0..LANES {
                        let crosses = from[lane] < to[lane];
                        first[lane] = lesser(first[lane], if crosses { from[lane] } else { f64::INFINITY });
                        last[lane] = greater(last[lane], if crosses { to[lane] } else { f64::NEG_INFINITY });
                    }
                }
                range = [first.into_iter().fold(f64::INFINITY, lesser), last.into_iter().fold(0.0, greater)];
            }
            let slabs = if range[0] < range[1] {
                let view = SlabView {
                    tree: TreeView::new(tree),
                    size: layer.size,
                    codes: layer.codes,
                    perspective: layer.perspective,
                };
                Slabs::of(simd, &view, &corners, range)
            } else {
                Slabs::UNKNOWN
            };
            let slabs = if whole_intervals { slabs.with_whole_intervals() } else { slabs };
            self.blocks.push(BlockInLayer { whole, missed: false, slabs });
        }
    }

    /// Cuts the rays of a group of the block that was looked at last, whose pixels have these numbers in the tile, from the
    /// eye to `ends` (0 where there is no pixel). What is lit as a whole is in [`Self::lit`] then.
    #[inline(always)]
    pub fn cut<S: Simd>(
        &mut self,
        simd: S,
        layers: &[LayerFan],
        group: usize,
        pixels: &[u32; LANES],
        ends: &Wide,
    ) {
        self.lit.clear();
        self.open.clear();
        self.open.push([[0.0; LANES], *ends]);
        for (index, layer) in layers.iter().enumerate() {
            let BlockInLayer { whole, missed, slabs } = self.blocks[index];
            if missed {
                continue;
            }
            let [from, to] = &self.crossings[index][group];
            let mut sink = Sink {
                segments: &mut self.segments[index],
                starts: &mut self.starts[index],
                bases: &mut self.bases[index],
                leftovers: &mut self.leftovers,
                layer,
                index,
                place: [self.place[0], self.place[1] + GROUP[1] * group as u32],
                pixels,
            };
            self.next.clear();
            for open in &self.open {
                let mut inside = *open;
                if !whole {
                    let (mut before, mut behind) = (*open, *open);
                    for lane in 0..LANES {
                        let crosses = from[lane] < to[lane];
                        let (a, b) = (open[0][lane], open[1][lane]);
                        // Of a ray that does not cross the layer all is before it.
                        let (first, last) = if crosses { (from[lane], to[lane]) } else { (b, b) };
                        inside[0][lane] = greater(first, a);
                        inside[1][lane] = lesser(last, b);
                        before[1][lane] = lesser(first, b);
                        behind[0][lane] = greater(last, a);
                    }
                    for rest in [before, behind] {
                        if is_any(&rest) {
                            self.next.push(rest);
                        }
                    }
                    if !is_any(&inside) {
                        continue;
                    }
                }
                for (kind, start, end) in slabs.iter() {
                    if kind == Kind::Dark {
                        continue;
                    }
                    let mut part = inside;
                    let [starts, ends] = &mut part;
                    for (own_start, own_end) in starts.iter_mut().zip(ends) {
                        *own_start = greater(*own_start, start);
                        *own_end = lesser(*own_end, end);
                    }
                    if is_any(&part) {
                        if kind == Kind::Lit {
                            self.lit.push(part);
                        } else {
                            sink.add(simd, &part);
                        }
                    }
                }
            }
            std::mem::swap(&mut self.open, &mut self.next);
        }
        self.lit.extend_from_slice(&self.open);
    }

    /// Bytes that the lists hold.
    pub fn memory_bytes(&self) -> u64 {
        let segments = self.segments.iter().map(|list| list.capacity() * size_of::<Segment>()).sum::<usize>();
        let lists = 3 * self.segments.capacity() * size_of::<Vec<Segment>>()
            + self.starts.iter().map(|list| list.capacity() * size_of::<Start>()).sum::<usize>()
            + self.bases.iter().map(|list| list.capacity() * size_of::<f64>()).sum::<usize>();
        let stretches =
            (self.open.capacity() + self.next.capacity() + self.lit.capacity()) * size_of::<Stretch>();
        let block = self.crossings.capacity() * size_of::<[Crossing; GROUPS]>()
            + self.blocks.capacity() * size_of::<BlockInLayer>();
        (segments + lists + stretches + block + self.leftovers.capacity() * size_of::<Leftover>()) as u64
    }
}

/// Where the segments of a group in one layer go.
struct Sink<'a> {
    segments: &'a mut Vec<Segment>,
    starts: &'a mut Vec<Start>,
    bases: &'a mut Vec<f64>,
    leftovers: &'a mut Vec<Leftover>,
    layer: &'a LayerFan,
    index: usize,
    /// The group's first pixel in the image.
    place: [u32; 2],
    pixels: &'a [u32; LANES],
}

impl Sink<'_> {
    /// Adds the segments of a stretch inside of the layer.
    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, stretch: &Stretch) {
        let layer = self.layer;
        let paths = &layer.fan.paths(self.place);
        if !layer.perspective {
            return self.write(simd, paths, stretch, Some(&layer.codes));
        }
        // What is nearer to the lamp than the codes reach is a segment of its own, without codes.
        let (depth, step) = (&paths.start[2], &paths.step[2]);
        let (mut above, mut below, mut below_step) = (*depth, *depth, *step);
        for lane in 0..LANES {
            above[lane] = depth[lane] - layer.nearest;
            below[lane] = -above[lane];
            below_step[lane] = -step[lane];
        }
        let [mut far, mut near] = [*stretch; 2];
        let [from, to] = &mut far;
        clip_by(&above, step, false, from, to);
        let [from, to] = &mut near;
        clip_by(&below, &below_step, true, from, to);
        if is_any(&far) {
            self.write(simd, paths, &far, Some(&layer.codes));
        }
        if is_any(&near) {
            self.write(simd, paths, &near, None);
        }
    }

    /// Writes down the segments of the rays that have a part of the stretch. Loops over lanes without a branch, word by
    /// word, then a transposition: a segment is a row.
    #[inline(always)]
    fn write<S: Simd>(
        &mut self,
        simd: S,
        paths: &MapPaths,
        [from, to]: &Stretch,
        codes: Option<&DepthCodes>,
    ) {
        let Self { layer, pixels, .. } = *self;
        let zero = [0.0; LANES];
        // Depth, code and end; what u and v are divided by, and how the divisor bends their steps.
        let (mut depth, mut code, mut rate, mut end, mut inverse, mut shear) =
            (zero, zero, zero, zero, zero, zero);
        let depth_step = &paths.step[2];
        let mut holds = [true; LANES];
        let first_code = codes.map_or([0.0; 2], |codes| codes.of_ray([0.0, 1.0]));
        for lane in 0..LANES {
            let length = to[lane] - from[lane];
            let (w, w_step) = (paths.start[2][lane] + from[lane] * depth_step[lane], depth_step[lane]);
            depth[lane] = w;
            if layer.perspective {
                let farthest = w + length * w_step;
                inverse[lane] = 1.0 / w;
                shear[lane] = w_step;
                end[lane] = length / farthest;
                code[lane] = first_code[0] - inverse[lane] * first_code[1];
                rate[lane] = w_step * inverse[lane] * first_code[1];
                holds[lane] &= (w > 0.0) & (farthest > 0.0) & (farthest <= LONGEST_PERSPECTIVE * w);
            } else {
                inverse[lane] = 1.0;
                end[lane] = length;
                code[lane] = first_code[0] + w * first_code[1];
                rate[lane] = w_step * first_code[1];
            }
            let last = code[lane] + rate[lane] * end[lane];
            holds[lane] &= (code[lane].abs() <= FARTHEST_CODE) & (last.abs() <= FARTHEST_CODE);
            holds[lane] &= (end[lane] <= STEEPEST) & (w.abs() <= STEEPEST) & (from[lane] <= STEEPEST);
        }
        let mut words = [[0u32; LANES]; LANES];
        for axis in 0..2 {
            let (size, side) = (f64::from(layer.size[axis]), f64::from(layer.sides[axis]));
            let (start, step) = (&paths.start[axis], &paths.step[axis]);
            let [place_word, step_word, per_word, border_word] =
                [Word::PlaceU, Word::StepU, Word::PerU, Word::BorderU].map(|word| word as usize + axis);
            for lane in 0..LANES {
                let u = (start[lane] + from[lane] * step[lane]) * inverse[lane];
                let slope = step[lane] - u * shear[lane];
                let flips = slope < 0.0;
                // Mirrored, a map that does not fill its side begins behind its start.
                let at = if flips { side - u } else { u };
                let least = if flips { side - size } else { 0.0 };
                let most = if flips { side - 1.0 } else { size - 1.0 };
                let first = at.floor().max(least).min(most);
                let place = (at - first).clamp(0.0, LARGEST_PLACE);
                let slope = slope.abs();
                let per = (1.0 / slope).min(STEEPEST);
                // An integer below 2³² plus 2⁵² has it in its low bits: casts of f64 saturate, which is slow.
                let index = (first + 4_503_599_627_370_496.0).to_bits() as u32;
                words[Word::Texel as usize][lane] |= index << (16 * axis);
                let flipped = if flips { layer.sides[axis] - 1 } else { 0 };
                words[Word::Mirror as usize][lane] |= flipped << (16 * axis);
                words[place_word][lane] = bits(place);
                words[step_word][lane] = bits(slope.min(STEEPEST));
                words[per_word][lane] = bits(per);
                words[border_word][lane] = bits(-place * per);
                holds[lane] &= (at.abs() <= STEEPEST) & (slope <= STEEPEST);
            }
        }
        for lane in 0..LANES {
            let rounded = f64::from(depth[lane] as f32);
            words[Word::Code as usize][lane] = bits(code[lane]);
            words[Word::CodeStep as usize][lane] = bits(rate[lane]);
            words[Word::End as usize][lane] = bits(end[lane]);
            words[Word::Depth as usize][lane] = bits(rounded);
            words[Word::DepthRest as usize][lane] = bits(depth[lane] - rounded);
            words[Word::PerDepth as usize][lane] = bits((1.0 / depth_step[lane]).clamp(-STEEPEST, STEEPEST));
        }
        let mut rows = [u32x16::splat(simd, 0); LANES];
        for (row, word) in rows.iter_mut().zip(&words) {
            *row = u32x16::load_array_ref(simd, word);
        }
        transpose(&mut rows);
        for lane in 0..LANES {
            if from[lane] < to[lane] {
                if holds[lane] {
                    self.segments.push(rows[lane].to_array());
                    self.starts.push(Start { pixel: pixels[lane], depth: from[lane] as f32 });
                    self.bases.push(from[lane]);
                } else {
                    let (pixel, part) = (pixels[lane], [from[lane], to[lane]]);
                    self.leftovers.push(Leftover { pixel, layer: self.index as u32, part });
                }
            }
        }
    }
}

/// The bits of a number rounded to f32.
#[inline(always)]
fn bits(value: f64) -> u32 {
    (value as f32).to_bits()
}

/// Largest place in a texel that f32 tells from 1.
const LARGEST_PLACE: f64 = 1.0 - 1.0 / (1u64 << 24) as f64;

/// Whether any ray has a part of the stretch.
#[inline(always)]
fn is_any([from, to]: &Stretch) -> bool {
    let mut any = false;
    for lane in 0..LANES {
        any |= from[lane] < to[lane];
    }
    any
}

/// Numbers of a group's pixels in a tile of that width, the group at `(x, y)` in it.
#[inline(always)]
pub fn numbers_in_tile(width: u32, [x, y]: [u32; 2]) -> [u32; LANES] {
    std::array::from_fn(|lane| {
        let [column, row] = place_in_group(lane);
        (y + row) * width + x + column
    })
}
