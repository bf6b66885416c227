//! The map itself: rendered by a source, or resampled from the frame's own map; and the rows of slices that are read from it.

use epipolar::driver::{SliceLight, SliceView};
use epipolar::geometry::diamond_angle;
use epipolar::rows::Row;
use scatter_core::{Frame, Level, MapError, MapSource, RenderError, at_level, simd_level};

use super::columns::LightSpread;
use super::reach::Reach;
use super::rectification::{Extent, NotRectified, Rectification};
use super::resampling::resample;

/// Texels that become lit columns side by side.
const LANES: usize = 64;

/// Least cosine between a slice and the bisectrix: slices beside the image that no pixel needs may have less.
const LEAST_COSINE: f64 = 1e-3;

/// Most splits of a map.
pub const MOST_SPLITS: usize = 16;

/// How many texels a map has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OwnMapSettings {
    /// Texels along view rays, over all splits.
    pub columns: u32,
    /// Texels across them.
    pub rows: u32,
    /// In how many maps the columns are cut (Klehm et al. 2014, Section 4.2, after Zhang et al. 2006).
    pub splits: u32,
}

/// A projective shadow map with its texels; kept from frame to frame.
#[derive(Debug)]
pub struct OwnMap {
    rectification: Option<Rectification>,
    columns: usize,
    rows: usize,
    splits: u32,
    /// κ between the splits, one more than there are.
    borders: [f64; MOST_SPLITS + 1],
    /// z/w of the first surface along each light ray, ∞ for none: `[split][row][column]`.
    texels: Vec<f32>,
    split: Vec<f32>,
    reach: Reach,
    spread: LightSpread,
    simd: Level,
}

impl Default for OwnMap {
    /// Empty, for the CPU that it runs on.
    fn default() -> Self {
        Self {
            rectification: None,
            columns: 0,
            rows: 0,
            splits: 0,
            borders: [0.0; MOST_SPLITS + 1],
            texels: Vec::new(),
            split: Vec::new(),
            reach: Reach::default(),
            spread: LightSpread::default(),
            simd: simd_level(),
        }
    }
}

impl OwnMap {
    /// Makes the map of a frame, by a source of maps, or from the frame's own map without one; an error of the source's, or the
    /// reason why there is no such map. The reason leaves no map, and so does [`Self::clear`].
    pub fn fill(
        &mut self,
        (frame, source): (&Frame<'_>, Option<&dyn MapSource>),
        settings: OwnMapSettings,
        by_itself: bool,
        extent: Extent,
    ) -> Result<Result<(), NotRectified>, RenderError> {
        self.clear();
        let mut rectification =
            match Rectification::new(frame, by_itself, extent, (&mut self.reach, self.simd)) {
                Ok(rectification) => rectification,
                Err(reason) => return Ok(Err(reason)),
            };
        let OwnMapSettings { columns, rows, splits } = settings;
        self.splits = splits.clamp(1, columns.clamp(1, MOST_SPLITS as u32));
        let a_split = (columns / self.splits).max(1);
        (self.columns, self.rows) = (a_split as usize, rows.max(1) as usize);
        self.lay_borders(frame, &mut rectification, extent);
        let area = self.columns * self.rows;
        self.texels.clear();
        self.texels.resize(area * self.splits as usize, f32::INFINITY);
        for split in 0..self.splits {
            let borders = self.split_borders(split);
            match source {
                Some(source) => {
                    let clip = rectification.clip_from_world(borders);
                    source.clip_map(clip, [a_split, rows], &mut self.split)?;
                    checked(&self.split, area)?;
                    self.texels[split as usize * area..][..area].copy_from_slice(&self.split);
                }
                None => {
                    let texels = &mut self.texels[split as usize * area..][..area];
                    resample(self.simd, (&rectification, borders), frame.shadow(), self.columns, texels);
                }
            }
        }
        self.rectification = Some(rectification);
        Ok(Ok(()))
    }

    /// Where the splits lie: means of whole rays need texels where the light of rays is, rows of runs only to come near enough.
    fn lay_borders(&mut self, frame: &Frame<'_>, rectification: &mut Rectification, extent: Extent) {
        let borders = &mut self.borders[..=self.splits as usize];
        match extent {
            Extent::Maps => {
                for (index, border) in borders.iter_mut().enumerate() {
                    *border = rectification.split_border(index as u32, self.splits);
                }
            }
            Extent::ViewRays => {
                let farthest = rectification.columns[1];
                self.spread.fill(frame, rectification);
                let far = rectification.place(farthest);
                let near = self.spread.nearest(far);
                self.spread.borders([near, far], borders);
                borders.iter_mut().for_each(|border| *border = rectification.column(*border));
                borders[self.splits as usize] = farthest;
                rectification.columns = [borders[0], farthest];
            }
        }
    }

    /// Forgets the map; its memory stays.
    pub fn clear(&mut self) {
        self.rectification = None;
    }

    /// Whether there is a map.
    pub fn is_filled(&self) -> bool {
        self.rectification.is_some()
    }

    /// Axes and ranges; `None` without a map.
    pub fn rectification(&self) -> Option<&Rectification> {
        self.rectification.as_ref()
    }

    /// Texels of all splits.
    pub fn texel_count(&self) -> usize {
        self.width() * self.rows
    }

    /// Columns of all splits.
    pub fn width(&self) -> usize {
        self.columns * self.splits as usize
    }

    /// Rows.
    pub fn row_count(&self) -> usize {
        self.rows
    }

    /// Columns of one split.
    pub fn columns_of_split(&self) -> usize {
        self.columns
    }

    /// Splits.
    pub fn split_count(&self) -> u32 {
        self.splits
    }

    /// κ at which a split begins and at which it ends.
    pub fn split_borders(&self, split: u32) -> [f64; 2] {
        [self.borders[split as usize], self.borders[split as usize + 1]]
    }

    /// y of the middle of a row.
    pub fn row_middle(&self, rectification: &Rectification, row: usize) -> f64 {
        let [low, high] = rectification.rows;
        high - (high - low) * (row as f64 + 0.5) / self.rows as f64
    }

    /// The texels of a row in one split, 0 to 1, or more for no surface.
    pub fn row_of_split(&self, split: u32, row: usize) -> &[f32] {
        &self.texels[(split as usize * self.rows + row) * self.columns..][..self.columns]
    }

    /// Runs that a row may have beside those of the given map.
    pub fn most_runs(&self) -> usize {
        if self.is_filled() { self.width() + 4 } else { 0 }
    }

    /// Fills `row` with a slice's light rays: those nearer to the eye than the map from the given map, all others from the
    /// row of texels in which the slice lies. A texel's surface is one view ray, so a texel is one run. Returns how many texels
    /// were read. O(columns).
    #[inline(always)]
    pub fn rectify(&self, slice: &SliceView<'_>, uncut_columns: f32, row: &mut Row) -> u64 {
        let Some(rectification) = &self.rectification else { return slice.rectify(uncut_columns, row) };
        let cosine = rectification.along.dot(slice.plane.across);
        if !(cosine > LEAST_COSINE) {
            return slice.rectify(uncut_columns, row);
        }
        let light_ray = |column: f64| match slice.light {
            SliceLight::Sun => (1.0 / (column * cosine)) as f32,
            SliceLight::Lamp { .. } => diamond_angle((column * cosine) as f32, 1.0),
        };
        let nearest = light_ray(rectification.columns[0]);
        let mut read = slice.up_to(slice.reach().min(nearest)).rectify(uncut_columns, row);
        row.reserve(self.most_runs());
        let y = rectification.across.dot(slice.plane.across) / cosine;
        let [low, high] = rectification.rows;
        let place = (high - y) / (high - low) * self.rows as f64;
        let index = (place.max(0.0) as usize).min(self.rows - 1);
        let surface = Surfaces::new(rectification, slice, cosine);
        for split in 0..self.splits {
            let [near, far] = self.split_borders(split);
            if light_ray(near) > slice.reach() {
                break;
            }
            let texels = self.row_of_split(split, index);
            read += texels.len() as u64;
            let step = (far - near) / self.columns as f64;
            at_level!(
                slice.scene().simd,
                surface.append(texels, row, |column| light_ray(near + step * column as f64))
            );
        }
        row.push(light_ray(rectification.columns[1]), slice.order.count() as u32);
        row.finish();
        read
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.texels.capacity() + self.split.capacity())
            + self.reach.memory_bytes()
            + self.spread.memory_bytes()
    }
}

/// What a texel's depth means in one slice: how many of its columns, counted from the light, see the light ray lit.
struct Surfaces {
    /// Fractional lit columns of a depth: numerator and denominator, each `start + depth·step`.
    numerator: [f32; 2],
    denominator: [f32; 2],
    columns: f32,
}

impl Surfaces {
    fn new(rectification: &Rectification, slice: &SliceView<'_>, cosine: f64) -> Self {
        let [first, last] = rectification.depths;
        // The surface at depth z is the view ray (1, −z·cosine) of the plane.
        let [numerator, denominator] = slice.order.lit_rows(slice.plane.column_from_plane()).map(|row| {
            let at = |z: f64| row.x - row.y * z * cosine;
            [at(first) as f32, (at(last) - at(first)) as f32]
        });
        Self { numerator, denominator, columns: slice.order.count() as f32 }
    }

    /// Appends a row of texels; `start` is the light ray at which a column begins.
    #[inline(always)]
    fn append(&self, texels: &[f32], row: &mut Row, start: impl Fn(usize) -> f32) {
        let mut last = u32::MAX;
        for (block, texels) in texels.chunks(LANES).enumerate() {
            let mut lit = [0u32; LANES];
            for (lit, &depth) in lit.iter_mut().zip(texels) {
                *lit = self.lit(depth);
            }
            for (lane, &lit) in lit[..texels.len()].iter().enumerate() {
                if lit != last {
                    row.push(start(block * LANES + lane), lit);
                    last = lit;
                }
            }
        }
    }

    #[inline(always)]
    fn lit(&self, depth: f32) -> u32 {
        // Behind all view rays; ∞ must not meet a factor of 0.
        let z = depth.min(1.0);
        let numerator = self.numerator[0] + self.numerator[1] * z;
        let denominator = self.denominator[0] + self.denominator[1] * z;
        let behind = if numerator < denominator { 0.0 } else { self.columns };
        let lit = if denominator > 0.0 { numerator / denominator } else { behind };
        let lit = if depth >= 1.0 { self.columns } else { lit };
        lit.max(0.0).min(self.columns) as u32
    }
}

/// Depths that a source has made must be depths.
fn checked(texels: &[f32], area: usize) -> Result<(), MapError> {
    if texels.len() != area {
        let problem = format!("it made {} texels of a map of {area}; fill all of them", texels.len());
        return Err(MapError::Source(problem));
    }
    match texels.iter().position(|depth| !(*depth >= 0.0)) {
        None => Ok(()),
        Some(place) => Err(MapError::Source(format!(
            "texel {place} of a map of z/w is {}; give depths from 0 to 1, or +∞ for no surface",
            texels[place]
        ))),
    }
}
