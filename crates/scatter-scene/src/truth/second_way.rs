//! The second, independent way to ray-cast truth, for tests: dense samples of visibility along the ray by brute-force
//! Möller-Trumbore over all triangles, bisection of every change, and integrals of its own. No code is shared with
//! the first way: neither tree, nor planes, nor the core's closed forms.

use glam::DVec3;

use crate::scene::Scene;

/// A light by its numbers.
#[derive(Debug, Clone, Copy)]
pub enum PlainLight {
    Sun { travel: DVec3 },
    Lamp { position: DVec3 },
    Spot { position: DVec3, axis: DVec3, inner_degrees: f64, outer_degrees: f64 },
}

/// A grey medium with one Henyey-Greenstein component.
#[derive(Debug, Clone, Copy)]
pub struct PlainMedium {
    pub sigma_s: f64,
    pub sigma_a: f64,
    pub g: f64,
}

/// One ray and what it sees. `eye` is in world space, `start` relative to it.
pub struct SecondWay<'a> {
    pub scene: &'a Scene,
    pub light: PlainLight,
    pub medium: PlainMedium,
    pub eye: DVec3,
    pub start: DVec3,
    pub along: DVec3,
}

impl SecondWay<'_> {
    /// Distance to the first triangle, at most `limit`.
    pub fn ray_end(&self, limit: f64) -> f64 {
        self.nearest(self.start, self.along).min(limit)
    }

    /// Lit stretches of `[0, end]`: visibility at `samples` equidistant points and at `hints`, and 100 bisections of
    /// each change. A hint only adds a sample: what is lit there is found here.
    pub fn lit(&self, end: f64, samples: usize, hints: &[f64]) -> Vec<(f64, f64)> {
        let mut at: Vec<f64> = (0..samples).map(|i| end * ((i as f64 + 0.5) / samples as f64)).collect();
        at.extend_from_slice(hints);
        at.sort_by(f64::total_cmp);
        let (mut stretches, mut begin) = (Vec::new(), self.is_lit(at[0]).then_some(0.0));
        for pair in at.windows(2) {
            let (mut a, mut b) = (pair[0], pair[1]);
            let before = begin.is_some();
            if self.is_lit(b) == before {
                continue;
            }
            for _ in 0..100 {
                let middle = 0.5 * (a + b);
                if self.is_lit(middle) == before { a = middle } else { b = middle }
            }
            match begin.take() {
                Some(start) => stretches.push((start, b)),
                None => begin = Some(b),
            }
        }
        stretches.extend(begin.map(|start| (start, end)));
        stretches
    }

    /// In-scattered radiance of a lit stretch for a light of strength 1.
    pub fn radiance(&self, a: f64, b: f64) -> f64 {
        let PlainMedium { sigma_s, sigma_a, g } = self.medium;
        let sigma_t = sigma_s + sigma_a;
        let phase =
            |cos: f64| (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cos).powf(1.5) / (4.0 * std::f64::consts::PI);
        match self.light {
            PlainLight::Sun { travel } => {
                let source = sigma_s * phase(-travel.dot(self.along));
                source * (-sigma_t * a).exp() * -(-sigma_t * (b - a)).exp_m1() / sigma_t
            }
            PlainLight::Lamp { position } | PlainLight::Spot { position, .. } => {
                let lamp = (position - self.eye) - self.start;
                let closest = lamp.dot(self.along);
                let eye_distance = (position - self.eye).length();
                let height = (lamp - closest * self.along).length().max(1e-6 * eye_distance);
                // t = t₀ + h·sinh w, d = h·cosh w, dt/d² = dw/(h·cosh w).
                let integrand = |w: f64| {
                    let (t, d) = (closest + height * w.sinh(), height * w.cosh());
                    let cone = self.cone(t);
                    sigma_s * phase(-w.tanh()) * cone * (-sigma_t * (t + d)).exp() / d
                };
                let w = |t: f64| ((t - closest) / height).asinh();
                // Pieces first, so that no narrow lobe lies between all points of the first rule; and cuts at the
                // cone's kinks, one of which can hide between an interval's end and the outermost point.
                let (low, high) = (w(a), w(b));
                let mut cuts: Vec<f64> =
                    (0..=64).map(|i| low + (high - low) * (f64::from(i) / 64.0)).collect();
                cuts.extend(self.kinks(low, high, |w| closest + height * w.sinh()));
                cuts.sort_by(f64::total_cmp);
                let sum = |f: &dyn Fn(f64, f64) -> f64| cuts.windows(2).map(|pair| f(pair[0], pair[1])).sum();
                let total: f64 = sum(&|a, b| kronrod(&integrand, a, b).0);
                sum(&|a, b| adaptive(&integrand, a, b, 1e-13 * total, 40))
            }
        }
    }

    /// The cone factor without its square, not clamped.
    fn cone_ramp(&self, t: f64) -> Option<f64> {
        let PlainLight::Spot { position, axis, inner_degrees, outer_degrees } = self.light else {
            return None;
        };
        let from_lamp = self.start + t * self.along - (position - self.eye);
        let cos = from_lamp.normalize().dot(axis);
        let (inner, outer) = (inner_degrees.to_radians().cos(), outer_degrees.to_radians().cos());
        Some((cos - outer) / (inner - outer).max(0.001))
    }

    pub fn cone(&self, t: f64) -> f64 {
        self.cone_ramp(t).map_or(1.0, |ramp| ramp.clamp(0.0, 1.0).powi(2))
    }

    /// Where the cone's ramp passes 0 or 1 between `low` and `high`, by samples and bisection.
    fn kinks(&self, low: f64, high: f64, t: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut kinks = Vec::new();
        for level in [0.0, 1.0] {
            let above = |w: f64| self.cone_ramp(t(w)).is_some_and(|ramp| ramp > level);
            let at = |i: u32| low + (high - low) * (f64::from(i) / 2048.0);
            for i in 0..2048 {
                let (mut a, mut b) = (at(i), at(i + 1));
                let before = above(a);
                if above(b) == before {
                    continue;
                }
                for _ in 0..60 {
                    let middle = 0.5 * (a + b);
                    if above(middle) == before { a = middle } else { b = middle }
                }
                kinks.push(b);
            }
        }
        kinks
    }

    pub fn is_lit(&self, t: f64) -> bool {
        let x = self.start + t * self.along;
        match self.light {
            PlainLight::Sun { travel } => self.nearest(x, -travel) == f64::INFINITY,
            PlainLight::Lamp { position } | PlainLight::Spot { position, .. } => {
                // A step of 1 reaches the lamp.
                self.nearest(x, (position - self.eye) - x) > 1.0
            }
        }
    }

    /// Smallest parameter > 0 at which `origin + s·step` (relative to the eye) meets a triangle.
    fn nearest(&self, origin: DVec3, step: DVec3) -> f64 {
        let mut nearest = f64::INFINITY;
        for (number, triangle) in (0..).zip(&self.scene.triangles) {
            let [a, b, c] = triangle.map(|i| self.scene.positions[i as usize] - self.eye);
            let (e1, e2) = (b - a, c - a);
            let p = step.cross(e2);
            let determinant = e1.dot(p);
            if determinant == 0.0 {
                continue;
            }
            let s = origin - a;
            let u = s.dot(p) / determinant;
            let q = s.cross(e1);
            let v = step.dot(q) / determinant;
            let t = e2.dot(q) / determinant;
            if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && self.is_there(number, u, v) {
                nearest = nearest.min(t);
            }
        }
        nearest
    }

    /// Whether a triangle has a texel at barycentric coordinates `u` and `v`, or no mask.
    fn is_there(&self, triangle: u32, u: f64, v: f64) -> bool {
        self.scene.cutouts.iter().find(|cutout| cutout.triangle == triangle).is_none_or(|cutout| {
            let [a, b, c] = cutout.uv;
            self.scene.masks[cutout.mask as usize].is_there(a * (1.0 - u - v) + b * u + c * v)
        })
    }
}

/// Gauss-Kronrod (7, 15) on one interval: value and error estimate (QUADPACK's qk15).
fn kronrod(f: &impl Fn(f64) -> f64, a: f64, b: f64) -> (f64, f64) {
    const X: [f64; 8] = [
        0.991_455_371_120_812_6,
        0.949_107_912_342_758_5,
        0.864_864_423_359_769_1,
        0.741_531_185_599_394_4,
        0.586_087_235_467_691_1,
        0.405_845_151_377_397_2,
        0.207_784_955_007_898_47,
        0.0,
    ];
    const K: [f64; 8] = [
        0.022_935_322_010_529_224,
        0.063_092_092_629_978_55,
        0.104_790_010_322_250_18,
        0.140_653_259_715_525_92,
        0.169_004_726_639_267_9,
        0.190_350_578_064_785_4,
        0.204_432_940_075_298_9,
        0.209_482_141_084_727_82,
    ];
    const G: [f64; 4] =
        [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let (mut wide, mut narrow) = (0.0, 0.0);
    for (i, &x) in X.iter().enumerate() {
        let sum = if x == 0.0 { f(middle) } else { f(middle - half * x) + f(middle + half * x) };
        wide += K[i] * sum;
        if i % 2 == 1 {
            narrow += G[i / 2] * sum;
        }
    }
    (wide * half, ((wide - narrow) * half).abs())
}

fn adaptive(f: &impl Fn(f64) -> f64, a: f64, b: f64, tolerance: f64, depth: u32) -> f64 {
    let (value, error) = kronrod(f, a, b);
    // Integrands are ≥ 0, so that errors of a part are errors of the whole; exponents of some hundreds round by 1e-13.
    if error <= tolerance.max(1e-12 * value) || depth == 0 {
        return value;
    }
    let middle = 0.5 * (a + b);
    adaptive(f, a, middle, 0.5 * tolerance, depth - 1) + adaptive(f, middle, b, 0.5 * tolerance, depth - 1)
}
