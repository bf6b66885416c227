//! What the shaders' functions are called with, what they must give in f64, and how far off f32 may be. An ulp is 2⁻²³ of a
//! number; WGSL promises additions and products to half an ulp, quotients to 2.5, roots to 4.5, `log` to 3 (2⁻²¹ absolutely
//! in [0.5, 2]) and `exp(x)` to 3 + 2·|x|.

use std::f64::consts::PI;

use scatter_core::{
    Camera, ClipSpace, DepthEncoding, Light, MapKind, MapLayout, Medium, Phase, Setup, ShadowDepthEncoding,
};
use scatter_kernels::{FARTHEST, FrameUniform, GpuFrame, ShadowDepth};

const ULP: f64 = 1.0 / (1 << 23) as f64;
/// What f32 may flush to 0.
const DENORMAL: f64 = 1.2e-38;
const INV_4PI: f64 = 0.25 / PI;
const SIZE: [u32; 2] = [37, 21];
/// σt of the coloured medium, numbers of f32.
const SIGMA: [f64; 3] = [0.125, 0.5, 2.0];

/// A number that a function must give.
#[derive(Debug, Clone, Copy)]
pub(super) struct Value {
    pub is: f64,
    /// Largest error, > 0.
    pub allowed: f64,
}

type Expected = Box<dyn Fn([f32; 4]) -> Vec<Value>>;

/// A function with its inputs.
pub(super) struct Case {
    pub name: &'static str,
    /// In `calls.wgsl`.
    pub number: u32,
    pub uniform: FrameUniform,
    pub inputs: Vec<[f32; 4]>,
    pub expected: Expected,
}

/// All of them.
pub(super) fn all() -> Vec<Case> {
    let mut cases = vec![
        case("finite_texel", 0, texels(), |[x, ..]| exact(&[finite_texel(x)])),
        case("phi", 1, positive(1e-12, 1e9), |[x, ..]| near(phi(x.into()), phi_ulps(x.into()))),
        case("exp_negative", 2, negative(1e-9, 200.0), |[x, ..]| {
            let x = f64::from(x);
            let below = if x < -87.0 { 1.7e-38 } else { DENORMAL };
            vec![Value { is: x.exp(), allowed: x.exp() * (4.0 + 2.0 * x.abs()) * ULP + below }]
        }),
        case("phase_at", 3, phases(), |input| near(phase(input), 20.0)),
        case("sin_cos", 4, positive(1e-9, 0.5 * PI), |[x, ..]| {
            let x = f64::from(x);
            [x.sin(), x.cos()].map(|is| Value { is, allowed: 2.5e-7 }).to_vec()
        }),
        // A quotient of at most tan(π/8) and three roundings of angles up to π.
        case("upper_angle", 5, circle(), |[x, y, ..]| {
            vec![Value { is: f64::from(y).atan2(x.into()), allowed: 6e-7 }]
        }),
        case("sun_interval", 8, stretches(), |[a, b, ..]| sun_interval(a.into(), b.into())),
        case("fog_column", 9, columns(), |input| fog_column(input.map(f64::from))),
        case("mixed", 11, seeds(), |[a, b, ..]| {
            let hash = mixed(a as u32, b as u32);
            exact(&[(hash >> 16).into(), (hash & 0xffff).into()])
        }),
    ];
    let camera = camera();
    let rays = |x: f32, y: f32| camera_ray(x, y);
    cases.push(case("pixel_ray", 7, pixels(), move |[x, y, ..]| {
        // A sum of three products whose parts are up to three times as long as it, a root, a quotient.
        rays(x, y).0.iter().map(|&is| Value { is, allowed: 14.0 * ULP }).collect()
    }));
    cases.extend(depth_cases(&camera));
    cases.push(map_case());
    cases
}

fn case(
    name: &'static str,
    number: u32,
    inputs: Vec<[f32; 4]>,
    expected: impl Fn([f32; 4]) -> Vec<Value> + 'static,
) -> Case {
    let uniform = uniform(&camera(), DepthEncoding::AlongRay);
    Case { name, number, uniform, inputs, expected: Box::new(expected) }
}

/// Each engine's convention: z of f32 read back as a distance along the ray.
fn depth_cases(_camera: &Camera) -> Vec<Case> {
    let (n, f) = (0.25, 64.0);
    // a, b, c, d of (a + b z) / (c + d z), from the projections' definitions.
    let conventions = [
        ("distance_of_texel, forward", DepthEncoding::Forward { near: n, far: f }, [n * f, 0.0, f, n - f]),
        ("distance_of_texel, reversed", DepthEncoding::Reversed { near: n, far: f }, [n * f, 0.0, n, f - n]),
        (
            "distance_of_texel, forward infinite",
            DepthEncoding::ForwardInfinite { near: n },
            [n, 0.0, 1.0, -1.0],
        ),
        (
            "distance_of_texel, reversed infinite",
            DepthEncoding::ReversedInfinite { near: n },
            [n, 0.0, 0.0, 1.0],
        ),
    ];
    let cases = conventions.into_iter().map(|(name, encoding, [a, b, c, d])| {
        let depths: Vec<f64> = log_spaced(0.26, 63.0, 500);
        let inputs = pixels().into_iter().zip(depths.iter().cycle());
        // v = (a + b z) / (c + d z) solved for z.
        let inputs = inputs.map(|([x, y, ..], v)| [x, y, ((a - c * v) / (d * v - b)) as f32, 0.0]).collect();
        let expected = move |[x, y, z, _]: [f32; 4]| {
            let z = f64::from(z);
            let (numerator, denominator) = (a + b * z, c + d * z);
            let distance = numerator / denominator * camera_ray(x, y).1;
            // The denominator cancels where its parts are larger than it.
            let condition = (c.abs() + (d * z).abs()) / denominator.abs();
            vec![Value { is: distance, allowed: distance * (3.0 * condition + 12.0) * ULP }]
        };
        Case { uniform: uniform(&camera(), encoding), ..case(name, 6, inputs, expected) }
    });
    cases.collect()
}

/// A sun's map of reversed z over 20 world units: z is 1 at its near plane.
fn map_case() -> Case {
    let clip = [[0.2, 0.0, 0.0, 0.0], [0.0, 0.0, 0.05, 0.0], [0.0, 0.2, 0.0, 0.0], [0.0, 0.0, 0.6, 1.0]];
    let encoding = ShadowDepthEncoding::Clip(ClipSpace::WGPU.reversed());
    let (projection, meaning) = ShadowDepth::of_clip(encoding, clip, [16, 12], 0).expect("a sane matrix");
    let layout = MapLayout::new(MapKind::Orthographic, &[projection]).expect("one map");
    let inputs = log_spaced(1e-6, 1.0, 2000).into_iter().map(|z| [z as f32, 3.5, 7.5, 0.0]).collect();
    let expected =
        |[z, ..]: [f32; 4]| vec![Value { is: 20.0 * (1.0 - f64::from(z)), allowed: 20.0 * 6.0 * ULP }];
    Case {
        uniform: uniform_of(&camera(), DepthEncoding::AlongRay, layout, &[meaning]),
        ..case("linear_of_texel", 10, inputs, expected)
    }
}

fn camera() -> Camera {
    Camera::perspective([1.0, 2.0, 6.0], [0.0; 3], [0.0, 1.0, 0.0], 70.0, SIZE).expect("a sane camera")
}

/// A pixel's unit direction, and its length over its depth.
fn camera_ray(x: f32, y: f32) -> ([f64; 3], f64) {
    let camera = camera();
    let direction = camera.pixel_ray(x as u32, y as u32).direction;
    (direction.to_array(), 1.0 / direction.dot(camera.forward()))
}

fn uniform(camera: &Camera, depth: DepthEncoding) -> FrameUniform {
    uniform_of(camera, depth, MapLayout::UNSHADOWED, &[])
}

fn uniform_of(
    camera: &Camera,
    depth: DepthEncoding,
    maps: MapLayout,
    shadow: &[ShadowDepth],
) -> FrameUniform {
    let light = Light::directional([0.0, -1.0, 0.0], [1.0; 3]).expect("a sane sun");
    let medium = Medium::homogeneous(SIGMA, [0.0; 3], Phase::Isotropic).expect("a sane medium");
    let setup = Setup::new(camera, &light, maps, &medium, 1000.0).expect("a sane set-up");
    FrameUniform::new(&GpuFrame { setup, depth, shadow, exposure: 1.0 }, [0, 0]).expect("a sane frame")
}

fn near(is: f64, ulps: f64) -> Vec<Value> {
    vec![Value { is, allowed: is.abs() * ulps * ULP + DENORMAL }]
}

/// Numbers that are equal or wrong.
fn exact(values: &[f64]) -> Vec<Value> {
    values.iter().map(|&is| Value { is, allowed: DENORMAL }).collect()
}

fn log_spaced(from: f64, to: f64, count: usize) -> Vec<f64> {
    let last = (count - 1) as f64;
    (0..count).map(|index| from * (to / from).powf(index as f64 / last)).collect()
}

fn positive(from: f64, to: f64) -> Vec<[f32; 4]> {
    let edges = [0.0, 0.4999999, 0.5, 0.50000006, 1.0].into_iter().filter(|&x| x <= to);
    edges.chain(log_spaced(from, to, 4000)).map(|x| [x as f32, 0.0, 0.0, 0.0]).collect()
}

fn negative(from: f64, to: f64) -> Vec<[f32; 4]> {
    positive(from, to)
        .into_iter()
        .map(|[x, ..]| [-x, 0.0, 0.0, 0.0])
        .chain([[-87.0, 0.0, 0.0, 0.0]])
        .collect()
}

fn pixels() -> Vec<[f32; 4]> {
    let [width, height] = SIZE;
    (0..width * height).map(|n| [(n % width) as f32, (n / width) as f32, 0.0, 0.0]).collect()
}

fn texels() -> Vec<[f32; 4]> {
    let special = [
        f32::NAN,
        -f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        0.0,
        -0.0,
        -1.0,
        FARTHEST,
        2.0 * FARTHEST,
        f32::MAX,
    ];
    let bits = (0..4096u32).map(|n| f32::from_bits(n.wrapping_mul(0x9E37_79B9)));
    special.into_iter().chain(bits).map(|x| [x, 0.0, 0.0, 0.0]).collect()
}

fn finite_texel(x: f32) -> f64 {
    let none = x.is_nan() || x == f32::INFINITY;
    f64::from(if none { FARTHEST } else { x.clamp(0.0, FARTHEST) })
}

fn phi(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { -(-x).exp_m1() / x }
}

/// Below 1/2 a series, then `(1 − e⁻ˣ)/x`, whose difference magnifies the error of the exponential.
fn phi_ulps(x: f64) -> f64 {
    if x < 0.5 { 4.0 } else { (3.0 + 2.0 * x) * (-x).exp() / (1.0 - (-x).exp()) + 5.0 }
}

fn phases() -> Vec<[f32; 4]> {
    let mut inputs = Vec::new();
    for (kind, g) in [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 0.5), (2.0, -0.7), (2.0, 0.99), (2.0, -0.99)]
    {
        for index in 0..=500 {
            let angle = PI * f64::from(index) / 500.0;
            let (sine, cosine) = (0.5 * angle).sin_cos();
            inputs.push([kind, g, (sine * sine) as f32, (cosine * cosine) as f32]);
        }
    }
    inputs
}

/// By the two squares that the shader gets: an angle of its own would cancel.
fn phase([kind, g, sin_sq, cos_sq]: [f32; 4]) -> f64 {
    let [g, sin_sq, cos_sq] = [g, sin_sq, cos_sq].map(f64::from);
    let cosine = cos_sq - sin_sq;
    match kind {
        1.0 => 3.0 / (16.0 * PI) * (1.0 + cosine * cosine),
        // 1 + g² − 2g·cosθ, of cos θ = 1 − 2 sin²(θ/2) for the sharp lobe: forward glows at sin² = 0.
        2.0 => {
            let away = if g >= 0.0 { sin_sq } else { cos_sq };
            let squared = (1.0 - g.abs()).powi(2) + 4.0 * g.abs() * away;
            INV_4PI * (1.0 - g * g) / squared.powf(1.5)
        }
        _ => INV_4PI,
    }
}

fn circle() -> Vec<[f32; 4]> {
    let radii = [1e-12, 1.0, 1e12];
    let points = radii.into_iter().flat_map(|radius: f64| {
        (0..=2000).map(move |index| {
            let (y, x) = (PI * f64::from(index) / 2000.0).sin_cos();
            [(radius * x) as f32, (radius * y).max(0.0) as f32, 0.0, 0.0]
        })
    });
    points.chain([[1.0, 0.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]).collect()
}

fn stretches() -> Vec<[f32; 4]> {
    let starts = [0.0].into_iter().chain(log_spaced(1e-3, 40.0, 60));
    let pairs = starts.flat_map(|a| log_spaced(1e-4, 300.0, 60).into_iter().map(move |w| [a, a + w]));
    pairs.map(|[a, b]| [a as f32, b as f32, 0.0, 0.0]).collect()
}

/// `∫ e^{−σt} dt` over [a, b] a channel: an argument is rounded once, an exponential as WGSL says, φ as above; and their
/// product may be subnormal, which a driver may flush (cards do, where a driver on the CPU does not).
fn sun_interval(a: f64, b: f64) -> Vec<Value> {
    let of = |sigma: f64| {
        let (depth, x) = (sigma * a, sigma * (b - a));
        let is = (-depth).exp() * (b - a) * phi(x);
        Value { is, allowed: is * (3.0 * depth + phi_ulps(x) + 8.0) * ULP + 2e-38 * (b - a) + DENORMAL }
    };
    SIGMA.map(of).to_vec()
}

fn columns() -> Vec<[f32; 4]> {
    let mut inputs = Vec::new();
    for log_density in [-8.0, -0.5, 0.0, 3.0] {
        for slope in [-1.5, -0.1, -1e-6, 0.0, 1e-6, 0.02, 2.0] {
            for a in [0.0, 0.01, 1.0, 7.0] {
                inputs.extend(
                    log_spaced(1e-3, 12.0, 20).iter().map(|w| [log_density, slope, a, a + *w as f32]),
                );
            }
        }
    }
    inputs
}

/// `∫ e^{ln ρ − m·t} dt` over [a, b]: the exponent's parts are rounded, and its error is the integral's.
fn fog_column([log_density, slope, a, b]: [f64; 4]) -> Vec<Value> {
    let width = b - a;
    let is = if slope == 0.0 {
        log_density.exp() * width
    } else {
        (log_density - slope * a).exp() * -(-slope * width).exp_m1() / slope
    };
    let end = if slope > 0.0 { a } else { b };
    let dense = log_density.abs() + 2.0 * (slope * end).abs();
    let way = width * phi((slope * width).abs());
    let exponent = is.ln().abs();
    // The logarithm of a number in [0.5, 2] is off by 2⁻²¹, four ulps of 1.
    let ulps = dense + 3.0 * way.ln().abs() + 4.0 + phi_ulps((slope * width).abs()) + 3.0 * exponent + 6.0;
    vec![Value { is, allowed: is * ulps * ULP }]
}

fn seeds() -> Vec<[f32; 4]> {
    (0..4096u32).map(|n| [(n * 2999 % (1 << 23)) as f32, (n % 61) as f32, 0.0, 0.0]).collect()
}

/// The hash of 32 bits that the marcher's jitter starts from.
fn mixed(a: u32, b: u32) -> u32 {
    let mut x = a ^ b.wrapping_mul(0x9E37_79B9).rotate_left(15);
    x = (x ^ (x >> 16)).wrapping_mul(0x7FEB_352D);
    x = (x ^ (x >> 15)).wrapping_mul(0x846C_A68B);
    x ^ (x >> 16)
}
