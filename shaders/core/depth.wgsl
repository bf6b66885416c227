// Depth texels as distances.

// Quotients whose denominator is smaller than this share of the numerator lie beyond FARTHEST.
fn guarded_quotient(numerator: f32, denominator: f32) -> f32 {
    let far = abs(denominator) * FARTHEST <= abs(numerator);
    let value = numerator / select(denominator, 1.0, far);
    // Beyond infinity: a far plane that f32 rounded.
    return select(value, FARTHEST, far || value < 0.0);
}

// Distance along the ray of a pixel, 0 to FARTHEST, of the texel of an engine's depth buffer.
fn distance_of_texel(pixel: vec2<u32>, texel: f32, stretch: f32) -> f32 {
    let z = finite_texel(texel);
    if has(frame.kinds.w, FRAME_DEPTH_HAS_CLEARED) && z == frame.depth_more.x {
        return FARTHEST;
    }
    if has(frame.kinds.w, FRAME_DEPTH_ALONG_RAY) {
        return z;
    }
    let p = from_reference(pixel);
    let q = frame.depth[0] + p.x * frame.depth[1] + p.y * frame.depth[2];
    // The sign of a distance before the ray's start is told from one beyond infinity by the numerator: it is the smaller.
    let numerator = q.x + q.y * z;
    let denominator = q.z + q.w * z;
    if numerator * sign(denominator) < 0.0 && abs(numerator) < abs(denominator) * 1e-6 {
        return 0.0;
    }
    return min(guarded_quotient(numerator, denominator) * stretch, FARTHEST);
}

// Linear depth, 0 to FARTHEST, of a stored texel of a map's layer; `uv` in texels of the layer.
fn linear_of_texel(layer: MapLayer, texel: f32, uv: vec2<f32>) -> f32 {
    let z = finite_texel(texel);
    if has(layer.place.w, LAYER_HAS_CLEARED) && z == layer.size.w {
        return FARTHEST;
    }
    if has(layer.place.w, LAYER_ALONG_RAY) {
        let way = length(layer.way[0].xyz + uv.x * layer.way[1].xyz + uv.y * layer.way[2].xyz);
        return min((layer.slope.z + z * layer.slope.w) / way + layer.size.z, FARTHEST);
    }
    let denominator = layer.quotient.z + layer.quotient.w * z + dot(layer.slope.xy, uv);
    return min(guarded_quotient(layer.quotient.x + layer.quotient.y * z, denominator) + layer.size.z, FARTHEST);
}
