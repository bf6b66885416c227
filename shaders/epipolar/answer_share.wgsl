// An answer of the sums as a share.

// Quotient of two sums with the same factors: exactly 1 where all is lit, exactly 0 where nothing is.
fn share_of(told: Answer) -> f32 {
    if all(told.sum == told.end) {
        return 1.0;
    }
    let band = epipolar.bands[told.channel * MOST_BANDS + told.band];
    // Chebyshev polynomials of the view ray's place in its band.
    let z = clamp((1.0 / told.sine - band.y) * band.z - 1.0, -1.0, 1.0);
    let weights = vec4<f32>(1.0, z, 2.0 * z * z - 1.0, (4.0 * z * z - 3.0) * z) * epipolar.units[told.channel];
    let whole = dot(vec4<f32>(told.end), weights);
    let lit = dot(vec4<f32>(told.sum), weights);
    if !(whole > 0.0) {
        return 1.0;
    }
    return clamp(lit / whole, 0.0, 1.0);
}

fn answer(told: Answer) {
    add_answer(told.pixel, told.channel, share_of(told), told.part);
}
