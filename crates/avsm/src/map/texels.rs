//! The curves of a map's texels, of whichever kind: what a walk asks of them.

use crate::curve::{Between, TransmittanceCurve};
use crate::curves::avsm::AvsmCurve;
use crate::curves::fourier::FourierCurve;
use crate::curves::moments::MomentCurve;
use crate::curves::opacity::OpacityCurve;
use crate::map::node_lists::NodeLists;
use crate::nodes::{ends_of, optical_depth_of, visit_nodes};
use crate::ray::crossing::Crossing;
use crate::ray::ray_sum::RayParts;

/// Slices of opacity shadow maps, and pairs of terms of Fourier opacity maps: those of the paper's comparison.
pub const SLICES: usize = 32;
/// Cosines, and as many sines.
pub const TERMS: usize = 16;

/// Curves of all texels, `[row][column]`.
pub trait TexelCurves: Sync {
    /// How τ runs between two neighbouring knots.
    fn between(&self) -> Between;

    /// [`TransmittanceCurve::first_depth`] and [`TransmittanceCurve::dark_depth`] of a texel.
    fn ends(&self, texel: usize) -> [f32; 2];

    /// Gives a whole crossing of a texel to the ray, if it takes such of this kind of curve.
    fn offer(&self, _texel: usize, _crossing: &Crossing, _parts: &mut impl RayParts) -> bool {
        false
    }

    /// [`TransmittanceCurve::optical_depth`] of a texel.
    fn optical_depth(&self, texel: usize, depth: f64) -> f64;

    /// [`TransmittanceCurve::visit`] of a texel.
    fn visit(&self, texel: usize, depths: [f64; 2], each: impl FnMut(f64, f64));
}

/// Adaptive curves, and how they are looked up.
#[derive(Debug, Clone, Default)]
pub struct AvsmTexels<const N: usize> {
    pub(crate) curves: Vec<AvsmCurve<N>>,
    pub(crate) between: Between,
}

impl<const N: usize> TexelCurves for AvsmTexels<N> {
    fn between(&self) -> Between {
        self.between
    }

    fn offer(&self, texel: usize, crossing: &Crossing, parts: &mut impl RayParts) -> bool {
        self.between == Between::Exponential && parts.crossing(crossing, &self.curves[texel])
    }

    fn ends(&self, texel: usize) -> [f32; 2] {
        let curve = &self.curves[texel];
        [curve.first_depth(), curve.dark_depth()]
    }

    fn optical_depth(&self, texel: usize, depth: f64) -> f64 {
        self.curves[texel].optical_depth_by(self.between, depth)
    }

    fn visit(&self, texel: usize, depths: [f64; 2], each: impl FnMut(f64, f64)) {
        self.curves[texel].visit_by(self.between, depths, each);
    }
}

impl<C: TransmittanceCurve + Sync> TexelCurves for Vec<C> {
    fn between(&self) -> Between {
        C::BETWEEN
    }

    fn ends(&self, texel: usize) -> [f32; 2] {
        [self[texel].first_depth(), self[texel].dark_depth()]
    }

    fn optical_depth(&self, texel: usize, depth: f64) -> f64 {
        self[texel].optical_depth(depth)
    }

    fn visit(&self, texel: usize, depths: [f64; 2], each: impl FnMut(f64, f64)) {
        self[texel].visit(depths, each);
    }
}

impl TexelCurves for NodeLists {
    fn between(&self) -> Between {
        NodeLists::between(self)
    }

    fn ends(&self, texel: usize) -> [f32; 2] {
        ends_of(self.nodes(texel))
    }

    fn optical_depth(&self, texel: usize, depth: f64) -> f64 {
        optical_depth_of(self.nodes(texel), NodeLists::between(self), depth)
    }

    fn visit(&self, texel: usize, depths: [f64; 2], each: impl FnMut(f64, f64)) {
        visit_nodes(self.nodes(texel), NodeLists::between(self), depths, each);
    }
}

/// All kinds. One at a time holds curves; its memory serves the next frame of that kind.
#[derive(Debug, Clone)]
pub enum Texels {
    /// Adaptive, 4 nodes.
    Avsm4(AvsmTexels<4>),
    /// Adaptive, 8 nodes.
    Avsm8(AvsmTexels<8>),
    /// Adaptive, 12 nodes.
    Avsm12(AvsmTexels<12>),
    /// Adaptive, 16 nodes.
    Avsm16(AvsmTexels<16>),
    /// Opacity shadow maps.
    Opacity(Vec<OpacityCurve<SLICES>>),
    /// Fourier opacity maps.
    Fourier(Vec<FourierCurve<TERMS>>),
    /// Moments: 4.
    Moments4(Vec<MomentCurve<5>>),
    /// Moments: 6.
    Moments6(Vec<MomentCurve<7>>),
    /// Moments: 8.
    Moments8(Vec<MomentCurve<9>>),
    /// Deep shadow maps and uncompressed curves.
    Lists(NodeLists),
}

/// Runs an expression with the curves of whichever kind a [`Texels`] holds, by static dispatch.
macro_rules! with_texels {
    ($texels:expr, $curves:ident => $use:expr) => {
        match $texels {
            $crate::map::texels::Texels::Avsm4($curves) => $use,
            $crate::map::texels::Texels::Avsm8($curves) => $use,
            $crate::map::texels::Texels::Avsm12($curves) => $use,
            $crate::map::texels::Texels::Avsm16($curves) => $use,
            $crate::map::texels::Texels::Opacity($curves) => $use,
            $crate::map::texels::Texels::Fourier($curves) => $use,
            $crate::map::texels::Texels::Moments4($curves) => $use,
            $crate::map::texels::Texels::Moments6($curves) => $use,
            $crate::map::texels::Texels::Moments8($curves) => $use,
            $crate::map::texels::Texels::Lists($curves) => $use,
        }
    };
}
pub(crate) use with_texels;

impl Texels {
    /// Bytes of the curves.
    pub fn memory_bytes(&self) -> u64 {
        fn of<T>(curves: &Vec<T>) -> u64 {
            (curves.capacity() * size_of::<T>()) as u64
        }
        match self {
            Self::Avsm4(texels) => of(&texels.curves),
            Self::Avsm8(texels) => of(&texels.curves),
            Self::Avsm12(texels) => of(&texels.curves),
            Self::Avsm16(texels) => of(&texels.curves),
            Self::Opacity(curves) => of(curves),
            Self::Fourier(curves) => of(curves),
            Self::Moments4(curves) => of(curves),
            Self::Moments6(curves) => of(curves),
            Self::Moments8(curves) => of(curves),
            Self::Lists(lists) => lists.memory_bytes(),
        }
    }
}
