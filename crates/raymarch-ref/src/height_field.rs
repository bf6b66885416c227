//! Height-field truth: the exact walk through the surface that interpolates a shadow map's texels (3D, not by nearest texel).
//!
//! The surface of Billeter et al. 2010, Section 4, as the model fixes it: vertices at the texels' centres, each quad between four
//! of them divided from its top left to its bottom right, triangles that are plane in the world. The half texels at the map's
//! border extend the centres' depths flat to it. A quad with a corner at `+∞` is stepped: each of its quarters has its own texel's
//! depth. A point is lit if and only if it is not deeper than the surface; outside of the map nothing is shadowed.
//!
//! A ray is cut by every line on which the surface bends: columns and rows of half texels, and the diagonals. In between the surface
//! is plane, and the crossing with a plane is the root of one linear function, in f64. There is no step size and so no step error:
//! what a technique that interpolates the map so can reach at best. It shares with the walk by nearest texel how rays are cut by the
//! layers, and nothing else; O(texels along the ray).

use glam::DVec3;
use scatter_core::{
    Capabilities, Frame, MapRay, RayLight, RenderError, RenderStats, ScatterImage, SceneFacts, ShadowLayer,
    StageClock, VolumetricShadow, parallel,
};

use crate::map_segments::visit_segments;
use crate::walk::{LitParts, add_coloured, tint};

/// The id of [`HeightFieldWalk`].
pub const HEIGHT_FIELD_ID: &str = "truth-height-field";

/// The reference of techniques that interpolate the shadow map: every light, medium, map and camera of the model; smoke and hair
/// are refused. No options.
#[derive(Debug, Clone, Copy, Default)]
pub struct HeightFieldWalk;

impl HeightFieldWalk {
    /// All of the model but smoke and hair, which have no surface.
    pub const CAPABILITIES: Capabilities = Capabilities { translucent: &[], ..crate::EVERYTHING };

    /// Calls `each(start, end)` for every lit stretch of the ray of pixel `(x, y)`, in order; neighbouring stretches are one. Ray
    /// parameters \[world units\].
    pub fn lit_stretches(frame: &Frame<'_>, x: u32, y: u32, each: impl FnMut(f64, f64)) {
        let eye = frame.camera().eye();
        let ray = frame.camera().pixel_ray(x, y);
        let mut lit = LitParts::new(each);
        visit_segments(frame.shadow(), eye, &ray, frame.ray_end(x, y), &mut |segment| match segment
            .layer
            .and_then(|index| frame.shadow().layer(index))
        {
            None => lit.push(segment.start, segment.end),
            Some(layer) => {
                let path = layer.projection().ray(eye, ray.origin, ray.direction);
                walk_layer(&layer, &path, [segment.start, segment.end], &mut lit);
            }
        });
        lit.finish();
    }
}

impl VolumetricShadow for HeightFieldWalk {
    fn id(&self) -> &'static str {
        HEIGHT_FIELD_ID
    }

    fn capabilities(&self) -> Capabilities {
        Self::CAPABILITIES
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        let [width, height] = frame.size();
        out.resize(frame.size());
        let (inscattered, transmittance) = out.pixels_mut();
        parallel::for_each_row_of_both(
            (inscattered, transmittance),
            width as usize,
            |y, inscattered, transmittance| {
                for x in 0..width {
                    let sum = pixel(frame, x, y as u32);
                    inscattered[x as usize] = sum.as_vec3().to_array();
                    transmittance[x as usize] = frame.transmittance(x, y as u32).map(|t| t as f32);
                }
            },
        );
        clock.lap(&mut stats, "walk");
        stats.counts.push("rays", u64::from(width) * u64::from(height));
        stats.push_modelled(&SceneFacts::of(frame));
        Ok(stats)
    }
}

fn pixel(frame: &Frame<'_>, x: u32, y: u32) -> DVec3 {
    let eye = frame.camera().eye();
    let ray = frame.camera().pixel_ray(x, y);
    let light = RayLight::new(frame.light(), frame.medium(), eye, &ray);
    let mut sum = DVec3::ZERO;
    HeightFieldWalk::lit_stretches(frame, x, y, |a, b| match frame.texture() {
        None => sum += light.interval(a, b),
        Some(texture) => add_coloured(texture, eye, &ray, (a, b), &mut |colour, a, b| {
            sum += tint(colour) * light.interval(a, b);
        }),
    });
    sum
}

/// Pushes the lit parts of `[a, b]`, which lies inside of the layer.
fn walk_layer<F: FnMut(f64, f64)>(
    layer: &ShadowLayer<'_>,
    path: &MapRay,
    [a, b]: [f64; 2],
    lit: &mut LitParts<F>,
) {
    let perspective = layer.projection().is_perspective();
    let (p, d) = (path.start, path.step);
    // (value at t = 0, slope) of the homogeneous coordinates; the divisor of a parallel map is 1.
    let divisor = if perspective { [p.z, d.z] } else { [1.0, 0.0] };
    let mut lines = [
        // Half texels, and diagonals u − v = n.
        Lines::new([2.0 * p.x, 2.0 * d.x], divisor, [a, b]),
        Lines::new([2.0 * p.y, 2.0 * d.y], divisor, [a, b]),
        Lines::new([p.x - p.y, d.x - d.y], divisor, [a, b]),
    ];
    let mut t = a;
    while t < b {
        let nearest = (0..3).min_by(|&m, &n| lines[m].next.total_cmp(&lines[n].next)).unwrap_or(0);
        let end = lines[nearest].next.min(b);
        if end > t {
            let middle = if end == f64::INFINITY { 2.0 * t.abs() + 1.0 + t } else { 0.5 * (t + end) };
            let w = divisor[0] + divisor[1] * middle;
            let (u, v) = ((p.x + d.x * middle) / w, (p.y + d.y * middle) / w);
            let above = Surface::at(layer, u, v).height_above(path, perspective);
            push_where_not_negative(above, [t, end], lit);
            t = end;
        }
        lines[nearest].pass();
    }
}

/// Lines on which a coordinate, `(value + slope·t)/(w + ẇ·t)`, is an integer, in the order in which a ray crosses them.
struct Lines {
    value: [f64; 2],
    divisor: [f64; 2],
    /// The next integer, and the way to the one behind it; 0 where the coordinate does not change.
    index: f64,
    step: f64,
    /// Where the ray crosses the next line.
    next: f64,
}

impl Lines {
    fn new(value: [f64; 2], divisor: [f64; 2], [a, b]: [f64; 2]) -> Self {
        let slope = value[1] * divisor[0] - value[0] * divisor[1];
        let step = if slope > 0.0 {
            1.0
        } else if slope < 0.0 {
            -1.0
        } else {
            0.0
        };
        // At the apex of a pyramid the coordinate is anything: a little further on it is not.
        let inner = if b < f64::INFINITY { a + 1e-12 * (b - a) } else { a };
        let at = (value[0] + value[1] * inner) / (divisor[0] + divisor[1] * inner);
        let index = if step > 0.0 { at.floor() + 1.0 } else { at.ceil() - 1.0 };
        let mut lines = Self { value, divisor, index, step, next: f64::INFINITY };
        lines.solve();
        lines
    }

    fn solve(&mut self) {
        let t =
            (self.value[0] - self.index * self.divisor[0]) / (self.index * self.divisor[1] - self.value[1]);
        // A perspective ray may never reach a line: the solution then lies behind the lamp.
        let is_reached = self.step != 0.0 && t.is_finite() && self.divisor[0] + self.divisor[1] * t > 0.0;
        self.next = if is_reached { t } else { f64::INFINITY };
    }

    fn pass(&mut self) {
        self.index += self.step;
        let before = self.next;
        self.solve();
        // Rounding must not turn the ray back.
        self.next = self.next.max(before);
    }
}

/// The plane of the surface at a point of the map.
enum Surface {
    /// No surface.
    Open,
    /// Through three vertices: column, row, depth.
    Plane([DVec3; 3]),
    /// Of one depth.
    Flat(f64),
}

impl Surface {
    fn at(layer: &ShadowLayer<'_>, u: f64, v: f64) -> Self {
        let size = layer.projection().size();
        let texel = |i: f64, j: f64| -> f64 {
            let clamped =
                [(i, size[0]), (j, size[1])].map(|(n, size)| n.clamp(0.0, f64::from(size) - 1.0) as u32);
            layer.at(clamped[0], clamped[1]).into()
        };
        // The quad's top left centre is that of texel (i, j), which may lie outside of the map.
        let (i, j) = ((u - 0.5).floor(), (v - 0.5).floor());
        let (right, below) = (u - 0.5 - i, v - 0.5 - j);
        let depths = [texel(i, j), texel(i + 1.0, j), texel(i, j + 1.0), texel(i + 1.0, j + 1.0)];
        if depths.contains(&f64::INFINITY) {
            let depth = texel(u.floor(), v.floor());
            return if depth == f64::INFINITY { Self::Open } else { Self::Flat(depth) };
        }
        let vertex = |n: usize| {
            let (di, dj) = ((n % 2) as f64, (n / 2) as f64);
            DVec3::new(i + 0.5 + di, j + 0.5 + dj, depths[n])
        };
        // Above the diagonal lies the top right corner.
        Self::Plane(if right > below {
            [vertex(0), vertex(1), vertex(3)]
        } else {
            [vertex(0), vertex(3), vertex(2)]
        })
    }

    /// How far the surface lies behind a ray's point, as a linear function of t with the sign of "lit": value at 0 and slope.
    fn height_above(&self, path: &MapRay, perspective: bool) -> [f64; 2] {
        let (p, d) = (path.start, path.step);
        match self {
            Self::Open => [1.0, 0.0],
            Self::Flat(depth) => [depth - p.z, -d.z],
            Self::Plane([a, b, c]) => {
                if perspective {
                    // Three points of the plane in the homogeneous space (u·w, v·w, w); it need not hold the lamp. Points before
                    // it have the lamp's side.
                    let point = |q: &DVec3| DVec3::new(q.x * q.z, q.y * q.z, q.z);
                    let (a, b, c) = (point(a), point(b), point(c));
                    let normal = (b - a).cross(c - a);
                    let at_lamp = normal.dot(a);
                    let sign = if at_lamp < 0.0 { -1.0 } else { 1.0 };
                    [sign * (at_lamp - normal.dot(p)), -sign * normal.dot(d)]
                } else {
                    let (slope_u, slope_v) = slopes(a, b, c);
                    let height = a.z + slope_u * (p.x - a.x) + slope_v * (p.y - a.y);
                    [height - p.z, slope_u * d.x + slope_v * d.y - d.z]
                }
            }
        }
    }
}

/// Change of depth a column and a row.
fn slopes(a: &DVec3, b: &DVec3, c: &DVec3) -> (f64, f64) {
    let (ab, ac) = (*b - *a, *c - *a);
    let area = ab.x * ac.y - ab.y * ac.x;
    ((ab.z * ac.y - ac.z * ab.y) / area, (ab.x * ac.z - ac.x * ab.z) / area)
}

/// Pushes the part of `[from, to]` where `value + slope·t ≥ 0`.
fn push_where_not_negative<F: FnMut(f64, f64)>(
    [value, slope]: [f64; 2],
    [from, to]: [f64; 2],
    lit: &mut LitParts<F>,
) {
    let root = -value / slope;
    if slope == 0.0 || !root.is_finite() {
        if value >= 0.0 {
            lit.push(from, to);
        }
    } else if slope > 0.0 {
        lit.push(from.max(root), to);
    } else {
        lit.push(from, to.min(root));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::MapProjection;

    /// The surface by interpolation alone, in the world: whether a point is lit.
    fn is_lit(layer: &ShadowLayer<'_>, p_world: DVec3) -> bool {
        let p = layer.projection().texel_from_world(p_world);
        let size = layer.projection().size();
        let texel = |i: i64, j: i64| {
            f64::from(layer.at(i.clamp(0, size[0] as i64 - 1) as u32, j.clamp(0, size[1] as i64 - 1) as u32))
        };
        let (i, j) = ((p.x - 0.5).floor() as i64, (p.y - 0.5).floor() as i64);
        let (x, y) = (p.x - 0.5 - i as f64, p.y - 0.5 - j as f64);
        let [a, b, c, d] = [texel(i, j), texel(i + 1, j), texel(i, j + 1), texel(i + 1, j + 1)];
        if [a, b, c, d].contains(&f64::INFINITY) {
            return p.z <= texel(p.x.floor() as i64, p.y.floor() as i64);
        }
        // Inverse depths are what a plane of the world is linear in, seen from a lamp.
        let f = |depth: f64| if layer.projection().is_perspective() { -1.0 / depth } else { depth };
        let [a, b, c, d] = [a, b, c, d].map(f);
        let height = if x > y { a + (b - a) * x + (d - b) * y } else { a + (d - c) * x + (c - a) * y };
        f(p.z) <= height
    }

    #[test]
    fn lit_stretches_are_where_interpolation_says_so() {
        let (position, forward, up) = ([0.3, 4.0, -0.2], [0.1, -1.0, 0.2], [0.0, 0.0, 1.0]);
        let maps = [
            MapProjection::orthographic(position, forward, up, [2.0, 1.5], [7, 5]).unwrap(),
            MapProjection::perspective(position, forward, up, 0.6, 6).unwrap(),
        ];
        let mut lit_count = 0;
        for map in maps {
            let texels: Vec<f32> = (0..map.size()[0] * map.size()[1])
                .map(|n| if n % 11 == 3 { f32::INFINITY } else { 3.0 + 0.4 * ((n * n) % 7) as f32 })
                .collect();
            let layer = ShadowLayer::new(map, &texels).unwrap();
            for n in 0..400 {
                let angle = f64::from(n);
                let start =
                    DVec3::new(2.0 * angle.sin(), 0.5 + (0.7 * angle).cos(), 1.7 * (1.3 * angle).cos());
                let towards = DVec3::new((2.1 * angle).cos(), (0.9 * angle).sin(), (1.9 * angle).sin());
                let direction = (towards - start).normalize();
                let path = map.ray(DVec3::ZERO, start, direction);
                let Some((a, b)) = crate::map_segments::inside(&map, &path, 0.0, 6.0) else { continue };
                let mut found = Vec::new();
                let mut lit = LitParts::new(|from, to| found.push((from, to)));
                walk_layer(&layer, &path, [a, b], &mut lit);
                lit.finish();
                for step in 0..300 {
                    let t = a + (b - a) * (f64::from(step) + 0.5) / 300.0;
                    let near = found.iter().any(|(from, to)| (from - t).abs().min((to - t).abs()) < 1e-9);
                    let inside = found.iter().any(|(from, to)| *from <= t && t < *to);
                    assert!(near || inside == is_lit(&layer, start + direction * t), "{n} at {t}: {found:?}");
                    lit_count += usize::from(inside);
                }
            }
        }
        assert!(lit_count > 20_000, "light and shadow: {lit_count}");
    }
}
