// Sines and angles to f32's rounding: WGSL promises 2^-11 of a sine and 4096 ulp of an arc tangent. The mirrors of
// raymarch-ref's lanes.rs.

// (sin x, cos x) for x in [0, pi/2], absolute error <= 2e-7.
fn sin_cos(x: f32) -> vec2<f32> {
    let q = x * x;
    let s = x * (1.0 + q * (-1.0 / 6.0 + q * (1.0 / 120.0 + q * (-1.0 / 5040.0 + q * (1.0 / 362880.0 - q / 39916800.0)))));
    let c = 1.0 + q * (-0.5 + q * (1.0 / 24.0 + q * (-1.0 / 720.0 + q * (1.0 / 40320.0
        + q * (-1.0 / 3628800.0 + q / 479001600.0)))));
    return vec2<f32>(s, c);
}

// The angle in [0, pi] of the point (x, y), y >= 0; 0 at the origin. Absolute error <= 4e-7.
fn upper_angle(y: f32, x: f32) -> f32 {
    let width = abs(x);
    let least = min(width, y);
    let greatest = max(max(width, y), 1.2e-38);
    let steep = least * 2.4142136 > greatest;
    let ratio = select(least, least - greatest, steep) / select(greatest, least + greatest, steep);
    let q = ratio * ratio;
    let p = 1.0 + q * (-1.0 / 3.0 + q * (0.2 + q * (-1.0 / 7.0 + q * (1.0 / 9.0 + q * (-1.0 / 11.0 + q / 13.0)))));
    var angle = p * ratio + select(0.0, 0.25 * PI, steep);
    angle = select(angle, 0.5 * PI - angle, y > width);
    return select(angle, PI - angle, x < 0.0);
}

// The angle in [-pi, pi] of the point (x, y).
fn angle_of(y: f32, x: f32) -> f32 {
    let angle = upper_angle(abs(y), x);
    return select(angle, -angle, y < 0.0);
}
