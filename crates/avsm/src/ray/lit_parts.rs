//! Lit parts of a view ray by the opaque shadow map: the exact walk's, with blocks of texels that are lit or dark as a whole
//! passed at once.

use glam::DVec3;
use scatter_core::{Frame, LayerPiece, MapRay, ModelError, ShadowLayer, TexelSpan, ViewRay, layer_pieces};

use crate::map::pyramid::{Pyramid, depths_on};

/// A pyramid for each layer of the shadow map. Buffers are reused from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct ShadowPyramids {
    layers: Vec<Pyramid>,
}

impl ShadowPyramids {
    /// Of a frame's map. O(texels).
    pub fn build(&mut self, frame: &Frame<'_>) -> Result<(), ModelError> {
        self.layers.resize_with(frame.shadow().layer_count(), Pyramid::default);
        for (pyramid, layer) in self.layers.iter_mut().zip(frame.shadow().layers()) {
            pyramid.build(layer.projection(), |texel| [layer.texels()[texel]; 2])?;
        }
        Ok(())
    }

    /// Calls `each(a, b)` for every lit part of `[0, end]` of a ray, in order; neighbours may touch. Visibility by nearest
    /// texel, crossings exact to the rounding of their one root, as in the walk of all texels. `ray.origin` is relative to
    /// the eye.
    pub fn lit_parts(&self, frame: &Frame<'_>, ray: &ViewRay, end: f64, mut each: impl FnMut(f64, f64)) {
        let eye = frame.camera().eye();
        layer_pieces(frame.setup().maps(), eye, ray, [0.0, end], |piece| {
            let layer =
                piece.layer.and_then(|index| Some((self.layers.get(index)?, frame.shadow().layer(index)?)));
            match layer {
                None => each(piece.t_min, piece.t_max),
                Some((pyramid, layer)) => walk_layer(pyramid, &layer, eye, ray, piece, &mut each),
            }
        });
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        let own = (self.layers.capacity() * size_of::<Pyramid>()) as u64;
        own + self.layers.iter().map(Pyramid::memory_bytes).sum::<u64>()
    }
}

fn walk_layer(
    pyramid: &Pyramid,
    layer: &ShadowLayer<'_>,
    eye: DVec3,
    ray: &ViewRay,
    piece: LayerPiece,
    each: &mut impl FnMut(f64, f64),
) {
    let path = layer.projection().ray(eye, ray.origin, ray.direction);
    // Both kinds of visits push lit parts: one queue for them.
    let each = std::cell::RefCell::new(each);
    pyramid.walk(
        &path,
        [piece.t_min, piece.t_max],
        &mut |span, [nearest, farthest]| {
            let [near, far] = depths_on(&path, span);
            if far <= f64::from(nearest) {
                each.borrow_mut()(span.t_min, span.t_max);
                return true;
            }
            near > f64::from(farthest)
        },
        &mut |span| {
            if let Some((a, b)) = lit_part(layer.at(span.i, span.j).into(), &path, span) {
                each.borrow_mut()(a, b);
            }
        },
    );
}

/// The part of a span that is not deeper than the texel's surface.
fn lit_part(surface: f64, path: &MapRay, span: &TexelSpan) -> Option<(f64, f64)> {
    let (start, step) = (path.start.z, path.step.z);
    if surface == f64::INFINITY {
        return Some((span.t_min, span.t_max));
    }
    let crossing = (surface - start) / step;
    match step.partial_cmp(&0.0)? {
        std::cmp::Ordering::Greater => Some((span.t_min, span.t_max.min(crossing))),
        std::cmp::Ordering::Less => Some((span.t_min.max(crossing), span.t_max)),
        std::cmp::Ordering::Equal => (start <= surface).then_some((span.t_min, span.t_max)),
    }
    .filter(|(a, b)| a < b)
}
