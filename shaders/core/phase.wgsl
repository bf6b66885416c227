// Phase functions by sin^2 and cos^2 of half the phase angle, both, so that neither lobe cancels: the mirror of
// `Phase::at_haversine_f32`.

const PHASE_ISOTROPIC: f32 = 0.0;
const PHASE_RAYLEIGH: f32 = 1.0;
const PHASE_HENYEY_GREENSTEIN: f32 = 2.0;

fn phase_at(kind: f32, g: f32, sin_sq: f32, cos_sq: f32) -> f32 {
    if kind == PHASE_RAYLEIGH {
        let cosine = cos_sq - sin_sq;
        return 0.75 * INV_4PI * (1.0 + cosine * cosine);
    }
    if kind == PHASE_HENYEY_GREENSTEIN {
        let away = select(cos_sq, sin_sq, g >= 0.0);
        let gap = 1.0 - abs(g);
        let denominator = gap * gap + 4.0 * abs(g) * away;
        return INV_4PI * gap * (1.0 + abs(g)) / (denominator * sqrt(denominator));
    }
    return INV_4PI;
}

// Sum of sigma_s * phase over the medium's components, RGB.
fn scattering(sin_sq: f32, cos_sq: f32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < min(frame.counts.x, 8u); i++) {
        let term = frame.phases[i];
        sum += term.sigma_s.xyz * phase_at(term.kind.x, term.kind.y, sin_sq, cos_sq);
    }
    return sum;
}

// The same under a sun: the phase angle is constant along a ray.
fn sun_scattering(direction: vec3<f32>) -> vec3<f32> {
    // cos(theta) = dot(light's travel, -direction): |travel + direction|^2 / 4 = sin^2(theta / 2).
    let apart = frame.light.xyz + direction;
    let along = frame.light.xyz - direction;
    return scattering(0.25 * dot(apart, apart), 0.25 * dot(along, along));
}
