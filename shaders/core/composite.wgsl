// One full-screen triangle: in-scattered light over the engine's picture. Of images of half or a quarter of the size the four
// nearest pixels are mixed, those at other distances less; under a sun what its light scatters into the pixel's own direction
// takes the place of what it scattered into theirs.
@group(0) @binding(8) var inscattered: texture_2d<f32>;
@group(0) @binding(9) var transmittance: texture_2d<f32>;

struct Composed {
    light: vec3<f32>,
    through: vec3<f32>,
}

struct Corner {
    @builtin(position) position: vec4<f32>,
    // In pixels of the camera, wherever in the target its viewport is.
    @location(0) place: vec2<f32>,
}

@vertex
fn composite_vertex(@builtin(vertex_index) index: u32) -> Corner {
    let corner = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    let place = vec2<f32>(corner.x, 1.0 - corner.y) * vec2<f32>(frame.image.xy);
    return Corner(vec4<f32>(corner * 2.0 - 1.0, 0.0, 1.0), place);
}

// Of a sun's light scattered into a direction to that scattered into the direction of a pixel of the image, RGB.
fn turned(scattered: vec3<f32>, pixel: vec2<i32>) -> vec3<f32> {
    let there = sun_scattering(image_direction(vec2<u32>(pixel)));
    return select(vec3<f32>(1.0), scattered / max(there, vec3<f32>(1e-30)), there > vec3<f32>(1e-30));
}

fn composed(place: vec2<f32>) -> Composed {
    let pixel = min(vec2<u32>(max(place, vec2<f32>(0.0))), frame.image.xy - vec2<u32>(1u));
    let block = frame.depth_more.y;
    if block == 1.0 {
        return Composed(textureLoad(inscattered, vec2<i32>(pixel), 0).xyz, textureLoad(transmittance, vec2<i32>(pixel), 0).xyz);
    }
    let end = ray_end(pixel);
    let last = vec2<i32>(image_size()) - vec2<i32>(1);
    let low = (vec2<f32>(pixel) + 0.5) / block - 0.5;
    let corner = floor(low);
    let part = low - corner;
    var sum = Composed(vec3<f32>(0.0), vec3<f32>(0.0));
    var weights = 0.0;
    let turns = frame.kinds.z == LIGHT_SUN && has(frame.kinds.w, FRAME_ANISOTROPIC);
    let scattered = sun_scattering(pixel_ray(pixel).direction);
    for (var i = 0; i < 4; i++) {
        let step = vec2<i32>(i & 1, i >> 1u);
        let at = clamp(vec2<i32>(corner) + step, vec2<i32>(0), last);
        let near = select(1.0 - part, part, step == vec2<i32>(1));
        let through = textureLoad(transmittance, at, 0);
        // A pixel at another distance by 1 % of it counts a tenth.
        let other = abs(through.w - min(end, 65504.0)) / max(min(end, 65504.0), 1e-6);
        let weight = (near.x * near.y + 1e-4) / (1.0 + 900.0 * min(other, 1e6));
        var light = textureLoad(inscattered, at, 0).xyz;
        if turns {
            light *= turned(scattered, at);
        }
        sum.light += weight * light;
        sum.through += weight * through.xyz;
        weights += weight;
    }
    return Composed(sum.light / weights, sum.through / weights);
}

// Blended as src + dst * src.a.
@fragment
fn composite_grey(corner: Corner) -> @location(0) vec4<f32> {
    let c = composed(corner.place);
    return vec4<f32>(c.light, (c.through.x + c.through.y + c.through.z) / 3.0);
}

// Blended as dst * src: what is left of the picture behind coloured extinction.
@fragment
fn composite_through(corner: Corner) -> @location(0) vec4<f32> {
    return vec4<f32>(composed(corner.place).through, 1.0);
}

// Blended as dst + src.
@fragment
fn composite_light(corner: Corner) -> @location(0) vec4<f32> {
    return vec4<f32>(composed(corner.place).light, 0.0);
}
