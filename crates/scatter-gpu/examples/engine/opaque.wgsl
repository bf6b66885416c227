// The engine's own shading: triangles seen from a matrix, a colour by how they face the sun.
struct Seen {
    clip_from_world: mat4x4<f32>,
    // The way the sun's light travels.
    sun: vec4<f32>,
}

@group(0) @binding(0) var<uniform> seen: Seen;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
}

@vertex
fn corner(@location(0) position: vec3<f32>) -> Corner {
    return Corner(seen.clip_from_world * vec4<f32>(position, 1.0), position);
}

@fragment
fn opaque(corner: Corner) -> @location(0) vec4<f32> {
    let normal = cross(dpdx(corner.world), dpdy(corner.world));
    let facing = abs(dot(normal, seen.sun.xyz)) / max(length(normal), 1e-20);
    return vec4<f32>(vec3<f32>(0.06, 0.05, 0.045) * (0.3 + facing), 1.0);
}
