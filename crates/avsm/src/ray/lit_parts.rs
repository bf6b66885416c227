//! Lit parts of a view ray by the opaque shadow map: the exact walk's, with blocks of texels that are lit or dark as a whole
//! passed at once.

use glam::DVec3;
use scatter_core::{Frame, LayerPiece, ModelError, ShadowLayer, ViewRay, layer_pieces, lit_part};

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

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::lit_stretches;
    use scatter_testing::{Filling, MapKind, OwnedFrame};

    /// Blocks pass what they can, and what is left is what the walk of all texels finds, by core's own walk. Of an
    /// even number of columns none runs along a border of texels, where rounding decides.
    #[test]
    fn lit_parts_are_those_of_the_walk_of_all_texels() {
        let mut parts = 0;
        for kind in MapKind::ALL {
            for (side, filling) in [
                (24, Filling::Random { seed: 5, far: 9.0 }),
                (257, Filling::Constant(4.0)),
                (600, Filling::Random { seed: 3, far: 9.0 }),
            ] {
                let frame = OwnedFrame::stock(kind, [16, 9], side, filling);
                frame.with(|frame| {
                    let mut pyramids = ShadowPyramids::default();
                    pyramids.build(frame).unwrap();
                    for (x, y) in (0..9).flat_map(|y| (0..16).map(move |x| (x, y))) {
                        let (ray, end) = (frame.camera().pixel_ray(x, y), frame.ray_end(x, y));
                        let mut found: Vec<[f64; 2]> = Vec::new();
                        pyramids.lit_parts(frame, &ray, end, |a, b| match found.last_mut() {
                            Some(last) if last[1] == a => last[1] = b,
                            _ => found.push([a, b]),
                        });
                        let mut expected = Vec::new();
                        let maps = (frame.shadow(), frame.setup().maps());
                        lit_stretches(maps, frame.camera().eye(), &ray, [0.0, end], |a, b| expected.push([a, b]));
                        parts += expected.len();
                        // Points in the middle of either's parts are in the other's, but for slits.
                        for (own, other) in [(&found, &expected), (&expected, &found)] {
                            for [a, b] in own.iter().filter(|[a, b]| b - a > 1e-9) {
                                let covered: f64 =
                                    other.iter().map(|[c, d]| (d.min(*b) - c.max(*a)).max(0.0)).sum();
                                assert!(
                                    (covered - (b - a)).abs() < 1e-9,
                                    "{kind:?} {side} ({x}, {y}): {a} to {b}, {covered}\n{found:?}\n{expected:?}"
                                );
                            }
                        }
                    }
                });
            }
        }
        assert!(parts > 10_000, "{parts}");
    }
}
