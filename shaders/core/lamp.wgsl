// One lit interval near a lamp: the airlight integral of `lamp_interval_f32.rs` in r = p/h = ((t - t0) + d)/h, by
// Gauss-Legendre panels of 4, 8 or 12 points: the scalar twin of `LampIntegralF32` (scatter-core), with its errors.

// A view ray near a lamp: the foot of the perpendicular, its distance h (clamped as the model says), the cone along it.
struct LampAlong {
    closest: f32,
    h: f32,
    // Cosines between the spot's axis and the ray, and the way from the lamp to the foot.
    along: f32,
    across: f32,
}

fn lamp_along(ray: Ray) -> LampAlong {
    let to_lamp = frame.light.xyz - ray.origin;
    var lamp: LampAlong;
    lamp.closest = dot(to_lamp, ray.direction);
    // direction * closest - to_lamp, without its cancellation.
    let foot = cross(ray.moment, ray.direction);
    // Where a ray passes closer it is taken at that distance, in the lamp's own direction.
    let distance = length(ray.moment);
    lamp.h = max(max(distance, frame.light.w), 1e-6 * length(to_lamp));
    lamp.along = dot(frame.cone.xyz, ray.direction);
    lamp.across = dot(frame.cone.xyz, foot) / lamp.h;
    return lamp;
}

// The way t + d over h from the foot, without cancellation before it.
fn lamp_path(lamp: LampAlong, t: f32) -> f32 {
    let y = (t - lamp.closest) / lamp.h;
    let d = sqrt(1.0 + y * y);
    return select(y + d, 1.0 / (d - y), y < 0.0);
}

fn cone_factor(lamp: LampAlong, sin_phi: f32, cos_phi: f32) -> f32 {
    let cosine = lamp.along * sin_phi + lamp.across * cos_phi;
    let share = clamp((cosine - frame.cone.w) * frame.cone_more.x, 0.0, 1.0);
    return share * share;
}

// Points and weights on [0, 1]: rules of 4, 8 and 12.
const LAMP_NODES = array<vec2<f32>, 24>(
    vec2<f32>(0.06943184, 0.17392743), vec2<f32>(0.3300095, 0.32607257),
    vec2<f32>(0.66999054, 0.32607257), vec2<f32>(0.93056816, 0.17392743),
    vec2<f32>(0.01985507, 0.050614268), vec2<f32>(0.10166676, 0.11119052),
    vec2<f32>(0.23723379, 0.15685332), vec2<f32>(0.40828267, 0.18134189),
    vec2<f32>(0.5917173, 0.18134189), vec2<f32>(0.7627662, 0.15685332),
    vec2<f32>(0.8983333, 0.11119052), vec2<f32>(0.9801449, 0.050614268),
    vec2<f32>(0.009219683, 0.023587668), vec2<f32>(0.04794137, 0.05346966),
    vec2<f32>(0.11504866, 0.080039166), vec2<f32>(0.20634103, 0.10158371),
    vec2<f32>(0.31608424, 0.11674627), vec2<f32>(0.4373833, 0.12457352),
    vec2<f32>(0.5626167, 0.12457352), vec2<f32>(0.68391573, 0.11674627),
    vec2<f32>(0.793659, 0.10158371), vec2<f32>(0.88495135, 0.080039166),
    vec2<f32>(0.9520586, 0.05346966), vec2<f32>(0.9907803, 0.023587668),
);

// Farthest point of a ray in units of its distance to the lamp: squares of squares stay below FARTHEST^2.
const FARTHEST_POINT: f32 = 1e9;

// Most panels of an interval: endless ones need 14 from the closest start, and each channel's extinction 3 more.
const MOST_LAMP_PANELS: u32 = 40u;

// Where the rest is dropped: e^-16 = 1.1e-7.
const NEGLIGIBLE_LAMP_DEPTH: f32 = 16.0;

// Between which points y = (t - t0) / h a ray is inside of a cone of at most 90 degrees: one stretch, for such a cone is
// convex; an empty one lies at FARTHEST_POINT. Roots of (along y + across)^2 = cos^2 (1 + y^2), which the mirrored cone has
// too: signs of whole terms tell the two apart.
fn inside_cone(lamp: LampAlong, cosine: f32) -> vec2<f32> {
    let square = cosine * cosine;
    let quadratic = lamp.along * lamp.along - square;
    let half_linear = lamp.along * lamp.across;
    let discriminant = square * (lamp.along * lamp.along + lamp.across * lamp.across - square);
    let root = sqrt(max(discriminant, 0.0));
    let q = -(half_linear + select(root, -root, half_linear < 0.0));
    let is_steep = quadratic < 0.0;
    if discriminant < 0.0 || (is_steep && lamp.across <= 0.0) || q == 0.0 {
        return vec2<f32>(FARTHEST_POINT);
    }
    // The root that adds, and the other one by Vieta: no cancellation.
    let is_flat = abs(q) >= FARTHEST_POINT * abs(quadratic);
    let one = select(q / select(quadratic, 1.0, is_flat), select(FARTHEST_POINT, -FARTHEST_POINT, q < 0.0), is_flat);
    let other = clamp((lamp.across * lamp.across - square) / q, -FARTHEST_POINT, FARTHEST_POINT);
    let low = min(one, other);
    let high = max(one, other);
    if is_steep {
        return vec2<f32>(low, high);
    }
    // A flatter ray is inside to one side for ever.
    return select(vec2<f32>(-FARTHEST_POINT, low), vec2<f32>(high, FARTHEST_POINT), lamp.along > 0.0);
}

// Integral over [a, b] of sum sigma_s p C exp(-sigma (t + d)) / d^2, RGB: times the intensity it is radiance. A spot's
// interval is cut where the cone starts, is full, is full no longer, and ends.
fn lamp_interval(lamp: LampAlong, a: f32, b: f32) -> vec3<f32> {
    let y_from = clamp((a - lamp.closest) / lamp.h, -FARTHEST_POINT, FARTHEST_POINT);
    let y_to = clamp((b - lamp.closest) / lamp.h, -FARTHEST_POINT, FARTHEST_POINT);
    var sum = vec3<f32>(0.0);
    var ends = vec4<f32>(y_from, y_from, y_to, y_to);
    let is_spot = frame.kinds.z == LIGHT_SPOT;
    if is_spot {
        let outer = inside_cone(lamp, frame.cone.w);
        let inner = inside_cone(lamp, frame.cone_more.y);
        let last = max(y_from, y_to);
        ends.x = clamp(outer.x, y_from, last);
        ends.w = clamp(outer.y, ends.x, last);
        ends.y = clamp(inner.x, ends.x, ends.w);
        ends.z = clamp(inner.y, ends.y, ends.w);
    }
    // One call for all pieces: drivers inline.
    for (var piece = 0u; piece < 3u; piece++) {
        let is_middle = piece == 1u;
        let begin = select(select(ends.z, ends.y, is_middle), ends.x, piece == 0u);
        let end = select(select(ends.w, ends.z, is_middle), ends.y, piece == 0u);
        sum += lamp_piece(lamp, begin, end, is_spot && !is_middle);
    }
    return min(sum / lamp.h, vec3<f32>(FARTHEST));
}

// r of a point y, without cancellation before the foot.
fn reduced_path(y: f32, distance: f32) -> f32 {
    let sum = abs(y) + distance;
    return select(sum, 1.0 / sum, y < 0.0);
}

// Between two points without a kink of the cone between them, times h.
fn lamp_piece(lamp: LampAlong, y_from: f32, y_to: f32, fades: bool) -> vec3<f32> {
    let width = y_to - y_from;
    if !(width > 0.0) {
        return vec3<f32>(0.0);
    }
    let sigma = frame.sigma_t.xyz;
    let near = sqrt(y_from * y_from + 1.0);
    let far = sqrt(y_to * y_to + 1.0);
    let start = reduced_path(y_from, near);
    // tanh of half the interval in ln r is its length over the sum of the distances: short ones do not cancel.
    let both = near + far;
    let short = 2.0 * start * width / max(both - width, 0.25 * both);
    var reach = select(reduced_path(y_to, far) - start, short, width < 0.5 * both);
    let kappa = min(sigma * lamp.h, vec3<f32>(FARTHEST));
    let weakest = min(kappa.x, min(kappa.y, kappa.z));
    let strongest = max(kappa.x, max(kappa.y, kappa.z));
    reach = min(reach, min((start + 1.0) * 1e9, NEGLIGIBLE_LAMP_DEPTH / max(weakest, 1e-18)));
    // t + d at the start, two terms >= 0 together: the extinction up to there.
    let before = max(lamp.closest + y_from * lamp.h + near * lamp.h, 0.0);

    var sum = vec3<f32>(0.0);
    var done = 0.0;
    for (var panel = 0u; panel < MOST_LAMP_PANELS && done < reach; panel++) {
        let begin = start + done;
        let rest = reach - done;
        // The steepest channel that still counts decides how long a panel may be.
        let counted = select(vec3<f32>(0.0), kappa, kappa * done <= vec3<f32>(NEGLIGIBLE_LAMP_DEPTH));
        let steepest = max(max(counted.x, max(counted.y, counted.z)), 1e-18);
        var first = 4u;
        var count = 8u;
        var step = min(rest, min(begin * 12.46, 8.0 / steepest));
        if fades {
            first = 12u;
            count = 12u;
            step = min(rest, min(begin * 23.5, 8.0 / steepest));
        } else if rest <= begin * 1.117 && strongest * rest <= 2.0 {
            first = 0u;
            count = 4u;
        }
        // r = N / M, both linear in x, r(1/2) the geometric mean of the ends: ln r to second order.
        let tilt = sqrt(begin / (begin + step));
        let rise = step * tilt;
        let slope = tilt - 1.0;
        let n_slope = begin * slope + rise;
        for (var index = first; index < first + count; index++) {
            let x = LAMP_NODES[index].x;
            let m = slope * x + 1.0;
            let n = n_slope * x + begin;
            let inverse = 1.0 / (m * m + n * n);
            var weight = 2.0 * rise * LAMP_NODES[index].y * inverse;
            if fades {
                weight *= cone_factor(lamp, (n * n - m * m) * inverse, 2.0 * m * n * inverse);
            }
            let light = scattering(n * n * inverse, m * m * inverse);
            sum += weight * light * exp_negative3(-kappa * (done + rise * x / m));
        }
        done = select(done + step, reach, step >= rest);
    }
    return sum * exp_negative3(-sigma * before);
}
