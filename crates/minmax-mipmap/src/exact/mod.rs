//! Exact mode: every pixel's own ray through min/max mipmaps of the light's maps.
//!
//! ```text
//! layers      each map's MinMaxTree, coded for the depths that view rays have
//! descent     a ray in f64, one at a time
//! ```

mod descent;
mod layers;
mod ray_fan;

use glam::DVec3;
use scatter_core::{
    Frame, Level, RayLight, RenderStats, ScatterImage, SceneFacts, StageClock, layer_pieces, parallel,
};

use descent::{Looks, lit_stretches};
use layers::LayerTrees;
use ray_fan::RayFan;

/// Exact mode with its buffers, which serve the next frame.
#[derive(Debug)]
pub struct Exact {
    simd: Level,
    layers: LayerTrees,
    /// What each row looked at.
    looks: Vec<Looks>,
}

impl Exact {
    /// With the instructions of a level.
    pub fn new(simd: Level) -> Self {
        Self { simd, layers: LayerTrees::default(), looks: Vec::new() }
    }

    /// Renders a frame, whatever it has.
    pub fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> RenderStats {
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        let facts = SceneFacts::of(frame);
        let fan = RayFan::new(frame.camera());
        clock.lap(&mut stats, "facts");

        if facts.casts_shadow {
            self.layers.build(self.simd, frame, &fan);
        }
        clock.lap(&mut stats, "mipmaps");

        let [width, height] = frame.size();
        self.looks.clear();
        self.looks.resize(height as usize, Looks::default());
        let trees = &self.layers;
        let (inscattered, transmittance) = out.overwritten(frame.size());
        parallel::for_each_band(
            (inscattered, transmittance, &mut self.looks),
            [width as usize, 1],
            |y, inscattered, transmittance, looks| {
                let y = y as u32;
                for x in 0..width {
                    let radiance =
                        descended(frame, facts.casts_shadow.then_some(trees), [x, y], &mut looks[0]);
                    inscattered[x as usize] = radiance.as_vec3().to_array();
                    transmittance[x as usize] =
                        frame.medium().transmittance(frame.ray_end(x, y)).map(|through| through as f32);
                }
            },
        );
        clock.lap(&mut stats, "descent");

        stats.counts.push("rays", u64::from(width) * u64::from(height));
        stats.counts.push("nodes", self.looks.iter().map(|looks| looks.nodes).sum());
        stats.counts.push("texels", self.looks.iter().map(|looks| looks.texels).sum());
        stats.push_modelled(&facts);
        stats.memory_bytes = self.layers.memory_bytes() + (self.looks.capacity() * size_of::<Looks>()) as u64;
        stats
    }
}

/// In-scattered radiance of one pixel in f64.
fn descended(frame: &Frame<'_>, trees: Option<&LayerTrees>, [x, y]: [u32; 2], looks: &mut Looks) -> DVec3 {
    let (camera, end) = (frame.camera(), frame.ray_end(x, y));
    let ray = camera.pixel_ray(x, y);
    let light = RayLight::new(frame.light(), frame.medium(), camera.eye(), &ray);
    let mut radiance = DVec3::ZERO;
    let mut add = |a: f64, b: f64| match frame.texture() {
        None => radiance += light.interval(a, b),
        Some(texture) => texture.pieces(camera.eye(), ray.origin, ray.direction, [a, b], |a, b, colour| {
            radiance += light.interval(a, b) * DVec3::from(colour.map(f64::from));
        }),
    };
    let Some(trees) = trees else {
        add(0.0, end);
        return radiance;
    };
    let mut open: Option<(f64, f64)> = None;
    let mut push = |a: f64, b: f64| match &mut open {
        Some((_, end)) if *end == a => *end = b,
        _ => {
            if let Some((a, b)) = open.replace((a, b)) {
                add(a, b);
            }
        }
    };
    layer_pieces(frame.setup().maps(), camera.eye(), &ray, [0.0, end], |piece| {
        let layer =
            piece.layer.and_then(|index| Some((frame.shadow().layer(index)?, trees.trees().get(index)?)));
        let Some((layer, tree)) = layer else {
            return push(piece.t_min, piece.t_max);
        };
        let path = layer.projection().ray(camera.eye(), ray.origin, ray.direction);
        lit_stretches(&layer, tree, &path, [piece.t_min, piece.t_max], looks, &mut push);
    });
    if let Some((a, b)) = open {
        add(a, b);
    }
    radiance
}
