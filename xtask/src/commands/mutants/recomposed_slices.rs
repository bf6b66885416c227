//! An epipolar technique composed from the public stages of `epipolar`, so that a stage can be wrong: uniform slices,
//! the exact rows of a sun's map, prefix sums over the lit light rays before each pixel (Baran et al. 2010, Sections 3
//! and 4).
//!
//! Departures: every view ray has sums of its own weights `∫ exp(−σt·t) dt` instead of a factorisation's, so that no
//! rank is chosen; a pixel takes the answer of the slice nearest to it. Slow, and only for suns. It stands here because
//! `scatter-validate` names no technique.

use scatter::epipolar::{
    Cells, ColumnOrder, Epipole, Extrema, Fan, FanPixels, Integrator, IntegratorScratch, LayerExtrema, Major,
    MapLine, Problem, Queries, Row, RunIndex, Runs, Seen, Slice, SlicePlane, SliceSet, Terms, integrate,
};
use scatter::{
    CameraKind, Capabilities, ExtinctionKind, Frame, Light, LightKind, Limits, MapKind, PhaseKind,
    RenderError, RenderStats, ScatterImage, ShadowLayer, TechniqueInfo, VolumetricShadow, simd_level,
    walked_radiance,
};

/// What is wrong with a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SliceFault {
    /// Pixels ask for the sum up to the run before their own.
    PrefixSumOffByOne,
    /// Pixels get the answer of the slice behind the nearest one.
    SlicesShifted,
    /// A tile of the map takes its nearest depth for its farthest one too. (The two swapped are no fault of this
    /// technique: it asks whether the box between them is seen as one, from whichever end, and no row of the matrix sees
    /// a difference.)
    MinTakenForMax,
}

impl SliceFault {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::PrefixSumOffByOne, Self::SlicesShifted, Self::MinTakenForMax];

    /// A few words.
    pub fn name(self) -> &'static str {
        match self {
            Self::PrefixSumOffByOne => "prefix sum of light rays off by one",
            Self::SlicesShifted => "epipolar slices shifted by one",
            Self::MinTakenForMax => "min of map tiles taken for max",
        }
    }
}

/// Group and name of the row that must reject them all: its epipole is so far beside the image that slices are rows of
/// pixels, and two a pixel go through all centres. The correct technique is exact there to the rounding of f32.
pub const RUNG: (&str, &str) = ("the epipole", "1e6 pixels outside, sun");

/// The technique; correct without a fault.
#[derive(Debug, Clone, Copy)]
pub struct RecomposedSlices {
    /// What is wrong with it.
    pub fault: Option<SliceFault>,
}

/// Distance of slices \[pixels\]: see [`RUNG`].
const SPACING: f64 = 0.5;

/// Where rays end that go on for ever: a number that f32 knows. Everything is dark before it, or nothing is.
const LONGEST: f64 = 1e30;

/// What tools see of it.
pub static INFO: TechniqueInfo = TechniqueInfo::of_reference(
    "recomposed slices",
    "epipolar slices half a pixel apart, summed ray by ray",
    Capabilities {
        lights: &[LightKind::Directional],
        maps: &[MapKind::Unshadowed, MapKind::Orthographic],
        cameras: &[CameraKind::Perspective, CameraKind::OffCentre],
        extinctions: &[ExtinctionKind::Grey, ExtinctionKind::Rgb],
        phases: &[PhaseKind::Isotropic, PhaseKind::Rayleigh, PhaseKind::HenyeyGreenstein],
        phase_sums: true,
        endless_rays: true,
        limits: Limits { sun_g: 1.0, layer_texels: u32::MAX as u64, ..Limits::NOTHING },
        ..Capabilities::NOTHING
    },
);

impl VolumetricShadow for RecomposedSlices {
    fn id(&self) -> &'static str {
        INFO.id
    }

    fn capabilities(&self) -> Capabilities {
        INFO.capabilities
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        let size = frame.size();
        out.resize(size);
        let (inscattered, transmittance) = out.pixels_mut();
        for (index, (radiance, through)) in inscattered.iter_mut().zip(transmittance).enumerate() {
            let (x, y) = (index as u32 % size[0], index as u32 / size[0]);
            *through = frame.medium().transmittance(frame.ray_end(x, y)).map(|t| t as f32);
            // For the one pixel that may be in no fan: the epipole's own.
            *radiance = walked_radiance(frame, x, y).to_array().map(|value| value as f32);
        }
        let epipole = Epipole::new(frame.camera(), frame.light());
        let mut set = SliceSet::default();
        set.distribute(&epipole, size, SPACING);
        let mut extrema = Extrema::default();
        extrema.rebuild(simd_level(), frame.shadow());
        for fan in &set.fans {
            let mut pixels = FanPixels::default();
            pixels.find(&epipole, size, fan, &set.slices);
            let slices = &set.slices[fan.first..][..fan.count];
            let pass = Pass { frame, epipole, fan, extrema: &extrema, fault: self.fault };
            for (index, nearest) in nearest_pixels(fan, &pixels, slices).into_iter().enumerate() {
                if nearest.is_empty() {
                    continue;
                }
                let shift = usize::from(self.fault == Some(SliceFault::SlicesShifted));
                let slice = &slices[(index + shift).min(fan.count - 1)];
                for (pixel, sum) in nearest.iter().zip(pass.sums(slice, pixels.columns, &nearest)) {
                    let [x, y] = pass.place(*pixel);
                    inscattered[(y * size[0] + x) as usize] = pass.radiance([x, y], sum);
                }
            }
        }
        Ok(RenderStats::default())
    }
}

/// A pixel of a fan: column along its major axis, place across.
type FanPixel = [u32; 2];

/// For each slice the pixels that are nearer to it than to any other, column by column.
fn nearest_pixels(fan: &Fan, pixels: &FanPixels, slices: &[Slice]) -> Vec<Vec<FanPixel>> {
    let mut nearest = vec![Vec::new(); slices.len()];
    for (column, range) in (pixels.columns[0]..pixels.columns[1]).zip(&pixels.ranges) {
        let at = |slice: &Slice| slice.minor_at(fan.major, f64::from(column) + 0.5);
        for pixel in range[0]..range[1] {
            let centre = f64::from(pixel) + 0.5;
            let behind = slices.partition_point(|slice| at(slice) < centre).min(slices.len() - 1);
            let before = behind.saturating_sub(1);
            let is_before = (at(&slices[before]) - centre).abs() < (at(&slices[behind]) - centre).abs();
            nearest[if is_before { before } else { behind }].push([column, pixel as u32]);
        }
    }
    nearest
}

/// What the slices of a fan share.
struct Pass<'a> {
    frame: &'a Frame<'a>,
    epipole: Epipole,
    fan: &'a Fan,
    extrema: &'a Extrema,
    fault: Option<SliceFault>,
}

impl Pass<'_> {
    /// `[x, y]` of a pixel.
    fn place(&self, [column, across]: FanPixel) -> [u32; 2] {
        match self.fan.major {
            Major::X => [column, across],
            Major::Y => [across, column],
        }
    }

    /// `∫ exp(−σt·t) dt` over what each of these pixels sees lit of a slice, per channel.
    fn sums(&self, slice: &Slice, columns: [u32; 2], pixels: &[FanPixel]) -> Vec<[f32; 3]> {
        let ascending = self.fan.ascending == self.epipole.outward;
        let order = ColumnOrder { columns, ascending };
        let plane = SlicePlane::new(self.frame.camera(), &self.epipole, slice, self.fan.major);
        let sine = |column: u32| plane.view_ray(f64::from(column)).normalize().x.max(f64::MIN_POSITIVE);
        let ends: Vec<f64> = pixels
            .iter()
            .map(|&pixel| {
                let [x, y] = self.place(pixel);
                self.frame.ray_end(x, y).min(LONGEST)
            })
            .collect();
        let gammas: Vec<f32> =
            pixels.iter().zip(&ends).map(|(pixel, end)| (end * sine(pixel[0])) as f32).collect();
        let reach = gammas.iter().copied().fold(0.0, f32::max);
        let row = self.row(&plane, order, reach);
        let mut index = RunIndex::default();
        index.fill(row.starts(), reach, 1);
        let mut scratch = IntegratorScratch::default();
        let one = |((pixel, end), gamma): ((&FanPixel, &f64), &f32)| {
            let rank = order.rank(pixel[0]);
            let mut run = [0];
            index.find(row.starts(), &[*gamma], &mut run);
            let [run] = run;
            let weight = |t: f64| self.weight(t);
            let per_gamma = 1.0 / sine(pixel[0]);
            let starts = &row.starts()[..=run as usize];
            let mut prefix: Vec<Terms<4>> =
                starts.iter().map(|&start| weight((f64::from(start) * per_gamma).min(*end))).collect();
            prefix.push(weight(*end));
            let wrong = u32::from(self.fault == Some(SliceFault::PrefixSumOffByOne));
            let problem = Problem {
                runs: Runs {
                    lit: &row.lit()[..=run as usize],
                    prefix: &prefix,
                    tint: None,
                    columns: [rank, rank + 1],
                },
                queries: Queries { ranks: &[rank], runs: &[run.saturating_sub(wrong)] },
                ends: &[weight(*end)],
                ascending,
            };
            scratch.reserve(run as usize + 2, order.count(), 1, 4);
            let mut sum = [[0.0; 4]];
            integrate(Integrator::Tree, &problem, &mut scratch, &mut sum);
            let [[r, g, b, _]] = sum;
            [r, g, b]
        };
        pixels.iter().zip(&ends).zip(&gammas).map(one).collect()
    }

    /// `∫ exp(−σt·t) dt` from 0 to t, per channel; the fourth number fills a register.
    fn weight(&self, t: f64) -> Terms<4> {
        let [r, g, b] = self
            .frame
            .medium()
            .sigma_t()
            .map(|sigma| if sigma * t > 0.0 { -(-sigma * t).exp_m1() / sigma } else { t });
        [r as f32, g as f32, b as f32, 0.0]
    }

    /// The light rays of a slice up to `reach`.
    fn row(&self, plane: &SlicePlane, order: ColumnOrder, reach: f32) -> Row {
        let columns = order.count() as u32;
        let seen = Seen { cells: Cells::Exact, columns, split_over: 0.0 };
        let mut row = Row::default();
        let layer: Option<ShadowLayer<'_>> = self.frame.shadow().layers().next();
        let line = layer.and_then(|layer| {
            let eye = self.frame.camera().eye();
            // An ulp further, so that the last cell is whole.
            let reach = f64::from(reach) * (1.0 + 1e-6);
            Some((MapLine::sun(layer.projection(), eye, plane, order, reach)?, layer))
        });
        // Two cells a texel, each cut at every column at the most.
        row.clear(line.as_ref().map_or(0, |(line, _)| 2 * (line.columns * (columns + 2)) as usize) + 64);
        row.push(0.0, columns);
        if let Some((line, layer)) = line {
            let LayerExtrema { tiles, width } = self.extrema.layer(0);
            let flat: Vec<[f32; 2]> = tiles.iter().map(|[nearest, _]| [*nearest; 2]).collect();
            let is_wrong = self.fault == Some(SliceFault::MinTakenForMax);
            let tiles = if is_wrong { &flat } else { tiles };
            row.append(simd_level(), &line, layer.texels(), LayerExtrema { tiles, width }, seen);
            row.push(line.gamma.at(line.length), columns);
        }
        row.finish();
        row
    }

    /// `σs·p·L` times the sum.
    fn radiance(&self, [x, y]: [u32; 2], sum: [f32; 3]) -> [f32; 3] {
        let Light::Directional(sun) = self.frame.light() else { return [0.0; 3] };
        let cos_theta = -sun.direction().dot(self.frame.camera().pixel_ray(x, y).direction);
        let scattering = self.frame.medium().scattering_towards(0.5 * (1.0 - cos_theta));
        let strength = self.frame.light().strength();
        std::array::from_fn(|c| (scattering[c] * strength[c] * f64::from(sum[c])) as f32)
    }
}

#[cfg(test)]
mod tests {
    use scatter_validate::mutants::recomposed_result;
    use scatter_validate::stress::cell::Cell;

    use super::*;

    /// Positions up to 24 texels in f32 through a product and a quotient, over a ray of tens of units of which a texel
    /// is a few: a hundred roundings.
    const F32: f64 = 100.0 * f32::EPSILON as f64;

    #[test]
    fn the_correct_one_is_exact_at_the_rung_and_every_fault_is_far_beyond_its_limit() {
        for fault in SliceFault::ALL {
            let renderers = [None, Some(fault)].map(|fault| RecomposedSlices { fault });
            let result = recomposed_result(fault.name(), RUNG, &INFO, renderers);
            let [outcome] = &result.outcomes[..] else { panic!("one outcome") };
            assert!(matches!(outcome.correct, Cell::Ok { error } if error <= F32), "{:?}", outcome.correct);
            let Cell::Fail(miss) = &outcome.mutant else { panic!("{}: {:?}", fault.name(), outcome.mutant) };
            assert!(miss.error > 10.0 * miss.limit, "{}: {miss}", fault.name());
        }
    }
}
