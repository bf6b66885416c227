//! Rays to segments: cuts sixteen rays by all layers of a light, and writes down the part inside of each.
//!
//! The first layer that contains a point decides. What is not covered yet is a list of stretches, each with an end on
//! every ray; a layer takes what lies in it and leaves the stretches before and behind. With one layer that is one stretch,
//! with nested cascades it stays at two or three. What is left over in the end is lit.

use super::layers::LayerTrees;
use super::ray_fan::{LANES, MapFan, MapPaths, RayFan, Wide, clip_by, place_in_group};
use super::segment::{Segment, Word};
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

/// Where the set-up puts what it finds; buffers are reused.
#[derive(Debug, Clone, Default)]
pub struct Found {
    /// Segments of each layer.
    pub segments: Vec<Vec<Segment>>,
    /// What goes the long way.
    pub leftovers: Vec<Leftover>,
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

    /// Cuts the rays of the group of pixels from `(x, y)` on, whose numbers in the tile are given, from the eye to `ends`
    /// (0 where there is no pixel), and calls `lit` for the stretches that no layer decides about.
    #[inline(always)]
    pub fn cut(
        &mut self,
        layers: &[LayerFan],
        place: [u32; 2],
        pixels: &[u32; LANES],
        ends: &Wide,
        mut lit: impl FnMut(&Stretch),
    ) {
        self.open.clear();
        self.open.push([[0.0; LANES], *ends]);
        for (index, layer) in layers.iter().enumerate() {
            let paths = layer.fan.paths(place);
            let (mut from, mut to) = ([0.0; LANES], *ends);
            layer.fan.clip(&paths, &mut from, &mut to);
            self.next.clear();
            for at in 0..self.open.len() {
                let open = self.open[at];
                let (mut inside, mut before, mut behind) = (open, open, open);
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
                    self.add(layer, index, &paths, pixels, &inside);
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

    /// Adds the segments of a stretch inside of a layer.
    #[inline(always)]
    fn add(
        &mut self,
        layer: &LayerFan,
        index: usize,
        paths: &MapPaths,
        pixels: &[u32; LANES],
        stretch: &Stretch,
    ) {
        if !layer.perspective {
            return self.write(layer, index, paths, pixels, stretch, Some(&layer.codes));
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
            self.write(layer, index, paths, pixels, &far, Some(&layer.codes));
        }
        if is_any(&near) {
            self.write(layer, index, paths, pixels, &near, None);
        }
    }

    #[inline(always)]
    fn write(
        &mut self,
        layer: &LayerFan,
        index: usize,
        paths: &MapPaths,
        pixels: &[u32; LANES],
        [from, to]: &Stretch,
        codes: Option<&DepthCodes>,
    ) {
        let zero = [0.0; LANES];
        // Place, step and texels of columns and of rows; start, step and end.
        let (mut place, mut step, mut texel, mut mirrored) =
            ([zero; 2], [zero; 2], [zero; 2], [[false; LANES]; 2]);
        let (mut depth, mut depth_step, mut code, mut code_step, mut end) = (zero, zero, zero, zero, zero);
        let mut holds = [true; LANES];
        for lane in 0..LANES {
            let s = from[lane];
            let length = to[lane] - s;
            let w = paths.start[2][lane] + s * paths.step[2][lane];
            let w_step = paths.step[2][lane];
            (depth[lane], depth_step[lane]) = (w, w_step);
            let (inverse, coordinate) = if layer.perspective {
                let inverse = 1.0 / w;
                let farthest = w + length * w_step;
                end[lane] = length / farthest;
                holds[lane] &= w > 0.0 && farthest > 0.0 && farthest <= LONGEST_PERSPECTIVE * w;
                (inverse, [-inverse, w_step * inverse])
            } else {
                end[lane] = length;
                (1.0, [w, w_step])
            };
            let [start, rate] = codes.map_or([0.0; 2], |codes| codes.of_ray(coordinate));
            (code[lane], code_step[lane]) = (start, rate);
            let last = start + rate * end[lane];
            holds[lane] &= start.abs() <= FARTHEST_CODE && last.abs() <= FARTHEST_CODE;
            for axis in 0..2 {
                let u = (paths.start[axis][lane] + s * paths.step[axis][lane]) * inverse;
                let along = paths.step[axis][lane];
                let slope = if layer.perspective { along - u * w_step } else { along };
                let flips = slope < 0.0;
                let (size, side) = (f64::from(layer.size[axis]), f64::from(layer.sides[axis]));
                // Mirrored, a map that does not fill its side begins behind its start.
                let (least, most) = if flips { (side - size, side - 1.0) } else { (0.0, size - 1.0) };
                let at = if flips { side - u } else { u };
                let first = at.floor().max(least).min(most);
                texel[axis][lane] = first;
                place[axis][lane] = (at - first).max(0.0).min(LARGEST_PLACE);
                step[axis][lane] = slope.abs().min(STEEPEST);
                mirrored[axis][lane] = flips;
                holds[lane] &= at.is_finite() && slope.abs() <= STEEPEST;
            }
            holds[lane] &= end[lane] <= STEEPEST && w.abs() <= STEEPEST && s <= STEEPEST;
        }
        for lane in 0..LANES {
            if !(from[lane] < to[lane]) {
                continue;
            }
            if !holds[lane] {
                let (pixel, part) = (pixels[lane], [from[lane], to[lane]]);
                self.leftovers.push(Leftover { pixel, layer: index as u32, part });
                continue;
            }
            let bits = |value: f64| (value as f32).to_bits();
            let rate = |slope: f64| (1.0 / slope).clamp(-STEEPEST, STEEPEST);
            let flip = |axis: usize| if mirrored[axis][lane] { layer.sides[axis] - 1 } else { 0 };
            let mut segment: Segment = [0; LANES];
            let mut set = |word: Word, value: u32| segment[word as usize] = value;
            set(Word::Texel, texel[0][lane] as u32 | (texel[1][lane] as u32) << 16);
            set(Word::Mirror, flip(0) | flip(1) << 16);
            set(Word::PlaceU, bits(place[0][lane]));
            set(Word::PlaceV, bits(place[1][lane]));
            set(Word::StepU, bits(step[0][lane]));
            set(Word::StepV, bits(step[1][lane]));
            set(Word::PerU, bits(rate(step[0][lane])));
            set(Word::PerV, bits(rate(step[1][lane])));
            set(Word::Code, bits(code[lane]));
            set(Word::CodeStep, bits(code_step[lane]));
            set(Word::End, bits(end[lane]));
            let rounded = f64::from(depth[lane] as f32);
            set(Word::Depth, bits(rounded));
            set(Word::DepthRest, bits(depth[lane] - rounded));
            set(Word::PerDepth, bits(rate(depth_step[lane])));
            set(Word::Pixel, pixels[lane]);
            set(Word::Base, bits(from[lane]));
            self.segments[index].push(segment);
        }
    }

    /// Bytes that the lists hold.
    pub fn memory_bytes(&self) -> u64 {
        let segments = self.segments.iter().map(|list| list.capacity() * size_of::<Segment>()).sum::<usize>();
        let lists = self.segments.capacity() * size_of::<Vec<Segment>>();
        let stretches = (self.open.capacity() + self.next.capacity()) * size_of::<Stretch>();
        (segments + lists + stretches + self.leftovers.capacity() * size_of::<Leftover>()) as u64
    }
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
