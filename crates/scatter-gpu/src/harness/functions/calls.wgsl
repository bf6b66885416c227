// One of the shaders' functions, called for a list of inputs: rung 1 of the ladder. The first input says which.
@group(0) @binding(1) var<storage, read> call_inputs: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> call_outputs: array<vec4<f32>>;

fn called(which: u32, a: vec4<f32>) -> vec4<f32> {
    let pixel = vec2<u32>(a.xy);
    switch which {
        case 0u: { return vec4<f32>(finite_texel(a.x)); }
        case 1u: { return vec4<f32>(phi(a.x)); }
        case 2u: { return vec4<f32>(exp_negative(a.x)); }
        case 3u: { return vec4<f32>(phase_at(a.x, a.y, a.z, a.w)); }
        case 4u: { return vec4<f32>(sin_cos(a.x), 0.0, 0.0); }
        case 5u: { return vec4<f32>(upper_angle(a.y, a.x)); }
        case 6u: { return vec4<f32>(distance_of_texel(pixel, a.z, pixel_ray(pixel).stretch)); }
        case 7u: { return vec4<f32>(pixel_ray(pixel).direction, 0.0); }
        case 8u: { return vec4<f32>(sun_interval(FogAlong(0.0, 0.0), a.x, a.y), 0.0); }
        case 9u: { return vec4<f32>(fog_column(FogAlong(a.x, a.y), a.z, a.w)); }
        case 10u: { return vec4<f32>(linear_of_texel(frame.maps[0], a.x, a.yz)); }
        // 23 bits of a hash at a time, as numbers: whatever a driver does to floats, it keeps these.
        default: {
            let hash = mixed(u32(a.x), u32(a.y));
            return vec4<f32>(f32(hash >> 16u), f32(hash & 0xffffu), 0.0, 0.0);
        }
    }
}

@compute @workgroup_size(64)
fn call(@builtin(global_invocation_id) id: vec3<u32>) {
    let index = id.x + 1u;
    if index >= arrayLength(&call_inputs) {
        return;
    }
    call_outputs[index] = called(u32(call_inputs[0].x), call_inputs[index]);
}
