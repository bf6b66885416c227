// Pixels on the epipole, or as good as on it, walk through the maps themselves, texel by texel: the light stands behind them, so
// there are few texels. A sun's maps alone.

@group(0) @binding(8) var<storage, read_write> status: array<atomic<u32>, 4>;

const NO_LAYER: u32 = 16u;
// Texels of a ray at the most: what is farther stays dark, and is counted.
const MOST_TEXELS: u32 = 65536u;

// The part of [0, s_end] of a ray in a layer; empty: both at FARTHEST.
fn part_in_layer(ray: MapRay, size: vec2<f32>, s_end: f32) -> vec2<f32> {
    var part = vec2<f32>(0.0, s_end);
    for (var axis = 0u; axis < 2u; axis++) {
        let start = ray.start[axis];
        let step = ray.step[axis];
        if abs(step) * FARTHEST <= max(abs(start), size[axis]) {
            if !(start >= 0.0 && start < size[axis]) {
                return vec2<f32>(FARTHEST);
            }
        } else {
            let a = clamp(-start / step, -FARTHEST, FARTHEST);
            let b = clamp((size[axis] - start) / step, -FARTHEST, FARTHEST);
            part = vec2<f32>(max(part.x, min(a, b)), min(part.y, max(a, b)));
        }
    }
    return select(vec2<f32>(FARTHEST), part, part.x < part.y);
}

// Where a ray leaves a texel along an axis; FARTHEST where it never does.
fn texel_end(start: f32, step: f32, texel: i32) -> f32 {
    let border = f32(texel + select(0, 1, step > 0.0));
    if abs(step) * FARTHEST <= abs(border - start) {
        return FARTHEST;
    }
    return (border - start) / step;
}

// The light of a pixel's ray up to s_end: runs end where a texel is entered that the ray is not lit in.
fn walked_light(pixel: vec2<u32>, fog: FogAlong, stretch: f32, s_end: f32) -> vec3<f32> {
    let layers = min(frame.kinds.x, 16u);
    var light = vec3<f32>(0.0);
    var s = 0.0;
    var layer = NO_LAYER;
    // Where the layer ends, or one that goes before it begins.
    var layer_end = 0.0;
    var cell = vec2<i32>(0);
    var ray: MapRay;
    for (var n = 0u; n < MOST_TEXELS; n++) {
        if s >= s_end {
            return light;
        }
        if s >= layer_end {
            layer = NO_LAYER;
            layer_end = s_end;
            for (var other = 0u; other < layers; other++) {
                let own = map_ray(other, pixel);
                let part = part_in_layer(own, frame.maps[other].size.xy, s_end);
                if part.x <= s && s < part.y {
                    layer = other;
                    layer_end = min(layer_end, part.y);
                    ray = own;
                    break;
                }
                if part.x > s {
                    layer_end = min(layer_end, part.x);
                }
            }
            let at = ray.start.xy + s * ray.step.xy;
            let below = select(vec2<i32>(0), vec2<i32>(1), (ray.step.xy < vec2<f32>(0.0)) & (at == floor(at)));
            cell = vec2<i32>(floor(clamp(at, vec2<f32>(-1e6), vec2<f32>(1e6)))) - below;
        }
        var end = layer_end;
        var lit = vec2<f32>(s, layer_end);
        if layer != NO_LAYER {
            let column_end = texel_end(ray.start.x, ray.step.x, cell.x);
            let row_end = texel_end(ray.start.y, ray.step.y, cell.y);
            end = min(max(min(column_end, row_end), s), layer_end);
            let surface = stored_depth(layer, cell);
            lit = vec2<f32>(s, end);
            if surface < FARTHEST {
                let crossing = (surface - ray.start.z) / select(ray.step.z, 1.0, ray.step.z == 0.0);
                if ray.step.z > 0.0 {
                    lit.y = min(end, crossing);
                } else if ray.step.z < 0.0 {
                    lit.x = max(s, crossing);
                } else if ray.start.z > surface {
                    lit.y = s;
                }
            }
            if row_end < column_end {
                cell.y += select(-1, 1, ray.step.y > 0.0);
            } else {
                cell.x += select(-1, 1, ray.step.x > 0.0);
            }
        }
        if lit.y > lit.x {
            light += sun_interval(fog, lit.x * stretch, lit.y * stretch);
        }
        s = end;
    }
    atomicAdd(&status[0], 1u);
    return light;
}
