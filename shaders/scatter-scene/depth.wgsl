// Vertex stage of every depth pass: clip coordinates of a world vertex, and nothing else.
//
// Vertices and the pass's reference point are sums of two f32 (high + low), relative to the scene's centre. Their
// difference is taken part by part: near the reference the high parts cancel exactly, so a vertex close to a lamp keeps
// all of its digits. The rows come composed in f64. CPU twin: scatter-scene, src/raster/pass.rs.

struct Pass {
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
    w: vec4<f32>,
    reference_high: vec3<f32>,
    reference_low: vec3<f32>,
}

var<immediate> depth_pass: Pass;

@vertex
fn vertex_main(@location(0) high: vec3<f32>, @location(1) low: vec3<f32>) -> @builtin(position) @invariant vec4<f32> {
    let p = (high - depth_pass.reference_high) + (low - depth_pass.reference_low);
    return vec4<f32>(
        dot(depth_pass.x.xyz, p) + depth_pass.x.w,
        dot(depth_pass.y.xyz, p) + depth_pass.y.w,
        dot(depth_pass.z.xyz, p) + depth_pass.z.w,
        dot(depth_pass.w.xyz, p) + depth_pass.w.w,
    );
}
