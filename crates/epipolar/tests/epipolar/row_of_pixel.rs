//! The rectified row of the slice that goes exactly through one pixel's centre, made of the crate's public stages.

use epipolar::baran::Cells;
use epipolar::driver::{SliceAngles, SliceScene, SliceView};
use epipolar::geometry::Epipole;
use epipolar::rows::{MinMaxTiles, Row};
use glam::DVec3;
use scatter_core::{Frame, simd_level};

use crate::intervals::Intervals;

/// A pixel's slice, its row, and the pixel's place in both.
pub struct RowOfPixel {
    pub row: Row,
    /// The pixel's column, counted from the light.
    pub rank: u32,
    pub column_count: u32,
    /// Sine and cosine of the angle between view ray and light.
    pub sine: f64,
    pub cosine: f64,
    /// The light ray in which the pixel's ray ends.
    pub gamma_end: f64,
    /// Distance of a lamp.
    pub lamp: Option<f64>,
    /// Texel columns that were read.
    pub read: u64,
}

/// Where the sine of the angle to the light is smaller, γ says little about a ray.
const LEAST_SINE: f64 = 1e-3;

impl RowOfPixel {
    /// `None` where the pixel lies at the epipole.
    pub fn new(frame: &Frame<'_>, pixel: [u32; 2], cells: Cells) -> Option<Self> {
        let mut tiles = MinMaxTiles::default();
        tiles.rebuild(simd_level(), frame.shadow());
        Self::with_tiles(frame, pixel, cells, &tiles)
    }

    /// With other tiles than the map's own.
    pub fn with_tiles(
        frame: &Frame<'_>,
        [x, y]: [u32; 2],
        cells: Cells,
        tiles: &MinMaxTiles,
    ) -> Option<Self> {
        let epipole = Epipole::new(frame.camera(), frame.light());
        let scene = SliceScene { frame, epipole, tiles, simd: simd_level() };
        let mut angles = SliceAngles::default();
        let (slice, column) = SliceView::through_pixel(scene, [x, y], &mut angles)?;
        let ray = slice.plane.view_ray(f64::from(column)).normalize();
        let (sine, cosine) = (ray.x, ray.y);
        if sine < LEAST_SINE {
            return None;
        }
        let lamp = frame.light().position().map(|position| (position - frame.camera().eye()).length());
        let mut this = Self {
            row: Row::default(),
            rank: slice.order.rank(column),
            column_count: slice.order.count() as u32,
            sine,
            cosine,
            gamma_end: 0.0,
            lamp,
            read: 0,
        };
        this.gamma_end = this.gamma_of(frame.ray_end(x, y));
        // A few ulps more than the end, so that the last cell is whole.
        let slice = slice.up_to((this.gamma_end * (1.0 + 1e-6)) as f32);
        // Room for a cut at every column of every cell.
        let mut texels = 0;
        slice.for_each_line(|_, line| texels += line.columns);
        this.row.clear((2 * texels * (this.column_count + 2) + 64) as usize);
        this.read = match cells {
            Cells::Exact => slice.rectify(0.0, &mut this.row),
            Cells::Sampled(cells) => cells.rectify(&slice, &mut this.row),
        };
        Some(this)
    }

    /// γ of a point of the pixel's ray.
    pub fn gamma_of(&self, t: f64) -> f64 {
        match self.lamp {
            None => t * self.sine,
            Some(distance) => {
                let (towards, across) = (distance - t * self.cosine, t * self.sine);
                1.0 - towards / (towards.abs() + across)
            }
        }
    }

    /// The light rays that the pixel sees lit, up to where its ray ends.
    pub fn lit(&self) -> Intervals {
        let mut lit = Intervals::default();
        for (run, &columns) in self.row.lit().iter().enumerate() {
            if columns > self.rank {
                let (start, end) = (self.row.starts()[run], self.row.starts()[run + 1]);
                lit.push(f64::from(start).min(self.gamma_end), f64::from(end).min(self.gamma_end));
            }
        }
        lit
    }
}

/// A unit vector.
pub fn axis(index: usize) -> DVec3 {
    [DVec3::X, DVec3::Y, DVec3::Z][index]
}
