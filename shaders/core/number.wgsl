// Numbers without infinities: WGSL lets a compiler assume that there are none, so nothing here makes or tests one.

// "No surface", "no end": larger than any distance that counts, and its square fits into f32.
const FARTHEST: f32 = 1e18;
const PI: f32 = 3.14159265358979;
const INV_4PI: f32 = 0.0795774715459477;

// A texel as a number from 0 to FARTHEST: NaN, by its bits, and infinities are FARTHEST, negative numbers 0.
fn finite_texel(texel: f32) -> f32 {
    let bits = bitcast<u32>(texel);
    if (bits & 0x7fffffffu) >= 0x7f800000u {
        return select(FARTHEST, 0.0, bits == 0xff800000u);
    }
    return clamp(texel, 0.0, FARTHEST);
}

// exp of x <= 0; 0 below -87, where f32 has no normal number left.
fn exp_negative(x: f32) -> f32 {
    return select(exp(max(x, -87.0)), 0.0, x < -87.0);
}

// phi(x) = (1 - exp(-x)) / x for x >= 0, phi(0) = 1. Relative error: 4 ulp below 1/2 (its series; the first term left out is
// x^8/9! < 1.1e-8), beyond that of exp.
fn phi(x: f32) -> f32 {
    if x < 0.5 {
        return 1.0 + x * (-0.5 + x * (1.0 / 6.0 + x * (-1.0 / 24.0 + x * (1.0 / 120.0
            + x * (-1.0 / 720.0 + x * (1.0 / 5040.0 - x * (1.0 / 40320.0)))))));
    }
    return (1.0 - exp_negative(-x)) / x;
}

fn phi3(x: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(phi(x.x), phi(x.y), phi(x.z));
}

fn exp_negative3(x: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(exp_negative(x.x), exp_negative(x.y), exp_negative(x.z));
}
