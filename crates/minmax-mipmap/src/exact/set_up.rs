//! Rays to segments: cuts sixteen rays by all layers of a light, and writes down the part inside of each.
//!
//! The first layer that contains a point decides. What is not covered yet is a list of stretches, each with an end on
//! every ray; a layer takes what lies in it and leaves the stretches before and behind. With one layer that is one stretch,
//! with nested cascades it stays at two or three. What is left over in the end is lit.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};

use super::lanes::transpose;
use super::layers::LayerTrees;
use super::ray_fan::{GROUP, LANES, MapFan, MapPaths, RayFan, Wide, clip_by, place_in_group};
use super::segment::{Segment, Word};
use super::slabs::{BlockBounds, Kind, Slabs};
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

/// Sixteen rays in one layer, and between which depths of the camera they are inside of it.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    paths: MapPaths,
    from: Wide,
    to: Wide,
}

/// Where the set-up puts what it finds; buffers are reused.
#[derive(Debug, Clone, Default)]
pub struct Found {
    /// Segments of each layer.
    pub segments: Vec<Vec<Segment>>,
    /// What goes the long way.
    pub leftovers: Vec<Leftover>,
    /// Of the block that is being cut: `[layer][group]`, and `[layer]`.
    crossings: Vec<Crossing>,
    slabs: Vec<Slabs>,
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

impl LayerFan {
    /// Bounds of the rays of a block of pixels, first and last one: affine functions have them at the corners.
    #[inline(always)]
    fn bounds(&self, first: [u32; 2], last: [u32; 2]) -> BlockBounds {
        let corners = [first, [last[0], first[1]], [first[0], last[1]], last];
        let mut bounds = BlockBounds {
            start: [[f64::INFINITY, f64::NEG_INFINITY]; 3],
            step: [[f64::INFINITY, f64::NEG_INFINITY]; 3],
        };
        for corner in corners {
            let [start, step] = self.fan.path_of(corner);
            let codes = self.codes.of_ray([start.z, step.z]);
            let values = [[start.x, step.x], [start.y, step.y], codes];
            for (axis, [start, step]) in values.into_iter().enumerate() {
                for (bound, value) in [(&mut bounds.start[axis], start), (&mut bounds.step[axis], step)] {
                    *bound = [bound[0].min(value), bound[1].max(value)];
                }
            }
        }
        bounds
    }
}

impl Found {
    /// Empties all lists, for a tile of that many pixels. Leaves room for twice as many segments a layer: which worker
    /// gets which tile is chance, and the second frame should allocate nothing.
    pub fn clear(&mut self, layers: usize, pixels: usize) {
        self.segments.resize_with(layers, Vec::new);
        for segments in &mut self.segments {
            segments.clear();
            segments.reserve(2 * pixels + LANES);
        }
        self.leftovers.clear();
        self.leftovers.reserve(pixels);
        for stretches in [&mut self.open, &mut self.next] {
            stretches.clear();
            stretches.reserve(MOST_STRETCHES);
        }
    }

    /// Looks at the block of 8×8 pixels from `(x, y)` on as a whole: where its rays, which end at `ends`, are inside of
    /// each layer, and which slabs of them are lit or dark.
    #[inline(always)]
    pub fn look(&mut self, layers: &[LayerFan], trees: &LayerTrees, [x, y]: [u32; 2], ends: &[Wide; GROUPS]) {
        self.crossings.clear();
        self.slabs.clear();
        for (layer, tree) in layers.iter().zip(trees.trees()) {
            let (mut first, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
            for (group, ends) in ends.iter().enumerate() {
                let paths = layer.fan.paths([x, y + GROUP[1] * group as u32]);
                let mut crossing = Crossing { paths, from: [0.0; LANES], to: *ends };
                layer.fan.clip(&crossing.paths, &mut crossing.from, &mut crossing.to);
                for lane in 0..LANES {
                    let (from, to) = (crossing.from[lane], crossing.to[lane]);
                    let crosses = from < to;
                    first = first.min(if crosses { from } else { f64::INFINITY });
                    last = last.max(if crosses { to } else { f64::NEG_INFINITY });
                }
                self.crossings.push(crossing);
            }
            let slabs = if layer.perspective || !(first < last) {
                Slabs::UNKNOWN
            } else {
                let corner = [x + GROUP[0] - 1, y + GROUP[1] * GROUPS as u32 - 1];
                Slabs::of(tree, layer.size, &layer.bounds([x, y], corner), [first, last])
            };
            self.slabs.push(slabs);
        }
    }

    /// Cuts the rays of a group of the block that was looked at last, whose pixels have these numbers in the tile, from the
    /// eye to `ends` (0 where there is no pixel), and calls `lit` for stretches that are lit as a whole.
    #[inline(always)]
    pub fn cut<S: Simd>(
        &mut self,
        simd: S,
        layers: &[LayerFan],
        group: usize,
        pixels: &[u32; LANES],
        ends: &Wide,
        mut lit: impl FnMut(&Stretch),
    ) {
        self.open.clear();
        self.open.push([[0.0; LANES], *ends]);
        for (index, layer) in layers.iter().enumerate() {
            let Crossing { paths, from, to } = &self.crossings[GROUPS * index + group];
            let mut sink = Sink {
                segments: &mut self.segments[index],
                leftovers: &mut self.leftovers,
                layer,
                index,
                paths,
                pixels,
            };
            self.next.clear();
            for open in &self.open {
                let (mut inside, mut before, mut behind) = (*open, *open, *open);
                for lane in 0..LANES {
                    let crosses = from[lane] < to[lane];
                    let (a, b) = (open[0][lane], open[1][lane]);
                    // Of a ray that does not cross the layer all is before it.
                    let (first, last) = if crosses { (from[lane], to[lane]) } else { (b, b) };
                    inside[0][lane] = first.max(a);
                    inside[1][lane] = last.min(b);
                    before[1][lane] = first.min(b);
                    behind[0][lane] = last.max(a);
                }
                if is_any(&inside) {
                    for (kind, start, end) in self.slabs[index].iter() {
                        if kind == Kind::Dark {
                            continue;
                        }
                        let mut part = inside;
                        let [from, to] = &mut part;
                        for (from, to) in from.iter_mut().zip(to) {
                            (*from, *to) = (from.max(start), to.min(end));
                        }
                        match kind {
                            _ if !is_any(&part) => {}
                            Kind::Lit => lit(&part),
                            _ => sink.add(simd, &part),
                        }
                    }
                }
                for rest in [before, behind] {
                    if is_any(&rest) {
                        self.next.push(rest);
                    }
                }
            }
            std::mem::swap(&mut self.open, &mut self.next);
        }
        self.open.iter().for_each(&mut lit);
    }

    /// Bytes that the lists hold.
    pub fn memory_bytes(&self) -> u64 {
        let segments = self.segments.iter().map(|list| list.capacity() * size_of::<Segment>()).sum::<usize>();
        let lists = self.segments.capacity() * size_of::<Vec<Segment>>();
        let stretches = (self.open.capacity() + self.next.capacity()) * size_of::<Stretch>();
        let block =
            self.crossings.capacity() * size_of::<Crossing>() + self.slabs.capacity() * size_of::<Slabs>();
        (segments + lists + stretches + block + self.leftovers.capacity() * size_of::<Leftover>()) as u64
    }
}

/// Where the segments of a group in one layer go.
struct Sink<'a> {
    segments: &'a mut Vec<Segment>,
    leftovers: &'a mut Vec<Leftover>,
    layer: &'a LayerFan,
    index: usize,
    paths: &'a MapPaths,
    pixels: &'a [u32; LANES],
}

impl Sink<'_> {
    /// Adds the segments of a stretch inside of the layer.
    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, stretch: &Stretch) {
        let layer = self.layer;
        if !layer.perspective {
            return self.write(simd, stretch, Some(&layer.codes));
        }
        // What is nearer to the lamp than the codes reach is a segment of its own, without codes.
        let (depth, step) = (&self.paths.start[2], &self.paths.step[2]);
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
            self.write(simd, &far, Some(&layer.codes));
        }
        if is_any(&near) {
            self.write(simd, &near, None);
        }
    }

    /// Writes down the segments of the rays that have a part of the stretch. Loops over lanes without a branch, word by
    /// word, then a transposition: a segment is a row.
    #[inline(always)]
    fn write<S: Simd>(&mut self, simd: S, [from, to]: &Stretch, codes: Option<&DepthCodes>) {
        let Self { layer, paths, pixels, .. } = *self;
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
            let [place_word, step_word, per_word] =
                [Word::PlaceU, Word::StepU, Word::PerU].map(|word| word as usize + axis);
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
            words[Word::Pixel as usize][lane] = pixels[lane];
            words[Word::Base as usize][lane] = bits(from[lane]);
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
