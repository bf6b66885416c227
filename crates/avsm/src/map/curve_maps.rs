//! All curve maps of a light: built from a frame, walked by view rays, looked up by surfaces.

use glam::DVec3;
use scatter_core::{
    Frame, MapLayout, RenderError, ShadowMap, Translucent, TranslucentCapture, ViewRay, layer_pieces,
};

use crate::map::layer::{CurveLayer, LayerInput, Occluders};
use crate::map::layout::curve_layout;
use crate::options::{Curve, Opaque, Options};
use crate::ray::ray_sum::RayParts;

/// The transmittance curves of a light: how much of it reaches any point of the scene (Salvi et al. 2010, Section 4.2).
///
/// Holds its buffers for the next frame. Adaptive curves take 8 bytes a node and texel, whatever the number of segments, and
/// [`Self::memory_bytes`] an eighth of a byte a texel more for what lets view rays pass empty blocks.
#[derive(Debug, Clone)]
pub struct CurveMaps {
    layout: MapLayout,
    layers: Vec<CurveLayer>,
    /// Layers of this frame; further ones are kept for a frame that has them.
    count: usize,
    capture: TranslucentCapture,
}

impl Default for CurveMaps {
    fn default() -> Self {
        Self {
            layout: MapLayout::UNSHADOWED,
            layers: Vec::new(),
            count: 0,
            capture: TranslucentCapture::new(),
        }
    }
}

impl CurveMaps {
    /// No curves.
    pub fn new() -> Self {
        Self::default()
    }

    /// Builds the curves of a frame. Errors are those of its source of occluders, and of a map that cannot be cut into so many
    /// texels.
    pub fn build(&mut self, frame: &Frame<'_>, options: &Options) -> Result<(), RenderError> {
        self.count = 0;
        self.layout = curve_layout(frame, options).map_err(scatter_core::MapError::from)?;
        let projections = self.layout.projections();
        let opaque = match frame.shadow() {
            ShadowMap::Unshadowed => None,
            shadow => (options.opaque == Opaque::Curve).then_some(shadow),
        };
        for (index, projection) in projections.iter().enumerate() {
            if self.layers.len() <= index {
                self.layers.push(CurveLayer::new(*projection));
            }
            let occluders = match frame.translucent() {
                None => Occluders::None,
                Some(Translucent::Captured(layers)) => {
                    layers.get(index).map_or(Occluders::None, |layer| Occluders::Captured(*layer))
                }
                Some(Translucent::Source(source)) if options.curve == Curve::Avsm => {
                    Occluders::Source(*source)
                }
                Some(Translucent::Source(source)) => {
                    let limit = TranslucentCapture::DEFAULT_LIMIT;
                    Occluders::Captured(self.capture.capture(*source, projection, limit)?)
                }
            };
            self.layers[index]
                .build(&LayerInput { projection: *projection, occluders, opaque, index }, options)?;
        }
        self.count = projections.len();
        Ok(())
    }

    /// The layers in the order of the light's maps: the first that contains a point decides.
    pub fn layers(&self) -> &[CurveLayer] {
        &self.layers[..self.count]
    }

    /// What a light ray keeps on its way to a world point, 0 to 1, by the curve of the texel that contains it. 1 outside of all
    /// maps.
    pub fn transmittance(&self, p_world: DVec3) -> f64 {
        self.lookup(p_world, |layer, p| (-layer.optical_depth([p.x as u32, p.y as u32], p.z)).exp())
    }

    /// The same between the centres of four texels, each looked up at the point's own depth and weighted by nearness (Salvi et
    /// al. 2010, Section 3.3); at a map's border by the texels that are there.
    pub fn transmittance_bilinear(&self, p_world: DVec3) -> f64 {
        self.lookup(p_world, |layer, p| {
            let [width, height] = layer.projection().size();
            let corner = [p.x - 0.5, p.y - 0.5];
            let [u, v] = corner.map(|c| c - c.floor());
            let texel =
                |c: f64, offset: f64, size: u32| (c.floor() + offset).clamp(0.0, f64::from(size - 1)) as u32;
            let mut sum = 0.0;
            for (row, weight_v) in [(0.0, 1.0 - v), (1.0, v)] {
                for (column, weight_u) in [(0.0, 1.0 - u), (1.0, u)] {
                    let at = [texel(corner[0], column, width), texel(corner[1], row, height)];
                    sum += weight_u * weight_v * (-layer.optical_depth(at, p.z)).exp();
                }
            }
            sum
        })
    }

    fn lookup(&self, p_world: DVec3, of: impl Fn(&CurveLayer, DVec3) -> f64) -> f64 {
        let found = self.layers().iter().find_map(|layer| {
            let map = layer.projection();
            let p = map.texel_from_world(p_world);
            let [width, height] = map.size().map(f64::from);
            let behind = map.is_perspective() && p.z <= 0.0;
            let inside = p.x >= 0.0 && p.y >= 0.0 && p.x < width && p.y < height && !behind;
            inside.then(|| of(layer, p))
        });
        found.unwrap_or(1.0)
    }

    /// Walks the part `[a, b]` of a ray whose origin is relative to `eye`: [`CurveLayer::walk`] over all layers.
    pub(crate) fn walk(&self, eye: DVec3, ray: &ViewRay, part: [f64; 2], parts: &mut impl RayParts) -> u64 {
        if self.count == 0 {
            parts.clear(part[0], part[1]);
            return 0;
        }
        let mut looked = 0;
        layer_pieces(&self.layout, eye, ray, part, |piece| {
            match piece.layer.and_then(|index| self.layers().get(index)) {
                None => parts.clear(piece.t_min, piece.t_max),
                Some(layer) => {
                    let path = layer.projection().ray(eye, ray.origin, ray.direction);
                    looked += layer.walk(&path, [piece.t_min, piece.t_max], parts);
                }
            }
        });
        looked
    }

    /// Bytes of the curves of this frame alone.
    pub fn curve_bytes(&self) -> u64 {
        self.layers().iter().map(CurveLayer::curve_bytes).sum()
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        let layers = (self.layers.capacity() * size_of::<CurveLayer>()) as u64;
        layers + self.layers.iter().map(CurveLayer::memory_bytes).sum::<u64>() + self.capture.memory_bytes()
    }
}
