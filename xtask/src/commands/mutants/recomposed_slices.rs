//! An epipolar technique on `epipolar`'s slice driver, of which a stage can be wrong: even slices, exact rows of a sun's map,
//! and the direct sum over the lit light rays before each pixel (Baran et al. 2010, Sections 3 and 4).
//!
//! It stands here because `scatter-validate` names no technique.

use scatter::epipolar::baran::sum_directly;
use scatter::epipolar::driver::{SliceAngles, SliceQueries, SliceRoom, SliceScene, SliceSettings, SliceView};
use scatter::epipolar::geometry::{Major, Slice};
use scatter::epipolar::rows::{MinMaxTiles, Row};
use scatter::epipolar::{self, SliceDriver, SliceIntegrator};
use scatter::{
    Capabilities, Frame, LightKind, RenderError, RenderStats, ScatterImage, TechniqueInfo, VolumetricShadow,
    simd_level,
};

/// What is wrong with a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SliceFault {
    /// Light rays are summed with the place of the run before.
    PrefixSumOffByOne,
    /// Pixels get the answer of the slice behind the nearest one.
    SlicesShifted,
    /// A tile of the map takes its nearest depth for its farthest one too. (The two swapped are no fault: rows ask whether
    /// the box between them is seen as one, from whichever end.)
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

/// Distance of slices \[pixels\]: at [`RUNG`] every pixel's centre has a slice of its own.
const SPACING: f64 = 0.5;

/// What tools see of it.
pub static INFO: TechniqueInfo = TechniqueInfo::of_reference(
    "recomposed slices",
    "epipolar slices half a pixel apart, summed ray by ray",
    Capabilities {
        lights: &[LightKind::Directional],
        textures: &[],
        height_fog: &[],
        translucent: &[],
        ..epipolar::CAPABILITIES
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
        Ok(SliceDriver::new(*self).render(frame, &SliceSettings::even(SPACING), out))
    }
}

impl SliceIntegrator for RecomposedSlices {
    /// The row, angles of a wrong slice, and tiles that take their nearest depth for their farthest one.
    type Scratch = (Row, SliceAngles, MinMaxTiles);

    fn channels(&self) -> usize {
        3
    }

    fn reserve(&self, room: &SliceRoom<'_>, (row, _, flat): &mut Self::Scratch) {
        row.clear(room.runs);
        flat.rebuild(simd_level(), room.frame.shadow());
        for layer in 0..room.frame.shadow().layer_count() {
            flat.layer_mut(layer).iter_mut().for_each(|[nearest, farthest]| *farthest = *nearest);
        }
    }

    fn integrate(&self, slice: &SliceView<'_>, queries: &mut SliceQueries, scratch: &mut Self::Scratch) {
        let (row, angles, flat) = scratch;
        let is = |fault| self.fault == Some(fault);
        let right = slice.scene();
        let scene =
            SliceScene { tiles: if is(SliceFault::MinTakenForMax) { flat } else { right.tiles }, ..right };
        let mut exit = slice.slice.exit;
        if is(SliceFault::SlicesShifted) {
            *(if slice.major == Major::X { &mut exit.y } else { &mut exit.x }) += SPACING;
        }
        let line = Slice::through(&scene.epipole, slice.major, exit);
        SliceView::new(scene, line, slice.major, slice.order, angles).up_to(slice.reach()).rectify(0.0, row);
        let mut lit = row.lit().to_vec();
        lit.rotate_right(usize::from(is(SliceFault::PrefixSumOffByOne)));
        sum_directly(slice, (row.starts(), &lit), None, queries);
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
