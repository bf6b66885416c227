//! The kinds of curves of the tables, behind one loop over all of them.

use scatter::avsm::{
    AvsmCurve, DeepCurve, DepthRange, FourierCurve, MomentCurve, OpacityCurve, Removal, TranslucentSegment,
    TransmittanceCurve, UncompressedCurve,
};

/// What is done with each kind: `make` gives an empty curve over a range of depths.
pub trait Visit {
    /// One kind, by its name in the tables.
    fn kind<C: TransmittanceCurve>(&mut self, name: &str, make: impl Fn(DepthRange) -> C);
}

/// Adaptive curves by another rule of removal.
#[derive(Clone)]
pub struct By<const N: usize>(AvsmCurve<N>, Removal);

impl<const N: usize> By<N> {
    /// Empty curves of a rule.
    pub fn rule(removal: Removal) -> impl Fn(DepthRange) -> Self {
        move |_| Self(AvsmCurve::default(), removal)
    }
}

impl<const N: usize> TransmittanceCurve for By<N> {
    fn insert(&mut self, segment: &TranslucentSegment) {
        self.0.insert_by(segment, self.1);
    }

    fn optical_depth(&self, depth: f64) -> f64 {
        self.0.optical_depth(depth)
    }

    fn first_depth(&self) -> f32 {
        self.0.first_depth()
    }

    fn visit(&self, depths: [f64; 2], each: impl FnMut(f64, f64)) {
        self.0.visit(depths, each);
    }
}

/// All kinds of the tables.
pub fn all(visit: &mut impl Visit) {
    visit.kind("avsm 4", |_| AvsmCurve::<4>::default());
    visit.kind("avsm 8", |_| AvsmCurve::<8>::default());
    visit.kind("avsm 12", |_| AvsmCurve::<12>::default());
    visit.kind("avsm 16", |_| AvsmCurve::<16>::default());
    visit.kind("avsm 8 ahead", By::<8>::rule(Removal::LookAhead));
    visit.kind("opacity 32", OpacityCurve::<32>::new);
    visit.kind("fourier 16", FourierCurve::<16>::new);
    visit.kind("moments 4", MomentCurve::<5>::new);
    visit.kind("moments 6", MomentCurve::<7>::new);
    visit.kind("moments 8", MomentCurve::<9>::new);
    visit.kind("deep 0.01", |_| DeepCurve::new(0.01));
    visit.kind("deep 0.002", |_| DeepCurve::new(0.002));
    visit.kind("uncompressed", |_| UncompressedCurve::default());
}
