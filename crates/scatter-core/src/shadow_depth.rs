//! Shadow maps as engines hold them: z/w of either direction through a matrix, or distances from the lamp.
//!
//! A [`ShadowLayer`] stores depths that are linear along the light's axis, `+∞` for "no surface".
//! [`ShadowDepthEncoding`], the twin of [`DepthEncoding`](crate::DepthEncoding), makes them of what a shadow pass wrote: one
//! map, the layers of a cascade array, or the six layers of a cube, each with its matrix.
//!
//! A parallel map's depth is z/w itself, counted from the near plane in world units. In a perspective the z row is a sum
//! of the others and a constant, z = kx·x + ky·y + k·w + β, so along the light ray of a texel's centre (a, b)
//! z/w = kx·a + ky·b + k + β/w, solved for w. That covers near planes that are oblique, and far planes at infinity.

use glam::{DVec2, DVec3, DVec4};

use crate::clip_rows::ClipRows;
use crate::clip_space::ClipSpace;
use crate::depth_quotient::ShadowDepthQuotient;
use crate::error::{ModelError, checked, checked_len, checked_size, checked_texels};
use crate::map_projection::MapProjection;
use crate::shadow_map::ShadowLayer;

const MATRIX: &str = "shadow map clip_from_world";

/// How an engine's shadow map encodes depth, and the clip space of its matrices.
///
/// A bias that the engine's pass added (constant, or by slope) is in its texels and stays there: surfaces then lie that
/// much deeper, and light reaches that much farther. Nothing is added here. Every texel is a surface at its centre's
/// depth, whatever filter the engine uses.
///
/// Cascades of a sun with reversed z in f32, as Bevy and many others render them (`Depth32Float`, cleared to 0):
///
/// ```
/// use glam::{Mat4, Vec3};
/// use scatter_core::{
///     Camera, ClipSpace, DepthEncoding, DepthMap, Frame, Light, Medium, Phase, ShadowDepthEncoding, ShadowMap,
/// };
///
/// # fn main() -> Result<(), scatter_core::ModelError> {
/// // What the engine has, in f32. Its camera: reversed z with an infinite far plane.
/// let (size, near) = ([64_u32, 36], 0.1);
/// let world_from_view = Mat4::from_translation(Vec3::new(0.0, 1.7, 8.0));
/// let view_from_world = world_from_view.inverse();
/// let clip_from_view = glam::camera::rh::proj::directx::perspective_infinite_reverse(1.0, 16.0 / 9.0, near);
/// let depth_buffer = vec![0.01_f32; 64 * 36];
///
/// // Its sun: four cascades in one array texture, each four times as wide, near and far swapped for reversed z.
/// let direction = Vec3::new(0.3, -1.0, 0.2).normalize();
/// let light_from_world = glam::camera::rh::view::look_to_mat4(-50.0 * direction, direction, Vec3::X);
/// let cascades: [Mat4; 4] = std::array::from_fn(|index| {
///     let half = 4.0_f32.powi(index as i32);
///     glam::camera::rh::proj::directx::orthographic(-half, half, -half, half, 100.0, 0.0) * light_from_world
/// });
/// // [cascade][row][column]: here nothing but the upper left quarter of each is below a roof, 40 units from the near plane.
/// let side = 32_u32;
/// let roof = |texel: u32| texel % side < side / 2 && texel / side % side < side / 2;
/// let shadow_texels: Vec<f32> = (0..4 * side * side).map(|texel| if roof(texel) { 0.6 } else { 0.0 }).collect();
///
/// // What the model wants, in f64. Keep the two buffers: from the second frame on nothing is allocated.
/// let matrix = |m: Mat4| m.as_dmat4().to_cols_array_2d();
/// let space = ClipSpace::WGPU.reversed();
/// let (mut distances, mut depths) = (Vec::new(), Vec::new());
///
/// let camera = Camera::from_matrices_in(matrix(view_from_world), matrix(clip_from_view), space, size)?;
/// // The product in f64: one in f32 loses digits of an eye that is far from the origin.
/// let clip_from_world = (clip_from_view.as_dmat4() * view_from_world.as_dmat4()).to_cols_array_2d();
/// DepthEncoding::Clip { clip_from_world, space }.decode(&camera, &depth_buffer, &mut distances)?;
/// let layers = ShadowDepthEncoding::Clip(space).layers(
///     &cascades.map(matrix),
///     [side; 2],
///     &shadow_texels,
///     &mut depths,
/// )?;
/// let shadow = ShadowMap::Cascades(&layers);
///
/// let light = Light::directional(direction.as_dvec3().to_array(), [10.0, 9.0, 7.5])?;
/// let medium = Medium::homogeneous([0.02; 3], [0.0; 3], Phase::henyey_greenstein(0.4)?)?;
/// let depth = DepthMap::new(&distances, size)?;
/// let frame = Frame::new(&camera, depth, &light, &shadow, &medium, 100.0)?;
///
/// // z = near / distance along the view: 10 units in the middle of the image.
/// assert!((frame.depth().at(32, 18) - 10.0).abs() < 1e-2);
/// // The roof's depth is 40 units, and open sky has none.
/// assert!((layers[2].at(0, 0) - 40.0).abs() < 1e-4 && layers[2].at(31, 31) == f32::INFINITY);
/// # Ok(())
/// # }
/// ```
///
/// A spot's map is one layer: `let [layer] = encoding.layers(&[clip_from_world], …)?; ShadowMap::Perspective(layer)`.
/// Six faces of a lamp, whatever their order, handedness and borders: `ShadowMap::Faces(&layers)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShadowDepthEncoding {
    /// What the device stored of z/w, in [0, 1]; the cleared value (1, or 0 of reversed z) means "no surface", and so do
    /// surfaces that were clamped to the far plane. What was clamped to the near plane is at depth 0 of a parallel map.
    Clip(ClipSpace),
    /// Distance from the lamp, or from the near plane of a parallel map along the light \[world units\], ≥ 0; `+∞` for no
    /// surface.
    AlongRay(ClipSpace),
    /// The same as a share of a stretch, in [0, 1]: 0 at `near`, 1 at `far` and for no surface. (three.js; near = 0 where
    /// the distance is divided by far.)
    AlongRayShare {
        /// The clip space of the matrices; what it says of z is not read.
        space: ClipSpace,
        /// Distance of the texel 0 \[world units\], ≥ 0.
        near: f64,
        /// Distance of the texel 1 \[world units\], > near.
        far: f64,
    },
}

impl ShadowDepthEncoding {
    /// The maps of a light: its matrices, column-major, and its texels, `[layer][row][column]`, `size` each. The linear
    /// depths are stored in `linear`, which is resized, and borrowed by the layers. One pass over the texels, f64 inside.
    ///
    /// # Errors
    ///
    /// Those of [`MapProjection::from_clip_from_world_in`]; a z/w that runs the other way along the light than the clip
    /// space says (told of perspectives here, of a sun's maps where they meet their light); texels outside of the
    /// encoding's range, by column and row, counted down all layers.
    pub fn layers<'a, const N: usize>(
        &self,
        clip_from_world: &[[[f64; 4]; 4]; N],
        size: [u32; 2],
        encoded: &[f32],
        linear: &'a mut Vec<f32>,
    ) -> Result<[ShadowLayer<'a>; N], ModelError> {
        let area = checked_size("shadow map", size)?;
        checked_len("shadow map", encoded.len(), area * N)?;
        self.check_texels(encoded, size[0])?;
        let blank = MapProjection::from_rows_unchecked([DVec4::X, DVec4::Y, DVec4::Z], false, size);
        let mut projections = [blank; N];
        linear.clear();
        linear.reserve(encoded.len());
        for ((matrix, projection), texels) in
            clip_from_world.iter().zip(&mut projections).zip(encoded.chunks_exact(area))
        {
            *projection = self.decode_into(matrix, size, texels, linear)?;
        }
        let linear: &'a [f32] = linear;
        Ok(std::array::from_fn(|index| {
            ShadowLayer::from_checked(projections[index], &linear[index * area..][..area])
        }))
    }

    /// Fills `out` with the linear depths of one map, `[row][column]`, and says where its texels are: for lists of maps
    /// whose number is not known before. Errors as those of [`Self::layers`].
    pub fn decode(
        &self,
        clip_from_world: [[f64; 4]; 4],
        size: [u32; 2],
        encoded: &[f32],
        out: &mut Vec<f32>,
    ) -> Result<MapProjection, ModelError> {
        checked_len("shadow map", encoded.len(), checked_size("shadow map", size)?)?;
        self.check_texels(encoded, size[0])?;
        out.clear();
        self.decode_into(&clip_from_world, size, encoded, out)
    }

    /// The inverse of [`Self::decode`]: what an engine's map would hold for linear depths of that projection.
    pub fn encode(
        &self,
        clip_from_world: [[f64; 4]; 4],
        size: [u32; 2],
        linear: &[f32],
        out: &mut Vec<f32>,
    ) -> Result<MapProjection, ModelError> {
        let (projection, curve) = self.curve(&clip_from_world, size)?;
        ShadowLayer::new(projection, linear)?;
        let width = size[0] as usize;
        out.clear();
        out.extend(linear.iter().enumerate().map(|(index, &depth)| {
            let place = [(index % width) as f64 + 0.5, (index / width) as f64 + 0.5];
            curve.texel(place, f64::from(depth)) as f32
        }));
        Ok(projection)
    }

    /// Where the texels of one map are, and what they mean as a quotient, for shaders. Errors as those of
    /// [`Self::layers`], but for texels.
    pub fn quotient(
        &self,
        clip_from_world: [[f64; 4]; 4],
        size: [u32; 2],
    ) -> Result<(MapProjection, ShadowDepthQuotient), ModelError> {
        let (projection, curve) = self.curve(&clip_from_world, size)?;
        Ok((projection, curve.quotient()))
    }

    fn space(&self) -> ClipSpace {
        match *self {
            Self::Clip(space) | Self::AlongRay(space) | Self::AlongRayShare { space, .. } => space,
        }
    }

    fn check_texels(&self, encoded: &[f32], width: u32) -> Result<(), ModelError> {
        match self {
            Self::AlongRay(_) => checked_texels(
                "shadow map",
                encoded,
                width,
                |t| t >= 0.0,
                "a distance ≥ 0, or +∞ for no surface",
            ),
            _ => checked_texels(
                "shadow map",
                encoded,
                width,
                |t| (0.0..=1.0).contains(&t),
                "a depth in [0, 1]; linear depths go to ShadowLayer::new as they are",
            ),
        }
    }

    fn decode_into(
        &self,
        matrix: &[[f64; 4]; 4],
        size: [u32; 2],
        encoded: &[f32],
        out: &mut Vec<f32>,
    ) -> Result<MapProjection, ModelError> {
        let (projection, curve) = self.curve(matrix, size)?;
        for (row, texels) in encoded.chunks_exact(size[0] as usize).enumerate() {
            curve.decode_row(row as f64 + 0.5, texels, out);
        }
        Ok(projection)
    }

    /// Where the texels are, and what their values mean there.
    fn curve(
        &self,
        matrix: &[[f64; 4]; 4],
        size: [u32; 2],
    ) -> Result<(MapProjection, DepthCurve), ModelError> {
        let space = self.space();
        let projection = MapProjection::from_clip_from_world_in(*matrix, space, size)?;
        let curve = match *self {
            Self::Clip(space) => {
                let mut clip = ClipRows::new(*matrix, MATRIX)?;
                clip.y = space.y_up(clip.y);
                match clip.parallel()? {
                    Some(clip) => DepthCurve::parallel(&clip, space),
                    None => DepthCurve::perspective(&clip, space, size)?,
                }
            }
            Self::AlongRay(_) => DepthCurve::along_ray(&projection, None)?,
            Self::AlongRayShare { near, far, .. } => {
                checked("shadow map near", near, |v| v >= 0.0, "a finite number ≥ 0")?;
                checked("shadow map far", far, |v| v > near, "a finite number > near")?;
                DepthCurve::along_ray(&projection, Some([near, far]))?
            }
        };
        Ok((projection, curve))
    }
}

/// What the texels of one map mean.
enum DepthCurve {
    /// depth = (z − near)·scale, with the sign of the direction in the scale.
    Parallel { space: ClipSpace, scale: f64 },
    /// depth = constant / (z − middle − slope·(u, v)).
    Perspective { space: ClipSpace, constant: f64, middle: f64, slope: DVec2 },
    /// depth = distance over the length of the light ray's step for a unit of depth, linear in the texel.
    AlongRay { step: DVec3, step_u: DVec3, step_v: DVec3, share: Option<[f64; 2]> },
}

impl DepthCurve {
    fn parallel(clip: &ClipRows, space: ClipSpace) -> Self {
        Self::Parallel { space, scale: space.sign() / clip.z.truncate().length() }
    }

    fn perspective(clip: &ClipRows, space: ClipSpace, size: [u32; 2]) -> Result<Self, ModelError> {
        let w = clip.w.truncate();
        let inverse = clip.inverse_of(w)?;
        // z = k·(x, y, w) + β.
        let k = inverse.transpose() * clip.z.truncate();
        let constant = clip.z.w - k.dot(DVec3::new(clip.x.w, clip.y.w, clip.w.w));
        if constant == 0.0 {
            return Err(
                clip.error("its z/w is the same at every depth", "give the matrix with its depth row")
            );
        }
        if constant * space.sign() > 0.0 {
            return Err(clip.error(
                "its z/w runs the other way than the clip space says",
                "say ClipSpace::reversed() of a map with reversed z, and of no other",
            ));
        }
        // a = 2u/width − 1 and b = 1 − 2v/height in the clip square, y up.
        let [width, height] = size.map(f64::from);
        Ok(Self::Perspective {
            space,
            constant: constant / w.length(),
            middle: k.z - k.x + k.y,
            slope: DVec2::new(2.0 * k.x / width, -2.0 * k.y / height),
        })
    }

    fn along_ray(projection: &MapProjection, share: Option<[f64; 2]>) -> Result<Self, ModelError> {
        let step = |u, v| projection.light_ray(u, v).map(|(_, step)| step);
        let (Some(step), Some(at_u), Some(at_v)) = (step(0.0, 0.0), step(1.0, 0.0), step(0.0, 1.0)) else {
            return Err(ModelError::Degenerate {
                what: MATRIX,
                problem: "it is singular",
                cure: "give an invertible matrix",
            });
        };
        Ok(Self::AlongRay { step, step_u: at_u - step, step_v: at_v - step, share })
    }

    fn quotient(&self) -> ShadowDepthQuotient {
        // z = at_0 + scale·texel.
        let line = |space: ClipSpace| {
            let at_0 = space.z_of_texel(0.0);
            (at_0, space.z_of_texel(1.0) - at_0)
        };
        match *self {
            Self::Parallel { space, scale } => {
                let (at_0, line) = line(space);
                ShadowDepthQuotient::Quotient {
                    coefficients: [(at_0 - space.near()) * scale, line * scale, 1.0, 0.0],
                    slope: DVec2::ZERO,
                    cleared: Some(space.cleared()),
                }
            }
            Self::Perspective { space, constant, middle, slope } => {
                let (at_0, line) = line(space);
                ShadowDepthQuotient::Quotient {
                    coefficients: [constant, 0.0, at_0 - middle, line],
                    slope: -slope,
                    cleared: Some(space.cleared()),
                }
            }
            Self::AlongRay { step, step_u, step_v, share } => ShadowDepthQuotient::AlongRay {
                way: [step, step_u, step_v],
                share: share.map_or([0.0, 1.0], |[near, far]| [near, far - near]),
                cleared: share.map(|_| 1.0),
            },
        }
    }

    fn decode_row(&self, v: f64, texels: &[f32], out: &mut Vec<f32>) {
        match *self {
            Self::Parallel { space, scale } => {
                let (near, cleared) = (space.near(), space.cleared());
                out.extend(texels.iter().map(|&texel| {
                    let depth = (space.z_of_texel(texel.into()) - near) * scale;
                    if texel == cleared { f32::INFINITY } else { depth as f32 }
                }));
            }
            Self::Perspective { space, constant, middle, slope } => {
                let (start, cleared) = (middle + slope.y * v, space.cleared());
                out.extend(texels.iter().enumerate().map(|(column, &texel)| {
                    let asymptote = start + slope.x * (column as f64 + 0.5);
                    let depth = constant / (space.z_of_texel(texel.into()) - asymptote);
                    // Beyond infinity: a far plane that f32 rounded.
                    let none = texel == cleared || !(depth >= 0.0);
                    if none { f32::INFINITY } else { depth as f32 }
                }));
            }
            Self::AlongRay { step, step_u, step_v, share } => {
                let start = step + step_v * v;
                out.extend(texels.iter().enumerate().map(|(column, &texel)| {
                    let stretch = (start + step_u * (column as f64 + 0.5)).length();
                    let distance = match share {
                        None => f64::from(texel),
                        Some(_) if texel == 1.0 => f64::INFINITY,
                        Some([near, far]) => near + f64::from(texel) * (far - near),
                    };
                    (distance / stretch) as f32
                }));
            }
        }
    }

    /// What a device would store for a linear depth, clamped between its near and far plane.
    fn texel(&self, [u, v]: [f64; 2], depth: f64) -> f64 {
        match *self {
            Self::Parallel { space, .. } | Self::Perspective { space, .. } if depth == f64::INFINITY => {
                space.cleared().into()
            }
            Self::Parallel { space, scale } => space.texel_of_z(space.near() + depth / scale),
            Self::Perspective { space, constant, middle, slope } => {
                space.texel_of_z(middle + slope.dot(DVec2::new(u, v)) + constant / depth)
            }
            Self::AlongRay { step, step_u, step_v, share } => {
                let distance = depth * (step + step_u * u + step_v * v).length();
                share.map_or(distance, |[near, far]| ((distance - near) / (far - near)).clamp(0.0, 1.0))
            }
        }
    }
}
