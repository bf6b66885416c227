//! A set-up as the shaders' uniform: f64 geometry, relative to the eye and to the middle of the image, rounded once.

use glam::DVec3;
use scatter_core::{
    AffineInPixel, DepthEncoding, Light, LightKind, MapFan, MapKind, MapProjection, ModelError, Phase,
    Projection, RayFan, Setup, ShadowDepthEncoding, ShadowDepthQuotient, Unsupported,
};

use crate::frame_uniform::{FARTHEST, FrameUniform, MOST_PHASES, MapLayer, PhaseTerm, flags};

/// Where the texels of one layer of a light's map lie in the texture, and what they mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowDepth {
    /// What a texel means.
    pub quotient: ShadowDepthQuotient,
    /// Layer of the texture.
    pub layer: u32,
    /// Column and row of its first texel: not 0 in an atlas.
    pub origin: [u32; 2],
    /// Added to every stored depth \[world units\]: surfaces lie that much deeper.
    pub bias: f64,
}

impl ShadowDepth {
    /// Texels that are linear depths, `+∞` for no surface.
    pub const fn linear(layer: u32) -> Self {
        Self { quotient: ShadowDepthQuotient::LINEAR, layer, origin: [0; 2], bias: 0.0 }
    }

    /// Of one matrix of an engine (column-major) and a map of `size` texels: where its texels are in the world, and what
    /// they mean. Errors as those of [`ShadowDepthEncoding::layers`].
    pub fn of_clip(
        encoding: ShadowDepthEncoding,
        clip_from_world: [[f64; 4]; 4],
        size: [u32; 2],
        layer: u32,
    ) -> Result<(MapProjection, Self), ModelError> {
        let (projection, quotient) = encoding.quotient(clip_from_world, size)?;
        Ok((projection, Self { quotient, ..Self::linear(layer) }))
    }
}

/// A frame as a GPU has it: the set-up, and what the texels mean that only it can see.
#[derive(Debug, Clone, Copy)]
pub struct GpuFrame<'a> {
    /// Camera, light, medium, where the maps look.
    pub setup: Setup<'a>,
    /// What the depth texture holds.
    pub depth: DepthEncoding,
    /// One a layer of the set-up's maps, in their order.
    pub shadow: &'a [ShadowDepth],
    /// Factor on the in-scattered radiance, ≥ 0.
    pub exposure: f32,
}

impl FrameUniform {
    /// Of a frame, with `viewport` the first pixel of the camera in the depth texture.
    ///
    /// # Errors
    ///
    /// A list of layers that does not fit the maps, a depth encoding that does not fit the camera, and more than
    /// [`MOST_PHASES`] different phase functions.
    pub fn new(frame: &GpuFrame<'_>, viewport: [u32; 2]) -> Result<Self, SetupError> {
        let setup = &frame.setup;
        let maps = setup.maps();
        if maps.projections().len() != frame.shadow.len() {
            return Err(ModelError::Mismatch(format!(
                "the light has {} maps and `shadow` says what {} mean; give one a map",
                maps.projections().len(),
                frame.shadow.len()
            ))
            .into());
        }
        if !(frame.exposure >= 0.0 && frame.exposure.is_finite()) {
            return Err(ModelError::OutOfRange {
                field: "exposure".into(),
                value: frame.exposure.into(),
                range: "a finite number ≥ 0",
            }
            .into());
        }
        let camera = setup.camera();
        let fan = RayFan::new(camera);
        let [width, height] = camera.size();
        let middle = [width / 2, height / 2];
        let mut uniform: Self = bytemuck::Zeroable::zeroed();
        uniform.image = [width, height, viewport[0], viewport[1]];
        uniform.direction = affine(fan.direction(), middle);
        uniform.origin = affine(fan.origin(), middle);
        uniform.reference =
            [middle[0] as f32, middle[1] as f32, bounded(setup.max_distance()), weakest(setup)];
        let depth = frame.depth.quotient(camera)?;
        uniform.depth = quotient_from(depth.coefficients, middle);
        uniform.depth_more = [depth.cleared.unwrap_or(0.0), 1.0, 0.0, 0.0];
        uniform.set_light(setup, frame.exposure);
        if let Some(lamp) = setup.light().position() {
            uniform.moment = moment(lamp - camera.eye(), fan.origin(), fan.direction(), camera.size());
        }
        uniform.set_medium(setup)?;
        let mut set = uniform.kinds[3];
        set |= flag(camera.projection() == Projection::Perspective, flags::FRAME_PERSPECTIVE);
        set |= flag(depth.along_ray, flags::FRAME_DEPTH_ALONG_RAY);
        set |= flag(depth.cleared.is_some(), flags::FRAME_DEPTH_HAS_CLEARED);
        if let Some(texture) = setup.texture() {
            uniform.glass =
                layer(&fan.in_map(texture), texture.is_perspective(), &ShadowDepth::linear(0), middle);
            set |= flags::FRAME_GLASS;
        }
        uniform.kinds[3] = set;
        uniform.kinds[0] = maps.projections().len() as u32;
        uniform.kinds[1] = match maps.kind() {
            MapKind::Unshadowed => flags::MAPS_NONE,
            MapKind::Orthographic | MapKind::Perspective => flags::MAPS_ONE,
            MapKind::Cascades => flags::MAPS_CASCADES,
            MapKind::Cube | MapKind::Faces => flags::MAPS_FACES,
        };
        for ((slot, projection), depth) in uniform.maps.iter_mut().zip(maps.projections()).zip(frame.shadow) {
            *slot = layer(&fan.in_map(projection), projection.is_perspective(), depth, middle);
        }
        Ok(uniform)
    }

    fn set_light(&mut self, setup: &Setup<'_>, exposure: f32) {
        let strength = setup.light().strength().map(|value| bounded(value * f64::from(exposure)));
        self.strength = [strength[0], strength[1], strength[2], 0.0];
        let eye = setup.camera().eye();
        let vector = |v: DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
        match setup.light() {
            Light::Directional(sun) => self.light = vector(sun.direction(), 0.0),
            Light::Point(lamp) => self.light = vector(lamp.position() - eye, lamp.radius()),
            Light::Spot(spot) => {
                self.light = vector(spot.lamp().position() - eye, spot.lamp().radius());
                self.cone = vector(spot.direction(), spot.cos_outer());
                self.cone_more = [spot.cone_slope() as f32, spot.cos_full() as f32, 0.0, 0.0];
            }
        }
        self.kinds[2] = match LightKind::of(setup.light()) {
            LightKind::Directional => flags::LIGHT_SUN,
            LightKind::Point => flags::LIGHT_POINT,
            LightKind::Spot => flags::LIGHT_SPOT,
        };
    }

    fn set_medium(&mut self, setup: &Setup<'_>) -> Result<(), SetupError> {
        let medium = setup.medium();
        let sigma_t = medium.sigma_t().map(bounded);
        let strongest = sigma_t.into_iter().fold(0.0, f32::max);
        self.sigma_t = [sigma_t[0], sigma_t[1], sigma_t[2], strongest];
        let mut terms: Vec<(Phase, [f64; 3])> = Vec::new();
        for component in medium.components() {
            let phase = if component.phase.is_isotropic() { Phase::Isotropic } else { component.phase };
            match terms.iter_mut().find(|(known, _)| *known == phase) {
                Some((_, sum)) => (0..3).for_each(|c| sum[c] += component.sigma_s[c]),
                None => terms.push((phase, component.sigma_s)),
            }
        }
        if terms.len() > MOST_PHASES {
            return Err(SetupError::Unsupported(Unsupported {
                reason: format!(
                    "a medium of {} different phase functions; give at most {MOST_PHASES}",
                    terms.len()
                )
                .into(),
            }));
        }
        self.counts[0] = terms.len() as u32;
        for (slot, (phase, sigma_s)) in self.phases.iter_mut().zip(&terms) {
            let [r, g, b] = sigma_s.map(bounded);
            let kind = match *phase {
                Phase::Isotropic => [0.0, 0.0],
                Phase::Rayleigh => [1.0, 0.0],
                Phase::HenyeyGreenstein { g } => [2.0, g as f32],
            };
            *slot = PhaseTerm { sigma_s: [r, g, b, 0.0], kind: [kind[0], kind[1], 0.0, 0.0] };
        }
        let anisotropic = terms.iter().any(|(phase, _)| *phase != Phase::Isotropic);
        self.kinds[3] |= flag(anisotropic, flags::FRAME_ANISOTROPIC);
        if let Some(falloff) = medium.height_falloff() {
            let up = falloff.up() / falloff.scale_height();
            let at_eye = falloff.log_density(setup.camera().eye(), DVec3::ZERO);
            let signed = |value: f64| value.clamp(-f64::from(FARTHEST), f64::from(FARTHEST)) as f32;
            self.fog = [signed(up.x), signed(up.y), signed(up.z), signed(at_eye)];
            self.kinds[3] |= flags::FRAME_FOG;
        }
        Ok(())
    }
}

/// Why a frame has no uniform.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SetupError {
    /// The frame's parts do not fit each other.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The shaders lack something.
    #[error(transparent)]
    Unsupported(#[from] Unsupported),
}

/// The weakest extinction of a channel that scatters; 0 if one is not extinguished.
fn weakest(setup: &Setup<'_>) -> f32 {
    let medium = setup.medium();
    let scatters = |channel: usize| medium.components().iter().any(|c| c.sigma_s[channel] > 0.0);
    let weakest = (0..3)
        .filter(|&channel| scatters(channel))
        .map(|channel| medium.sigma_t()[channel])
        .fold(f64::INFINITY, f64::min);
    bounded(weakest)
}

fn layer(fan: &MapFan, perspective: bool, depth: &ShadowDepth, middle: [u32; 2]) -> MapLayer {
    let mut layer: MapLayer = bytemuck::Zeroable::zeroed();
    layer.start = affine(&fan.start, middle);
    layer.step = affine(&fan.step, middle);
    layer.size = [fan.size[0] as f32, fan.size[1] as f32, depth.bias as f32, 0.0];
    let mut set = flag(perspective, flags::LAYER_PERSPECTIVE);
    let cleared = match depth.quotient {
        ShadowDepthQuotient::Quotient { coefficients, slope, cleared } => {
            layer.quotient = coefficients.map(|value| value as f32);
            layer.slope = [slope.x as f32, slope.y as f32, 0.0, 0.0];
            cleared
        }
        ShadowDepthQuotient::AlongRay { way, share, cleared } => {
            layer.way = way.map(|v| [v.x as f32, v.y as f32, v.z as f32, 0.0]);
            layer.slope = [0.0, 0.0, share[0] as f32, share[1] as f32];
            set |= flags::LAYER_ALONG_RAY;
            cleared
        }
    };
    layer.size[3] = cleared.unwrap_or(0.0);
    set |= flag(cleared.is_some(), flags::LAYER_HAS_CLEARED);
    layer.place = [depth.origin[0], depth.origin[1], depth.layer, set];
    layer
}

/// Most significant bits of what is summed exactly: three numbers, each a coefficient times a pixel's place.
const EXACT_BITS: i32 = 22;

/// `(lamp − origin) × direction`, affine in the pixel since one of the two is the same for all: first the coefficients rounded to
/// a common quantum, so small a number of times that every product with a pixel's place and every sum of them is a number of f32;
/// then what that leaves over. A ray's distance from the lamp is thus good to 2⁻²⁴ of itself and 2⁻³⁴ of the lamp's distance,
/// whatever a driver does to sums.
fn moment(lamp: DVec3, origin: &AffineInPixel, direction: &AffineInPixel, size: [u32; 2]) -> [[f32; 4]; 6] {
    let [x, y] = size.map(|side| f64::from(side / 2));
    let at = |affine: &AffineInPixel, [x, y]: [f64; 2]| affine[0] + affine[1] * x + affine[2] * y;
    let of = |place| (lamp - at(origin, place)).cross(at(direction, place));
    let first = of([x, y]);
    let coefficients = [first, of([x + 1.0, y]) - first, of([x, y + 1.0]) - first];
    let reach = [1.0, x + 1.0, y + 1.0];
    let largest = coefficients.iter().zip(reach).map(|(c, n)| c.abs().max_element() * n).fold(0.0, f64::max);
    if !(largest > 0.0) {
        return [[0.0; 4]; 6];
    }
    let quantum = (largest.log2().ceil() as i32 - EXACT_BITS) as f64;
    let quantum = quantum.exp2();
    let exact = coefficients.map(|c| (c / quantum).round() * quantum);
    let rest = std::array::from_fn::<_, 3, _>(|index| coefficients[index] - exact[index]);
    let vector = |v: DVec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
    [exact[0], exact[1], exact[2], rest[0], rest[1], rest[2]].map(vector)
}

fn flag(on: bool, flag: u32) -> u32 {
    if on { flag } else { 0 }
}

fn bounded(value: f64) -> f32 {
    value.min(f64::from(FARTHEST)) as f32
}

fn affine([first, columns, rows]: &AffineInPixel, [x, y]: [u32; 2]) -> [[f32; 4]; 3] {
    let middle = *first + *columns * f64::from(x) + *rows * f64::from(y);
    [middle, *columns, *rows].map(|v| [v.x as f32, v.y as f32, v.z as f32, 0.0])
}

fn quotient_from([first, columns, rows]: [[f64; 4]; 3], [x, y]: [u32; 2]) -> [[f32; 4]; 3] {
    let middle = std::array::from_fn(|i| first[i] + columns[i] * f64::from(x) + rows[i] * f64::from(y));
    [middle, columns, rows].map(|row: [f64; 4]| row.map(|value| value as f32))
}
