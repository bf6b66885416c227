// One lit interval under a sun, in closed form (MODEL.md), uniform or in height fog.

struct FogAlong {
    // ln(density) at t = 0 and -d(ln density)/dt.
    log_density: f32,
    slope: f32,
}

fn fog_along(ray: Ray) -> FogAlong {
    return FogAlong(frame.fog.w - dot(frame.fog.xyz, ray.origin), dot(frame.fog.xyz, ray.direction));
}

// Integral of the density over [a, b], 0 to FARTHEST: from the denser end, with exponents added before any exponential.
fn fog_column(fog: FogAlong, a: f32, b: f32) -> f32 {
    let width = max(b - a, 0.0);
    let dense = fog.log_density - fog.slope * select(b, a, fog.slope > 0.0);
    let way = width * phi(min(abs(fog.slope) * width, FARTHEST));
    if !(way > 0.0) {
        return 0.0;
    }
    let exponent = dense + log(way);
    // e^41 = 6e17.
    return select(exp(max(exponent, -87.0)), FARTHEST, exponent > 41.0) * select(1.0, 0.0, exponent < -87.0);
}

// Integral over [a, b] of density * exp(-tau), RGB: times strength, scattering and phase it is radiance.
fn sun_interval(fog: FogAlong, a: f32, b: f32) -> vec3<f32> {
    let sigma = frame.sigma_t.xyz;
    if has(frame.kinds.w, FRAME_FOG) {
        let column = fog_column(fog, a, b);
        let before = fog_column(fog, 0.0, a);
        return exp_negative3(-sigma * before) * column * phi3(sigma * column);
    }
    let width = max(b - a, 0.0);
    return exp_negative3(-sigma * a) * width * phi3(sigma * width);
}

// RGB transmittance from the ray's start to t.
fn transmittance_to(fog: FogAlong, t: f32) -> vec3<f32> {
    var way = t;
    if has(frame.kinds.w, FRAME_FOG) {
        way = fog_column(fog, 0.0, t);
    }
    return exp_negative3(-frame.sigma_t.xyz * way);
}
