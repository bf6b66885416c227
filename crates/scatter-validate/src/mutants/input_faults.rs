//! Faults that are as if the technique had been given other input: it gets a frame that is wrong in one thing.

use glam::{DMat4, DVec4};
use scatter_core::{
    Camera, CubeShadow, DepthMap, Frame, HeightFalloff, MapProjection, Medium, ModelError, Phase, Projection,
    Scattering, ShadowLayer, ShadowMap,
};

use super::fault::Fault;

/// Hands over the frame, or one that is wrong in what the fault names.
pub fn with_wrong_input<R>(fault: Fault, frame: &Frame<'_>, use_frame: impl FnOnce(&Frame<'_>) -> R) -> R {
    if !fault.is_of_input() {
        return use_frame(frame);
    }
    let mut use_frame = Some(use_frame);
    let wrong = wrong_frame(fault, frame, &mut use_frame);
    // What cannot be made wrong is left right: the mutant survives, and that is reported.
    match (wrong, use_frame) {
        (Ok(Some(result)), _) => result,
        (_, Some(use_frame)) => use_frame(frame),
        (_, None) => unreachable!("a frame that was used has a result"),
    }
}

fn wrong_frame<R, F: FnOnce(&Frame<'_>) -> R>(
    fault: Fault,
    frame: &Frame<'_>,
    use_frame: &mut Option<F>,
) -> Result<Option<R>, ModelError> {
    let mut camera = frame.camera().clone();
    let mut distances = frame.depth().texels().to_vec();
    let mut medium = frame.medium().clone();
    let mut max_distance = frame.max_distance();
    let mut maps = Maps::of(frame.shadow());
    match fault {
        Fault::GSignFlipped => medium = with_components(&medium, medium.sigma_a(), |s| s, flipped)?,
        Fault::ScatteringAndAbsorptionSwapped => {
            let scattering: [f64; 3] =
                std::array::from_fn(|c| medium.components().iter().map(|p| p.sigma_s[c]).sum());
            medium = with_components(&medium, scattering, |_| medium.sigma_a(), |phase| phase)?;
        }
        Fault::LastStepDropped => {
            distances.iter_mut().for_each(|d| *d = d.min(max_distance as f32) * (63.0 / 64.0));
        }
        Fault::DepthReadAsZ => {
            let width = camera.size()[0] as usize;
            for (index, distance) in distances.iter_mut().enumerate() {
                let ray = camera.pixel_ray((index % width) as u32, (index / width) as u32);
                *distance *= ray.direction.dot(camera.forward()) as f32;
            }
        }
        Fault::EyeMoved if camera.projection() == Projection::Perspective => {
            let eye = camera.eye() + 0.01 * camera.right();
            camera = Camera::perspective_off_centre(
                eye.to_array(),
                (eye + camera.forward()).to_array(),
                camera.up().to_array(),
                camera.window(),
                camera.size(),
            )?;
        }
        Fault::MaxDistanceIgnored => max_distance *= 1e3,
        Fault::NearAndFarSwapped => maps.each_texel(|t| if t.is_finite() { f32::INFINITY } else { 0.0 }),
        Fault::MapReadOneTexelFurther => maps.each_row(|row| row.rotate_left(1)),
        Fault::MapShiftedByHalfATexel => {
            for layer in &mut maps.layers {
                layer.0 = shifted_by_half_a_texel(&layer.0)?;
            }
        }
        Fault::CascadesReversed => maps.layers.reverse(),
        Fault::TextureIgnored => {}
        Fault::FogUpsideDown | Fault::FogBaseIgnored => {
            let Some(falloff) = medium.height_falloff() else { return Ok(None) };
            let (up, base, scale) = (falloff.up(), falloff.base_height(), falloff.scale_height());
            let wrong = match fault {
                // About the base: only the sign of the slope and of the eye's height.
                Fault::FogUpsideDown => HeightFalloff::new((-up).to_array(), -base, scale)?,
                _ => HeightFalloff::new(up.to_array(), 0.0, scale)?,
            };
            medium = medium.with_height_falloff(wrong);
        }
        _ => return Ok(None),
    }
    let mut layers = Vec::new();
    let shadow = maps.shadow(frame.shadow(), &mut layers)?;
    let depth = DepthMap::new(&distances, camera.size())?;
    let wrong = Frame::new(&camera, depth, frame.light(), &shadow, &medium, max_distance)?;
    let wrong = match frame.texture() {
        Some(texture) if fault != Fault::TextureIgnored => wrong.with_texture(texture)?,
        _ => wrong,
    };
    Ok(use_frame.take().map(|use_frame| use_frame(&wrong)))
}

fn flipped(phase: Phase) -> Phase {
    match phase {
        Phase::HenyeyGreenstein { g } => Phase::HenyeyGreenstein { g: -g },
        other => other,
    }
}

fn with_components(
    medium: &Medium,
    sigma_a: [f64; 3],
    sigma_s: impl Fn([f64; 3]) -> [f64; 3],
    phase: impl Fn(Phase) -> Phase,
) -> Result<Medium, ModelError> {
    let components = medium.components().iter();
    let components =
        components.map(|part| Scattering { sigma_s: sigma_s(part.sigma_s), phase: phase(part.phase) });
    let changed = Medium::new(components.collect(), sigma_a)?;
    Ok(match medium.height_falloff() {
        Some(falloff) => changed.with_height_falloff(*falloff),
        None => changed,
    })
}

/// The texels of a light's maps, to be changed.
struct Maps {
    layers: Vec<(MapProjection, Vec<f32>)>,
    cube: Vec<f32>,
}

impl Maps {
    fn of(shadow: &ShadowMap<'_>) -> Self {
        match shadow {
            ShadowMap::Cube(cube) => Self { layers: Vec::new(), cube: cube.texels().to_vec() },
            _ => {
                let layers = shadow.layers().map(|layer| (*layer.projection(), layer.texels().to_vec()));
                Self { layers: layers.collect(), cube: Vec::new() }
            }
        }
    }

    fn each_texel(&mut self, change: impl Fn(f32) -> f32) {
        let layers = self.layers.iter_mut().flat_map(|(_, texels)| texels);
        layers.chain(&mut self.cube).for_each(|texel| *texel = change(*texel));
    }

    fn each_row(&mut self, change: impl Fn(&mut [f32])) {
        for (projection, texels) in &mut self.layers {
            texels.chunks_mut(projection.size()[0] as usize).for_each(&change);
        }
    }

    /// A shadow map of the kind of `like`; `layers` is a buffer.
    fn shadow<'l, 's: 'l>(
        &'s self,
        like: &ShadowMap<'_>,
        layers: &'l mut Vec<ShadowLayer<'s>>,
    ) -> Result<ShadowMap<'l>, ModelError> {
        let layer = |index: usize| ShadowLayer::new(self.layers[index].0, &self.layers[index].1);
        Ok(match like {
            ShadowMap::Unshadowed => ShadowMap::Unshadowed,
            ShadowMap::Orthographic(_) => ShadowMap::Orthographic(layer(0)?),
            ShadowMap::Perspective(_) => ShadowMap::Perspective(layer(0)?),
            ShadowMap::Cube(cube) => {
                ShadowMap::Cube(CubeShadow::new(cube.position().to_array(), cube.size(), &self.cube)?)
            }
            ShadowMap::Faces(_) | ShadowMap::Cascades(_) => {
                *layers = (0..self.layers.len()).map(layer).collect::<Result<_, _>>()?;
                match layers.as_array() {
                    Some(faces) if matches!(like, ShadowMap::Faces(_)) => ShadowMap::Faces(faces),
                    _ => ShadowMap::Cascades(layers),
                }
            }
        })
    }
}

/// The projection whose texel coordinates are greater by a half, through an engine's matrix.
fn shifted_by_half_a_texel(projection: &MapProjection) -> Result<MapProjection, ModelError> {
    let [mut u, mut v, depth] = projection.rows();
    let weight = if projection.is_perspective() { depth } else { DVec4::W };
    u += 0.5 * weight;
    v += 0.5 * weight;
    let [half_u, half_v] = projection.size().map(|n| 0.5 * f64::from(n));
    let (x, y) = (u / half_u - weight, weight - v / half_v);
    let rows = if projection.is_perspective() { [x, y, DVec4::W, depth] } else { [x, y, depth, weight] };
    let clip = DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose();
    MapProjection::from_clip_from_world(clip.to_cols_array_2d(), projection.size())
}
