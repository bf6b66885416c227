//! The colour that a light has at sixteen columns' samples: nearest texel of its texture, white outside.

use glam::DVec3;
use scatter_core::{LightTexture, RayLanes};

use super::paths::{LANES, Lanes, Paths, Texels, projected};

/// Glass before a light, along sixteen rays.
pub struct Glass<'a> {
    texels: Texels<'a, [f32; 3]>,
    perspective: bool,
    paths: Paths,
}

impl<'a> Glass<'a> {
    /// Along these rays.
    #[inline(always)]
    pub fn new(texture: &LightTexture<'a>, eye: DVec3, rays: &RayLanes) -> Self {
        let projection = texture.projection();
        Self {
            texels: Texels::new(texture.texels(), projection.size()),
            perspective: projection.is_perspective(),
            paths: Paths::in_map(projection, eye, rays),
        }
    }

    /// RGB factors at distance `t`.
    #[inline(always)]
    pub fn colour(&self, t: f64) -> [Lanes; 3] {
        let point = self.paths.at(t);
        let (found, _) = if self.perspective {
            let (u, v, seen) = projected(&point);
            self.texels.nearest(&u, &v, &seen, [1.0; 3])
        } else {
            self.texels.nearest(&point[0], &point[1], &[true; LANES], [1.0; 3])
        };
        let mut colour = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            for channel in 0..3 {
                colour[channel][lane] = found[lane][channel];
            }
        }
        colour
    }
}
