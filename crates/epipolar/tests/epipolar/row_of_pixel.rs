//! The rectified row of the slice that goes exactly through one pixel's centre, made of the crate's public stages.

use epipolar::{
    Cells, ColumnOrder, Epipole, Extrema, LayerExtrema, Major, MapLine, Row, Seen, Slice, SlicePlane,
};
use glam::{DVec2, DVec3};
use scatter_core::{Frame, MapProjection, ShadowMap, simd_level};

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
    pub read: u32,
}

/// Where the sine of the angle to the light is smaller, γ says little about a ray.
const LEAST_SINE: f64 = 1e-3;

impl RowOfPixel {
    /// `None` where the pixel lies at the epipole.
    pub fn new(frame: &Frame<'_>, pixel: [u32; 2], cells: Cells) -> Option<Self> {
        let mut extrema = Extrema::default();
        extrema.rebuild(simd_level(), frame.shadow());
        Self::with_extrema(frame, pixel, cells, |index| extrema.layer(index))
    }

    /// With other extrema than the map's own, layer by layer.
    pub fn with_extrema<'a>(
        frame: &Frame<'_>,
        [x, y]: [u32; 2],
        cells: Cells,
        extrema: impl Fn(usize) -> LayerExtrema<'a>,
    ) -> Option<Self> {
        let camera = frame.camera();
        let epipole = Epipole::new(camera, frame.light());
        let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let away = epipole.towards(centre);
        let major = if away.x.abs() >= away.y.abs() { Major::X } else { Major::Y };
        let slice = Slice::through(&epipole, major, centre);
        let (length, column) = match major {
            Major::X => (camera.size()[0], x),
            Major::Y => (camera.size()[1], y),
        };
        let step = |column: u32| major.of(epipole.towards(DVec2::splat(f64::from(column) + 0.5)));
        let fan_ascending = step(column) > 0.0;
        let own = |column: &u32| if fan_ascending { step(*column) > 0.0 } else { step(*column) < 0.0 };
        let columns = [(0..length).find(own)?, (0..length).rfind(own)? + 1];
        let order = ColumnOrder { columns, ascending: fan_ascending == epipole.outward };
        let plane = SlicePlane::new(camera, &epipole, &slice, major);
        let ray = plane.view_ray(f64::from(column)).normalize();
        let (sine, cosine) = (ray.x, ray.y);
        if sine < LEAST_SINE {
            return None;
        }
        let lamp = frame.light().position().map(|position| (position - camera.eye()).length());
        let end = frame.ray_end(x, y);
        let mut this = Self {
            row: Row::default(),
            rank: order.rank(column),
            column_count: order.count() as u32,
            sine,
            cosine,
            gamma_end: 0.0,
            lamp,
            read: 0,
        };
        this.gamma_end = this.gamma_of(end);
        this.fill(frame, &plane, order, cells, extrema);
        Some(this)
    }

    fn fill<'a>(
        &mut self,
        frame: &Frame<'_>,
        plane: &SlicePlane,
        order: ColumnOrder,
        cells: Cells,
        extrema: impl Fn(usize) -> LayerExtrema<'a>,
    ) {
        let columns = self.column_count;
        let seen = Seen { cells, columns, split_over: 0.0 };
        // The reach is f32 in the technique; an ulp more than the end, so that the last cell is whole.
        let reach = self.gamma_end * (1.0 + 1e-6);
        let line = |projection: &MapProjection| match self.lamp {
            None => MapLine::sun(projection, frame.camera().eye(), plane, order, reach),
            Some(distance) => MapLine::lamp(projection, plane, order, distance, reach),
        };
        let mut parts: Vec<_> = match frame.shadow() {
            ShadowMap::Unshadowed | ShadowMap::Cascades(_) => vec![],
            shadow => (shadow.layers().enumerate())
                .filter_map(|(index, layer)| Some((line(layer.projection())?, layer, index)))
                .collect(),
        };
        parts.sort_by(|a, b| a.0.gamma.at(0.0).total_cmp(&b.0.gamma.at(0.0)));
        // Room for a cut at every column of every cell.
        let texels: u32 = parts.iter().map(|(line, ..)| line.columns).sum();
        self.row.clear((2 * texels * (columns + 2) + 64) as usize);
        self.row.push(0.0, columns);
        let mut covered = -1.0;
        for (line, layer, index) in &parts {
            if line.gamma.at(line.length) <= covered {
                continue; // The slice runs along the edge between two faces.
            }
            covered = line.gamma.at(line.length);
            self.read += self.row.append(simd_level(), line, layer.texels(), extrema(*index), seen);
            self.row.push(line.gamma.at(line.length), columns);
        }
        self.row.finish();
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
