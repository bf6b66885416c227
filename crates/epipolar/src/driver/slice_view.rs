//! One slice as whoever sums it sees it: its columns from the light on, its plane, its light, and its lines through all maps
//! of the light in the order of the light rays.

use glam::{DVec2, DVec3};
use scatter_core::{Camera, Frame, Level, Light, LightTexture, SpotLight, ViewRay};

use crate::geometry::{
    ColumnOrder, Epipole, Major, Slice, SlicePlane, diamond_angle, direction_of_diamond_angle,
};
use crate::rows::{MapLine, MinMaxTiles, Row, RowSettings, for_each_line, line_through};

/// What the slices of a frame share.
#[derive(Clone, Copy)]
pub struct SliceScene<'a> {
    /// The frame.
    pub frame: &'a Frame<'a>,
    /// Where its slices meet.
    pub epipole: Epipole,
    /// Extrema of the shadow map's tiles.
    pub tiles: &'a MinMaxTiles,
    /// With which instructions rows are read.
    pub simd: Level,
}

/// The light of a slice, in its plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SliceLight {
    /// Light rays are parallel; γ is the distance of a light ray from the eye.
    Sun,
    /// Light rays meet in the lamp; γ is the [`diamond_angle`] of a light ray, 0 towards the eye.
    Lamp {
        /// Distance of the lamp from the eye \[world units\].
        distance: f64,
    },
}

impl SliceLight {
    /// Of a frame.
    pub fn of(frame: &Frame<'_>) -> Self {
        match frame.light().position() {
            None => Self::Sun,
            Some(position) => Self::Lamp { distance: (position - frame.camera().eye()).length() },
        }
    }

    /// Distance of a lamp from the eye.
    pub fn lamp_distance(self) -> Option<f64> {
        match self {
            Self::Sun => None,
            Self::Lamp { distance } => Some(distance),
        }
    }

    /// The light ray γ that meets a view ray, at the angle β to the light, at the distance `t` from the eye.
    #[inline(always)]
    pub fn light_ray(self, t: f64, sine: f64, cosine: f64) -> f64 {
        match self {
            Self::Sun => t * sine,
            Self::Lamp { distance } => {
                let (towards, across) = (distance - t * cosine, t * sine);
                let size = (towards.abs() + across).max(f64::MIN_POSITIVE);
                if towards >= 0.0 { across / size } else { 2.0 - across / size }
            }
        }
    }

    /// How far from the eye a view ray meets the light ray γ: the inverse of [`Self::light_ray`]; ∞ where it does not.
    #[inline(always)]
    pub fn distance(self, gamma: f64, sine: f64, cosine: f64) -> f64 {
        match self {
            Self::Sun => gamma / sine,
            Self::Lamp { distance } => {
                let DVec2 { x: towards, y: across } = direction_of_diamond_angle(gamma);
                let divergence = across * cosine + towards * sine;
                if divergence > 0.0 { distance * across / divergence } else { f64::INFINITY }
            }
        }
    }
}

/// Sines and cosines of the angles between a slice's view rays and its light; a buffer.
#[derive(Debug, Default)]
pub struct SliceAngles {
    sines: Vec<f32>,
    cosines: Vec<f32>,
}

impl SliceAngles {
    /// Room for slices of `columns` columns.
    pub fn reserve(&mut self, columns: usize) {
        for buffer in [&mut self.sines, &mut self.cosines] {
            buffer.resize(columns.max(buffer.len()), 0.0);
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.sines.capacity() + self.cosines.capacity())
    }
}

/// One slice of a frame, for some consecutive columns: the half-plane through the eye and the light that an image line shows
/// (Baran et al. 2010, Section 3), with everything that a sum over its light rays needs.
#[derive(Clone, Copy)]
pub struct SliceView<'a> {
    scene: SliceScene<'a>,
    /// The slice's line in the image.
    pub slice: Slice,
    /// The image axis that its columns are counted along.
    pub major: Major,
    /// Its columns, from the light on.
    pub order: ColumnOrder,
    /// Its half-plane.
    pub plane: SlicePlane,
    /// Its light.
    pub light: SliceLight,
    sines: &'a [f32],
    cosines: &'a [f32],
    reach: f32,
    is_exact: bool,
}

impl<'a> SliceView<'a> {
    /// Some consecutive columns of a slice that is counted along an image axis. Up to the last light ray;
    /// [`Self::up_to`] ends it earlier.
    #[inline(always)]
    pub fn new(
        scene: SliceScene<'a>,
        slice: Slice,
        major: Major,
        order: ColumnOrder,
        angles: &'a mut SliceAngles,
    ) -> Self {
        let plane = SlicePlane::new(scene.frame.camera(), &scene.epipole, &slice, major);
        let count = order.count();
        angles.reserve(count);
        let SliceAngles { sines, cosines } = angles;
        plane.angles(order.columns[0], &mut sines[..count], &mut cosines[..count]);
        let light = SliceLight::of(scene.frame);
        let (sines, cosines) = (&sines[..count], &cosines[..count]);
        Self { scene, slice, major, order, plane, light, sines, cosines, reach: f32::MAX, is_exact: false }
    }

    /// The slice through the centre of pixel `(x, y)`, with all columns on its side of the epipole, and the pixel's column;
    /// `None` where it is too near to the epipole.
    pub fn through_pixel(
        scene: SliceScene<'a>,
        [x, y]: [u32; 2],
        angles: &'a mut SliceAngles,
    ) -> Option<(Self, u32)> {
        let epipole = scene.epipole;
        let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let away = epipole.towards(centre);
        if epipole.is_too_near(away) {
            return None;
        }
        let major = if away.x.abs() >= away.y.abs() { Major::X } else { Major::Y };
        let [width, height] = scene.frame.size();
        let (length, column) = if major == Major::X { (width, x) } else { (height, y) };
        let step = |column: u32| major.of(epipole.towards(DVec2::splat(f64::from(column) + 0.5)));
        let ascending = step(column) > 0.0;
        let own = |column: &u32| if ascending { step(*column) > 0.0 } else { step(*column) < 0.0 };
        let columns = [(0..length).find(own)?, (0..length).rfind(own)? + 1];
        let slice = Slice::through(&epipole, major, centre);
        let order = ColumnOrder { columns, ascending: ascending == epipole.outward };
        Some((Self::new(scene, slice, major, order, angles), column))
    }

    /// The same slice up to the light ray γ = `reach`.
    #[inline(always)]
    pub fn up_to(self, reach: f32) -> Self {
        Self { reach, ..self }
    }

    /// The same slice, whose texels are all cut where they pass from view ray to view ray: what others are measured against.
    #[inline(always)]
    pub fn exactly(self) -> Self {
        Self { is_exact: true, ..self }
    }

    /// The last light ray that is asked for.
    pub fn reach(&self) -> f32 {
        self.reach
    }

    /// What it shares with the other slices of its frame.
    pub fn scene(&self) -> SliceScene<'a> {
        self.scene
    }

    /// The frame.
    pub fn frame(&self) -> &'a Frame<'a> {
        self.scene.frame
    }

    /// The frame's camera.
    pub fn camera(&self) -> &'a Camera {
        self.scene.frame.camera()
    }

    /// A spot light's cone.
    pub fn spot(&self) -> Option<&'a SpotLight> {
        match self.scene.frame.light() {
            Light::Spot(spot) => Some(spot),
            Light::Directional(_) | Light::Point(_) => None,
        }
    }

    /// Sine of the angle β between each column's view ray and the light, > 0; from the first column on.
    #[inline(always)]
    pub fn sines(&self) -> &'a [f32] {
        self.sines
    }

    /// Cosine of it.
    #[inline(always)]
    pub fn cosines(&self) -> &'a [f32] {
        self.cosines
    }

    /// The view ray of a column, relative to the eye.
    pub fn view_ray(&self, column: u32) -> ViewRay {
        let ray = self.plane.view_ray(f64::from(column)).normalize();
        let direction = self.plane.across * ray.x + self.plane.to_light * ray.y;
        ViewRay { origin: DVec3::ZERO, direction }
    }

    /// Calls `visit(layer, line)` for every stretch of the slice's light rays that lies in one map of the light, from the eye
    /// on, each light ray once; what lies between two stretches no map shadows.
    #[inline(always)]
    pub fn for_each_line(&self, visit: impl FnMut(usize, MapLine)) {
        let (shadow, eye) = (self.scene.frame.shadow(), self.camera().eye());
        let reach = f64::from(self.reach);
        for_each_line(shadow, eye, (&self.plane, self.order), self.light.lamp_distance(), reach, visit);
    }

    /// The slice's line through a texture of its light.
    #[inline(always)]
    pub fn texture_line(&self, texture: &LightTexture<'_>) -> Option<MapLine> {
        let (eye, lamp) = (self.camera().eye(), self.light.lamp_distance());
        line_through(texture.projection(), eye, (&self.plane, self.order), lamp, f64::from(self.reach))
    }

    /// All depths of a layer of the shadow map, `[row][column]`.
    #[inline(always)]
    pub fn texels(&self, layer: usize) -> &'a [f32] {
        self.scene.frame.shadow().layer(layer).map_or(&[], |layer| layer.texels())
    }

    /// Fills `row` with the light rays of the slice up to its reach, exactly; returns how many texel columns were read.
    ///
    /// Along the slice the row is the map's own visibility: cells end where the line crosses from texel to texel, and a
    /// texel's surface is cut where it passes from one view ray to the next, if it hides more than `uncut_columns` columns
    /// (0 to 16; of a slice that is to be [exact](Self::exactly), 0). Positions are f32: the row is that of an eye moved by less than 1e-6 of the distances (test
    /// `rows_are_the_walk_of_an_eye_moved_by_little`). O(texels in doubt along the slice).
    #[inline(always)]
    pub fn rectify(&self, uncut_columns: f32, row: &mut Row) -> u64 {
        let uncut_columns = if self.is_exact { 0.0 } else { uncut_columns };
        let settings = RowSettings { columns: self.order.count() as u32, uncut_columns };
        let SliceScene { tiles, simd, .. } = self.scene;
        self.fill_row(row, |row, line, layer| {
            row.append(simd, line, self.texels(layer), tiles.layer(layer), settings)
        })
    }

    /// Fills `row`, of which `append` appends the light rays of one line through one layer; returns the sum of what it
    /// returns. What no map holds is lit for all columns.
    #[inline(always)]
    pub fn fill_row(&self, row: &mut Row, mut append: impl FnMut(&mut Row, &MapLine, usize) -> u32) -> u64 {
        let columns = self.order.count() as u32;
        let mut read = 0;
        row.clear(0);
        row.push(0.0, columns);
        self.for_each_line(|layer, line| {
            row.make_room(2 * line.columns as usize);
            read += u64::from(append(row, &line, layer));
            // Outside of the map nothing is shadowed.
            row.push(line.gamma.at(line.length), columns);
        });
        row.finish();
        read
    }
}

/// As [`SliceLight::light_ray`], in f32.
#[inline(always)]
pub(super) fn lamp_light_ray(distance: f32, t: f32, sine: f32, cosine: f32) -> f32 {
    diamond_angle(distance - t * cosine, t * sine)
}
