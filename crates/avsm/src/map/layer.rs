//! One curve map: its texels built from segments that stream in or lie there, and a part of a view ray walked through it.

use std::cell::RefCell;
use std::sync::Mutex;

use scatter_core::{
    MapError, MapProjection, MapRay, ShadowMap, TexelSpan, TranslucentLayer, TranslucentSegment,
    TranslucentSource, parallel,
};

use crate::curve::{DepthRange, TransmittanceCurve};
use crate::curves::avsm::AvsmCurve;
use crate::map::node_lists::NodeLists;
use crate::map::opaque::opaque_depth;
use crate::map::pyramid::{Pyramid, depths_on};
use crate::map::texels::{AvsmTexels, TexelCurves, Texels, with_texels};
use crate::options::{Curve, Moments, Nodes, Options};
use crate::ray::crossing::Crossing;
use crate::ray::dimmed_light::DimmedPart;
use crate::ray::ray_sum::RayParts;

/// Rows of texels that one thread fills. Fewer ask a source more often, each time over all of its occluders.
const BAND: usize = 16;

/// Curves of one map of a light.
#[derive(Debug, Clone)]
pub struct CurveLayer {
    projection: MapProjection,
    texels: Texels,
    ends: Pyramid,
}

/// What dims the light of a layer.
#[derive(Clone, Copy)]
pub enum Occluders<'a> {
    /// Nothing but opaque surfaces.
    None,
    /// Segments of this very map.
    Captured(TranslucentLayer<'a>),
    /// What can name them: for curves that store none.
    Source(&'a dyn TranslucentSource),
}

/// All that goes into a layer.
#[derive(Clone, Copy)]
pub struct LayerInput<'a> {
    /// Where it looks.
    pub projection: MapProjection,
    /// Smoke and hair.
    pub occluders: Occluders<'a>,
    /// Opaque surfaces that are to be in the curves.
    pub opaque: Option<&'a ShadowMap<'a>>,
    /// Which layer of the light it is.
    pub index: usize,
}

impl LayerInput<'_> {
    fn width(&self) -> usize {
        self.projection.size()[0] as usize
    }

    fn place(&self, texel: usize) -> [u32; 2] {
        [(texel % self.width()) as u32, (texel / self.width()) as u32]
    }

    /// The opaque surface of a texel as a segment.
    fn surface(&self, texel: usize) -> Option<TranslucentSegment> {
        let depth = opaque_depth(self.opaque?, self.index, &self.projection, self.place(texel));
        (depth < f32::INFINITY).then_some(TranslucentSegment {
            entry: depth,
            exit: depth,
            optical_depth: f32::INFINITY,
        })
    }

    /// Calls `each` with the segments of a texel that lie there.
    fn segments(&self, texel: usize, each: impl FnMut(&TranslucentSegment)) {
        if let Occluders::Captured(layer) = &self.occluders {
            let [i, j] = self.place(texel);
            layer.at(i, j).iter().for_each(each);
        }
    }
}

impl CurveLayer {
    /// An empty layer.
    pub fn new(projection: MapProjection) -> Self {
        Self { projection, texels: Texels::Lists(NodeLists::default()), ends: Pyramid::default() }
    }

    /// Builds the curves of `input`: adaptive ones in one pass, where a source streams into them, the others from segments that
    /// lie there. Curves that divide a range of depths take that of all segments of the layer.
    pub fn build(&mut self, input: &LayerInput<'_>, options: &Options) -> Result<(), MapError> {
        self.projection = input.projection;
        match options.curve {
            Curve::Avsm => match options.nodes {
                Nodes::Four => self.build_avsm::<4>(input, options, Texels::Avsm4, |t| match t {
                    Texels::Avsm4(own) => Some(own),
                    _ => None,
                }),
                Nodes::Eight => self.build_avsm::<8>(input, options, Texels::Avsm8, |t| match t {
                    Texels::Avsm8(own) => Some(own),
                    _ => None,
                }),
                Nodes::Twelve => self.build_avsm::<12>(input, options, Texels::Avsm12, |t| match t {
                    Texels::Avsm12(own) => Some(own),
                    _ => None,
                }),
                Nodes::Sixteen => self.build_avsm::<16>(input, options, Texels::Avsm16, |t| match t {
                    Texels::Avsm16(own) => Some(own),
                    _ => None,
                }),
            }?,
            Curve::Opacity => self.build_ranged(input, OpacityTexel::new, Texels::Opacity, |t| match t {
                Texels::Opacity(own) => Some(own),
                _ => None,
            })?,
            Curve::Fourier => self.build_ranged(input, FourierTexel::new, Texels::Fourier, |t| match t {
                Texels::Fourier(own) => Some(own),
                _ => None,
            })?,
            Curve::Moments => match options.moments {
                Moments::Four => {
                    self.build_ranged(input, MomentTexel::<5>::new, Texels::Moments4, |t| match t {
                        Texels::Moments4(own) => Some(own),
                        _ => None,
                    })
                }
                Moments::Six => {
                    self.build_ranged(input, MomentTexel::<7>::new, Texels::Moments6, |t| match t {
                        Texels::Moments6(own) => Some(own),
                        _ => None,
                    })
                }
                Moments::Eight => {
                    self.build_ranged(input, MomentTexel::<9>::new, Texels::Moments8, |t| match t {
                        Texels::Moments8(own) => Some(own),
                        _ => None,
                    })
                }
            }?,
            Curve::Deep | Curve::Uncompressed => {
                let threshold = (options.curve == Curve::Deep).then_some(options.threshold);
                if !matches!(self.texels, Texels::Lists(_)) {
                    self.texels = Texels::Lists(NodeLists::default());
                }
                if let Texels::Lists(lists) = &mut self.texels {
                    lists.build(input.projection.size(), threshold, |texel, list| {
                        list.extend(input.surface(texel));
                        input.segments(texel, |segment| list.push(*segment));
                    });
                }
            }
        }
        with_texels!(&self.texels, texels => self.ends.build(&input.projection, |texel| texels.ends(texel)))?;
        Ok(())
    }

    fn build_avsm<const N: usize>(
        &mut self,
        input: &LayerInput<'_>,
        options: &Options,
        make: fn(AvsmTexels<N>) -> Texels,
        own: fn(&mut Texels) -> Option<&mut AvsmTexels<N>>,
    ) -> Result<(), MapError> {
        if own(&mut self.texels).is_none() {
            self.texels = make(AvsmTexels::default());
        }
        let Some(texels) = own(&mut self.texels) else { return Ok(()) };
        texels.between = options.between;
        let removal = options.removal;
        fill(&mut texels.curves, AvsmCurve::default(), input, |curve, segment| {
            curve.insert_by(segment, removal)
        })
    }

    fn build_ranged<C: TransmittanceCurve + Copy + Send>(
        &mut self,
        input: &LayerInput<'_>,
        empty: fn(DepthRange) -> C,
        make: fn(Vec<C>) -> Texels,
        own: fn(&mut Texels) -> Option<&mut Vec<C>>,
    ) -> Result<(), MapError> {
        if own(&mut self.texels).is_none() {
            self.texels = make(Vec::new());
        }
        let mut range = DepthRange::EMPTY;
        let texels = input.width() * input.projection.size()[1] as usize;
        for texel in 0..texels {
            range = input.surface(texel).iter().fold(range, |range, surface| range.with(surface));
            input.segments(texel, |segment| range = range.with(segment));
        }
        let Some(curves) = own(&mut self.texels) else { return Ok(()) };
        fill(curves, empty(range), input, |curve, segment| curve.insert(segment))
    }

    /// Where it looks.
    pub fn projection(&self) -> &MapProjection {
        &self.projection
    }

    /// τ that a texel's light has crossed at a depth.
    pub fn optical_depth(&self, [i, j]: [u32; 2], depth: f64) -> f64 {
        let texel = j as usize * self.projection.size()[0] as usize + i as usize;
        with_texels!(&self.texels, texels => texels.optical_depth(texel, depth))
    }

    /// Walks the part `[t_min, t_max]` of a ray, all of which lies in the map, and gives what it finds to `parts`; dark parts are
    /// left out. Returns how many texels it looked at.
    pub fn walk(&self, path: &MapRay, part: [f64; 2], parts: &mut impl RayParts) -> u64 {
        with_texels!(&self.texels, texels => self.walk_texels(texels, path, part, parts))
    }

    fn walk_texels(
        &self,
        texels: &impl TexelCurves,
        path: &MapRay,
        part: [f64; 2],
        parts: &mut impl RayParts,
    ) -> u64 {
        let width = self.projection.size()[0] as usize;
        let mut looked = 0;
        // Blocks and texels both find parts: one taker for them.
        let parts = RefCell::new(parts);
        let settles = |crossing: &Crossing, [first, dark]: [f32; 2]| {
            let ([near, far], [a, b]) = (crossing.depths, crossing.t);
            if far <= f64::from(first) {
                parts.borrow_mut().clear(a, b);
                return true;
            }
            near > f64::from(dark)
        };
        let crossing = |span: &TexelSpan| Crossing {
            t: [span.t_min, span.t_max],
            depths: depths_on(path, span),
            is_along: path.step.z > 0.0,
            line: [path.start.z, path.step.z],
        };
        self.ends.walk(path, part, &mut |span, ends| settles(&crossing(span), ends), &mut |span| {
            looked += 1;
            let texel = span.j as usize * width + span.i as usize;
            let crossing = crossing(span);
            if !settles(&crossing, texels.ends(texel)) {
                let mut parts = parts.borrow_mut();
                if !texels.offer(texel, &crossing, &mut **parts) {
                    cut_crossing(texels, texel, &crossing, &mut **parts);
                }
            }
        });
        looked
    }

    /// Bytes of its curves alone.
    pub fn curve_bytes(&self) -> u64 {
        self.texels.memory_bytes()
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        self.curve_bytes() + self.ends.memory_bytes()
    }
}

/// Cuts a crossing at the knots of its texel's curve.
fn cut_crossing(texels: &impl TexelCurves, texel: usize, crossing: &Crossing, parts: &mut impl RayParts) {
    let between = texels.between();
    let ([near, far], [a, b]) = (crossing.depths, crossing.t);
    if !(near < far) {
        let optical_depth = texels.optical_depth(texel, near);
        return parts.dimmed(&DimmedPart { t: crossing.t, optical_depths: [optical_depth; 2], between });
    }
    // Knots come in the order of depths, which may be against the ray.
    let [first, last] = if crossing.is_along { [a, b] } else { [b, a] };
    let at = |depth: f64| crossing.parameter_at(depth).clamp(a, b);
    let mut before: Option<(f64, f64)> = None;
    texels.visit(texel, crossing.depths, |depth, optical_depth| {
        let now = match before {
            None => first,
            Some(_) if depth == far => last,
            Some(_) => at(depth),
        };
        if let Some((then, optical_depth_then)) = before {
            let mut t = [then, now];
            let mut optical_depths = [optical_depth_then, optical_depth];
            if !crossing.is_along {
                t.reverse();
                optical_depths.reverse();
            }
            if t[0] < t[1] {
                parts.dimmed(&DimmedPart { t, optical_depths, between });
            }
        }
        before = Some((now, optical_depth));
    });
}

type OpacityTexel = crate::curves::opacity::OpacityCurve<{ crate::map::texels::SLICES }>;
type FourierTexel = crate::curves::fourier::FourierCurve<{ crate::map::texels::TERMS }>;
type MomentTexel<const M: usize> = crate::curves::moments::MomentCurve<M>;

/// Fills the curves of a layer, opaque surfaces first, since nothing behind them needs to be inserted. Each band of rows by one
/// thread, each texel's segments in their order. Allocates only where the map grows, and then exactly what it needs.
fn fill<C: Copy + Send>(
    curves: &mut Vec<C>,
    empty: C,
    input: &LayerInput<'_>,
    insert: impl Fn(&mut C, &TranslucentSegment) + Sync + Send,
) -> Result<(), MapError> {
    let [width, height] = input.projection.size().map(|side| side as usize);
    curves.clear();
    curves.reserve_exact(width * height);
    curves.resize(width * height, empty);
    let failure = Mutex::new(None);
    parallel::for_each_row(curves, width * BAND, |band, curves| {
        let first = band * BAND * width;
        for (texel, curve) in curves.iter_mut().enumerate() {
            if let Some(surface) = input.surface(first + texel) {
                insert(curve, &surface);
            }
            input.segments(first + texel, |segment| insert(curve, segment));
        }
        if let Occluders::Source(source) = input.occluders {
            let rows = [band * BAND, band * BAND + curves.len() / width].map(|row| row as u32);
            let tile = [0, rows[0], width as u32, rows[1]];
            let captured = source.capture(&input.projection, tile, &mut |texel, segment| {
                if let Some(curve) = curves.get_mut(texel as usize) {
                    insert(curve, &segment);
                }
            });
            if let Err(error) = captured {
                // The first band's, so that the message does not depend on the threads.
                let mut first = failure.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                if first.as_ref().is_none_or(|(earlier, _)| band < *earlier) {
                    *first = Some((band, error));
                }
            }
        }
    });
    match failure.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner) {
        Some((_, error)) => Err(error),
        None => Ok(()),
    }
}
