// What a frame is without its texels: the mirror of `FrameUniform` (scatter-kernels, frame_uniform.rs; a test compares the
// layouts). All positions are relative to the eye.

struct MapLayer {
    // (u, v, depth) of a pixel's ray at s = 0, and a unit of s: at the reference pixel, a column's, a row's.
    start: array<vec4<f32>, 3>,
    step: array<vec4<f32>, 3>,
    // Width, height, bias added to stored depths, cleared texel.
    size: vec4<f32>,
    // Stored texel z -> linear depth (a + b z) / (c + d z + slope . (u, v)).
    quotient: vec4<f32>,
    // Slope in u and v; near and far - near of shares along the light's rays.
    slope: vec4<f32>,
    // Maps of distances along the light's rays: the way of a light ray for a unit of depth, a texel's u and v.
    way: array<vec4<f32>, 3>,
    // Column and row of its first texel in the texture, layer of the texture, flags (LAYER_*).
    place: vec4<u32>,
}

struct PhaseTerm {
    // RGB sigma_s.
    sigma_s: vec4<f32>,
    // PHASE_* as a number, g.
    kind: vec4<f32>,
}

struct FrameUniform {
    // Width, height, and the first pixel of the viewport in the depth texture.
    image: vec4<u32>,
    // How many maps, MAPS_*, LIGHT_*, flags (FRAME_*).
    kinds: vec4<u32>,
    // How many phase terms; steps of a march, its seed, its flags (MARCH_*).
    counts: vec4<u32>,
    // Direction of a pixel's ray a unit of s: at the reference pixel, a column's, a row's.
    direction: array<vec4<f32>, 3>,
    // Its start.
    origin: array<vec4<f32>, 3>,
    // Reference pixel, max_distance, extinction of the weakest channel that scatters.
    reference: vec4<f32>,
    // Depth texel z -> s = (a + b z) / (c + d z), (a, b, c, d) at the reference pixel, a column's, a row's.
    depth: array<vec4<f32>, 3>,
    // Cleared depth texel, block of pixels that one distance stands for (1, 2, 4), -, -.
    depth_more: vec4<f32>,
    // Sun: the way the light travels. Lamp: position, radius.
    light: vec4<f32>,
    // RGB irradiance or intensity times the exposure.
    moment: array<vec4<f32>, 6>,
    strength: vec4<f32>,
    // Spot: axis, cosine of the outer angle.
    cone: vec4<f32>,
    // Spot: slope of the cone's factor, cosine from which on it is 1, -, -.
    cone_more: vec4<f32>,
    // RGB, the largest of them.
    sigma_t: vec4<f32>,
    // Height fog: up / scale height, ln(density) at the eye.
    fog: vec4<f32>,
    phases: array<PhaseTerm, 8>,
    glass: MapLayer,
    maps: array<MapLayer, 16>,
}

const LAYER_PERSPECTIVE: u32 = 1u;
const LAYER_ALONG_RAY: u32 = 2u;
const LAYER_HAS_CLEARED: u32 = 4u;

const MAPS_NONE: u32 = 0u;
const MAPS_ONE: u32 = 1u;
const MAPS_CASCADES: u32 = 2u;
const MAPS_FACES: u32 = 3u;

const LIGHT_SUN: u32 = 0u;
const LIGHT_POINT: u32 = 1u;
const LIGHT_SPOT: u32 = 2u;

const FRAME_PERSPECTIVE: u32 = 1u;
const FRAME_FOG: u32 = 2u;
const FRAME_GLASS: u32 = 4u;
const FRAME_DEPTH_ALONG_RAY: u32 = 8u;
const FRAME_DEPTH_HAS_CLEARED: u32 = 16u;
const FRAME_ANISOTROPIC: u32 = 32u;

const MARCH_JITTER: u32 = 1u;
const MARCH_UNIFORM: u32 = 2u;

@group(0) @binding(0) var<uniform> frame: FrameUniform;

fn has(flags: u32, flag: u32) -> bool {
    return (flags & flag) != 0u;
}

// The pixel relative to the reference pixel, for what is affine in it.
fn from_reference(pixel: vec2<u32>) -> vec2<f32> {
    return vec2<f32>(pixel) - frame.reference.xy;
}

struct Ray {
    // Start, relative to the eye.
    origin: vec3<f32>,
    // Unit direction.
    direction: vec3<f32>,
    // Length of a unit of s: s is the depth along a perspective camera's axis, or the way along a parallel camera's rays.
    stretch: f32,
    // A lamp's position relative to the start × the direction: its length is the ray's distance from the lamp.
    moment: vec3<f32>,
}

// The way of a unit of s of the ray through a place of the image, which counts from the reference pixel.
fn way_at(p: vec2<f32>) -> vec3<f32> {
    return frame.direction[0].xyz + p.x * frame.direction[1].xyz + p.y * frame.direction[2].xyz;
}

fn pixel_ray(pixel: vec2<u32>) -> Ray {
    let p = from_reference(pixel);
    let way = way_at(p);
    var ray: Ray;
    ray.stretch = length(way);
    ray.direction = way / ray.stretch;
    // The first sum is exact in any order, fused or not (frame_setup.rs), so that rays which all but meet the lamp keep their
    // digits, too.
    let exact = frame.moment[0].xyz + p.x * frame.moment[1].xyz + p.y * frame.moment[2].xyz;
    let rest = frame.moment[3].xyz + p.x * frame.moment[4].xyz + p.y * frame.moment[5].xyz;
    ray.moment = (exact + rest) / ray.stretch;
    ray.origin = frame.origin[0].xyz + p.x * frame.origin[1].xyz + p.y * frame.origin[2].xyz;
    return ray;
}
