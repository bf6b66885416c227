// One lit interval near a lamp: the airlight integral of `lamp_interval_f32.rs` in r = p/h = ((t - t0) + d)/h, by
// Gauss-Legendre panels of eight points.

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
    let foot = ray.direction * lamp.closest - to_lamp;
    // Where a ray passes closer it is taken at that distance, in the lamp's own direction.
    let distance = length(foot);
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

const LAMP_NODES = array<vec2<f32>, 8>(
    vec2<f32>(0.01985507, 0.050614268), vec2<f32>(0.101666763, 0.111190517),
    vec2<f32>(0.237233795, 0.156853323), vec2<f32>(0.408282679, 0.181341892),
    vec2<f32>(0.591717321, 0.181341892), vec2<f32>(0.762766205, 0.156853323),
    vec2<f32>(0.898333239, 0.111190517), vec2<f32>(0.980144928, 0.050614268),
);

// Most panels of an interval.
const MOST_LAMP_PANELS: u32 = 64u;

// Integral over [a, b] of sum sigma_s p C exp(-sigma (t + d)) / d^2, RGB: times the intensity it is radiance.
fn lamp_interval(lamp: LampAlong, a: f32, b: f32) -> vec3<f32> {
    let sigma = frame.sigma_t.xyz;
    let start = lamp_path(lamp, a);
    // Short intervals do not cancel: tanh of half the growth in ln r is the length over the sum of the distances.
    let near = length(vec2<f32>(lamp.h, a - lamp.closest));
    let far = length(vec2<f32>(lamp.h, b - lamp.closest));
    let width = max(b - a, 0.0);
    let short = start * 2.0 * width / max(near + far - width, 1e-30);
    var reach = select(lamp_path(lamp, b) - start, short, width < 0.5 * (near + far));
    // What lies behind an optical depth of 17, or behind 1e9 times the start, is dropped.
    let kappa = min(sigma * lamp.h, vec3<f32>(1e18));
    let weakest = min(kappa.x, min(kappa.y, kappa.z));
    reach = min(reach, min(1e9 * (1.0 + start), 17.0 / max(weakest, 1e-18)));
    let strongest = max(kappa.x, max(kappa.y, kappa.z));
    let fades = frame.kinds.z == LIGHT_SPOT;
    let growth = select(0.8, 0.25, fades);
    var sum = vec3<f32>(0.0);
    var done = 0.0;
    for (var panel = 0u; panel < MOST_LAMP_PANELS && done < reach; panel++) {
        var step = reach - done;
        if panel + 1u < MOST_LAMP_PANELS {
            step = min(step, min((start + done) * growth, 4.0 / max(strongest, 1e-18)));
        }
        for (var node = 0u; node < 8u; node++) {
            let begin = done + step * LAMP_NODES[node].x;
            let r = start + begin;
            let inverse = 1.0 / (1.0 + r * r);
            let sin_sq = r * r * inverse;
            var value = 2.0 * inverse * step * LAMP_NODES[node].y;
            if fades {
                value *= cone_factor(lamp, (r * r - 1.0) * inverse, 2.0 * r * inverse);
            }
            sum += value * scattering(sin_sq, inverse) * exp_negative3(-kappa * begin);
        }
        done += step;
    }
    // t + d at the start: the extinction up to there.
    let before = a + near;
    return sum * exp_negative3(-sigma * before) / lamp.h;
}
