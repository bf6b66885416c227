//! Curves as pure functions: what holds after any insertions, and how far each kind is from the exact curve.

use avsm::{
    AvsmCurve, DeepCurve, DepthRange, LinearAvsm, Node, Removal, TranslucentSegment, TransmittanceCurve,
    UncompressedCurve,
};
use scatter_testing::Random;

/// A segment of a random scene: smoke, thin smoke, a hair, now and then something opaque, degenerate or empty.
fn random_segment(random: &mut Random) -> TranslucentSegment {
    let entry = random.range(0.0, 10.0) as f32;
    let length = match random.below(4) {
        0 => 0.0,
        1 => random.range(0.0, 0.1) as f32,
        _ => random.range(0.0, 3.0) as f32,
    };
    let optical_depth = match random.below(40) {
        0 => f32::INFINITY,
        1 => 0.0,
        2 => random.range(1.0, 9.0) as f32,
        _ => 10f32.powf(random.range(-4.0, 0.0) as f32),
    };
    let (entry, exit) = if random.below(20) == 0 { (entry + length, entry) } else { (entry, entry + length) };
    TranslucentSegment { entry, exit, optical_depth }
}

fn exact(segments: &[TranslucentSegment]) -> UncompressedCurve {
    let mut curve = UncompressedCurve::default();
    segments.iter().for_each(|segment| curve.insert(segment));
    curve.finish();
    curve
}

/// `∫ |T_a − T_b| dz` between the first and the last of `ends`, all knots of both curves among them: extinction of both is
/// constant between two of them, so each part is a difference of two closed forms, or two of them where the curves cross.
fn integral_of_difference(a: &impl TransmittanceCurve, b: &impl TransmittanceCurve, ends: &[f32]) -> f64 {
    let mut cuts: Vec<f64> = ends.iter().map(|&end| end.into()).collect();
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    let area = |from: f64, to: f64, length: f64| {
        let x = to - from;
        (-from).exp() * length * if x.abs() > 1e-12 { -(-x).exp_m1() / x } else { 1.0 }
    };
    let part = |from: f64, to: f64| {
        // From the right of one knot to the left of the next: two inner points give the line.
        let line = |curve: &dyn Fn(f64) -> f64| {
            let [first, second] = [0.25, 0.75].map(|share| curve(from + share * (to - from)));
            let slope = second - first;
            [(first - 0.5 * slope).max(0.0), second + 0.5 * slope]
        };
        let [p, q] = [line(&|z| a.optical_depth(z)), line(&|z| b.optical_depth(z))];
        let [left, right] = [p[0] - q[0], p[1] - q[1]];
        let length = to - from;
        let difference =
            |p: [f64; 2], q: [f64; 2], length| (area(p[0], p[1], length) - area(q[0], q[1], length)).abs();
        if left * right < 0.0 {
            let share = left / (left - right);
            let middle = p[0] + share * (p[1] - p[0]);
            difference([p[0], middle], [q[0], middle], share * length)
                + difference([middle, p[1]], [middle, q[1]], (1.0 - share) * length)
        } else {
            difference(p, q, length)
        }
    };
    cuts.windows(2).map(|pair| part(pair[0], pair[1])).sum()
}

fn nodes<const N: usize>(curve: &AvsmCurve<N>) -> Vec<Node> {
    curve.nodes().collect()
}

/// What must hold of a curve's nodes after `segments`; `before` are those that it had before the last one.
fn assert_in_order(nodes: &[Node], before: &[Node], segments: &[TranslucentSegment], what: &str) {
    assert!(nodes.windows(2).all(|pair| pair[0].depth <= pair[1].depth), "{what}: depths, {nodes:?}");
    let falls = nodes.windows(2).all(|pair| pair[0].optical_depth <= pair[1].optical_depth);
    assert!(falls, "{what}: transmittance, {nodes:?}");
    let ends: Vec<f32> = segments.iter().flat_map(|segment| [segment.entry, segment.exit]).collect();
    assert!(nodes.iter().all(|node| ends.contains(&node.depth)), "{what}: a node has moved, {nodes:?}");
    if let (Some(first), Some(was)) = (nodes.first(), before.first()) {
        let entry = segments.last().map_or(f32::INFINITY, |segment| segment.entry.min(segment.exit));
        assert!(
            first.depth == was.depth || first.depth == entry && entry < was.depth,
            "{what}: the first node"
        );
        assert_eq!(first.optical_depth, 0.0, "{what}: the first node");
    }
    if let (Some(last), Some(was)) = (nodes.last(), before.last()) {
        assert!(last.depth >= was.depth, "{what}: the last node, {before:?} {nodes:?}");
        assert!(last.optical_depth >= was.optical_depth, "{what}: all that was crossed");
    }
}

fn check_sequences<const N: usize>(removal: Removal, sequences: u64) -> (f64, f64) {
    let (mut tightest, mut largest) = (f64::INFINITY, 0.0f64);
    for seed in 0..sequences {
        let mut random = Random(1000 * N as u64 + seed);
        let count = 1 + random.below(30);
        let mut curve = AvsmCurve::<N>::default();
        let (mut bound, mut segments) = (0.0, Vec::new());
        let mut before = Vec::new();
        for _ in 0..count {
            let segment = random_segment(&mut random);
            segments.push(segment);
            bound += curve.insert_bounded(&segment, removal);
            let now = nodes(&curve);
            assert_in_order(&now, &before, &segments, &format!("{N} nodes, {removal:?}, seed {seed}"));
            before = now;
        }
        let ends: Vec<f32> = segments.iter().flat_map(|segment| [segment.entry, segment.exit]).collect();
        let error = integral_of_difference(&curve, &exact(&segments), &ends);
        // Nodes are rounded to f32 at every insertion, 6e-8 of τ ≤ 30 each, over 13 units.
        assert!(
            error <= bound * (1.0 + 1e-6) + 3e-5,
            "{N} nodes, {removal:?}, seed {seed}: {error} over {bound}"
        );
        if error > 0.01 {
            tightest = tightest.min(bound / error);
        }
        largest = largest.max(error);
    }
    (tightest, largest)
}

/// 10⁴ sequences of up to 30 insertions: order, ends, depths, and the bound.
#[test]
fn after_any_insertions_nodes_are_in_order_and_the_bound_holds() {
    for removal in [Removal::Exponential, Removal::Triangle, Removal::LookAhead] {
        for (n, (tightest, largest)) in [
            (4, check_sequences::<4>(removal, 2000)),
            (8, check_sequences::<8>(removal, 2000)),
            (12, check_sequences::<12>(removal, 500)),
            (16, check_sequences::<16>(removal, 500)),
        ] {
            println!(
                "{n} nodes, {removal:?}: largest error {largest:.3}, bound at least {tightest:.2} of it"
            );
        }
    }
}

#[test]
fn ten_thousand_faint_hairs_keep_their_product() {
    // (1 − 1e-6)^10000
    let expected = 0.990_049_83;
    let hair = |n: u32| TranslucentSegment::hair(1.0 + n as f32 * 1e-4, 1e-6);
    let mut curve = AvsmCurve::<8>::default();
    (0..10_000).for_each(|n| curve.insert(&hair(n)));
    let mut exact = UncompressedCurve::default();
    (0..10_000).for_each(|n| exact.insert(&hair(n)));
    exact.finish();
    // An optical depth of 0.01 is summed in f32: 10⁴ roundings of 5e-10 at most.
    for (left, allowed) in [(curve.transmittance(3.0), 1e-6), (exact.transmittance(3.0), 1e-8)] {
        println!("{left:.9}, off by {:.1e} of {allowed:.0e}", left - expected);
        assert!((left - expected).abs() < allowed, "{left}");
    }
    // All in one place, and in random order.
    let mut curve = AvsmCurve::<4>::default();
    (0..10_000).for_each(|_| curve.insert(&TranslucentSegment::hair(2.0, 1e-6)));
    assert!((curve.transmittance(2.1) - expected).abs() < 5e-6, "{}", curve.transmittance(2.1));
    let mut curve = LinearAvsm::<4>::default();
    (0..10_000).for_each(|n| curve.insert(&hair(n * 7919 % 10_000)));
    assert!((curve.transmittance(3.0) - expected).abs() < 5e-6, "{}", curve.transmittance(3.0));
}

#[test]
fn degenerate_insertions_are_what_they_say() {
    let mut curve = AvsmCurve::<4>::default();
    assert_eq!(curve.transmittance(1.0), 1.0);
    curve.insert(&TranslucentSegment { entry: 3.0, exit: 3.0, optical_depth: 0.0 });
    curve.insert(&TranslucentSegment { entry: f32::NAN, exit: 3.0, optical_depth: 1.0 });
    assert_eq!(curve, AvsmCurve::default());
    // Opaque first: nothing behind it matters, what is before it does.
    curve.insert(&TranslucentSegment::hair(5.0, 1.0));
    curve.insert(&TranslucentSegment::volume(7.0, 9.0, 0.3));
    assert_eq!(curve.count(), 2);
    assert_eq!([4.0, 5.0, 5.1, 9.0].map(|z| curve.transmittance(z)), [1.0, 1.0, 0.0, 0.0]);
    curve.insert(&TranslucentSegment::volume(3.0, 4.0, 0.5));
    assert!((curve.transmittance(5.0) - (-0.5f64).exp()).abs() < 1e-6);
    assert_eq!(curve.transmittance(5.1), 0.0);
    // The same one twice is twice as dense, and no more nodes than needed are lost.
    let mut twice = AvsmCurve::<4>::default();
    let smoke = TranslucentSegment::volume(1.0, 2.0, 0.4);
    (0..2).for_each(|_| twice.insert(&smoke));
    for z in [1.0, 1.25, 1.9, 5.0] {
        let expected = (-0.8 * (z - 1.0f64).clamp(0.0, 1.0)).exp();
        assert!((twice.transmittance(z) - expected).abs() < 1e-6, "{z}");
    }
    // A reversed segment.
    let mut reversed = AvsmCurve::<4>::default();
    reversed.insert(&TranslucentSegment { entry: 2.0, exit: 1.0, optical_depth: 0.4 });
    let mut forward = AvsmCurve::<4>::default();
    forward.insert(&TranslucentSegment { entry: 1.0, exit: 2.0, optical_depth: 0.4 });
    assert_eq!(reversed, forward);
}

#[test]
fn a_curve_is_eight_bytes_a_node() {
    assert_eq!(size_of::<AvsmCurve<4>>(), 32);
    assert_eq!(size_of::<AvsmCurve<16>>(), 128);
}

/// Deep shadow maps keep their threshold at every depth, and take fewer nodes for a larger one.
#[test]
fn deep_curves_keep_their_threshold() {
    for threshold in [0.01f32, 0.002] {
        let (mut worst, mut kept, mut all) = (0.0f64, 0, 0);
        for seed in 0..200 {
            let mut random = Random(31 * seed + 5);
            let segments: Vec<_> = (0..1 + random.below(60)).map(|_| random_segment(&mut random)).collect();
            let exact = exact(&segments);
            let mut deep = DeepCurve::new(threshold);
            segments.iter().for_each(|segment| deep.insert(segment));
            deep.finish();
            (kept, all) = (kept + deep.nodes().len(), all + exact.nodes().len());
            let ends = segments.iter().flat_map(|s| [s.entry, s.exit]).map(f64::from);
            let places =
                ends.flat_map(|z| [z - 1e-5, z, z + 1e-5]).chain((0..700).map(|n| f64::from(n) * 0.02));
            for z in places {
                let error = (deep.transmittance(z) - exact.transmittance(z)).abs();
                worst = worst.max(error);
                assert!(error <= threshold.into(), "{threshold}, seed {seed}: {error} at {z}");
            }
        }
        println!("threshold {threshold}: worst {worst:.5}, {kept} of {all} nodes");
        assert!(kept < all);
    }
}

/// A texel as the papers show them: three columns of smoke over a long range, or hairs with and without smoke.
fn texel(kind: &str, seed: u64, range: f64) -> Vec<TranslucentSegment> {
    let mut random = Random(seed);
    let mut segments = Vec::new();
    if kind != "hair" {
        for column in 0..3 {
            let centre = range * (0.15 + 0.35 * f64::from(column));
            for _ in 0..if kind == "smoke" { 47 } else { 20 } {
                let middle = centre + random.range(-0.4, 0.4);
                let half = random.range(0.02, 0.2);
                let optical_depth = random.range(0.0, 0.04) as f32;
                segments.push(TranslucentSegment {
                    entry: (middle - half) as f32,
                    exit: (middle + half) as f32,
                    optical_depth,
                });
            }
        }
    }
    if kind != "smoke" {
        let centre = range * random.range(0.3, 0.6);
        for _ in 0..60 {
            segments.push(TranslucentSegment::hair((centre + random.range(-0.5, 0.5)) as f32, 0.04));
        }
    }
    segments
}

/// RMS of the transmittance's error over 64 texels × 256 depths of the range.
fn rms<C: TransmittanceCurve>(kind: &str, range: f64, sorted: bool, make: impl Fn(DepthRange) -> C) -> f64 {
    let mut sum = 0.0;
    for seed in 0..64 {
        let mut segments = texel(kind, seed, range);
        if sorted {
            segments.sort_by(|a, b| a.entry.total_cmp(&b.entry));
        }
        let exact = exact(&segments);
        // Slices and series divide the depths of the whole map, as their papers do.
        let mut curve = make(DepthRange { near: 0.0, far: range as f32 });
        segments.iter().for_each(|segment| curve.insert(segment));
        curve.finish();
        for n in 0..256 {
            let depth = range * (f64::from(n) + 0.5) / 256.0;
            sum += (curve.transmittance(depth) - exact.transmittance(depth)).powi(2);
        }
    }
    (sum / (64.0 * 256.0)).sqrt()
}

struct By<const N: usize>(AvsmCurve<N>, Removal);

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

fn avsm<const N: usize>(removal: Removal) -> impl Fn(DepthRange) -> By<N> {
    move |_| By(AvsmCurve::default(), removal)
}

/// The table of the README: quality over the number of nodes, by both rules, sorted and shuffled, and the other techniques.
#[test]
fn twelve_nodes_are_close_and_eight_beat_slices_and_series() {
    use avsm::{FourierCurve, MomentCurve, OpacityCurve};
    println!(
        "RMS [%]        | avsm 4 / 8 / 12 / 16, shuffled | sorted | triangle rule | opacity 32, Fourier 16, moments 4 / 6 / 8"
    );
    for kind in ["smoke", "hair", "smoke-and-hair"] {
        for range in [4.0, 16.0, 64.0] {
            let avsm_rms = |removal: Removal, sorted: bool| {
                [
                    rms(kind, range, sorted, avsm::<4>(removal)),
                    rms(kind, range, sorted, avsm::<8>(removal)),
                    rms(kind, range, sorted, avsm::<12>(removal)),
                    rms(kind, range, sorted, avsm::<16>(removal)),
                ]
            };
            let ours = avsm_rms(Removal::Exponential, false);
            let sorted = avsm_rms(Removal::Exponential, true);
            let triangles = avsm_rms(Removal::Triangle, false);
            let others = [
                rms(kind, range, false, OpacityCurve::<32>::new),
                rms(kind, range, false, FourierCurve::<16>::new),
                rms(kind, range, false, MomentCurve::<5>::new),
                rms(kind, range, false, MomentCurve::<7>::new),
                rms(kind, range, false, MomentCurve::<9>::new),
            ];
            let percent = |values: &[f64]| {
                values.iter().map(|v| format!("{:.2}", 100.0 * v)).collect::<Vec<_>>().join(" / ")
            };
            println!(
                "{kind:14} {range:2} | {} | {} | {} | {}",
                percent(&ours),
                percent(&sorted),
                percent(&triangles),
                percent(&others)
            );
            assert!(ours[2] <= 0.015, "{kind} {range}: 12 nodes, {}", ours[2]);
            // Over a range as short as the smoke is deep, slices are as fine as what is in it; they do not follow where it grows.
            if range > 16.0 || (kind == "hair" && range > 4.0) {
                assert!(ours[1] < others[0] && ours[1] < others[1], "{kind} {range}: {ours:?} {others:?}");
            }
        }
    }
}
