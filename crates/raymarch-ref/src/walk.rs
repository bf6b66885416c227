//! Shadow-map truth: the exact walk of every pixel's ray through the given shadow map (MODEL.md, References).
//!
//! Visibility is that of the map by nearest texel; each lit stretch is integrated in closed form. There is no step
//! size and so no step error: this is what a technique that reads this shadow map can reach at best. f64.
//!
//! Translucent occluders dim it by nearest texel too, through segments that were captured for the texels' centres: of the
//! layers that the frame brings, or of its source, at the shadow map's own texels.

mod dimmed_parts;
mod map_path;
mod min_max_tree;
mod texel_walk;

use glam::DVec3;
use scatter_core::{
    Capabilities, Frame, LightKind, LightTexture, MapKind, RayLight, RenderError, RenderStats, ScatterImage,
    SceneFacts, StageClock, Translucent, TranslucentCapture, TranslucentLayer, Unsupported, ViewRay,
    VolumetricShadow, parallel,
};

use crate::map_segments::{inside, visit_segments};
use dimmed_parts::dimmed_radiance;
use map_path::MapPath;
use min_max_tree::MinMaxTrees;
pub use texel_walk::LitParts;
use texel_walk::walk_layer;

/// Pixels along the side of a tile, whose rays pass the same part of the map. Smaller tiles read it more often,
/// larger ones keep threads idle.
const TILE_SIDE: u32 = 32;

/// The id of [`ShadowMapWalk`].
pub const WALK_ID: &str = "truth-shadow-map";

/// The reference: exact for the given shadow map, every light, medium, map and camera of the model. No options.
#[derive(Debug, Clone)]
pub struct ShadowMapWalk {
    trees: MinMaxTrees,
    skips: bool,
    /// Texels and blocks that each band of the image asked for.
    asked: Vec<u64>,
    /// Segments of translucent occluders that come from a source, one for each layer of the shadow map.
    captures: Vec<TranslucentCapture>,
}

impl Default for ShadowMapWalk {
    fn default() -> Self {
        Self::new()
    }
}

impl ShadowMapWalk {
    /// All of the model: what [`VolumetricShadow::capabilities`] of a walk are.
    pub const CAPABILITIES: Capabilities = Capabilities {
        translucent: &[LightKind::Directional, LightKind::Point, LightKind::Spot],
        ..crate::EVERYTHING
    };

    /// The walk that skips uniform blocks of the map by a min/max quadtree.
    pub fn new() -> Self {
        Self { trees: MinMaxTrees::default(), skips: true, asked: Vec::new(), captures: Vec::new() }
    }

    /// The walk that asks every texel: the same image to the last bit, many times slower. What the other one is
    /// tested against.
    pub fn plain() -> Self {
        Self { skips: false, ..Self::new() }
    }

    fn pixel(&self, frame: &Frame<'_>, translucent: &[TranslucentLayer<'_>], x: u32, y: u32) -> (DVec3, u64) {
        let eye = frame.camera().eye();
        let ray = frame.camera().pixel_ray(x, y);
        let light = RayLight::new(frame.light(), frame.medium(), eye, &ray);
        let mut sum = DVec3::ZERO;
        let asked = self.visit_lit(frame, x, y, |a, b| match frame.texture() {
            None if translucent.is_empty() => sum += light.interval(a, b),
            None => sum += dimmed_radiance(translucent, eye, &ray, &light, (a, b)),
            Some(texture) => add_coloured(texture, eye, &ray, (a, b), &mut |colour, a, b| {
                sum += tint(colour)
                    * if translucent.is_empty() {
                        light.interval(a, b)
                    } else {
                        dimmed_radiance(translucent, eye, &ray, &light, (a, b))
                    };
            }),
        });
        (sum, asked)
    }

    /// Calls `each(start, end)` for every lit stretch of the ray of pixel `(x, y)`, in order; neighbouring texels'
    /// stretches are one. Ray parameters \[world units\]. Cost: every texel that the ray crosses.
    pub fn lit_stretches(frame: &Frame<'_>, x: u32, y: u32, each: impl FnMut(f64, f64)) {
        Self::plain().visit_lit(frame, x, y, each);
    }

    /// The same by this walk's trees, which must be those of the frame. Returns how many texels and blocks it asked.
    fn visit_lit(&self, frame: &Frame<'_>, x: u32, y: u32, each: impl FnMut(f64, f64)) -> u64 {
        let eye = frame.camera().eye();
        let ray = frame.camera().pixel_ray(x, y);
        let mut asked = 0;
        let mut lit = LitParts::new(each);
        visit_segments(frame.shadow(), eye, &ray, frame.ray_end(x, y), &mut |segment| {
            let layer = segment.layer.and_then(|index| Some((index, frame.shadow().layer(index)?)));
            match layer {
                None => lit.push(segment.start, segment.end),
                Some((index, layer)) => {
                    let tree = self.skips.then(|| self.trees.layer(index));
                    let path = layer.projection().ray(eye, ray.origin, ray.direction);
                    asked += walk_layer(&layer, tree, path, (segment.start, segment.end), &mut lit);
                }
            }
        });
        lit.finish();
        asked
    }
}

impl VolumetricShadow for ShadowMapWalk {
    fn id(&self) -> &'static str {
        WALK_ID
    }

    fn capabilities(&self) -> Capabilities {
        Self::CAPABILITIES
    }

    fn supports(&self, frame: &Frame<'_>) -> Result<(), Unsupported> {
        self.capabilities().check(frame)?;
        let has_source = frame.translucent().is_some_and(|translucent| translucent.source().is_some());
        if has_source && frame.shadow().kind() == MapKind::Unshadowed {
            let reason = "translucent occluders from a source without a shadow map, whose texels they would be captured \
                          for; give a shadow map, or captured layers";
            return Err(Unsupported { reason: reason.into() });
        }
        Ok(())
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        let [width, height] = frame.size();
        out.resize(frame.size());
        if self.skips {
            self.trees.build(frame.shadow());
            clock.lap(&mut stats, "min-max tree");
        }
        if let Some(Translucent::Source(source)) = frame.translucent() {
            let layers = frame.setup().maps().projections();
            self.captures.resize_with(layers.len(), TranslucentCapture::new);
            for (capture, projection) in self.captures.iter_mut().zip(layers) {
                capture.capture(*source, projection, TranslucentCapture::DEFAULT_LIMIT)?;
            }
            clock.lap(&mut stats, "capture");
        }
        let mut asked = std::mem::take(&mut self.asked);
        asked.clear();
        asked.resize(height.div_ceil(TILE_SIDE) as usize, 0);
        let walk = &*self;
        let captured: Vec<TranslucentLayer<'_>> = match frame.translucent() {
            None => Vec::new(),
            Some(Translucent::Captured(layers)) => layers.to_vec(),
            Some(Translucent::Source(_)) => {
                walk.captures.iter().filter_map(TranslucentCapture::layer).collect()
            }
        };
        let (inscattered, transmittance) = out.pixels_mut();
        let band_pixels = (width * TILE_SIDE) as usize;
        parallel::for_each_band(
            (inscattered, transmittance, &mut asked),
            [band_pixels, 1],
            |index, inscattered, transmittance, asked| {
                let first_y = index as u32 * TILE_SIDE;
                for first_x in (0..width).step_by(TILE_SIDE as usize) {
                    for y in first_y..height.min(first_y + TILE_SIDE) {
                        for x in first_x..width.min(first_x + TILE_SIDE) {
                            let pixel = (y - first_y) as usize * width as usize + x as usize;
                            let (sum, texels) = walk.pixel(frame, &captured, x, y);
                            inscattered[pixel] = sum.as_vec3().to_array();
                            transmittance[pixel] = frame.transmittance(x, y).map(|t| t as f32);
                            asked[0] += texels;
                        }
                    }
                }
            },
        );
        clock.lap(&mut stats, "walk");
        stats.counts.push("shadow-map fetches", asked.iter().sum());
        drop(captured);
        self.asked = asked;
        stats.counts.push("rays", u64::from(width) * u64::from(height));
        stats.push_modelled(&SceneFacts::of(frame));
        let captures: u64 = self.captures.iter().map(TranslucentCapture::memory_bytes).sum();
        stats.memory_bytes =
            captures + self.trees.memory_bytes() + (self.asked.capacity() * size_of::<u64>()) as u64;
        Ok(stats)
    }
}

/// Adds a lit stretch behind a colour texture, `add(colour, from, to)`: piece by piece of the texture's texels, neighbours of one colour
/// together.
pub fn add_coloured(
    texture: &LightTexture<'_>,
    eye: DVec3,
    ray: &ViewRay,
    (a, b): (f64, f64),
    add: &mut dyn FnMut([f32; 3], f64, f64),
) {
    let mut open: Option<([f32; 3], f64, f64)> = None;
    let mut push = |colour: [f32; 3], from: f64, to: f64| {
        if !(to > from) {
            return;
        }
        match &mut open {
            Some((same, _, end)) if *same == colour => *end = to,
            _ => {
                if let Some((colour, from, to)) = open.replace((colour, from, to)) {
                    add(colour, from, to);
                }
            }
        }
    };
    let projection = texture.projection();
    let path = projection.ray(eye, ray.origin, ray.direction);
    match inside(projection, &path, a, b) {
        None => push([1.0; 3], a, b),
        Some((start, end)) => {
            push([1.0; 3], a, start);
            match MapPath::new(path, projection.is_perspective(), projection.size(), start, end) {
                Some(path) => {
                    path.visit_texels((start, end), |i, j, from, to| push(texture.at(i, j), from, to))
                }
                None => push([1.0; 3], start, end),
            }
            push([1.0; 3], end, b);
        }
    }
    if let Some((colour, from, to)) = open {
        add(colour, from, to);
    }
}

pub fn tint(colour: [f32; 3]) -> DVec3 {
    DVec3::from(colour.map(f64::from))
}
