//! From the grid to pixels: each one reads its four nearest columns at the distance of its own surface.
//!
//! Along the depth the *share* of the light that is lit is interpolated as light adds up: within a slice visibility is constant,
//! so the share of a ray that ends within it is `(S·B + V·ΔB)/(B + ΔB)`, B the unoccluded light up to the slice and ΔB that of
//! the part before the surface (Hillaire's integral again, of a part of a slice). It is exact along a column's own ray under a
//! sun in a uniform medium; lamps and height fog take B in proportion to the distance. The share multiplies the pixel's own
//! unoccluded closed form. The engines' way, [`Lookup::Radiance`](crate::Lookup::Radiance), is linear in the slices' number.

use scatter_core::{
    Frame, Level, LightIntegralF32, RayLanes, exp_f32, sun_interval, transmittances_of_pixels_f32,
};

use crate::grid::footing::Footing;
use crate::grid::slices::Slices;
use crate::light::paths::{LANES, Lanes};

/// How light adds up along the slices, for what reads between their bounds.
#[derive(Debug, Clone, Default)]
pub struct SliceBlend {
    sigma: [f32; 3],
    /// `[slice][channel]`: unoccluded light before the slice over what is left of the transmittance there, and one over the
    /// light of the whole slice in the same unit.
    slices: Vec<[[f32; 2]; 3]>,
}

impl SliceBlend {
    /// For extinctions `sigma_t` of a uniform medium under a sun; zeros for what takes light in proportion to the distance.
    pub fn set(&mut self, sigma_t: [f64; 3], slices: &Slices) {
        self.sigma = sigma_t.map(|sigma| sigma as f32);
        self.slices.clear();
        self.slices.extend(slices.bounds().windows(2).map(|pair| {
            sigma_t.map(|sigma| {
                let [from, to] = [pair[0], pair[1]];
                // e^{σt}·∫₀ᵗ e^{−σs} ds = (e^{σt} − 1)/σ; beyond f32 nothing changes any more.
                let before = if sigma > 0.0 { (sigma * from).exp_m1() / sigma } else { from };
                [before.min(1e30) as f32, (1.0 / sun_interval(sigma, 0.0, to - from)).min(1e30) as f32]
            })
        }));
    }

    /// Weight of a slice's own share against that before it, for rays that end `within` the slice of each lane.
    #[inline(always)]
    fn weights(&self, channel: usize, slice: &[usize; LANES], within: &Lanes) -> Lanes {
        let sigma = self.sigma[channel];
        let (mut before, mut inverse, mut weights) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            [before[lane], inverse[lane]] = self.slices[slice[lane]][channel];
        }
        for lane in 0..LANES {
            let x = sigma * within[lane];
            let thick = (1.0 - exp_f32(-x)) / sigma;
            // φ by its series below ½: the first term left out is x⁶/7!, 3e-6.
            let series = 1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0 - x / 720.0))));
            let own = if x < 0.5 { within[lane] * series } else { thick };
            let whole = 1.0 / inverse[lane];
            let weight = own * inverse[lane] * ((before[lane] + whole) / (before[lane] + own));
            // At the very start of the first slice it is 0/0; there is one share only.
            weights[lane] = if before[lane] > 0.0 { weight.min(1.0) } else { 1.0 };
        }
        weights
    }

    /// Bytes of the table.
    pub fn memory_bytes(&self) -> u64 {
        (self.slices.capacity() * size_of::<[[f32; 2]; 3]>()) as u64
    }
}

/// What pixels read.
pub struct Resolve<'a> {
    /// The frame.
    pub frame: &'a Frame<'a>,
    /// Its unoccluded light.
    pub light: &'a LightIntegralF32<'a>,
    /// Where the slices lie.
    pub slices: &'a Slices,
    /// How light adds up along them.
    pub blend: &'a SliceBlend,
    /// The columns that each pixel column reads.
    pub columns: &'a [Footing],
    /// Numbers of sixteen columns.
    pub block_length: usize,
    /// The CPU's instructions.
    pub simd: Level,
}

impl Resolve<'_> {
    /// Fills a line `y` of the picture from two rows of the grid in `C` channels, the second of which weighs `share`.
    #[inline(always)]
    pub fn line<const C: usize, const RADIANCE: bool>(
        &self,
        y: u32,
        (rows, share): ([&[f32]; 2], f32),
        inscattered: &mut [[f32; 3]],
        transmittance: &mut [[f32; 3]],
    ) {
        let width = inscattered.len();
        let depth = &self.frame.depth().texels()[y as usize * width..][..width];
        let limit = self.frame.max_distance() as f32;
        let mut slice = 0;
        for x in (0..width).step_by(LANES) {
            let lanes = LANES.min(width - x);
            let mut ends = [0.0f32; LANES];
            for lane in 0..lanes {
                ends[lane] = depth[x + lane].min(limit);
            }
            let through = transmittances_of_pixels_f32(self.frame.setup(), (x as u32, y), &ends);
            let mut slices = [0usize; LANES];
            for lane in 0..lanes {
                slice = self.slice_near(slice, ends[lane]);
                slices[lane] = slice;
            }
            let columns = &self.columns[x..x + lanes];
            let mut radiance = self.read::<C, RADIANCE>((rows, share), columns, &slices, &ends);
            let is_dark = radiance.iter().all(|values| values[..lanes].iter().all(|&value| value == 0.0));
            if !RADIANCE && !is_dark {
                let setup = self.frame.setup();
                let whole = self.light.whole_rays(self.simd, setup, (x as u32, y), &ends, &through);
                for (values, whole) in radiance.iter_mut().zip(&whole) {
                    for (value, whole) in values.iter_mut().zip(whole) {
                        *value *= whole;
                    }
                }
            }
            for lane in 0..lanes {
                inscattered[x + lane] = std::array::from_fn(|channel| radiance[channel][lane]);
                transmittance[x + lane] = std::array::from_fn(|channel| through[channel][lane]);
            }
        }
    }

    /// [`Slices::slice_of`], from the neighbour's slice on: surfaces are mostly near to each other.
    #[inline(always)]
    fn slice_near(&self, mut slice: usize, distance: f32) -> usize {
        let bounds = self.slices.bounds_f32();
        for _ in 0..4 {
            if slice > 0 && bounds[slice] >= distance {
                slice -= 1;
            } else if slice + 1 < self.slices.count() && bounds[slice + 1] < distance {
                slice += 1;
            } else {
                return slice;
            }
        }
        self.slices.slice_of(distance)
    }

    /// Shares, or radiances, of sixteen pixels.
    #[inline(always)]
    fn read<const C: usize, const RADIANCE: bool>(
        &self,
        (rows, row_share): ([&[f32]; 2], f32),
        columns: &[Footing],
        slices: &[usize; LANES],
        ends: &Lanes,
    ) -> [Lanes; 3] {
        let bounds = self.slices.bounds_f32();
        let mut within = [0.0; LANES];
        for lane in 0..LANES {
            let end = ends[lane].min(self.slices.far() as f32);
            within[lane] = (end - bounds[slices[lane]]).max(0.0);
        }
        let mut found = [[0.0; LANES]; 3];
        for channel in 0..C {
            let weights = if RADIANCE {
                std::array::from_fn(|lane| {
                    let place = self.slices.place(f64::from(ends[lane])) - slices[lane] as f64;
                    place.clamp(0.0, 1.0) as f32
                })
            } else {
                self.blend.weights(channel, slices, &within)
            };
            for (lane, footing) in columns.iter().enumerate() {
                let slice = slices[lane];
                let at = |row: &[f32], column: u32| {
                    let column = column as usize;
                    let block = column / LANES * self.block_length + channel * LANES + column % LANES;
                    let own = row[block + slice * C * LANES];
                    let before = match slice {
                        0 if RADIANCE => 0.0,
                        0 => own,
                        _ => row[block + (slice - 1) * C * LANES],
                    };
                    before + weights[lane] * (own - before)
                };
                let across = |row: &[f32]| {
                    let first = at(row, footing.first);
                    if footing.share == 0.0 {
                        return first;
                    }
                    first + footing.share * (at(row, footing.second) - first)
                };
                let first = across(rows[0]);
                found[channel][lane] =
                    if row_share == 0.0 { first } else { first + row_share * (across(rows[1]) - first) };
            }
        }
        for channel in C..3 {
            found[channel] = found[0];
        }
        found
    }

    /// Fills a line `y` of a picture that nothing shadows: the closed form alone.
    #[inline(always)]
    pub fn clear_line(&self, y: u32, inscattered: &mut [[f32; 3]], transmittance: &mut [[f32; 3]]) {
        let width = inscattered.len();
        let depth = &self.frame.depth().texels()[y as usize * width..][..width];
        let limit = self.frame.max_distance() as f32;
        for x in (0..width).step_by(LANES) {
            let lanes = LANES.min(width - x);
            let mut ends = [0.0f32; LANES];
            for lane in 0..lanes {
                ends[lane] = depth[x + lane].min(limit);
            }
            let setup = self.frame.setup();
            let through = transmittances_of_pixels_f32(setup, (x as u32, y), &ends);
            let whole = self.light.whole_rays(self.simd, setup, (x as u32, y), &ends, &through);
            for lane in 0..lanes {
                inscattered[x + lane] = std::array::from_fn(|channel| whole[channel][lane]);
                transmittance[x + lane] = std::array::from_fn(|channel| through[channel][lane]);
            }
        }
    }
}

/// Sixteen pixels are resolved side by side, as core's closed forms are.
const _: () = assert!(LANES == RayLanes::COUNT);
