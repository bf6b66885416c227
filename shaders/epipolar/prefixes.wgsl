// Prefixes of the integrand's factors up to a light ray, in integers of 2^-29 of the largest: `prefix_at` of factor_tables.rs.

@group(0) @binding(15) var<storage, read> factor_nodes: array<vec4<i32>>;

// `gamma` by its bits, `scale` in places a unit of gamma.
fn prefix_at(channel: u32, scale: f32, gamma: u32) -> vec4<i32> {
    let table = epipolar.tables[channel];
    let bits = table.z;
    let place = u32(min(bitcast<f32>(gamma) * scale, f32(table.y << bits)));
    let node = min(place >> bits, table.y - 1u);
    let part = place - (node << bits);
    let start = factor_nodes[table.x + node];
    let step = factor_nodes[table.x + node + 1u] - start;
    // A product of 52 bits by its two halves.
    let high = (step >> vec4<u32>(12u)) * i32(part);
    let low = vec4<u32>(step & vec4<i32>(4095)) * part;
    return start + (high >> vec4<u32>(bits - 12u)) + vec4<i32>(low >> vec4<u32>(bits));
}
