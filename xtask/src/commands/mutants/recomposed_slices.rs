//! An epipolar technique on `epipolar`'s slice driver, of which a stage can be wrong: even slices, exact rows of a sun's map,
//! and for every view ray the sum over the lit light rays before it (Baran et al. 2010, Sections 3 and 4), run by run.
//!
//! It stands here because `scatter-validate` names no technique.

use scatter::epipolar::driver::{
    Refinement, Resampling, SliceAngles, SliceQueries, SliceRoom, SliceScene, SliceSettings, SliceView,
};
use scatter::epipolar::geometry::{Major, Slice};
use scatter::epipolar::rows::{MinMaxTiles, Row};
use scatter::epipolar::{SliceDriver, SliceIntegrator};
use scatter::{
    CameraKind, Capabilities, ExtinctionKind, Frame, LightKind, Limits, MapKind, PhaseKind, RayLight,
    RenderError, RenderStats, ScatterImage, TechniqueInfo, VolumetricShadow, simd_level,
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

/// Half a pixel apart, so that at [`RUNG`] every pixel's centre has a slice of its own.
const SLICES: SliceSettings = SliceSettings {
    spacing: 0.5,
    fewest_slices: 1.0,
    target: None,
    refinement: Refinement { tolerance: 1.0, floor: 1.0, halvings: 0, walks_rest: false },
    resampling: Resampling::Pixels,
};

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
        Ok(SliceDriver::new(*self).render(frame, &SLICES, out))
    }
}

/// A worker's row, and what a fault needs.
#[derive(Debug, Default)]
pub struct Scratch {
    row: Row,
    angles: SliceAngles,
    /// Tiles that take their nearest depth for their farthest one.
    flat: MinMaxTiles,
}

impl SliceIntegrator for RecomposedSlices {
    type Scratch = Scratch;

    fn channels(&self) -> usize {
        3
    }

    fn reserve(&self, room: &SliceRoom<'_>, scratch: &mut Scratch) {
        scratch.row.clear(room.runs);
        scratch.flat.rebuild(simd_level(), room.frame.shadow());
        for layer in 0..room.frame.shadow().layers().count() {
            scratch.flat.layer_mut(layer).iter_mut().for_each(|[nearest, farthest]| *farthest = *nearest);
        }
    }

    fn integrate(&self, slice: &SliceView<'_>, queries: &mut SliceQueries, scratch: &mut Scratch) {
        let Scratch { row, angles, flat } = scratch;
        let is = |fault| self.fault == Some(fault);
        let right = slice.scene();
        let scene =
            SliceScene { tiles: if is(SliceFault::MinTakenForMax) { flat } else { right.tiles }, ..right };
        let mut exit = slice.slice.exit;
        if is(SliceFault::SlicesShifted) {
            *(if slice.major == Major::X { &mut exit.y } else { &mut exit.x }) += SLICES.spacing;
        }
        let line = Slice::through(&scene.epipole, slice.major, exit);
        SliceView::new(scene, line, slice.major, slice.order, angles).up_to(slice.reach()).rectify(0.0, row);
        let open = queries.open(0..queries.len());
        let mut shares = open.shares;
        for (query, (&column, &end)) in open.columns.iter().zip(open.ends).enumerate() {
            let column = slice.order.columns[0] + column;
            let (ray, rank) = (slice.view_ray(column), slice.order.rank(column));
            let light =
                RayLight::new(slice.frame().light(), slice.frame().medium(), slice.camera().eye(), &ray);
            let sine = slice.plane.view_ray(f64::from(column)).normalize().x;
            let meets = |gamma: f32| (f64::from(gamma) / sine).min(end.into());
            let last = row.starts().partition_point(|&start| meets(start) < end.into());
            let runs =
                if is(SliceFault::PrefixSumOffByOne) { last.saturating_sub(1) } else { last.min(row.len()) };
            let mut sum = [0.0; 3];
            for run in (0..runs).filter(|&run| row.lit()[run] > rank) {
                let lit = light.interval(meets(row.starts()[run]), meets(row.starts()[run + 1]));
                sum.iter_mut().zip(lit.to_array()).for_each(|(sum, lit)| *sum += lit);
            }
            let whole = light.interval(0.0, end.into()).to_array();
            for (shares, (sum, whole)) in shares.iter_mut().zip(sum.into_iter().zip(whole)) {
                shares[query] = if whole > 0.0 { (sum / whole) as f32 } else { 1.0 };
            }
        }
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
