// The marcher (raymarch-ref): a ray a thread, visibility by one look-up a step, each step's integral in closed form.

const NEGLIGIBLE_OPTICAL_DEPTH: f32 = 17.0;
const MOST_STEPS: u32 = 65536u;

fn mixed(a: u32, b: u32) -> u32 {
    let turned = b * 0x9E3779B9u;
    var x = a ^ ((turned << 15u) | (turned >> 17u));
    x = (x ^ (x >> 16u)) * 0x7FEB352Du;
    x = (x ^ (x >> 15u)) * 0x846CA68Bu;
    return x ^ (x >> 16u);
}

// Where in its step a sample lies, in [0, 1): the CPU marcher's bits.
fn sample_place(seed: u32, step: u32) -> f32 {
    if !has(frame.counts.w, MARCH_JITTER) {
        return 0.5;
    }
    var x = seed + step * 0x9E3779B9u;
    x = (x ^ (x >> 16u)) * 0x7FEB352Du;
    x = (x ^ (x >> 15u)) * 0x846CA68Bu;
    x = x ^ (x >> 16u);
    return f32(x >> 8u) * (1.0 / 16777216.0);
}

fn colour_at(glass: MarchRay, at: f32, w: f32) -> vec3<f32> {
    if !has(frame.kinds.w, FRAME_GLASS) {
        return vec3<f32>(1.0);
    }
    let p = glass.start * w + glass.step * at;
    return glass_at(p, select(w, p.z, has(frame.glass.place.w, LAYER_PERSPECTIVE)));
}

fn glass_ray(pixel: vec2<u32>, s: f32, unit: f32) -> MarchRay {
    let p = from_reference(pixel);
    let start = (frame.glass.start[0] + p.x * frame.glass.start[1] + p.y * frame.glass.start[2]).xyz;
    let step = (frame.glass.step[0] + p.x * frame.glass.step[1] + p.y * frame.glass.step[2]).xyz;
    return MarchRay(start + step * s, step * unit);
}

fn marches() -> bool {
    return frame.kinds.x > 0u || has(frame.kinds.w, FRAME_GLASS);
}

// The part of a ray in height fog that is worth marching (raymarch-ref's fog_window.rs).
fn fog_window(fog: FogAlong, end: f32) -> vec2<f32> {
    let sigma = frame.reference.w;
    let m = fog.slope;
    var reach = FARTHEST;
    if sigma > 0.0 {
        let log_share = log(NEGLIGIBLE_OPTICAL_DEPTH) - log(sigma) - fog.log_density;
        let log_ratio = log_share + log(max(abs(m), 1e-30));
        if log_ratio < -16.0 {
            reach = exp(min(log_share, 41.0));
        } else if m > 0.0 {
            let ratio = exp(min(log_ratio, 41.0));
            if ratio < 1.0 {
                reach = -log(1.0 - ratio) / m;
            }
        } else if log_ratio > 16.0 {
            reach = log_ratio / -m;
        } else {
            reach = log(1.0 + exp(log_ratio)) / -m;
        }
    }
    let last = min(end, min(reach, FARTHEST));
    let depth = min(21.0 / max(abs(m), 1e-30), FARTHEST);
    if m > 0.0 {
        return vec2<f32>(0.0, min(last, depth));
    }
    return vec2<f32>(max(last - depth, 0.0), last);
}

fn march_sun(pixel: vec2<u32>, ray: Ray, fog: FogAlong, end: f32, seed: u32) -> vec3<f32> {
    let sigma = frame.sigma_t.xyz;
    let steps = clamp(frame.counts.y, 1u, MOST_STEPS);
    let in_fog = has(frame.kinds.w, FRAME_FOG);
    var window = vec2<f32>(0.0, min(end, select(FARTHEST, NEGLIGIBLE_OPTICAL_DEPTH / max(frame.reference.w, 1e-18),
        frame.reference.w > 0.0)));
    if in_fog {
        window = fog_window(fog, end);
    }
    let width = (window.y - window.x) / f32(steps);
    let s = window.x / ray.stretch;
    let unit = width / ray.stretch;
    let first = march_ray(0u, pixel, s, unit);
    let glass = glass_ray(pixel, s, unit);
    var lit = vec3<f32>(0.0);
    var whole = vec3<f32>(0.0);
    if in_fog {
        // From the near end to the far one; densities as shares of the densest step's.
        let steep = abs(fog.slope) * width;
        let along = width * phi(min(steep, FARTHEST));
        let densest = fog.log_density - fog.slope * select(window.y, window.x, fog.slope > 0.0);
        // A weak medium may be dense here by many orders: only the product is bounded.
        let unit_depth = min(sigma * exp(min(densest + log(max(along, 1e-30)), 41.0)), vec3<f32>(1e6));
        var through = vec3<f32>(1.0);
        for (var i = 0u; i < steps; i++) {
            let from_densest = select(f32(steps - 1u - i), f32(i), fog.slope > 0.0);
            let density = exp_negative(-steep * from_densest);
            let depth = unit_depth * density;
            let weight = through * density * phi3(depth);
            let at = f32(i) + sample_place(seed, i);
            whole += weight;
            if is_lit(first, pixel, s, unit, at, 1.0) {
                lit += weight * colour_at(glass, at, 1.0);
            }
            through *= exp_negative3(-depth);
        }
    } else {
        // Weights r^i: Horner's scheme from the far end, in blocks that are scaled as one.
        let rate = exp_negative3(-sigma * width);
        let block_rate = exp_negative3(-sigma * width * 64.0);
        let blocks = (steps + 63u) / 64u;
        for (var b = 0u; b < blocks; b++) {
            let start = (blocks - 1u - b) * 64u;
            let stop = min(steps, start + 64u);
            var block = vec3<f32>(0.0);
            var block_whole = vec3<f32>(0.0);
            for (var j = 0u; j < stop - start; j++) {
                let step = stop - 1u - j;
                let at = f32(step) + sample_place(seed, step);
                var light = vec3<f32>(0.0);
                if is_lit(first, pixel, s, unit, at, 1.0) {
                    light = colour_at(glass, at, 1.0);
                }
                block = block * rate + light;
                block_whole = block_whole * rate + vec3<f32>(1.0);
            }
            lit = lit * block_rate + block;
            whole = whole * block_rate + block_whole;
        }
    }
    let share = select(vec3<f32>(0.0), lit / max(whole, vec3<f32>(1e-37)), whole > vec3<f32>(1e-37));
    return sun_interval(fog, 0.0, end) * share;
}

// The part of a ray that a lamp can light, in xi (raymarch-ref's angle_span.rs): first angle, its last, both counted from the
// other end as pi/2 - xi where `from_end`.
struct AngleSpan {
    begin: f32,
    to: f32,
    from_end: bool,
}

fn angle_span(lamp: LampAlong, end: f32) -> AngleSpan {
    let sigma = frame.reference.w;
    let start = lamp_path(lamp, 0.0);
    var reach = lamp_path(lamp, end);
    if sigma > 0.0 {
        reach = min(reach, start + NEGLIGIBLE_OPTICAL_DEPTH / (sigma * lamp.h));
    }
    reach = max(reach, start);
    var span: AngleSpan;
    span.from_end = start > 1.0;
    if span.from_end {
        span.begin = upper_angle(1.0, start);
        span.to = upper_angle(1.0, min(reach, FARTHEST));
    } else {
        span.begin = upper_angle(start, 1.0);
        span.to = upper_angle(min(reach, FARTHEST), 1.0);
    }
    if frame.kinds.z == LIGHT_SPOT {
        let amplitude = length(vec2<f32>(lamp.along, lamp.across));
        if !(amplitude > frame.cone.w) {
            span.to = span.begin;
            return span;
        }
        let peak = angle_of(lamp.along, lamp.across);
        let c = frame.cone.w / amplitude;
        let half = upper_angle(sqrt(max((1.0 - c) * (1.0 + c), 0.0)), c);
        let low = 0.5 * (peak - half) + 0.25 * PI;
        let high = 0.5 * (peak + half) + 0.25 * PI;
        if span.from_end {
            span.begin = min(span.begin, 0.5 * PI - low);
            span.to = max(span.to, 0.5 * PI - high);
        } else {
            span.begin = max(span.begin, low);
            span.to = min(span.to, high);
        }
    }
    return span;
}

fn march_lamp(pixel: vec2<u32>, ray: Ray, end: f32, seed: u32) -> vec3<f32> {
    let sigma = frame.sigma_t.xyz;
    let lamp = lamp_along(ray);
    let steps = clamp(frame.counts.y, 1u, MOST_STEPS);
    let span = angle_span(lamp, end);
    let width = (span.to - span.begin) / f32(steps);
    if (span.from_end && !(width < 0.0)) || (!span.from_end && !(width > 0.0)) {
        return vec3<f32>(0.0);
    }
    let s = lamp.closest / ray.stretch;
    let unit = lamp.h / ray.stretch;
    let first = march_ray(0u, pixel, s, unit);
    let glass = glass_ray(pixel, s, unit);
    let to_foot = sigma * lamp.closest;
    let of_distance = sigma * lamp.h;
    var sum = vec3<f32>(0.0);
    let uniform_steps = has(frame.counts.w, MARCH_UNIFORM);
    // Ends of the part as (t - t0) / h = -1 / tan(2 xi), for steps of equal length.
    var x_from = 0.0;
    var x_width = 0.0;
    if uniform_steps {
        let a = sin_cos(span.begin);
        let b = sin_cos(span.to);
        let sign = select(1.0, -1.0, span.from_end);
        x_from = sign * (a.x * a.x - a.y * a.y) / max(2.0 * a.x * a.y, 1e-18);
        x_width = (sign * (b.x * b.x - b.y * b.y) / max(2.0 * b.x * b.y, 1e-18) - x_from) / f32(steps);
    }
    for (var i = 0u; i < steps; i++) {
        let at = f32(i) + sample_place(seed, i);
        var cos_phi: f32;
        var sin_phi: f32;
        var tan_half: f32;
        var sin_sq: f32;
        var weight = 1.0;
        if uniform_steps {
            let x = x_from + at * x_width;
            let begin = x_from + f32(i) * x_width;
            cos_phi = 1.0 / sqrt(1.0 + x * x);
            sin_phi = x * cos_phi;
            let path = abs(x) + 1.0 / cos_phi;
            tan_half = select(path, 1.0 / path, x < 0.0);
            sin_sq = 0.5 * cos_phi * tan_half;
            weight = 0.5 * upper_angle(x_width, 1.0 + begin * (begin + x_width));
        } else {
            var sc = sin_cos(clamp(span.begin + at * width, 0.0, 0.5 * PI));
            if span.from_end {
                sc = sc.yx;
            }
            let cosine = max(sc.y, 1e-12);
            cos_phi = 2.0 * sc.x * cosine;
            sin_phi = sc.x * sc.x - cosine * cosine;
            tan_half = sc.x / cosine;
            sin_sq = sc.x * sc.x;
        }
        if !is_lit(first, pixel, s, unit, sin_phi, cos_phi) {
            continue;
        }
        if frame.kinds.z == LIGHT_SPOT {
            weight *= cone_factor(lamp, sin_phi, cos_phi);
        }
        let through = exp_negative3(min(-(to_foot + of_distance * tan_half), vec3<f32>(0.0)));
        sum += weight * scattering(sin_sq, 1.0 - sin_sq) * through * colour_at(glass, sin_phi, cos_phi);
    }
    return sum * select(abs(width), 1.0, uniform_steps) * 2.0 / lamp.h;
}

@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= image_size()) {
        return;
    }
    let pixel = camera_pixel(id.xy);
    let ray = pixel_ray(pixel);
    let end = ray_end(pixel);
    let fog = fog_along(ray);
    let seed = mixed(pixel.y * frame.image.x + pixel.x, frame.counts.z);
    var radiance = vec3<f32>(0.0);
    if frame.kinds.z == LIGHT_SUN {
        if marches() {
            radiance = march_sun(pixel, ray, fog, end, seed);
        } else {
            radiance = sun_interval(fog, 0.0, end);
        }
        radiance *= sun_scattering(image_direction(id.xy));
    } else if marches() {
        radiance = march_lamp(pixel, ray, end, seed);
    } else {
        radiance = lamp_interval(lamp_along(ray), 0.0, end);
    }
    write_pixel(id.xy, radiance * frame.strength.xyz, transmittance_to(fog, end), end);
}
