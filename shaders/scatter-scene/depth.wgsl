// Every depth pass: clip coordinates of a world vertex, and for cut-outs whether a fragment's texel is there.
//
// Vertices and the pass's reference point are sums of two f32 (high + low), relative to the scene's centre. Their
// difference is taken part by part: near the reference the high parts cancel exactly, so a vertex close to a lamp keeps
// all of its digits. The rows come composed in f64. CPU twins: scatter-scene, src/raster/pass.rs and src/cutout.rs.

struct Pass {
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
    w: vec4<f32>,
    reference_high: vec3<f32>,
    reference_low: vec3<f32>,
}

var<immediate> depth_pass: Pass;

fn clip_coordinates(high: vec3<f32>, low: vec3<f32>) -> vec4<f32> {
    let p = (high - depth_pass.reference_high) + (low - depth_pass.reference_low);
    return vec4<f32>(
        dot(depth_pass.x.xyz, p) + depth_pass.x.w,
        dot(depth_pass.y.xyz, p) + depth_pass.y.w,
        dot(depth_pass.z.xyz, p) + depth_pass.z.w,
        dot(depth_pass.w.xyz, p) + depth_pass.w.w,
    );
}

@vertex
fn vertex_main(@location(0) high: vec3<f32>, @location(1) low: vec3<f32>) -> @builtin(position) @invariant vec4<f32> {
    return clip_coordinates(high, low);
}

// A point of a cut-out: its place on the mask [texels, before wrapping], and the mask: first word, columns, rows,
// wraps (u in bits 0 and 1, v in bits 2 and 3).
struct CardPoint {
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) texel: vec2<f32>,
    @location(1) @interpolate(flat) mask: vec4<u32>,
}

// Blocks of 8x8 texels, two words each: bit 8·(row mod 8) + column mod 8.
@group(0) @binding(0) var<storage, read> mask_words: array<u32>;

@vertex
fn card_vertex(
    @location(0) high: vec3<f32>,
    @location(1) low: vec3<f32>,
    @location(2) texel: vec2<f32>,
    @location(3) mask: vec4<u32>,
) -> CardPoint {
    return CardPoint(clip_coordinates(high, low), texel, mask);
}

const REPEAT: u32 = 0u;
const MIRRORED_REPEAT: u32 = 1u;

// The texel of `count` that shows at `place`.
fn shown(place: f32, count: u32, wrap: u32) -> u32 {
    // Within what an i32 holds with room to spare; beyond that an f32 has no texels left.
    let texel = i32(clamp(floor(place), -1e9, 1e9));
    let n = i32(count);
    if wrap == REPEAT {
        return u32(((texel % n) + n) % n);
    }
    if wrap == MIRRORED_REPEAT {
        let within = ((texel % (2 * n)) + 2 * n) % (2 * n);
        return u32(min(within, 2 * n - 1 - within));
    }
    return u32(clamp(texel, 0, n - 1));
}

@fragment
fn card_fragment(point: CardPoint) {
    let column = shown(point.texel.x, point.mask.y, point.mask.w & 3u);
    let row = shown(point.texel.y, point.mask.z, point.mask.w >> 2u);
    let block = (row / 8u) * ((point.mask.y + 7u) / 8u) + column / 8u;
    let bit = 8u * (row % 8u) + column % 8u;
    let word = mask_words[point.mask.x + 2u * block + bit / 32u];
    if ((word >> (bit % 32u)) & 1u) == 0u {
        discard;
    }
}
